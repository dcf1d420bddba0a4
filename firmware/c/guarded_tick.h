/* One tick of the rig "guarded" in its firmware: what stands around the controller, in the simulator's order. */
#ifndef GUARDED_TICK_H
#define GUARDED_TICK_H

#include "eft.h"
#include "guarded.h"

static eft_adaptive_f32 config;
static eft_adaptive_state_f32 state;
static eft_observer_f32 observer;
static eft_observer_state_f32 observer_state;
static eft_protection_f32 protection;
static eft_protection_state_f32 protection_state;

/* A rig at rest before the start; 0 where something was refused. */
static inline int start(void)
{
  return eft_adaptive_configure_f32(&EFT_RIG, &config, NULL) == EFT_OK &&
         eft_observer_configure_f32(&EFT_VELOCITY, &observer, NULL) == EFT_OK &&
         eft_protection_configure_f32(&EFT_PROTECTION, &protection, NULL) == EFT_OK &&
         eft_adaptive_reset_f32(&config, &state) == EFT_OK &&
         eft_observer_reset_f32(&observer, &observer_state, 0.0f, 0.0f) == EFT_OK &&
         eft_protection_reset_f32(&protection_state) == EFT_OK;
}

/* Finds the velocity of *in, whose command is as it was asked for, and what drives the valve; 0 for a null pointer. */
static inline int step(eft_adaptive_input_f32 *in, float displacement, eft_output_f32 *out)
{
  eft_permitted_f32 permitted;
  if (eft_observer_step_f32(&observer, &observer_state, displacement, in->force * (float)EFT_PER_MASS, &in->velocity) != EFT_OK) {
    return 0;
  }
  const eft_protection_input_f32 asked = {in->command, in->force, displacement, in->velocity, in->spool};
  if (eft_protection_step_f32(&protection, &protection_state, &asked, &permitted) != EFT_OK) {
    return 0;
  }
  in->command = permitted.command;
  return eft_adaptive_step_f32(&config, &state, in, out) == EFT_OK &&
         eft_protection_apply_f32(&protection, &protection_state, &permitted, out) == EFT_OK;
}

#endif
