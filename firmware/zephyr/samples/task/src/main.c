/* A rig's controller under Zephyr: the tick in the system timer's interrupt, once a sample, and the learner in a thread
   below it. sample() and drive() stand for your converters. */
#include <zephyr/kernel.h>
#include <zephyr/sys/printk.h>

#include "guarded.h"

static eft_channel_f32 channel;
static eft_state_f32 state;
static eft_learner_f32 learner;
static eft_learner_state_f32 learned;
static eft_input_f32 input;
/* Windows go down to the learner, calibrations up to the tick. */
static eft_windows_f32 windows;
static eft_calibrations_f32 calibrations;
static atomic_t flags;

K_SEM_DEFINE(window_offered, 0, 1);

/* Your converters: what they read since the last tick, in SI units. A rig at rest stands here. */
static void sample(eft_input_f32 *in)
{
  in->command = 0.0f;           /* N */
  in->force = 0.0f;             /* N */
  in->displacement = 0.0f;      /* m */
  in->spool = 0.0f;             /* 1 */
  in->supply_pressure = 19.0e6f; /* Pa */
}

/* Your converter: the valve command in V. */
static void drive(float voltage)
{
  ARG_UNUSED(voltage);
}

static void tick(struct k_timer *timer)
{
  eft_output_f32 output;
  const eft_calibration_f32 *const calibration = eft_take_calibration_f32(&calibrations);
  ARG_UNUSED(timer);
  if (calibration != NULL && eft_publish_f32(&channel, &state, calibration) != EFT_OK) {
    return;
  }
  sample(&input);
  if (eft_step_f32(&channel, &state, &input, &output) != EFT_OK) {
    drive(0.0f);
    return;
  }
  drive(output.voltage);
  atomic_set(&flags, (atomic_val_t)output.status);
  /* A window that the learner has no time for counts as lost samples. */
  if (output.window_closed && eft_offer_window_f32(&windows, &output.window) == EFT_OK) {
    k_sem_give(&window_offered);
  }
}

K_TIMER_DEFINE(ticks, tick, NULL);

static bool start(void)
{
  eft_error why;
  if (eft_abi_version() != EFT_ABI_VERSION) {
    printk("header and library do not belong together\n");
    return false;
  }
  if (eft_configure_f32(&EFT_RIG_GUARDED, &channel, &why) != EFT_OK ||
      eft_learner_configure_f32(&EFT_RIG_GUARDED, &learner, &why) != EFT_OK) {
    printk("refused: %s\n", why.parameter);
    return false;
  }
  if (eft_reset_f32(&channel, &state) != EFT_OK || eft_learner_reset_f32(&learner, &learned) != EFT_OK ||
      eft_input_init_f32(&input) != EFT_OK) {
    return false;
  }
  sample(&input);
  /* Without a bump from wherever the rig stands. */
  return eft_prime_f32(&channel, &state, &input) == EFT_OK;
}

int main(void)
{
  atomic_val_t reported = 0;
  if (CONFIG_SYS_CLOCK_TICKS_PER_SEC != (int)EFT_RIG_GUARDED.sample_rate || !start()) {
    return 1;
  }
  k_timer_start(&ticks, K_TICKS(1), K_TICKS(1));
  for (;;) {
    eft_calibration_f32 calibration;
    k_sem_take(&window_offered, K_FOREVER);
    const eft_window_f32 *const window = eft_take_window_f32(&windows);
    if (window == NULL || eft_learn_f32(&learner, &learned, window, &calibration) != EFT_OK) {
      continue;
    }
    if (eft_offer_calibration_f32(&calibrations, &calibration) != EFT_OK) {
      printk("the tick has not taken the last calibration\n");
    }
    if (atomic_get(&flags) != reported) {
      reported = atomic_get(&flags);
      printk("status %08lx\n", (unsigned long)reported);
    }
  }
}
