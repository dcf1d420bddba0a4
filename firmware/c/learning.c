/* The golden bits of a rig that learns through the C interface, on the host and on the target: the run of
   firmware/golden/src/learning.rs once more. The rig is that of the exported header named by RIG_HEADER. */
#include "eft.h"
#include RIG_HEADER
#include "bits.h"

#define TICKS 100000u
#define LYING 80000u

/* A slow swing between -1 and 1. */
static float triangle(uint32_t tick)
{
  const float phase = (float)(tick & 0x3ffu) / 256.0f;
  return phase < 2.0f ? phase - 1.0f : 3.0f - phase;
}

/* A sensor's reading: the true value with noise, or an invalid number. */
static float reported(uint32_t tick, float scale, float truth)
{
  const float noise = regular(5.0e-4f * scale);
  if (tick < LYING) {
    return tick % 1009u == 1008u && next() % 4u == 0u ? of_bits(0x7fc00000u) : truth + noise;
  }
  return (tick & 0x700u) == 0x400u ? sample(scale) : truth + noise;
}

static eft_channel_f32 channel;
static eft_state_f32 state;
static eft_learner_f32 learner;
static eft_learner_state_f32 learned;

static int start(void)
{
  return eft_configure_f32(&RIG, &channel, NULL) == EFT_OK && eft_check_f32(&channel, &RIG) == EFT_OK &&
         eft_reset_f32(&channel, &state) == EFT_OK && eft_learner_configure_f32(&RIG, &learner, NULL) == EFT_OK &&
         eft_learner_check_f32(&learner, &RIG) == EFT_OK && eft_learner_reset_f32(&learner, &learned) == EFT_OK;
}

/* One tick, and the learner where a window has closed. */
static int step(const eft_input_f32 *in, eft_output_f32 *out)
{
  eft_calibration_f32 calibration;
  return eft_step_f32(&channel, &state, in, out) == EFT_OK &&
         (out->window_closed == 0u || (eft_learn_f32(&learner, &learned, &out->window, &calibration) == EFT_OK &&
                                       eft_publish_f32(&channel, &state, &calibration) == EFT_OK));
}

static int run(void)
{
  float position = 0.0f;
  uint32_t tick;
  eft_input_f32 in;
  if (eft_abi_version() != EFT_ABI_VERSION || !start() || eft_input_init_f32(&in) != EFT_OK) {
    return 0;
  }
  begin(20051u);
  for (tick = 0u; tick < TICKS; tick++) {
    const float swing = triangle(tick), opening = 0.3f * triangle(tick);
    const float velocity = (2.293f - 1.579f * (opening < 0.0f ? -opening : opening)) * opening;
    eft_output_f32 out;
    position += velocity * (1.0f / 4096.0f);
    in.command = reported(tick, 1.0e4f, 2.0e3f * swing);
    in.next_command = tick % 1013u == 1012u ? of_bits(0x7fc00000u) : 2.0e3f * triangle(tick + 1u);
    in.velocity = reported(tick, 1.0f, velocity);
    in.force = reported(tick, 1.5e5f, 1.9e3f * swing);
    in.spool = reported(tick, 1.0f, opening);
    in.displacement = reported(tick, 0.127f, position);
    in.supply_pressure = reported(tick, 1.9e7f, 1.9e7f);
    if (!step(&in, &out)) {
      return 0;
    }
    add(bits_of(out.voltage));
    add(out.status);
  }
  return report("learning");
}
