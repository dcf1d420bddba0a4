/* The golden bits through the C interface, on the host and on the target: the inputs of firmware/golden/src/inputs.rs
   once more, and a hash of every answer. The rig is that of the exported header named by RIG_HEADER. */
#include <float.h>

#include "eft.h"
#include RIG_HEADER
#include "bits.h"

#define STEPS 100000u
#define CHANNELS 5u

static const float scales[CHANNELS] = {1.0e4f, 1.3f, 1.6e5f, 1.2f, 1.0e-3f};

/* The next tick's command, for a rig that looks ahead: in proportion to the command, and NaN now and then. */
static float next_command(uint32_t n, float command)
{
  return n % 61u == 60u ? of_bits(0x7fc00000u) : 0.9375f * command;
}

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

static eft_channel_f32 channel;

/* Whether the rig has a learner, which rests here. */
static int learns(void)
{
  return RIG.learning.adaptive != 0u || RIG.learning.guard != 0u;
}

/* The hash of a whole replay: of the valve command, or of the compensation signal without a force loop. */
static int replay(uint8_t realization)
{
  static eft_state_f32 state;
  eft_parameters parameters = RIG;
  eft_input_f32 input;
  float c[CHANNELS];
  uint32_t n;
  parameters.realization = realization;
  if (learns()) {
    parameters.learning.adaptive = parameters.learning.curve_correction = parameters.learning.guard = 0u;
  } else {
    /* As the paper's controller, which continues from its last state after any gap. */
    parameters.gap_time = DBL_MAX;
  }
  begin(2463534242u);
  if (eft_configure_f32(&parameters, &channel, NULL) != EFT_OK || eft_check_f32(&channel, &parameters) != EFT_OK ||
      eft_reset_f32(&channel, &state) != EFT_OK || eft_input_init_f32(&input) != EFT_OK) {
    return 0;
  }
  for (n = 0u; tick(n, c); n++) {
    eft_output_f32 output;
    /* The compensation alone uses no command. */
    input.command = realization == EFT_REALIZATION_DIGITAL ? c[0] : 0.0f;
    input.next_command = next_command(n, input.command);
    input.velocity = c[1];
    input.force = c[2];
    input.spool = c[3];
    if (eft_step_f32(&channel, &state, &input, &output) != EFT_OK) {
      return 0;
    }
    add(bits_of(output.voltage));
    add(output.status);
  }
  return 1;
}

static int run(void)
{
  return eft_abi_version() == EFT_ABI_VERSION && replay(EFT_REALIZATION_DIGITAL) && report("controller") &&
         (learns() || (replay(EFT_REALIZATION_ANALOG) && report("compensation")));
}
