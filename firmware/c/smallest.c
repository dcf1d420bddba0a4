/* The smallest program with the whole tick and the learner. It shows that an archive of the library links. */
#include "eft.h"
#include "guarded.h"

static eft_channel_f32 channel;
static eft_state_f32 state;
static eft_learner_f32 learner;
static eft_learner_state_f32 learned;
static eft_input_f32 input;
static volatile float voltage;

void start(void);

void start(void)
{
  const eft_parameters *rig = &EFT_RIG_GUARDED;
  eft_error why;
  if (eft_configure_f32(rig, &channel, &why) == EFT_OK && eft_reset_f32(&channel, &state) == EFT_OK &&
      eft_learner_configure_f32(rig, &learner, &why) == EFT_OK &&
      eft_learner_reset_f32(&learner, &learned) == EFT_OK && eft_input_init_f32(&input) == EFT_OK) {
    for (;;) {
      eft_output_f32 output;
      eft_calibration_f32 calibration;
      if (eft_step_f32(&channel, &state, &input, &output) == EFT_OK) {
        voltage = output.voltage;
        if (output.window_closed && eft_learn_f32(&learner, &learned, &output.window, &calibration) == EFT_OK &&
            eft_publish_f32(&channel, &state, &calibration) != EFT_OK) {
          voltage = 0.0f;
        }
      }
    }
  }
}
