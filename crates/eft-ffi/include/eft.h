/* Effective force testing: the controller for firmware. Made by cbindgen from crates/eft-ffi; do not edit.

   A rig that learns, in one context:

     #include "eft.h"

     extern const eft_parameters rig;      // written by "eft export"
     static eft_channel_f32 channel;       // configuration
     static eft_state_f32 state;           // state of the tick
     static eft_learner_f32 learner;       // the same for the learner, if the rig learns
     static eft_learner_state_f32 learned;
     static eft_input_f32 input;

     int start(void)                       // 0: a parameter was refused
     {
       eft_error why;                      // why.parameter names it
       return eft_abi_version() == EFT_ABI_VERSION &&
              eft_configure_f32(&rig, &channel, &why) == EFT_OK && eft_reset_f32(&channel, &state) == EFT_OK &&
              eft_learner_configure_f32(&rig, &learner, &why) == EFT_OK &&
              eft_learner_reset_f32(&learner, &learned) == EFT_OK && eft_input_init_f32(&input) == EFT_OK;
     }

     float tick(float command, float velocity, float force, float spool)  // once a sample: V to the converter
     {
       eft_output_f32 output;
       eft_calibration_f32 calibration;
       input.command = command;            // N
       input.velocity = velocity;          // m/s
       input.force = force;                // N
       input.spool = spool;                // 1
       if (eft_step_f32(&channel, &state, &input, &output) != EFT_OK) {
         return 0.0f;                      // start() was forgotten
       }
       if (output.window_closed && eft_learn_f32(&learner, &learned, &output.window, &calibration) == EFT_OK &&
           eft_publish_f32(&channel, &state, &calibration) != EFT_OK) {
         return 0.0f;
       }
       return output.voltage;              // output.status has the flags
     }

   With the learner in a task of lower priority, the interrupt offers the window (eft_offer_window_f32). It publishes
   the calibration that it takes (eft_take_calibration_f32). The task takes the window and offers the calibration.

   The language is C99 or C++11, or later ones.

   Rules for every function:
   - Memory. The caller owns every struct and passes it by pointer. The library has no globals and allocates no memory.
     A struct with a marker is opaque: a function makes it. One that was never made is refused with EFT_NOT_MADE.
   - Pointers. Each is null or points to a whole, aligned struct of its type. The structs of a call do not overlap. Null
     gives EFT_NULL_POINTER and has no other effect, except that eft_step gives 0 V.
   - Contexts. Call a function that takes a state in the context of its step. Requests (eft_request_...) may come from
     any context at any moment, and none is lost. Call eft_offer_... of an exchange in one context and eft_take_... in
     one context. Make and check configurations outside the interrupt.
   - Floating point. Round to nearest, without flush to zero and without default NaN, as FPSCR is after reset. In
     another mode the bits differ from those of a simulation. Compile your own arithmetic with -ffp-contract=off.
   - Units are SI. A positive spool opening admits flow to the chamber that pulls the structure. Load pressure and force
     are then positive. Displacement and velocity are positive in the direction of a positive force. */
#ifndef EFT_H
#define EFT_H

#include <stddef.h>
#include <stdint.h>

#if defined(__cplusplus) && __cplusplus < 201103L && !defined(_MSC_VER)
#error "eft.h needs C++11 or later"
#endif

#if defined(__cplusplus) ? __cplusplus >= 201703L : defined(__STDC_VERSION__) && __STDC_VERSION__ >= 202311L
#define EFT_NODISCARD [[nodiscard]]
#elif defined(__GNUC__)
#define EFT_NODISCARD __attribute__((warn_unused_result))
#else
#define EFT_NODISCARD
#endif

