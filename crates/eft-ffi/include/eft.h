/* Effective force testing: the controller for firmware. Made by cbindgen from crates/eft-ffi; do not edit.

   Everything is owned by the caller and passed by pointer; there are no globals, so every function is re-entrant.
   A null pointer gives EFT_NULL_POINTER and nothing else happens. SI units throughout. Signs: a positive spool
   opening lets flow into the chamber that pulls the structure; force and velocity are then positive. */

#ifndef EFT_H
#define EFT_H

#include <stddef.h>
#include <stdint.h>

#if defined(__cplusplus)
#define EFT_STATIC_ASSERT(fact) static_assert(fact, #fact)
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define EFT_STATIC_ASSERT(fact) _Static_assert(fact, #fact)
#else
#define EFT_PASTE_(a, b) a##b
#define EFT_PASTE(a, b) EFT_PASTE_(a, b)
#define EFT_STATIC_ASSERT(fact) typedef char EFT_PASTE(eft_assert_, __LINE__)[(fact) ? 1 : -1]
#endif

// Changes with every incompatible change of the header.
#define EFT_ABI_VERSION 5

// eft_adaptive_parameters.parts: demand the command's own flow as well.
#define EFT_FEEDFORWARD 1

// eft_adaptive_parameters.parts: estimate flow gain and valve during the test.
#define EFT_ESTIMATORS 2

// eft_adaptive_parameters.parts: take the level back where overcompensation pumps the structure.
#define EFT_GUARD 4

// eft_adaptive_parameters.parts: correct the flow table by direction and band of opening, beside EFT_ESTIMATORS.
#define EFT_CURVE 8

// Points a flow table may have.
#define EFT_TABLE_CAPACITY 21

// eft_parameters.mode: the piston's motion is not compensated.
#define EFT_MODE_OFF 0

// eft_parameters.mode: through the initial flow gain.
#define EFT_MODE_LINEAR 1

// eft_parameters.mode: through the inverse flow table and the load-pressure correction.
#define EFT_MODE_NONLINEAR 2

// eft_parameters.sign_from: the load-pressure correction takes its sign from the measured spool, as in the paper.
#define EFT_SIGN_FROM_SPOOL 0

// eft_parameters.sign_from: the sign of the demanded flow, free of chatter.
#define EFT_SIGN_FROM_DEMAND 1

// Done.
#define EFT_OK 0

// A pointer was null; nothing was done.
#define EFT_NULL_POINTER 1

// A parameter is NaN or infinite.
#define EFT_NOT_FINITE 2

// A parameter is zero or negative.
#define EFT_NOT_POSITIVE 3

// A parameter is outside its range.
#define EFT_OUT_OF_RANGE 4

// A table does not increase strictly.
#define EFT_NOT_INCREASING 5

// A table's length is not allowed.
#define EFT_LENGTH 6

// A table rises too steeply.
#define EFT_TOO_STEEP 7

// Another configuration is still waiting to be taken over.
#define EFT_BUSY 8

// The configuration was refused for a reason this version of the interface has no name for.
#define EFT_REFUSED 9

// The configuration is not what its parameters make.
#define EFT_CORRUPT 10

// A parameter is no whole number.
#define EFT_NOT_WHOLE 11

// Measured or required spool opening beyond the warning level.
#define EFT_SPOOL_WARNING (1 << 0)

// The demanded flow lies beyond the flow table, or the required opening beyond the spool's stroke.
#define EFT_DEMAND_SATURATED (1 << 1)

// The load-pressure correction is at its limit.
#define EFT_LOAD_PRESSURE_FLOORED (1 << 2)

// The valve command was cut to its limit.
#define EFT_COMMAND_LIMITED (1 << 3)

// The valve command's rate was cut to its limit.
#define EFT_RATE_LIMITED (1 << 4)

// A measurement was not finite or out of its range; the last output is held.
#define EFT_INVALID_MEASUREMENT (1 << 5)

// The force command was not finite; the last output is held, or a protection follows the last valid command.
#define EFT_INVALID_COMMAND (1 << 6)

// The output was held on request.
#define EFT_HELD (1 << 7)

// The tick was missed; the last output is held.
#define EFT_MISSED_TICK (1 << 11)

// eft_output.status, adaptive: the estimators stand still, after a bad measurement or where their models do not
// explain what is measured.
#define EFT_ADAPTATION_FROZEN (1 << 12)

// eft_output.status, adaptive: an estimate stands at one of its bounds.
#define EFT_ESTIMATE_BOUNDED (1 << 13)

// eft_output.status, adaptive: the overcompensation guard has taken the compensation level back.
#define EFT_LEVEL_REDUCED (1 << 14)

// A measurement is beyond its warning level of the protection.
#define EFT_PROTECTION_WARNING (1 << 15)

// The protection has tripped: the force command is frozen and taken to zero.
#define EFT_TRIPPED (1 << 16)

// The protection takes the whole valve command to zero.
#define EFT_SHUT_DOWN (1 << 17)

// A measurement repeats itself to the last bit: its sensor or converter is frozen.
#define EFT_STUCK_MEASUREMENT (1 << 18)

// A controller's parameters in SI units; plain data, so that a constant one can stay in flash.
typedef struct eft_parameters {
  // Points of the flow table in use.
  uint32_t table_length;
  // EFT_MODE_...
  uint8_t mode;
  // EFT_SIGN_FROM_...
  uint8_t sign_from;
  // Zero.
  uint16_t reserved;
  // Compensation level, 1.
  double level;
  // Piston area, m².
  double piston_area;
  // Supply pressure, Pa.
  double supply_pressure;
  // Flow gain of the linear mode, m³/s.
  double flow_gain;
  // Valve gain, 1/V.
  double valve_gain;
  // Response delay, s.
  double response_delay;
  // The lead network's α, 1.
  double lead_alpha;
  // Sample rate, Hz.
  double sample_rate;
  // Force sensitivity, V/N.
  double force_sensitivity;
  // Proportional gain, V/V.
  double proportional_gain;
  // Derivative gain, s.
  double derivative_gain;
  // Largest valve command, V; DBL_MAX for no limit.
  double valve_command;
  // Largest rate of the valve command, V/s; DBL_MAX for no limit.
  double valve_command_rate;
  // Opening that raises EFT_SPOOL_WARNING, 1.
  double spool_warning;
  // Velocity beyond which a measurement is invalid, m/s.
  double velocity_range;
  // Force beyond which a measurement is invalid, N.
  double force_range;
  // Spool opening beyond which a measurement is invalid, 1.
  double spool_range;
  // Spool openings of the flow table, strictly increasing, 1.
  double openings[EFT_TABLE_CAPACITY];
  // Flows of the flow table, strictly increasing, m³/s.
  double flows[EFT_TABLE_CAPACITY];
} eft_parameters;

// An adaptive controller's parameters in SI units: the nominal rig, and what is switched on.
typedef struct eft_adaptive_parameters {
  // The rig as the plain controller knows it.
  struct eft_parameters rig;
  // Oil compressibility of the chambers, m³/Pa.
  double compressibility;
  // Cross-piston leakage, m³/(s·Pa).
  double leakage;
  // Delay of the velocity itself, of an estimate for example, s; 0 for a sensor's.
  double velocity_delay;
  // Samples by which the compensation comes late to the valve command, at most 1000, 1.
  uint32_t computation_delay;
  // EFT_FEEDFORWARD and its siblings, added up.
  uint32_t parts;
} eft_adaptive_parameters;

// A configuration: opaque, filled by eft_adaptive_configure only. One drives any number of states.
typedef struct eft_adaptive_f32 {
  float words[288];
} eft_adaptive_f32;

// Why a configuration was refused.
typedef struct eft_error {
  // The refused value (lengths as numbers); zero where there is none.
  double value;
  // The lowest value allowed.
  double lowest;
  // The highest value allowed.
  double highest;
  // The entry of a table.
  uint32_t index;
  // The parameter's name, ended by a zero byte.
  char parameter[28];
} eft_error;

// What the adaptive controller remembers and has learned; opaque, filled by eft_adaptive_reset or
// eft_adaptive_prime before the first step.
typedef struct eft_adaptive_state_f32 {
  float words[272];
} eft_adaptive_state_f32;

// One tick's command and measurements.
typedef struct eft_adaptive_input_f32 {
  // Force command, N.
  float command;
  // Piston velocity, m/s.
  float velocity;
  // Force, N.
  float force;
  // Spool opening, 1.
  float spool;
  // Supply pressure, Pa; the configured one where there is no transducer.
  float supply_pressure;
  // Valve command that stood when the others were sampled, V; only the compensation alone looks at it.
  float valve_command;
} eft_adaptive_input_f32;

// One tick's result.
typedef struct eft_output_f32 {
  // Valve command, V.
  float valve_command;
  // The part of it that compensates the piston's motion, V.
  float compensation;
  // EFT_SPOOL_WARNING and its siblings.
  uint32_t status;
} eft_output_f32;

// What was learned.
typedef struct eft_learned_f32 {
  // True flow over the table's, 1.
  float flow_gain;
  // The spool's gain over the configured one, 1.
  float valve_gain;
  // Delay that the lead network makes up for, s.
  float response_delay;
  // The guard's factor on the compensation level, 1.
  float level;
} eft_learned_f32;

// A configuration: opaque, filled by eft_adaptive_configure only. One drives any number of states.
typedef struct eft_adaptive_f64 {
  double words[288];
} eft_adaptive_f64;

// What the adaptive controller remembers and has learned; opaque, filled by eft_adaptive_reset or
// eft_adaptive_prime before the first step.
typedef struct eft_adaptive_state_f64 {
  double words[272];
} eft_adaptive_state_f64;

// One tick's command and measurements.
typedef struct eft_adaptive_input_f64 {
  // Force command, N.
  double command;
  // Piston velocity, m/s.
  double velocity;
  // Force, N.
  double force;
  // Spool opening, 1.
  double spool;
  // Supply pressure, Pa; the configured one where there is no transducer.
  double supply_pressure;
  // Valve command that stood when the others were sampled, V; only the compensation alone looks at it.
  double valve_command;
} eft_adaptive_input_f64;

// One tick's result.
typedef struct eft_output_f64 {
  // Valve command, V.
  double valve_command;
  // The part of it that compensates the piston's motion, V.
  double compensation;
  // EFT_SPOOL_WARNING and its siblings.
  uint32_t status;
} eft_output_f64;

// What was learned.
typedef struct eft_learned_f64 {
  // True flow over the table's, 1.
  double flow_gain;
  // The spool's gain over the configured one, 1.
  double valve_gain;
  // Delay that the lead network makes up for, s.
  double response_delay;
  // The guard's factor on the compensation level, 1.
  double level;
} eft_learned_f64;

// A configuration: opaque, filled by eft_configure only. One drives any number of states.
typedef struct eft_controller_f32 {
  float words[100];
} eft_controller_f32;

// What the controller remembers; all zero bytes are a rig at rest.
typedef struct eft_state_f32 {
  float words[5];
} eft_state_f32;

// One tick's command and measurements.
typedef struct eft_input_f32 {
  // Force command, N.
  float command;
  // Piston velocity, m/s.
  float velocity;
  // Force, N.
  float force;
  // Spool opening, 1.
  float spool;
  // Flow wanted on top of the piston's, m³/s; 0 for none.
  float further_flow;
} eft_input_f32;

// Which copy is in use and which was last offered: 0 or 1 each.
typedef struct eft_turn {
  uint32_t active;
  uint32_t offered;
} eft_turn;

// Two configurations: the interrupt steps with one while the other is written.
typedef struct eft_shadow_f32 {
  struct eft_controller_f32 copies[2];
  struct eft_turn turn;
} eft_shadow_f32;

// A configuration: opaque, filled by eft_configure only. One drives any number of states.
typedef struct eft_controller_f64 {
  double words[92];
} eft_controller_f64;

// What the controller remembers; all zero bytes are a rig at rest.
typedef struct eft_state_f64 {
  double words[5];
} eft_state_f64;

// One tick's command and measurements.
typedef struct eft_input_f64 {
  // Force command, N.
  double command;
  // Piston velocity, m/s.
  double velocity;
  // Force, N.
  double force;
  // Spool opening, 1.
  double spool;
  // Flow wanted on top of the piston's, m³/s; 0 for none.
  double further_flow;
} eft_input_f64;

// Two configurations: the interrupt steps with one while the other is written.
typedef struct eft_shadow_f64 {
  struct eft_controller_f64 copies[2];
  struct eft_turn turn;
} eft_shadow_f64;

// A protection's parameters in SI units. DBL_MAX is no limit; a level that is zero trips at once.
typedef struct eft_protection_parameters {
  // Sample rate, Hz.
  double sample_rate;
  // Force that raises EFT_PROTECTION_WARNING, N.
  double force_warning;
  // Force that trips the test, N.
  double force_trip;
  // Displacement that raises EFT_PROTECTION_WARNING, m.
  double displacement_warning;
  // Displacement that trips the test, m.
  double displacement_trip;
  // Velocity that raises EFT_PROTECTION_WARNING, m/s.
  double velocity_warning;
  // Velocity that trips the test, m/s.
  double velocity_trip;
  // Spool opening that raises EFT_PROTECTION_WARNING, 1.
  double spool_warning;
  // Spool opening that trips the test, 1.
  double spool_trip;
  // Time from zero to the whole command at the start, s; 0 for none.
  double start_time;
  // Time from the whole command to zero after a trip or at the end, s.
  double ramp_time;
  // Time from the whole valve command to zero in a shutdown, s.
  double shutdown_time;
  // Lost or refused samples in a row that are waited for before a shutdown, lost commands before a trip; a whole
  // number, 1.
  double lost_samples;
  // Time for which EFT_ADAPTATION_FROZEN or EFT_STUCK_MEASUREMENT is waited for before a trip, s.
  double fault_time;
} eft_protection_parameters;

// A protection: opaque, filled by eft_protection_configure only. One drives any number of states.
typedef struct eft_protection_f32 {
  float words[24];
} eft_protection_f32;

// What a protection remembers; all zero bytes are a rig before the start.
typedef struct eft_protection_state_f32 {
  float words[16];
} eft_protection_state_f32;

// One tick's command and measurements.
typedef struct eft_protection_input_f32 {
  // Force command, N.
  float command;
  // Force, N.
  float force;
  // Displacement, m.
  float displacement;
  // Piston velocity, m/s.
  float velocity;
  // Spool opening, 1.
  float spool;
} eft_protection_input_f32;

// What the protection permits in one tick.
typedef struct eft_permitted_f32 {
  // The force command for the controller's step, N; finite.
  float command;
  // Factor on the valve command, 1; eft_protection_apply puts it there.
  float authority;
  // EFT_PROTECTION_WARNING, EFT_TRIPPED, EFT_SHUT_DOWN, EFT_INVALID_COMMAND.
  uint32_t status;
} eft_permitted_f32;

// A protection: opaque, filled by eft_protection_configure only. One drives any number of states.
typedef struct eft_protection_f64 {
  double words[24];
} eft_protection_f64;

// What a protection remembers; all zero bytes are a rig before the start.
typedef struct eft_protection_state_f64 {
  double words[16];
} eft_protection_state_f64;

// One tick's command and measurements.
typedef struct eft_protection_input_f64 {
  // Force command, N.
  double command;
  // Force, N.
  double force;
  // Displacement, m.
  double displacement;
  // Piston velocity, m/s.
  double velocity;
  // Spool opening, 1.
  double spool;
} eft_protection_input_f64;

// What the protection permits in one tick.
typedef struct eft_permitted_f64 {
  // The force command for the controller's step, N; finite.
  double command;
  // Factor on the valve command, 1; eft_protection_apply puts it there.
  double authority;
  // EFT_PROTECTION_WARNING, EFT_TRIPPED, EFT_SHUT_DOWN, EFT_INVALID_COMMAND.
  uint32_t status;
} eft_permitted_f64;

// What a watch for stuck sensors is made from.
typedef struct eft_stuck_parameters {
  // Samples for which a measurement may repeat itself to the last bit before it counts as stuck, 1.
  uint32_t repeats;
} eft_stuck_parameters;

// A watch for stuck sensors: opaque, filled by eft_stuck_configure only.
typedef struct eft_stuck_f32 {
  float words[2];
} eft_stuck_f32;

// The last measurements and how often each has repeated itself; all zero bytes have seen nothing.
typedef struct eft_stuck_state_f32 {
  float words[8];
} eft_stuck_state_f32;

// A watch for stuck sensors: opaque, filled by eft_stuck_configure only.
typedef struct eft_stuck_f64 {
  double words[2];
} eft_stuck_f64;

// The last measurements and how often each has repeated itself; all zero bytes have seen nothing.
typedef struct eft_stuck_state_f64 {
  double words[8];
} eft_stuck_state_f64;

// What a filtered derivative is made from.
typedef struct eft_derivative_parameters {
  // Sample rate, Hz.
  double sample_rate;
  // Corner of its two low-passes, Hz.
  double corner;
} eft_derivative_parameters;

// A filtered derivative: opaque, filled by eft_derivative_configure only.
typedef struct eft_derivative_f32 {
  float words[4];
} eft_derivative_f32;

// What a filtered derivative remembers; all zero bytes are a rig at rest at zero displacement.
typedef struct eft_derivative_state_f32 {
  float words[4];
} eft_derivative_state_f32;

// What a steady-state Kalman observer is made from.
typedef struct eft_observer_parameters {
  // Sample rate, Hz.
  double sample_rate;
  // Gain on the displacement, 1.
  double gain_on_displacement;
  // Gain on the velocity, 1/s.
  double gain_on_velocity;
  // Gain on the drift of the acceleration, 1/s².
  double gain_on_drift;
} eft_observer_parameters;

// A velocity observer: opaque, filled by eft_observer_configure only.
typedef struct eft_observer_f32 {
  float words[8];
} eft_observer_f32;

// What a velocity observer remembers; all zero bytes are a rig at rest at zero displacement and
// acceleration.
typedef struct eft_observer_state_f32 {
  float words[8];
} eft_observer_state_f32;

// A filtered derivative: opaque, filled by eft_derivative_configure only.
typedef struct eft_derivative_f64 {
  double words[4];
} eft_derivative_f64;

// What a filtered derivative remembers; all zero bytes are a rig at rest at zero displacement.
typedef struct eft_derivative_state_f64 {
  double words[4];
} eft_derivative_state_f64;

// A velocity observer: opaque, filled by eft_observer_configure only.
typedef struct eft_observer_f64 {
  double words[8];
} eft_observer_f64;

// What a velocity observer remembers; all zero bytes are a rig at rest at zero displacement and
// acceleration.
typedef struct eft_observer_state_f64 {
  double words[8];
} eft_observer_state_f64;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version this library was built with: compare it with EFT_ABI_VERSION once at start-up.
uint32_t eft_abi_version(void);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_adaptive_configure_f32(const struct eft_adaptive_parameters *parameters,
                                   struct eft_adaptive_f32 *config,
                                   struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_adaptive_check_f32(const struct eft_adaptive_f32 *config, const struct eft_adaptive_parameters *parameters);

// A rig at rest, nothing learned yet.
uint8_t eft_adaptive_reset_f32(const struct eft_adaptive_f32 *config, struct eft_adaptive_state_f32 *state);

// A rig that has long been at this operating point, nothing learned yet: the next step starts without a
// bump.
uint8_t eft_adaptive_prime_f32(const struct eft_adaptive_f32 *config,
                               struct eft_adaptive_state_f32 *state,
                               const struct eft_adaptive_input_f32 *input);

// Repeats the last valve command; the state stays. Behind a protection it has to pass eft_protection_apply as any
// other. Of an adaptive controller that misses several ticks give the step a measurement that is NaN instead, so
// that nothing is learned of the gap.
uint8_t eft_adaptive_hold_f32(const struct eft_adaptive_f32 *config,
                              const struct eft_adaptive_state_f32 *state,
                              struct eft_output_f32 *output);

// In place of a tick that was missed: the last valve command stays, and the output says so.
uint8_t eft_adaptive_missed_f32(const struct eft_adaptive_f32 *config,
                                const struct eft_adaptive_state_f32 *state,
                                struct eft_output_f32 *output);

// One tick. What is NaN, infinite or out of its range repeats the last valve command and raises
// EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND; nothing is learned for a tenth of a second after it.
// A supply pressure is in its range from 0.05 to 4 times the configured one.
uint8_t eft_adaptive_step_f32(const struct eft_adaptive_f32 *config,
                              struct eft_adaptive_state_f32 *state,
                              const struct eft_adaptive_input_f32 *input,
                              struct eft_output_f32 *output);

// As eft_adaptive_step, where the next sample's command, N, is known, as of a ground motion: the flow that
// is fed forward is that of the time until the next sample. Behind a protection it is what
// eft_protection_preview gives.
uint8_t eft_adaptive_step_ahead_f32(const struct eft_adaptive_f32 *config,
                                    struct eft_adaptive_state_f32 *state,
                                    const struct eft_adaptive_input_f32 *input,
                                    float next_command,
                                    struct eft_output_f32 *output);

// The compensation alone, for a force loop that another controller closes: output->valve_command is the
// compensation signal. input->valve_command must be measured; where it is NaN, infinite or beyond 1e12, only
// learning waits (EFT_ADAPTATION_FROZEN).
uint8_t eft_adaptive_compensation_step_f32(const struct eft_adaptive_f32 *config,
                                           struct eft_adaptive_state_f32 *state,
                                           const struct eft_adaptive_input_f32 *input,
                                           struct eft_output_f32 *output);

// As eft_adaptive_compensation_step, where the next sample's command, N, is known: see
// eft_adaptive_step_ahead.
uint8_t eft_adaptive_compensation_step_ahead_f32(const struct eft_adaptive_f32 *config,
                                                 struct eft_adaptive_state_f32 *state,
                                                 const struct eft_adaptive_input_f32 *input,
                                                 float next_command,
                                                 struct eft_output_f32 *output);

// What was learned so far.
uint8_t eft_adaptive_learned_f32(const struct eft_adaptive_state_f32 *state, struct eft_learned_f32 *learned);

// No-load flow that the valve was found to pass at a spool opening: m3/s at 1. At the openings of the
// table it is the rig's new flow curve, beyond its ends that of the end. EFT_NOT_FINITE for an opening
// that is NaN or infinite, and *flow stays. For after a test, not for the interrupt: its cost is not
// counted.
uint8_t eft_adaptive_flow_f32(const struct eft_adaptive_f32 *config,
                              const struct eft_adaptive_state_f32 *state,
                              float opening,
                              float *flow);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_adaptive_configure_f64(const struct eft_adaptive_parameters *parameters,
                                   struct eft_adaptive_f64 *config,
                                   struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_adaptive_check_f64(const struct eft_adaptive_f64 *config, const struct eft_adaptive_parameters *parameters);

// A rig at rest, nothing learned yet.
uint8_t eft_adaptive_reset_f64(const struct eft_adaptive_f64 *config, struct eft_adaptive_state_f64 *state);

// A rig that has long been at this operating point, nothing learned yet: the next step starts without a
// bump.
uint8_t eft_adaptive_prime_f64(const struct eft_adaptive_f64 *config,
                               struct eft_adaptive_state_f64 *state,
                               const struct eft_adaptive_input_f64 *input);

// Repeats the last valve command; the state stays. Behind a protection it has to pass eft_protection_apply as any
// other. Of an adaptive controller that misses several ticks give the step a measurement that is NaN instead, so
// that nothing is learned of the gap.
uint8_t eft_adaptive_hold_f64(const struct eft_adaptive_f64 *config,
                              const struct eft_adaptive_state_f64 *state,
                              struct eft_output_f64 *output);

// In place of a tick that was missed: the last valve command stays, and the output says so.
uint8_t eft_adaptive_missed_f64(const struct eft_adaptive_f64 *config,
                                const struct eft_adaptive_state_f64 *state,
                                struct eft_output_f64 *output);

// One tick. What is NaN, infinite or out of its range repeats the last valve command and raises
// EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND; nothing is learned for a tenth of a second after it.
// A supply pressure is in its range from 0.05 to 4 times the configured one.
uint8_t eft_adaptive_step_f64(const struct eft_adaptive_f64 *config,
                              struct eft_adaptive_state_f64 *state,
                              const struct eft_adaptive_input_f64 *input,
                              struct eft_output_f64 *output);

// As eft_adaptive_step, where the next sample's command, N, is known, as of a ground motion: the flow that
// is fed forward is that of the time until the next sample. Behind a protection it is what
// eft_protection_preview gives.
uint8_t eft_adaptive_step_ahead_f64(const struct eft_adaptive_f64 *config,
                                    struct eft_adaptive_state_f64 *state,
                                    const struct eft_adaptive_input_f64 *input,
                                    double next_command,
                                    struct eft_output_f64 *output);

// The compensation alone, for a force loop that another controller closes: output->valve_command is the
// compensation signal. input->valve_command must be measured; where it is NaN, infinite or beyond 1e12, only
// learning waits (EFT_ADAPTATION_FROZEN).
uint8_t eft_adaptive_compensation_step_f64(const struct eft_adaptive_f64 *config,
                                           struct eft_adaptive_state_f64 *state,
                                           const struct eft_adaptive_input_f64 *input,
                                           struct eft_output_f64 *output);

// As eft_adaptive_compensation_step, where the next sample's command, N, is known: see
// eft_adaptive_step_ahead.
uint8_t eft_adaptive_compensation_step_ahead_f64(const struct eft_adaptive_f64 *config,
                                                 struct eft_adaptive_state_f64 *state,
                                                 const struct eft_adaptive_input_f64 *input,
                                                 double next_command,
                                                 struct eft_output_f64 *output);

// What was learned so far.
uint8_t eft_adaptive_learned_f64(const struct eft_adaptive_state_f64 *state, struct eft_learned_f64 *learned);

// No-load flow that the valve was found to pass at a spool opening: m3/s at 1. At the openings of the
// table it is the rig's new flow curve, beyond its ends that of the end. EFT_NOT_FINITE for an opening
// that is NaN or infinite, and *flow stays. For after a test, not for the interrupt: its cost is not
// counted.
uint8_t eft_adaptive_flow_f64(const struct eft_adaptive_f64 *config,
                              const struct eft_adaptive_state_f64 *state,
                              double opening,
                              double *flow);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_configure_f32(const struct eft_parameters *parameters,
                          struct eft_controller_f32 *config,
                          struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_check_f32(const struct eft_controller_f32 *config, const struct eft_parameters *parameters);

// Puts a state to rest.
uint8_t eft_reset_f32(struct eft_state_f32 *state);

// The state of a rig that has long been at this operating point: the next step starts without a bump.
uint8_t eft_prime_f32(const struct eft_controller_f32 *config,
                      struct eft_state_f32 *state,
                      const struct eft_input_f32 *input);

// Repeats the last valve command; the state stays. Behind a protection it has to pass eft_protection_apply as any
// other. Of an adaptive controller that misses several ticks give the step a measurement that is NaN instead, so
// that nothing is learned of the gap.
uint8_t eft_hold_f32(const struct eft_controller_f32 *config,
                     const struct eft_state_f32 *state,
                     struct eft_output_f32 *output);

// In place of a tick that was missed: the last valve command stays, and the output says so.
uint8_t eft_missed_f32(const struct eft_controller_f32 *config,
                       const struct eft_state_f32 *state,
                       struct eft_output_f32 *output);

// One tick. A measurement or command that is NaN, infinite or out of its range leaves the state as it
// was, repeats the last valve command and raises EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND; the
// next good tick continues.
uint8_t eft_step_f32(const struct eft_controller_f32 *config,
                     struct eft_state_f32 *state,
                     const struct eft_input_f32 *input,
                     struct eft_output_f32 *output);

// The compensation alone, for a force loop that another controller closes: the command does not count,
// and output->valve_command is the compensation signal.
uint8_t eft_compensation_step_f32(const struct eft_controller_f32 *config,
                                  struct eft_state_f32 *state,
                                  const struct eft_input_f32 *input,
                                  struct eft_output_f32 *output);

// Both copies become *config, and none waits. Before the interrupt is enabled.
uint8_t eft_shadow_init_f32(struct eft_shadow_f32 *shadow, const struct eft_controller_f32 *config);

// Offers a configuration to the interrupt; EFT_BUSY while the one before still waits. From one thread at
// a time.
uint8_t eft_shadow_offer_f32(struct eft_shadow_f32 *shadow, const struct eft_controller_f32 *config);

// In the interrupt, before the step: the configuration to step with; null for null.
const struct eft_controller_f32 *eft_shadow_take_f32(const struct eft_shadow_f32 *shadow);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_configure_f64(const struct eft_parameters *parameters,
                          struct eft_controller_f64 *config,
                          struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_check_f64(const struct eft_controller_f64 *config, const struct eft_parameters *parameters);

// Puts a state to rest.
uint8_t eft_reset_f64(struct eft_state_f64 *state);

// The state of a rig that has long been at this operating point: the next step starts without a bump.
uint8_t eft_prime_f64(const struct eft_controller_f64 *config,
                      struct eft_state_f64 *state,
                      const struct eft_input_f64 *input);

// Repeats the last valve command; the state stays. Behind a protection it has to pass eft_protection_apply as any
// other. Of an adaptive controller that misses several ticks give the step a measurement that is NaN instead, so
// that nothing is learned of the gap.
uint8_t eft_hold_f64(const struct eft_controller_f64 *config,
                     const struct eft_state_f64 *state,
                     struct eft_output_f64 *output);

// In place of a tick that was missed: the last valve command stays, and the output says so.
uint8_t eft_missed_f64(const struct eft_controller_f64 *config,
                       const struct eft_state_f64 *state,
                       struct eft_output_f64 *output);

// One tick. A measurement or command that is NaN, infinite or out of its range leaves the state as it
// was, repeats the last valve command and raises EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND; the
// next good tick continues.
uint8_t eft_step_f64(const struct eft_controller_f64 *config,
                     struct eft_state_f64 *state,
                     const struct eft_input_f64 *input,
                     struct eft_output_f64 *output);

// The compensation alone, for a force loop that another controller closes: the command does not count,
// and output->valve_command is the compensation signal.
uint8_t eft_compensation_step_f64(const struct eft_controller_f64 *config,
                                  struct eft_state_f64 *state,
                                  const struct eft_input_f64 *input,
                                  struct eft_output_f64 *output);

// Both copies become *config, and none waits. Before the interrupt is enabled.
uint8_t eft_shadow_init_f64(struct eft_shadow_f64 *shadow, const struct eft_controller_f64 *config);

// Offers a configuration to the interrupt; EFT_BUSY while the one before still waits. From one thread at
// a time.
uint8_t eft_shadow_offer_f64(struct eft_shadow_f64 *shadow, const struct eft_controller_f64 *config);

// In the interrupt, before the step: the configuration to step with; null for null.
const struct eft_controller_f64 *eft_shadow_take_f64(const struct eft_shadow_f64 *shadow);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_protection_configure_f32(const struct eft_protection_parameters *parameters,
                                     struct eft_protection_f32 *config,
                                     struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_protection_check_f32(const struct eft_protection_f32 *config,
                                 const struct eft_protection_parameters *parameters);

// A rig before the start, nothing tripped.
uint8_t eft_protection_reset_f32(struct eft_protection_state_f32 *state);

// One tick, before the controller's step, which gets permitted->command. A measurement that is NaN or
// infinite counts as lost. In place of such a command the last valid one is followed and
// EFT_INVALID_COMMAND raised; when it stays lost the test is tripped.
uint8_t eft_protection_step_f32(const struct eft_protection_f32 *config,
                                struct eft_protection_state_f32 *state,
                                const struct eft_protection_input_f32 *input,
                                struct eft_permitted_f32 *permitted);

// After eft_protection_step: *permitted is what the next one will make of a command, N, known in advance,
// if nothing new happens.
uint8_t eft_protection_preview_f32(const struct eft_protection_f32 *config,
                                   const struct eft_protection_state_f32 *state,
                                   float next_command,
                                   float *permitted);

// After the controller's step: puts the authority on output->valve_command and joins the flags. A fault
// that persists in output->status trips the test; samples that the controller keeps refusing, so that it
// holds its output (EFT_INVALID_MEASUREMENT, EFT_INVALID_COMMAND), shut it down as lost ones do.
// *permitted is what the step gave.
uint8_t eft_protection_apply_f32(const struct eft_protection_f32 *config,
                                 struct eft_protection_state_f32 *state,
                                 const struct eft_permitted_f32 *permitted,
                                 struct eft_output_f32 *output);

// Trips from outside, as an emergency stop does, at the last command. Not while a step runs.
uint8_t eft_protection_trip_f32(struct eft_protection_state_f32 *state);

// Asks for the soft end: the command, still followed, fades along the ramp. Not while a step runs.
uint8_t eft_protection_end_f32(struct eft_protection_state_f32 *state);

// Sets *down to 1 where the ramp has reached zero (or the test has not begun), to 0 elsewhere.
uint8_t eft_protection_is_down_f32(const struct eft_protection_state_f32 *state, uint8_t *down);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_protection_configure_f64(const struct eft_protection_parameters *parameters,
                                     struct eft_protection_f64 *config,
                                     struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_protection_check_f64(const struct eft_protection_f64 *config,
                                 const struct eft_protection_parameters *parameters);

// A rig before the start, nothing tripped.
uint8_t eft_protection_reset_f64(struct eft_protection_state_f64 *state);

// One tick, before the controller's step, which gets permitted->command. A measurement that is NaN or
// infinite counts as lost. In place of such a command the last valid one is followed and
// EFT_INVALID_COMMAND raised; when it stays lost the test is tripped.
uint8_t eft_protection_step_f64(const struct eft_protection_f64 *config,
                                struct eft_protection_state_f64 *state,
                                const struct eft_protection_input_f64 *input,
                                struct eft_permitted_f64 *permitted);

// After eft_protection_step: *permitted is what the next one will make of a command, N, known in advance,
// if nothing new happens.
uint8_t eft_protection_preview_f64(const struct eft_protection_f64 *config,
                                   const struct eft_protection_state_f64 *state,
                                   double next_command,
                                   double *permitted);

// After the controller's step: puts the authority on output->valve_command and joins the flags. A fault
// that persists in output->status trips the test; samples that the controller keeps refusing, so that it
// holds its output (EFT_INVALID_MEASUREMENT, EFT_INVALID_COMMAND), shut it down as lost ones do.
// *permitted is what the step gave.
uint8_t eft_protection_apply_f64(const struct eft_protection_f64 *config,
                                 struct eft_protection_state_f64 *state,
                                 const struct eft_permitted_f64 *permitted,
                                 struct eft_output_f64 *output);

// Trips from outside, as an emergency stop does, at the last command. Not while a step runs.
uint8_t eft_protection_trip_f64(struct eft_protection_state_f64 *state);

// Asks for the soft end: the command, still followed, fades along the ramp. Not while a step runs.
uint8_t eft_protection_end_f64(struct eft_protection_state_f64 *state);

// Sets *down to 1 where the ramp has reached zero (or the test has not begun), to 0 elsewhere.
uint8_t eft_protection_is_down_f64(const struct eft_protection_state_f64 *state, uint8_t *down);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_stuck_configure_f32(const struct eft_stuck_parameters *parameters,
                                struct eft_stuck_f32 *config,
                                struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_stuck_check_f32(const struct eft_stuck_f32 *config, const struct eft_stuck_parameters *parameters);

// Forgets what was seen.
uint8_t eft_stuck_reset_f32(struct eft_stuck_state_f32 *state);

// One sample of piston velocity, m/s (or displacement, m, where the velocity is made of it), force, N, and
// spool opening, 1: *status is EFT_STUCK_MEASUREMENT where one of them has repeated itself too often, 0
// elsewhere. NaN is never stuck.
uint8_t eft_stuck_step_f32(const struct eft_stuck_f32 *config,
                           struct eft_stuck_state_f32 *state,
                           float velocity,
                           float force,
                           float spool,
                           uint32_t *status);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_stuck_configure_f64(const struct eft_stuck_parameters *parameters,
                                struct eft_stuck_f64 *config,
                                struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_stuck_check_f64(const struct eft_stuck_f64 *config, const struct eft_stuck_parameters *parameters);

// Forgets what was seen.
uint8_t eft_stuck_reset_f64(struct eft_stuck_state_f64 *state);

// One sample of piston velocity, m/s (or displacement, m, where the velocity is made of it), force, N, and
// spool opening, 1: *status is EFT_STUCK_MEASUREMENT where one of them has repeated itself too often, 0
// elsewhere. NaN is never stuck.
uint8_t eft_stuck_step_f64(const struct eft_stuck_f64 *config,
                           struct eft_stuck_state_f64 *state,
                           double velocity,
                           double force,
                           double spool,
                           uint32_t *status);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_derivative_configure_f32(const struct eft_derivative_parameters *parameters,
                                     struct eft_derivative_f32 *config,
                                     struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_derivative_check_f32(const struct eft_derivative_f32 *config,
                                 const struct eft_derivative_parameters *parameters);

// A rig that has long been at rest at this displacement, m: no kick in the next step.
uint8_t eft_derivative_reset_f32(const struct eft_derivative_f32 *config,
                                 struct eft_derivative_state_f32 *state,
                                 float displacement);

// One sample: *velocity, m/s, for the measured displacement, m. A displacement that is NaN or infinite
// leaves the state and gives NaN, which the controller's step refuses with EFT_INVALID_MEASUREMENT.
uint8_t eft_derivative_step_f32(const struct eft_derivative_f32 *config,
                                struct eft_derivative_state_f32 *state,
                                float displacement,
                                float *velocity);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_observer_configure_f32(const struct eft_observer_parameters *parameters,
                                   struct eft_observer_f32 *config,
                                   struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_observer_check_f32(const struct eft_observer_f32 *config, const struct eft_observer_parameters *parameters);

// A rig that has long been at rest at this displacement, m, and with this acceleration, m/s², as the
// step will get it: it is taken as balanced, as that of a steady force on a standing piston is.
uint8_t eft_observer_reset_f32(const struct eft_observer_f32 *config,
                               struct eft_observer_state_f32 *state,
                               float displacement,
                               float acceleration);

// One sample: *velocity, m/s, for the measured displacement, m, and an acceleration, m/s²: an
// accelerometer's, or the measured force over the mass that it moves. What is NaN or infinite leaves
// the state and gives NaN, which the controller's step refuses with EFT_INVALID_MEASUREMENT.
uint8_t eft_observer_step_f32(const struct eft_observer_f32 *config,
                              struct eft_observer_state_f32 *state,
                              float displacement,
                              float acceleration,
                              float *velocity);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_derivative_configure_f64(const struct eft_derivative_parameters *parameters,
                                     struct eft_derivative_f64 *config,
                                     struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_derivative_check_f64(const struct eft_derivative_f64 *config,
                                 const struct eft_derivative_parameters *parameters);

// A rig that has long been at rest at this displacement, m: no kick in the next step.
uint8_t eft_derivative_reset_f64(const struct eft_derivative_f64 *config,
                                 struct eft_derivative_state_f64 *state,
                                 double displacement);

// One sample: *velocity, m/s, for the measured displacement, m. A displacement that is NaN or infinite
// leaves the state and gives NaN, which the controller's step refuses with EFT_INVALID_MEASUREMENT.
uint8_t eft_derivative_step_f64(const struct eft_derivative_f64 *config,
                                struct eft_derivative_state_f64 *state,
                                double displacement,
                                double *velocity);

// Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and
// *why (may be null) says what was wrong. Not for the interrupt: it computes in double precision.
uint8_t eft_observer_configure_f64(const struct eft_observer_parameters *parameters,
                                   struct eft_observer_f64 *config,
                                   struct eft_error *why);

// Whether a configuration still is what its parameters make: EFT_CORRUPT if any number of it differs, as
// after a memory fault or before it was configured. Not for the interrupt.
uint8_t eft_observer_check_f64(const struct eft_observer_f64 *config, const struct eft_observer_parameters *parameters);

// A rig that has long been at rest at this displacement, m, and with this acceleration, m/s², as the
// step will get it: it is taken as balanced, as that of a steady force on a standing piston is.
uint8_t eft_observer_reset_f64(const struct eft_observer_f64 *config,
                               struct eft_observer_state_f64 *state,
                               double displacement,
                               double acceleration);

// One sample: *velocity, m/s, for the measured displacement, m, and an acceleration, m/s²: an
// accelerometer's, or the measured force over the mass that it moves. What is NaN or infinite leaves
// the state and gives NaN, which the controller's step refuses with EFT_INVALID_MEASUREMENT.
uint8_t eft_observer_step_f64(const struct eft_observer_f64 *config,
                              struct eft_observer_state_f64 *state,
                              double displacement,
                              double acceleration,
                              double *velocity);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* EFT_H */

/* The same are asserted where the library is built. */
#ifndef EFT_H_ASSERTED
#define EFT_H_ASSERTED
EFT_STATIC_ASSERT(sizeof(eft_parameters) == 480);
EFT_STATIC_ASSERT(offsetof(eft_parameters, level) == 8);
EFT_STATIC_ASSERT(offsetof(eft_parameters, openings) == 144);
EFT_STATIC_ASSERT(offsetof(eft_parameters, flows) == 312);
EFT_STATIC_ASSERT(sizeof(eft_error) == 56);
EFT_STATIC_ASSERT(offsetof(eft_error, parameter) == 28);
EFT_STATIC_ASSERT(sizeof(eft_controller_f32) == 400);
EFT_STATIC_ASSERT(sizeof(eft_controller_f64) == 736);
EFT_STATIC_ASSERT(sizeof(eft_state_f32) == 20);
EFT_STATIC_ASSERT(sizeof(eft_state_f64) == 40);
EFT_STATIC_ASSERT(sizeof(eft_input_f32) == 20);
EFT_STATIC_ASSERT(sizeof(eft_input_f64) == 40);
EFT_STATIC_ASSERT(offsetof(eft_input_f32, further_flow) == 16);
EFT_STATIC_ASSERT(sizeof(eft_output_f32) == 12);
EFT_STATIC_ASSERT(sizeof(eft_output_f64) == 24);
EFT_STATIC_ASSERT(offsetof(eft_output_f32, status) == 8);
EFT_STATIC_ASSERT(sizeof(eft_adaptive_parameters) == 512);
EFT_STATIC_ASSERT(offsetof(eft_adaptive_parameters, parts) == 508);
EFT_STATIC_ASSERT(sizeof(eft_adaptive_f32) == 1152);
EFT_STATIC_ASSERT(sizeof(eft_adaptive_f64) == 2304);
EFT_STATIC_ASSERT(sizeof(eft_adaptive_state_f32) == 1088);
EFT_STATIC_ASSERT(sizeof(eft_adaptive_state_f64) == 2176);
EFT_STATIC_ASSERT(sizeof(eft_adaptive_input_f32) == 24);
EFT_STATIC_ASSERT(sizeof(eft_adaptive_input_f64) == 48);
EFT_STATIC_ASSERT(sizeof(eft_learned_f32) == 16);
EFT_STATIC_ASSERT(sizeof(eft_learned_f64) == 32);
EFT_STATIC_ASSERT(sizeof(eft_derivative_parameters) == 16);
EFT_STATIC_ASSERT(sizeof(eft_observer_parameters) == 32);
EFT_STATIC_ASSERT(sizeof(eft_derivative_f32) == 16);
EFT_STATIC_ASSERT(sizeof(eft_derivative_f64) == 32);
EFT_STATIC_ASSERT(sizeof(eft_derivative_state_f32) == 16);
EFT_STATIC_ASSERT(sizeof(eft_derivative_state_f64) == 32);
EFT_STATIC_ASSERT(sizeof(eft_observer_f32) == 32);
EFT_STATIC_ASSERT(sizeof(eft_observer_f64) == 64);
EFT_STATIC_ASSERT(sizeof(eft_observer_state_f32) == 32);
EFT_STATIC_ASSERT(sizeof(eft_observer_state_f64) == 64);
EFT_STATIC_ASSERT(sizeof(eft_protection_parameters) == 112);
EFT_STATIC_ASSERT(offsetof(eft_protection_parameters, fault_time) == 104);
EFT_STATIC_ASSERT(sizeof(eft_protection_f32) == 96);
EFT_STATIC_ASSERT(sizeof(eft_protection_f64) == 192);
EFT_STATIC_ASSERT(sizeof(eft_protection_state_f32) == 64);
EFT_STATIC_ASSERT(sizeof(eft_protection_state_f64) == 128);
EFT_STATIC_ASSERT(sizeof(eft_protection_input_f32) == 20);
EFT_STATIC_ASSERT(sizeof(eft_protection_input_f64) == 40);
EFT_STATIC_ASSERT(sizeof(eft_permitted_f32) == 12);
EFT_STATIC_ASSERT(sizeof(eft_permitted_f64) == 24);
EFT_STATIC_ASSERT(sizeof(eft_stuck_parameters) == 4);
EFT_STATIC_ASSERT(sizeof(eft_stuck_f32) == 8);
EFT_STATIC_ASSERT(sizeof(eft_stuck_f64) == 16);
EFT_STATIC_ASSERT(sizeof(eft_stuck_state_f32) == 32);
EFT_STATIC_ASSERT(sizeof(eft_stuck_state_f64) == 64);
EFT_STATIC_ASSERT(sizeof(eft_shadow_f32) == 808);
EFT_STATIC_ASSERT(sizeof(eft_shadow_f64) == 1480);
#endif
