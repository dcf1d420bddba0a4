/* A control loop in C, as on a board: timer, sample, step, command, watchdog on overrun. The learner runs inline after
   the tick. With TASK it runs in PendSV, with a lower priority than the timer's interrupt. Semihosting replaces the
   converters: samples come from the file "to-firmware", and commands go to "from-firmware". */
#include "board.h"
#include "firmware.h"

#define CLOCK 25000000u /* of both QEMU machines' timers, Hz */

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

static uint32_t open_file(const char *name, uint32_t length, uint32_t mode)
{
  const uint32_t block[3] = {(uint32_t)(uintptr_t)name, mode, length};
  return semihost(SYS_OPEN, block);
}

/* Bytes that were not transferred. */
static uint32_t transfer(uint32_t operation, uint32_t file, void *bytes, uint32_t length)
{
  uint32_t left = length;
  while (left > 0u) {
    const uint32_t block[3] = {file, (uint32_t)(uintptr_t)bytes + (length - left), left};
    const uint32_t rest = semihost(operation, block);
    if (rest >= left) {
      break;
    }
    left = rest;
  }
  return left;
}

static uint32_t input, output;

static void sampled(sample *in)
{
  if (transfer(SYS_READ, input, in, sizeof *in) != 0u) {
    leave(0u); /* the end of the test */
  }
}

static void put(const answer *out)
{
  answer copy = *out;
  if (transfer(SYS_WRITE, output, &copy, sizeof copy) != 0u) {
    leave(2u);
  }
}

/* Only the interrupt writes it. */
static volatile uint32_t ticks;

#ifdef TASK
#define SCB_ICSR (*(volatile uint32_t *)0xE000ED04u)
#define SCB_SHPR3 (*(volatile uint32_t *)0xE000ED20u)

/* Windows go to the learner, calibrations to the tick. */
static eft_windows_f32 windows;
static eft_calibrations_f32 calibrations;

void sys_tick(void)
{
  sample in;
  answer a;
  eft_output_f32 out;
  const eft_calibration_f32 *const calibration = eft_take_calibration_f32(&calibrations);
  if (calibration != NULL && eft_publish_f32(&channel, &state, calibration) != EFT_OK) {
    leave(2u);
  }
  sampled(&in);
  if (!tick(&in, &out, &a)) {
    leave(2u);
  }
  put(&a);
  if (out.window_closed != 0u) {
    /* A window that the learner has no time for counts as lost samples. */
    (void)!eft_offer_window_f32(&windows, &out.window);
    SCB_ICSR = 1u << 28; /* pends PendSV */
  }
  ticks = ticks + 1u;
}

void pend_sv(void)
{
  const eft_window_f32 *const window = eft_take_window_f32(&windows);
  eft_calibration_f32 calibration;
  if (window == NULL) {
    return;
  }
  const uint32_t begun = ticks;
  if (eft_learn_f32(&learner, &learned, window, &calibration) != EFT_OK) {
    leave(2u);
  }
  /* A delay, so that the learner is preempted as on a slower processor. */
  while (ticks - begun < begun / 16u % 8u) {
  }
  if (eft_offer_calibration_f32(&calibrations, &calibration) != EFT_OK) {
    leave(2u);
  }
}

static void loop(void)
{
  SCB_SHPR3 = 0x00ff0000u; /* SysTick above, PendSV below */
  SYST_CSR = 7u;
  for (;;) {
    __asm__ volatile("wfi");
  }
}
#else
void sys_tick(void)
{
  ticks = ticks + 1u;
}

void pend_sv(void)
{
}

static void loop(void)
{
  uint32_t done = ticks;
  SYST_CSR = 7u;
  for (;;) {
    sample in;
    answer a;
    eft_output_f32 out;
    while (ticks == done) {
      __asm__ volatile("wfi");
    }
    done = done + 1u;
    sampled(&in);
    if (!tick(&in, &out, &a)) {
      leave(2u);
    }
    put(&a);
    if (!learn(&out)) {
      leave(2u);
    }
    if (ticks != done) {
      leave(4u); /* the watchdog: the work must be done before the next tick */
    }
  }
}
#endif

void program(void)
{
  if (!start()) {
    leave(2u);
  }
  input = open_file("to-firmware", 11u, 1u);
  output = open_file("from-firmware", 13u, 5u);
  SYST_RVR = (uint32_t)((double)CLOCK / RIG.sample_rate) - 1u;
  SYST_CVR = 0u;
  loop();
}