#if defined(__cplusplus)
#define EFT_STATIC_ASSERT(fact) static_assert(fact, #fact)
extern "C" {
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define EFT_STATIC_ASSERT(fact) _Static_assert(fact, #fact)
#else
#define EFT_PASTE_(a, b) a##b
#define EFT_PASTE(a, b) EFT_PASTE_(a, b)
#define EFT_STATIC_ASSERT(fact) typedef char EFT_PASTE(eft_assert_, __LINE__)[(fact) ? 1 : -1]
#endif
#define EFT_SIZES(type, f32, f64) EFT_STATIC_ASSERT(sizeof(type##_f32) == f32 && sizeof(type##_f64) == f64)

/* ---------- Version and return codes ---------- */

#define EFT_ABI_VERSION 6          // Changes with every incompatible change of the header.
#define EFT_OK 0                   // Done.
#define EFT_NULL_POINTER 1         // A pointer is null.
#define EFT_NOT_FINITE 2           // A parameter is NaN or infinite.
#define EFT_NOT_POSITIVE 3         // A parameter is zero or negative.
#define EFT_OUT_OF_RANGE 4         // A parameter is outside its range.
#define EFT_NOT_INCREASING 5       // A table does not increase strictly.
#define EFT_LENGTH 6               // A table's length is not allowed.
#define EFT_TOO_STEEP 7            // A table rises too steeply.
#define EFT_BUSY 8                 // The last offer has not been taken yet.
#define EFT_REFUSED 9              // A parameter was refused for a reason that has no code.
#define EFT_CORRUPT 10             // The configuration differs from one that is made from its parameters.
#define EFT_NOT_MADE 11            // An opaque struct was never configured, reset or filled.

// The version this library was built with: compare it with EFT_ABI_VERSION once at start-up.
EFT_NODISCARD uint32_t eft_abi_version(void);

/* ---------- Status of a tick ---------- */

#define EFT_NO_STEP (1u << 31)     // The step was refused; its return code has the reason, and the output is 0 V.
#define EFT_SPOOL_WARNING (1u << 0) // The measured or required spool opening is beyond its warning level.
#define EFT_DEMAND_SATURATED (1u << 1) // The demanded flow is beyond the flow table, or the opening beyond the stroke.
#define EFT_LOAD_PRESSURE_FLOORED (1u << 2) // The load-pressure correction is at its limit.
#define EFT_COMMAND_LIMITED (1u << 3) // The valve command was cut to its limit.
#define EFT_RATE_LIMITED (1u << 4) // The valve command's rate was cut to its limit.
#define EFT_INVALID_MEASUREMENT (1u << 5) // A measurement is not finite or out of its range; the last output is held.
#define EFT_INVALID_COMMAND (1u << 6) // The command or next command is not finite; the last output or command is held.
#define EFT_HELD (1u << 7)         // The output was held on request.
#define EFT_MISSED_TICK (1u << 11) // A tick was missed, or a sample is old, missing or of the wrong period.
#define EFT_ADAPTATION_FROZEN (1u << 12) // Nothing is learned: samples are bad, or the models do not explain them.
#define EFT_ESTIMATE_BOUNDED (1u << 13) // An estimate is at one of its bounds.
#define EFT_LEVEL_REDUCED (1u << 14) // The overcompensation guard has reduced the compensation level.
#define EFT_PROTECTION_WARNING (1u << 15) // A measurement is beyond its warning level.
#define EFT_TRIPPED (1u << 16)     // The protection has tripped: the force command is frozen and ramps to zero.
#define EFT_SHUT_DOWN (1u << 17)   // The protection ramps the whole valve command to that of the closed valve.
#define EFT_STUCK_MEASUREMENT (1u << 18) // A measurement repeats to the last bit, as from a stuck sensor.
#define EFT_CALIBRATION_LATE (1u << 19) // The learner's last calibration came late or is missing.
#define EFT_FORCE_LOOP_OPEN (1u << 20) // The force loop is open; an analog controller must open its own.
#define EFT_FORCE_DISTRUSTED (1u << 21) // The force is distrusted: it was lost for too long, or contradicted.
#define EFT_DISPLACEMENT_DISTRUSTED (1u << 22) // The displacement is distrusted.
#define EFT_VELOCITY_DISTRUSTED (1u << 23) // The velocity is distrusted.
#define EFT_SPOOL_DISTRUSTED (1u << 24) // The spool opening is distrusted.
#define EFT_CALIBRATION_EXPIRED (1u << 25) // The calibration in use is older than its age limit.
#define EFT_CAUSE_SHIFT 26         // Lowest of the five bits of a status that hold the first cause of a trip.
#define EFT_CAUSE (31u << EFT_CAUSE_SHIFT) // Those five bits, to be shifted to the right.
#define EFT_CAUSE_NONE 0           // Nothing tripped.
#define EFT_CAUSE_REQUEST 1        // A request from outside.
#define EFT_CAUSE_FORCE_LEVEL 2    // The force was beyond its trip level.
#define EFT_CAUSE_DISPLACEMENT_LEVEL 3 // The displacement was beyond its trip level.
#define EFT_CAUSE_VELOCITY_LEVEL 4 // The velocity was beyond its trip level.
#define EFT_CAUSE_SPOOL_LEVEL 5    // The spool opening was beyond its trip level.
#define EFT_CAUSE_COMMAND_LOST 6   // The force command stayed lost.
#define EFT_CAUSE_MEASUREMENT_LOST 7 // Measurements stayed lost.
#define EFT_CAUSE_REFUSED 8        // The controller kept refusing its samples.
#define EFT_CAUSE_MODEL_CONTRADICTED 9 // The estimators' models stayed contradicted, or a measurement stayed stuck.
#define EFT_CAUSE_FORCE_LOST 10    // The force stayed lost.
#define EFT_CAUSE_DISPLACEMENT_LOST 11 // The displacement stayed lost.
#define EFT_CAUSE_VELOCITY_LOST 12 // The velocity stayed lost.
#define EFT_CAUSE_SPOOL_LOST 13    // The spool opening stayed lost.
#define EFT_CAUSE_FORCE_IMPLAUSIBLE 14 // The force contradicts the actuator's flow balance, jumped, or is stuck.
#define EFT_CAUSE_DISPLACEMENT_IMPLAUSIBLE 15 // The displacement contradicts the velocity and the flow, or jumped.
#define EFT_CAUSE_VELOCITY_IMPLAUSIBLE 16 // The velocity contradicts displacement and flow, jumped, or is stuck.
#define EFT_CAUSE_SPOOL_IMPLAUSIBLE 17 // The spool opening contradicts command and flow, or jumped.
#define EFT_CAUSE_FLOW_IMPLAUSIBLE 18 // The valve's flow is not the piston's: check supply, valve and flow curve.
#define EFT_CAUSE_VALVE_IMPLAUSIBLE 19 // The spool does not follow its command, but the flow follows the spool.
#define EFT_CAUSE_STATE_CORRUPT 20 // A latch in memory was changed from outside.
#define EFT_CAUSE_SAMPLES_OLD 21   // The alive counter stood still or skipped.
#define EFT_CAUSE_SAMPLE_PERIOD 22 // The measured sample period was off.
#define EFT_CAUSE_CALIBRATION_EXPIRED 23 // The learner published nothing for longer than its age limit.
#define EFT_CAUSE_FORCE_OSCILLATION 24 // The force error from about 30 to 150 Hz persisted or grew.

/* ---------- Parameters ---------- */

#define EFT_TABLE_CAPACITY 21      // The most points of a flow table.
#define EFT_REALIZATION_DIGITAL 0  // realization: the force loop is closed here; the output is the valve command
#define EFT_REALIZATION_ANALOG 1   // realization: an analog controller closes it; the output is its compensation signal
#define EFT_MODE_OFF 0             // mode: no compensation
#define EFT_MODE_LINEAR 1          // mode: by the linear flow gain
#define EFT_MODE_NONLINEAR 2       // mode: by the flow table, corrected for the load pressure
#define EFT_SIGN_FROM_SPOOL 0      // sign_from: the measured spool, as in the paper
#define EFT_SIGN_FROM_DEMAND 1     // sign_from: the demanded flow, which does not chatter near null
#define EFT_VELOCITY_SENSOR 0      // velocity_source: a sensor
#define EFT_VELOCITY_DERIVATIVE 1  // velocity_source: the filtered derivative of the displacement
#define EFT_VELOCITY_OBSERVER 2    // velocity_source: an observer of displacement and force
#define EFT_VELOCITY_ACCELEROMETER 3 // velocity_source: an observer of displacement and measured acceleration

// The quantities that are learned during the test, and their bounds.
typedef struct eft_learning {
  uint8_t adaptive;                  // 0 or 1; estimate flow gain and valve
  uint8_t curve_correction;          // 0 or 1; correct the flow table by direction and band of flow as well
  uint8_t guard;                     // 0 or 1; reduce the level if overcompensation excites the structure
  double excitation;                 // 1; opening below which nothing is learned
  double flow_gain_bounds[2];        // 1; lowest and highest flow gain over the table's
  double valve_gain_bounds[2];       // 1; lowest and highest valve gain over the configured one
  double response_delay_bounds[2];   // 1; lowest and highest response delay over the configured one
  double age_limit;                  // s; a calibration expires after this time without a new one, at least 0.02
} eft_learning;

// The plausibility watch, which compares the measurements with each other.
typedef struct eft_plausibility {
  uint8_t enabled;                   // 0 or 1; without it a wrong sensor is not noticed
  double force_noise;                // N; standard deviation of the noise per sample
  double displacement_noise;         // m
  double velocity_noise;             // m/s
  double spool_noise;                // 1
  double load_pressure_tolerance;    // N; force against load pressure times area; DBL_MAX: not measured
  double false_alarms;               // 1/h; false alarms that this noise may raise
  double settle_time;                // s; the piston follows the specimen for this time in a shutdown
} eft_plausibility;

// The protection of the specimen; DBL_MAX in a level or time means none.
typedef struct eft_protection {
  uint8_t enabled;                   // 0 or 1; without it no level, request or fault trips
  double force_warning;              // N
  double force_trip;                 // N
  double displacement_warning;       // m
  double displacement_trip;          // m
  double velocity_warning;           // m/s
  double velocity_trip;              // m/s
  double spool_warning;              // 1
  double spool_trip;                 // 1
  double start_time;                 // s; from zero to the whole command at the start, 0 for none
  double ramp_time;                  // s; from the whole command to zero after a trip or at the end
  double shutdown_time;              // s; from the whole valve command to zero in a shutdown
  uint32_t lost_samples;             // samples; this many lost in a row do not trip, at most 100000
  double fault_time;                 // s; longest duration of a fault that the controller reports
  double period_tolerance;           // 1; largest relative deviation of a measured sample period
  double oscillation_limit;          // N; rms of the force error from 30 to 150 Hz that causes a shutdown
  eft_plausibility plausibility;     // the plausibility watch
} eft_protection;

// The rig as its controller knows it, in SI units, and the parts of the controller that are switched on. DBL_MAX in a
// limit or range means none.
typedef struct eft_parameters {
  double sample_rate;                // Hz
  uint8_t realization;               // EFT_REALIZATION_...
  uint8_t mode;                      // EFT_MODE_...
  double level;                      // 1; compensation level, 1 is full compensation
  uint8_t sign_from;                 // EFT_SIGN_FROM_...
  double piston_area;                // m2
  double supply_pressure;            // Pa; at which the flow table holds
  uint8_t supply_correction;         // 0 or 1; the supply pressure is measured and its deviations are corrected
  double compressibility;            // m3/Pa; of the oil in the chambers
  double leakage;                    // m3/(s Pa); across the piston
  double friction;                   // N; Coulomb friction of the seals, 0 for none
  double friction_velocity;          // m/s; below it the friction falls to zero
  double overlap;                    // 1; overlap of the spool's lands, which is not in the flow table, 0 for none
  double null_bias;                  // 1; opening without flow at no load, 0 for none
  uint32_t table_length;             // points of the flow table, from 2 to EFT_TABLE_CAPACITY
  double openings[EFT_TABLE_CAPACITY]; // 1; spool openings of the flow table, strictly increasing
  double flows[EFT_TABLE_CAPACITY];  // m3/s; its flows, strictly increasing
  double flow_gain;                  // m3/s at opening 1; of the linear scheme
  double valve_gain;                 // opening per V
  double response_delay;             // s; delay of the valve, for which the lead network compensates
  double lead_alpha;                 // 1; the lead network's alpha
  uint8_t velocity_source;           // EFT_VELOCITY_...
  double corner;                     // Hz; low-passes of EFT_VELOCITY_DERIVATIVE
  double gain_on_displacement;       // 1; gains of the observers
  double gain_on_velocity;           // 1/s
  double gain_on_drift;              // 1/s2
  double mass;                       // kg; moved by the force, for EFT_VELOCITY_OBSERVER
  double velocity_delay;             // s; delay of the velocity; a learning lead network compensates for it as well
  uint32_t computation_delay;        // samples; delay of the compensation by computation, at most 1000
  uint8_t feedforward;               // 0 or 1; demand the flow that the command needs as well
  uint8_t look_ahead;                // 0 or 1; feedforward and load-pressure correction use the next tick's command
  double force_sensitivity;          // V/N
  double proportional_gain;          // V/V
  double derivative_gain;            // s
  double integral_gain;              // 1/s; of a force loop that is closed in the channel, 0 for none
  double valve_command;              // V; limit of the valve command
  double valve_command_rate;         // V/s; limit of its rate
  double spool_warning;              // 1; opening that raises EFT_SPOOL_WARNING
  double velocity_range;             // m/s; beyond it a measurement is invalid
  double force_range;                // N
  double spool_range;                // 1
  double gap_time;                   // s; after this time without a valid sample the controller resumes
  eft_learning learning;             // what is learned
  eft_protection protection;         // the protection
  uint32_t stuck_samples;            // samples; a measurement may repeat to the last bit this often, 0: not watched
} eft_parameters;

// Why a configuration was refused.
typedef struct eft_error {
  double value;                      // refused value or length; 0 without one
  double lowest;                     // lowest value allowed
  double highest;                    // highest value allowed
  uint32_t index;                    // entry of a table
  char parameter[52];                // name of the parameter, terminated by a zero byte
} eft_error;

/* ---------- The tick ---------- */

// A channel's configuration. One drives any number of actuators.
typedef struct eft_channel_f32 { uint64_t marker; float value[337]; } eft_channel_f32;
// The state of a channel. Each actuator has one.
typedef struct eft_state_f32 { uint64_t marker; float value[431]; } eft_state_f32;
// The learner's result for the tick.
typedef struct eft_calibration_f32 { uint64_t marker; float value[54]; } eft_calibration_f32;

// One tick's command and measurements. A signal that is not given is NaN. If the tick needs it, the tick raises a flag.
typedef struct eft_input_f32 {
  float command;                     // Force command (N).
  float velocity;                    // Piston velocity (m/s), if a sensor measures it.
  float force;                       // Force (N).
  float spool;                       // Spool opening (1).
  float displacement;                // Displacement (m), for a protection or to estimate the velocity.
  float acceleration;                // Acceleration (m/s2), for a velocity from an accelerometer.
  float supply_pressure;             // Supply pressure (Pa), for supply_correction.
  float next_command;                // Force (N) that is to act at the next tick, for look_ahead.
  float valve_command;               // Valve command (V) of this sample, of an analog controller; NaN if unknown.
  float alive;                       // Counter of the samples (1), below 16777216, for a protection; NaN: none.
  float period;                      // Time (s) since the last sample, for a protection; NaN if it is not measured.
  float load_pressure;               // Load pressure (Pa), with the sign of the force, for load_pressure_tolerance.
} eft_input_f32;

// The sums of a closed window, for the learner.
typedef struct eft_window_f32 { uint64_t marker; float value[14]; } eft_window_f32;

// One tick's result.
typedef struct eft_output_f32 {
  float voltage;                     // V; to the converter: valve command, or compensation signal for an analog loop
  float compensation;                // V; the compensation signal
  float velocity;                    // m/s; measured or estimated, not finite if a measurement for it is not
  float permitted_command;           // N; an analog controller may follow it; without a protection the given command
  float authority;                   // 1; the protection's factor, which an analog controller must apply
  uint32_t status;                   // the flags and the cause above
  uint32_t window_closed;            // 1 if a window has closed with this tick, else 0
  eft_window_f32 window;             // for eft_learn, if window_closed is 1
} eft_output_f32;

// Checks the parameters and makes a configuration from them. After a refusal every function refuses *channel, and *why
// (may be null) has the reason.
EFT_NODISCARD uint8_t eft_configure_f32(const eft_parameters *parameters, eft_channel_f32 *channel, eft_error *why);

// Makes a configuration again and compares it with *channel. Returns EFT_CORRUPT if any number differs, for example
// after a memory fault.
EFT_NODISCARD uint8_t eft_check_f32(const eft_channel_f32 *channel, const eft_parameters *parameters);

// Sets *word to a checksum of a configuration. Keep the first checksum and compare it each second. A difference means
// that memory has changed.
EFT_NODISCARD uint8_t eft_integrity_f32(const eft_channel_f32 *channel, uint32_t *word);

// Sets *word to a checksum of a state. Compare the checksum after a tick with that before the next tick.
EFT_NODISCARD uint8_t eft_state_integrity_f32(const eft_state_f32 *state, uint32_t *word);

// Makes the state of a rig at rest, with the nominal calibration and without trip or request. An estimated velocity
// starts at zero from the first displacement.
EFT_NODISCARD uint8_t eft_reset_f32(const eft_channel_f32 *channel, eft_state_f32 *state);

// Like eft_reset, with the valve at the null of a calibration from eft_first_calibration, which is in use from the
// first tick.
EFT_NODISCARD uint8_t eft_reset_with_f32(const eft_channel_f32 *channel, const eft_calibration_f32 *calibration,
    eft_state_f32 *state);

// Sets every field to NaN, for signals that the rig does not have.
EFT_NODISCARD uint8_t eft_input_init_f32(eft_input_f32 *input);

// Sets the state to that of a rig that has long been at this operating point, so that the valve command does not jump.
// The calibration in use and the state of the protection do not change. An invalid input gives a rig at rest.
EFT_NODISCARD uint8_t eft_prime_f32(const eft_channel_f32 *channel, eft_state_f32 *state, const eft_input_f32 *input);

// One tick, in the interrupt. A null pointer, or a channel or state that was never made, is refused: the output is then
// 0 V with EFT_NO_STEP. A measurement or command that is NaN, infinite or out of its range repeats the last output and
// raises EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND. The first good tick continues. After a trip the plausibility
// watch replaces a lost measurement by its last one, without this flag. The last valid supply pressure replaces an
// invalid one and raises EFT_STUCK_MEASUREMENT. The last valid next_command replaces an invalid one and raises
// EFT_INVALID_COMMAND, if the rig looks ahead.
EFT_NODISCARD uint8_t eft_step_f32(const eft_channel_f32 *channel, eft_state_f32 *state, const eft_input_f32 *input,
    eft_output_f32 *output);

// In place of a tick: repeats the last output and raises EFT_HELD. The state does not change. For several ticks call
// eft_step with a measurement of NaN instead, so that nothing is learned from the gap. velocity and permitted_command
// are NaN: an analog controller keeps its last command. Refused like eft_step.
EFT_NODISCARD uint8_t eft_hold_f32(const eft_channel_f32 *channel, const eft_state_f32 *state, eft_output_f32 *output);

// Like eft_hold, for a missed tick. It raises EFT_MISSED_TICK as well.
EFT_NODISCARD uint8_t eft_missed_f32(const eft_channel_f32 *channel, const eft_state_f32 *state,
    eft_output_f32 *output);

// Gives a calibration to the tick. The calibration from window k takes effect with the first tick of window k + 2. A
// later one takes effect with the next window, and until then each tick raises EFT_CALIBRATION_LATE. One from a window
// that has not begun is of another test, and has no effect.
EFT_NODISCARD uint8_t eft_publish_f32(const eft_channel_f32 *channel, eft_state_f32 *state,
    const eft_calibration_f32 *calibration);

// Copies the calibration in use.
EFT_NODISCARD uint8_t eft_calibration_in_use_f32(const eft_state_f32 *state, eft_calibration_f32 *calibration);

// Requests a trip, for an emergency stop or another actuator of the specimen. The next step trips at the last command.
// No effect if the rig's protection is off.
EFT_NODISCARD uint8_t eft_request_trip_f32(eft_state_f32 *state);

// Requests the soft end. From the next step on, the force follows a command that fades along the ramp. No effect if the
// rig's protection is off.
EFT_NODISCARD uint8_t eft_request_end_f32(eft_state_f32 *state);

// Sets *down to 1 if the protection's ramp has reached zero or the test has not begun, else to 0.
EFT_NODISCARD uint8_t eft_is_down_f32(const eft_state_f32 *state, uint8_t *down);

/* ---------- The learner ---------- */

#define EFT_CURVE_NODES 17         // nodes of the flow curve's correction

// A learner's configuration. One serves any number of channels of the same parameters.
typedef struct eft_learner_f32 { uint64_t marker; float value[176]; } eft_learner_f32;
// The state of a learner. Each channel has one.
typedef struct eft_learner_state_f32 { uint64_t marker; float value[314]; } eft_learner_state_f32;

// A calibration to keep over a restart, from eft_save_calibration for eft_start_from. It is valid for either precision
// and any sample rate. Standard deviations depend on both: after eft_start_from, eft_first_calibration and
// eft_read_calibration have them.
typedef struct eft_saved_calibration {
  uint32_t version;                  // version of this struct; any other is refused
  double greatest_flow;              // m3/s; of the flow table, to which flow gain and curve refer
  double flow_gain;                  // 1; true flow over the table's
  double valve_gain;                 // 1; the spool's gain over the configured one
  double response_delay;             // s; of the measured spool after its command
  double velocity_delay;             // s; of the measured velocity after the measured spool
  double null_offset;                // 1; commanded opening at which the valve passes nothing at no load
  double excitation;                 // s; integral of the squared opening x, 0 before anything is learned
  double time;                       // s; remembered time of motion
  double mean_weight;                // 1; of the remembered motion, 1 if nothing was forgotten
  double mean_square_frequency;      // 1/s2; mean of x'x' by that of xx, like the next ones; x' is its rate
  double growth;                     // 1/s; mean of xx'
  double flow;                       // m3/s; mean of xq, with the flow q
  double flow_rate;                  // m3/s2; mean of xq'
  double rate_flow;                  // m3/s2; mean of x'q
  double rate_flow_rate;             // m3/s3; mean of x'q'
  double compressed_flow;            // m3/s; rms flow that leaks and compresses the oil, by the rms opening
  double flow_error;                 // m3/s; rms flow that the estimates leave unexplained
  double spool_error;                // 1; rms opening that the estimates leave unexplained
  double flow_gain_distance;         // 1; results of the least squares minus the estimates in use
  double valve_gain_distance;        // 1
  double response_delay_distance;    // s
  double velocity_delay_distance;    // s
  double null_offset_distance;       // 1
  double asymmetry;                  // 1; table flow per forward flow over the mean of both directions, less 1
  double asymmetry_deviation;        // 1
  double departures[EFT_CURVE_NODES]; // m3/s; from the direction, at -8/7 to 8/7 of the greatest flow
  double departure_deviations[EFT_CURVE_NODES]; // m3/s
  double curve_error;                // m3/s; rms part of a window's flow that the correction leaves unexplained
  double flow_gain_share;            // 1; share of the flow gain that follows from the departures
  double mean_departure;             // 1; over the flow, which the flow gain slowly takes over
  double curve_time;                 // s; remembered time of curve_error and sensor_offset
  double sensor_offset;              // 1; spool's reading minus the commanded opening times the spool's gain
  double null_time;                  // s; remembered time of the null offset, at the table's slope at null
  double null_coupling;              // 1; share of it in which a direction's gain looks like a null offset
} eft_saved_calibration;

// The numbers of a calibration.
typedef struct eft_learned_f32 {
  float flow_gain;                   // 1; true flow over the table's
  float valve_gain;                  // 1; the spool's gain over the configured one
  float response_delay;              // s; of the measured spool after its command
  float velocity_delay;              // s; of the measured velocity after the measured spool
  float null_offset;                 // 1; commanded opening at which the valve passes nothing at no load
  float flow_gain_deviation;         // 1; standard deviations, infinite before anything is learned
  float valve_gain_deviation;        // 1
  float response_delay_deviation;    // s
  float velocity_delay_deviation;    // s
  float null_offset_deviation;       // 1
  float level;                       // 1; the guard's factor on the compensation level
  float test_ratio;                  // 1; unexplained over permitted residual of the models: above 1 nothing is learned
  uint32_t window;                   // number of its window; UINT32_MAX from the configuration or what was saved
  uint32_t status;                   // EFT_ADAPTATION_FROZEN, EFT_ESTIMATE_BOUNDED, EFT_LEVEL_REDUCED
} eft_learned_f32;

// Like eft_configure, for a learner. The parameters are the channel's.
EFT_NODISCARD uint8_t eft_learner_configure_f32(const eft_parameters *parameters, eft_learner_f32 *learner,
    eft_error *why);

// Like eft_check, for a learner.
EFT_NODISCARD uint8_t eft_learner_check_f32(const eft_learner_f32 *learner, const eft_parameters *parameters);

// Like eft_integrity, for a learner.
EFT_NODISCARD uint8_t eft_learner_integrity_f32(const eft_learner_f32 *learner, uint32_t *word);

// Like eft_state_integrity, for a learner's state. Compare the checksum after eft_learn with that before the next call.
EFT_NODISCARD uint8_t eft_learner_state_integrity_f32(const eft_learner_state_f32 *state, uint32_t *word);

// Makes the state of a learner that has learned nothing yet.
EFT_NODISCARD uint8_t eft_learner_reset_f32(const eft_learner_f32 *learner, eft_learner_state_f32 *state);

// Like eft_learner_reset, but the learner starts from a saved calibration. Then start the channel by
// eft_first_calibration and eft_reset_with. Refuses data that the learner cannot have saved. *why (may be null) then
// has the reason.
EFT_NODISCARD uint8_t eft_start_from_f32(const eft_learner_f32 *learner, const eft_saved_calibration *saved,
    eft_learner_state_f32 *state, eft_error *why);

// Makes the calibration of the learner's present estimates, for eft_reset_with. Before anything is learned the channel
// then starts as after eft_reset.
EFT_NODISCARD uint8_t eft_first_calibration_f32(const eft_learner_f32 *learner, const eft_learner_state_f32 *state,
    eft_calibration_f32 *calibration);

// Saves the calibration, after a test.
EFT_NODISCARD uint8_t eft_save_calibration_f32(const eft_learner_f32 *learner, const eft_learner_state_f32 *state,
    eft_saved_calibration *saved);

// Makes the next calibration from a window, for eft_publish. Call it after the step, or in a task of lower priority
// than the interrupt.
EFT_NODISCARD uint8_t eft_learn_f32(const eft_learner_f32 *learner, eft_learner_state_f32 *state,
    const eft_window_f32 *window, eft_calibration_f32 *calibration);

// Reads the numbers of a calibration.
EFT_NODISCARD uint8_t eft_read_calibration_f32(const eft_calibration_f32 *calibration, eft_learned_f32 *learned);

// Sets *flow to the learned no-load flow (m3/s) at a spool opening (1), for use after a test. At the openings of the
// table these are the rig's new flow curve. Beyond the table it is the flow of its end. Returns EFT_NOT_FINITE and
// leaves *flow unchanged if the opening is NaN or infinite.
EFT_NODISCARD uint8_t eft_found_flow_f32(const eft_learner_f32 *learner, const eft_calibration_f32 *calibration,
    float opening, float *flow);

/* ---------- From one context to another, without a lock ---------- */

// Passes a configuration, window or calibration from one context to another. It is empty if all its bytes are zero.
typedef struct eft_channels_f32 { eft_channel_f32 copies[2]; uint32_t offered; uint32_t taken; } eft_channels_f32;
typedef struct eft_windows_f32 { eft_window_f32 copies[2]; uint32_t offered; uint32_t taken; } eft_windows_f32;
typedef struct eft_calibrations_f32 { eft_calibration_f32 copies[2]; uint32_t offered; uint32_t taken;
    } eft_calibrations_f32;

// Continues a state under a new configuration of the same sample rate, without a jump unless the last valve command is
// beyond the new limit. Another level, mode or flow table is a step of the compensation, which the lead network
// enlarges up to 1/lead_alpha times, so change these at rest. Call it after eft_take_channel for each state. An
// estimate of the velocity from another source starts at rest from the next displacement, so change the source at rest.
// Only an observer keeps its drift from the one before it, with or without an accelerometer. The calibration stays in
// use until the new learner publishes, unless the new configuration learns nothing. It keeps 1/(G_p*K_s) of its own
// configuration, so change these gains at rest or while nothing is learned. A trip stays in the state, but a
// configuration without a protection follows the command again.
EFT_NODISCARD uint8_t eft_take_over_f32(const eft_channel_f32 *channel, eft_state_f32 *state);

// Offers a configuration to the interrupt. Returns EFT_BUSY until the last one is taken.
EFT_NODISCARD uint8_t eft_offer_channel_f32(eft_channels_f32 *to, const eft_channel_f32 *item);

// Offers output->window to the learner's task. Returns EFT_BUSY until the last one is taken. The learner counts the
// samples of a window that was not offered as lost.
EFT_NODISCARD uint8_t eft_offer_window_f32(eft_windows_f32 *to, const eft_window_f32 *item);

// Offers a calibration to the interrupt. Returns EFT_BUSY until the last one is taken.
EFT_NODISCARD uint8_t eft_offer_calibration_f32(eft_calibrations_f32 *to, const eft_calibration_f32 *item);

// The offered configuration, or null if there is no new one. After eft_take_over the interrupt steps with it until it
// takes the next one.
EFT_NODISCARD const eft_channel_f32 *eft_take_channel_f32(eft_channels_f32 *from);

// The offered window, valid until the next one is taken; null if there is no new one.
EFT_NODISCARD const eft_window_f32 *eft_take_window_f32(eft_windows_f32 *from);

// The offered calibration for eft_publish, valid until the next one is taken; null if there is no new one.
EFT_NODISCARD const eft_calibration_f32 *eft_take_calibration_f32(eft_calibrations_f32 *from);

/* ---------- Double precision: as above ---------- */

typedef struct eft_channel_f64 { uint64_t marker; double value[337]; } eft_channel_f64;
typedef struct eft_state_f64 { uint64_t marker; double value[431]; } eft_state_f64;
typedef struct eft_calibration_f64 { uint64_t marker; double value[54]; } eft_calibration_f64;
typedef struct eft_input_f64 { double command; double velocity; double force; double spool; double displacement;
    double acceleration; double supply_pressure; double next_command; double valve_command; double alive; double period;
    double load_pressure; } eft_input_f64;
typedef struct eft_window_f64 { uint64_t marker; double value[14]; } eft_window_f64;
typedef struct eft_output_f64 { double voltage; double compensation; double velocity; double permitted_command;
    double authority; uint32_t status; uint32_t window_closed; eft_window_f64 window; } eft_output_f64;
typedef struct eft_channels_f64 { eft_channel_f64 copies[2]; uint32_t offered; uint32_t taken; } eft_channels_f64;
typedef struct eft_windows_f64 { eft_window_f64 copies[2]; uint32_t offered; uint32_t taken; } eft_windows_f64;
typedef struct eft_calibrations_f64 { eft_calibration_f64 copies[2]; uint32_t offered; uint32_t taken;
    } eft_calibrations_f64;
typedef struct eft_learner_f64 { uint64_t marker; double value[176]; } eft_learner_f64;
typedef struct eft_learner_state_f64 { uint64_t marker; double value[314]; } eft_learner_state_f64;
typedef struct eft_learned_f64 { double flow_gain; double valve_gain; double response_delay; double velocity_delay;
    double null_offset; double flow_gain_deviation; double valve_gain_deviation; double response_delay_deviation;
    double velocity_delay_deviation; double null_offset_deviation; double level; double test_ratio; uint32_t window;
    uint32_t status; } eft_learned_f64;
EFT_NODISCARD uint8_t eft_configure_f64(const eft_parameters *parameters, eft_channel_f64 *channel, eft_error *why);
EFT_NODISCARD uint8_t eft_check_f64(const eft_channel_f64 *channel, const eft_parameters *parameters);
EFT_NODISCARD uint8_t eft_integrity_f64(const eft_channel_f64 *channel, uint32_t *word);
EFT_NODISCARD uint8_t eft_state_integrity_f64(const eft_state_f64 *state, uint32_t *word);
EFT_NODISCARD uint8_t eft_reset_f64(const eft_channel_f64 *channel, eft_state_f64 *state);
EFT_NODISCARD uint8_t eft_reset_with_f64(const eft_channel_f64 *channel, const eft_calibration_f64 *calibration,
    eft_state_f64 *state);
EFT_NODISCARD uint8_t eft_input_init_f64(eft_input_f64 *input);
EFT_NODISCARD uint8_t eft_prime_f64(const eft_channel_f64 *channel, eft_state_f64 *state, const eft_input_f64 *input);
EFT_NODISCARD uint8_t eft_step_f64(const eft_channel_f64 *channel, eft_state_f64 *state, const eft_input_f64 *input,
    eft_output_f64 *output);
EFT_NODISCARD uint8_t eft_hold_f64(const eft_channel_f64 *channel, const eft_state_f64 *state, eft_output_f64 *output);
EFT_NODISCARD uint8_t eft_missed_f64(const eft_channel_f64 *channel, const eft_state_f64 *state,
    eft_output_f64 *output);
EFT_NODISCARD uint8_t eft_publish_f64(const eft_channel_f64 *channel, eft_state_f64 *state,
    const eft_calibration_f64 *calibration);
EFT_NODISCARD uint8_t eft_calibration_in_use_f64(const eft_state_f64 *state, eft_calibration_f64 *calibration);
EFT_NODISCARD uint8_t eft_request_trip_f64(eft_state_f64 *state);
EFT_NODISCARD uint8_t eft_request_end_f64(eft_state_f64 *state);
EFT_NODISCARD uint8_t eft_is_down_f64(const eft_state_f64 *state, uint8_t *down);
EFT_NODISCARD uint8_t eft_take_over_f64(const eft_channel_f64 *channel, eft_state_f64 *state);
EFT_NODISCARD uint8_t eft_offer_channel_f64(eft_channels_f64 *to, const eft_channel_f64 *item);
EFT_NODISCARD uint8_t eft_offer_window_f64(eft_windows_f64 *to, const eft_window_f64 *item);
EFT_NODISCARD uint8_t eft_offer_calibration_f64(eft_calibrations_f64 *to, const eft_calibration_f64 *item);
EFT_NODISCARD const eft_channel_f64 *eft_take_channel_f64(eft_channels_f64 *from);
EFT_NODISCARD const eft_window_f64 *eft_take_window_f64(eft_windows_f64 *from);
EFT_NODISCARD const eft_calibration_f64 *eft_take_calibration_f64(eft_calibrations_f64 *from);
EFT_NODISCARD uint8_t eft_learner_configure_f64(const eft_parameters *parameters, eft_learner_f64 *learner,
    eft_error *why);
EFT_NODISCARD uint8_t eft_learner_check_f64(const eft_learner_f64 *learner, const eft_parameters *parameters);
EFT_NODISCARD uint8_t eft_learner_integrity_f64(const eft_learner_f64 *learner, uint32_t *word);
EFT_NODISCARD uint8_t eft_learner_state_integrity_f64(const eft_learner_state_f64 *state, uint32_t *word);
EFT_NODISCARD uint8_t eft_learner_reset_f64(const eft_learner_f64 *learner, eft_learner_state_f64 *state);
EFT_NODISCARD uint8_t eft_start_from_f64(const eft_learner_f64 *learner, const eft_saved_calibration *saved,
    eft_learner_state_f64 *state, eft_error *why);
EFT_NODISCARD uint8_t eft_first_calibration_f64(const eft_learner_f64 *learner, const eft_learner_state_f64 *state,
    eft_calibration_f64 *calibration);
EFT_NODISCARD uint8_t eft_save_calibration_f64(const eft_learner_f64 *learner, const eft_learner_state_f64 *state,
    eft_saved_calibration *saved);
EFT_NODISCARD uint8_t eft_learn_f64(const eft_learner_f64 *learner, eft_learner_state_f64 *state,
    const eft_window_f64 *window, eft_calibration_f64 *calibration);
EFT_NODISCARD uint8_t eft_read_calibration_f64(const eft_calibration_f64 *calibration, eft_learned_f64 *learned);
EFT_NODISCARD uint8_t eft_found_flow_f64(const eft_learner_f64 *learner, const eft_calibration_f64 *calibration,
    double opening, double *flow);

/* ---------- Sizes, as the library has them ---------- */

EFT_STATIC_ASSERT(sizeof(eft_learning) == 72);
EFT_STATIC_ASSERT(sizeof(eft_plausibility) == 64);
EFT_STATIC_ASSERT(sizeof(eft_protection) == 192);
EFT_STATIC_ASSERT(sizeof(eft_parameters) == 904);
EFT_STATIC_ASSERT(sizeof(eft_error) == 80);
EFT_STATIC_ASSERT(sizeof(eft_saved_calibration) == 536);
EFT_SIZES(eft_channel, 1360, 2704);
EFT_SIZES(eft_state, 1736, 3456);
EFT_SIZES(eft_input, 48, 96);
EFT_SIZES(eft_output, 96, 168);
EFT_SIZES(eft_window, 64, 120);
EFT_SIZES(eft_calibration, 224, 440);
EFT_SIZES(eft_learner, 712, 1416);
EFT_SIZES(eft_learner_state, 1264, 2520);
EFT_SIZES(eft_learned, 56, 104);

#ifdef __cplusplus
}
#endif

#endif

