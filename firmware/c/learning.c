/* The golden bits of an adaptive rig through the C interface, on the host and on the target: the run of
   firmware/golden/src/learning.rs once more. With GUARDED, velocity observer and protection stand around it. */
#ifdef GUARDED
#include "guarded_tick.h"
#else
#include "eft.h"
#include RIG_HEADER
#endif
#include "bits.h"

#define TICKS 100000u
#define LYING 80000u

/* A slow swing between -1 and 1. */
static float triangle(uint32_t tick)
{
  const float phase = (float)(tick & 0x3ffu) / 256.0f;
  return phase < 2.0f ? phase - 1.0f : 3.0f - phase;
}

/* What a sensor reports: the truth with noise, or a number that it should not send. */
static float reported(uint32_t tick, float scale, float truth)
{
  const float noise = regular(5.0e-4f * scale);
  if (tick < LYING) {
    return tick % 1009u == 1008u && next() % 4u == 0u ? of_bits(0x7fc00000u) : truth + noise;
  }
  return (tick & 0x700u) == 0x400u ? sample(scale) : truth + noise;
}

#ifndef GUARDED
static eft_adaptive_f32 config;
static eft_adaptive_state_f32 state;

static int start(void)
{
  return eft_adaptive_configure_f32(&EFT_RIG, &config, NULL) == EFT_OK &&
         eft_adaptive_check_f32(&config, &EFT_RIG) == EFT_OK && eft_adaptive_reset_f32(&config, &state) == EFT_OK;
}

static int step(eft_adaptive_input_f32 *in, float displacement, eft_output_f32 *out)
{
  (void)displacement;
  in->supply_pressure = (float)EFT_RIG.rig.supply_pressure; /* this rig has no transducer */
  return eft_adaptive_step_f32(&config, &state, in, out) == EFT_OK;
}
#endif

static int run(void)
{
  float position = 0.0f;
  uint32_t tick;
  if (eft_abi_version() != EFT_ABI_VERSION || !start()) {
    return 0;
  }
  begin(20051u);
  for (tick = 0u; tick < TICKS; tick++) {
    const float swing = triangle(tick), opening = 0.3f * triangle(tick);
    const float velocity = (2.293f - 1.579f * (opening < 0.0f ? -opening : opening)) * opening;
    eft_adaptive_input_f32 in;
    eft_output_f32 out;
    float displacement;
    position += velocity * (1.0f / 4096.0f);
    in.command = reported(tick, 1.0e4f, 2.0e3f * swing);
    in.velocity = reported(tick, 1.0f, velocity);
    in.force = reported(tick, 1.5e5f, 1.9e3f * swing);
    in.spool = reported(tick, 1.0f, opening);
    displacement = reported(tick, 0.127f, position);
    in.supply_pressure = reported(tick, 1.9e7f, 1.9e7f);
    in.valve_command = 0.0f;
    if (!step(&in, displacement, &out)) {
      return 0;
    }
    add(bits_of(out.valve_command));
    add(out.status);
  }
  return report("learning");
}
