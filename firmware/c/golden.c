/* The golden bits through the C interface, on the host and on the target: the inputs of firmware/golden/src/inputs.rs
   once more, and a hash of every answer. The rig is that of the exported header named by RIG_HEADER. */
#include "eft.h"
#include RIG_HEADER
#include "bits.h"

#define STEPS 100000u
#define CHANNELS 5u

static const float scales[CHANNELS] = {1.0e4f, 1.3f, 1.6e5f, 1.2f, 1.0e-3f};

/* The channels of tick n; 0 when there is none. */
static int tick(uint32_t n, float channels[CHANNELS])
{
  uint32_t i;
  if (n < STEPS) {
    for (i = 0u; i < CHANNELS; i++) {
      channels[i] = sample(scales[i]);
    }
  } else {
    const uint32_t at = n - STEPS;
    const uint32_t pair = at / (SPECIALS * SPECIALS), first = at / SPECIALS % SPECIALS, second = at % SPECIALS;
    if (pair / CHANNELS >= CHANNELS) {
      return 0;
    }
    for (i = 0u; i < CHANNELS; i++) {
      const float ordinary = regular(scales[i]);
      channels[i] = i == pair % CHANNELS   ? of_bits(special[second])
                    : i == pair / CHANNELS ? of_bits(special[first])
                                           : ordinary;
    }
  }
  return 1;
}

typedef uint8_t (*step)(const eft_controller_f32 *, eft_state_f32 *, const eft_input_f32 *, eft_output_f32 *);

static eft_controller_f32 config;

/* The hash of a whole replay; `both` adds the compensation signal and the further flow. */
static int replay(step function, int both)
{
  eft_state_f32 state;
  float c[CHANNELS];
  uint32_t n;
  begin(2463534242u);
  if (eft_reset_f32(&state) != EFT_OK) {
    return 0;
  }
  for (n = 0u; tick(n, c); n++) {
    eft_input_f32 input;
    eft_output_f32 output;
    input.command = c[0];
    input.velocity = c[1];
    input.force = c[2];
    input.spool = c[3];
    input.further_flow = both ? c[4] : 0.0f;
    if (function(&config, &state, &input, &output) != EFT_OK) {
      return 0;
    }
    add(bits_of(output.valve_command));
    if (both) {
      add(bits_of(output.compensation));
    }
    add(output.status);
  }
  return 1;
}

static int run(void)
{
  return eft_abi_version() == EFT_ABI_VERSION && eft_configure_f32(&EFT_RIG, &config, NULL) == EFT_OK &&
         eft_check_f32(&config, &EFT_RIG) == EFT_OK && replay(eft_step_f32, 0) && report("controller") &&
         replay(eft_compensation_step_f32, 0) && report("compensation") && replay(eft_step_f32, 1) &&
         report("further_flow");
}
