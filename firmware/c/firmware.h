/* A rig's firmware between the converters: the paper's, or with GUARDED that of the rig "guarded". */
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

/* One tick's result, and what the controller believes. */
typedef struct {
  eft_output_f32 output;
  float velocity;       /* that it took, m/s */
  float flow_gain;      /* true flow over the table's, 1 */
  float response_delay; /* that it makes up for, s */
  float valve_gain;     /* the spool's gain over the configured one, 1 */
  float level;          /* the guard's factor on the compensation level, 1 */
} answer;

#ifdef GUARDED
#include "guarded_tick.h"
#define SAMPLE_RATE EFT_RIG.rig.sample_rate

static inline int tick(const sample *s, answer *a)
{
  eft_adaptive_input_f32 in = {s->command, 0.0f, s->force, s->spool, s->supply_pressure, 0.0f};
  eft_learned_f32 learned;
  if (!step(&in, s->displacement, &a->output) || eft_adaptive_learned_f32(&state, &learned) != EFT_OK) {
    return 0;
  }
  a->velocity = in.velocity;
  a->flow_gain = learned.flow_gain;
  a->response_delay = learned.response_delay;
  a->valve_gain = learned.valve_gain;
  a->level = learned.level;
  return 1;
}
#else
#include "zhao2005.h"
#define SAMPLE_RATE EFT_RIG.sample_rate

static eft_controller_f32 config;
static eft_state_f32 state;

static inline int start(void)
{
  return eft_configure_f32(&EFT_RIG, &config, NULL) == EFT_OK && eft_reset_f32(&state) == EFT_OK;
}

static inline int tick(const sample *s, answer *a)
{
  const eft_input_f32 in = {s->command, s->velocity, s->force, s->spool, 0.0f};
  a->velocity = s->velocity;
  a->flow_gain = 1.0f;
  a->response_delay = (float)EFT_RIG.response_delay;
  a->valve_gain = 1.0f;
  a->level = 1.0f;
  return eft_step_f32(&config, &state, &in, &a->output) == EFT_OK;
}
#endif

#endif
