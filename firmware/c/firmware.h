/* A rig's firmware between the converters: the paper's, or with GUARDED that of the rig "guarded", which learns. */
#ifndef FIRMWARE_H
#define FIRMWARE_H

#include "eft.h"

/* One tick's command and measurements, as the converters would give them. */
typedef struct {
  float command;         /* N */
  float velocity;        /* m/s, where a sensor measures it */
  float force;           /* N */
  float spool;           /* 1 */
  float displacement;    /* m */
  float supply_pressure; /* Pa, where a transducer measures it */
  float acceleration;    /* m/s2, where an accelerometer measures it */
  float next_command;    /* N, where the next tick's is known */
} sample;

/* One tick's result, and the controller's estimates. */
typedef struct {
  float voltage;        /* V */
  float compensation;   /* V */
  uint32_t status;
  float velocity;       /* used by the controller, m/s */
  float flow_gain;      /* true flow over the table's, 1 */
  float response_delay; /* for which it compensates, s */
  float valve_gain;     /* the spool's gain over the configured one, 1 */
  float level;          /* the guard's factor on the compensation level, 1 */
} answer;

#ifdef GUARDED
#include "guarded.h"
#define RIG EFT_RIG_GUARDED
#else
#include "zhao2005.h"
#define RIG EFT_RIG_ZHAO2005
#endif

static eft_channel_f32 channel;
static eft_state_f32 state;
static eft_learner_f32 learner;
static eft_learner_state_f32 learned;

/* A rig at rest before the start; 0 where something was refused. */
static inline int start(void)
{
  return eft_abi_version() == EFT_ABI_VERSION && eft_configure_f32(&RIG, &channel, NULL) == EFT_OK &&
         eft_check_f32(&channel, &RIG) == EFT_OK && eft_reset_f32(&channel, &state) == EFT_OK &&
         eft_learner_configure_f32(&RIG, &learner, NULL) == EFT_OK &&
         eft_learner_reset_f32(&learner, &learned) == EFT_OK;
}

/* One tick without the learner; 0 if it was refused. */
static inline int tick(const sample *s, eft_output_f32 *out, answer *a)
{
  eft_calibration_f32 calibration;
  eft_learned_f32 found;
  eft_input_f32 in;
  if (eft_input_init_f32(&in) != EFT_OK) {
    return 0;
  }
  in.command = s->command;
  in.velocity = s->velocity;
  in.force = s->force;
  in.spool = s->spool;
  in.displacement = s->displacement;
  in.acceleration = s->acceleration;
  in.supply_pressure = s->supply_pressure;
  in.next_command = s->next_command;
  if (eft_step_f32(&channel, &state, &in, out) != EFT_OK ||
      eft_calibration_in_use_f32(&state, &calibration) != EFT_OK ||
      eft_read_calibration_f32(&calibration, &found) != EFT_OK) {
    return 0;
  }
  a->voltage = out->voltage;
  a->compensation = out->compensation;
  a->status = out->status;
  a->velocity = out->velocity;
  a->flow_gain = found.flow_gain;
  a->response_delay = found.response_delay;
  a->valve_gain = found.valve_gain;
  a->level = found.level;
  return 1;
}

/* The learner inline, after a tick that closed a window; 0 if it was refused. */
static inline int learn(const eft_output_f32 *out)
{
  eft_calibration_f32 calibration;
  return out->window_closed == 0u ||
         (eft_learn_f32(&learner, &learned, &out->window, &calibration) == EFT_OK &&
          eft_publish_f32(&channel, &state, &calibration) == EFT_OK);
}

#endif
