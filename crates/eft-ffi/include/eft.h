/* Effective force testing: the controller for firmware.

   Everything is owned by the caller and passed by pointer; there are no globals, so every function is re-entrant.
   A null pointer gives EFT_NULL_POINTER and nothing else happens. SI units throughout. Signs: a positive spool
   opening lets flow into the chamber that pulls the structure; force and velocity are then positive. */
#ifndef EFT_H
#define EFT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#define EFT_STATIC_ASSERT(fact) static_assert(fact, #fact)
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define EFT_STATIC_ASSERT(fact) _Static_assert(fact, #fact)
#else
#define EFT_PASTE_(a, b) a##b
#define EFT_PASTE(a, b) EFT_PASTE_(a, b)
#define EFT_STATIC_ASSERT(fact) typedef char EFT_PASTE(eft_assert_, __LINE__)[(fact) ? 1 : -1]
#endif

/* Compare with eft_abi_version() once at start-up. */
#define EFT_ABI_VERSION 1u
uint32_t eft_abi_version(void);

/* What a call returns. */
#define EFT_OK 0u
#define EFT_NULL_POINTER 1u
#define EFT_NOT_FINITE 2u
#define EFT_NOT_POSITIVE 3u
#define EFT_OUT_OF_RANGE 4u
#define EFT_NOT_INCREASING 5u
#define EFT_LENGTH 6u
#define EFT_TOO_STEEP 7u
#define EFT_BUSY 8u
#define EFT_REFUSED 9u

/* Bits of an output's status. */
#define EFT_SPOOL_WARNING (UINT32_C(1) << 0)         /* measured or required opening beyond the warning level */
#define EFT_DEMAND_SATURATED (UINT32_C(1) << 1)      /* the demanded flow lies beyond table or stroke */
#define EFT_LOAD_PRESSURE_FLOORED (UINT32_C(1) << 2) /* the load-pressure correction is at its limit */
#define EFT_COMMAND_LIMITED (UINT32_C(1) << 3)
#define EFT_RATE_LIMITED (UINT32_C(1) << 4)
#define EFT_INVALID_MEASUREMENT (UINT32_C(1) << 5) /* the last output is held */
#define EFT_INVALID_COMMAND (UINT32_C(1) << 6)     /* the last output is held */
#define EFT_HELD (UINT32_C(1) << 7)
#define EFT_MISSED_TICK (UINT32_C(1) << 11)

/* eft_parameters.mode and .sign_from */
#define EFT_MODE_OFF 0u
#define EFT_MODE_LINEAR 1u
#define EFT_MODE_NONLINEAR 2u
#define EFT_SIGN_FROM_SPOOL 0u
#define EFT_SIGN_FROM_DEMAND 1u

#define EFT_TABLE_CAPACITY 21

/* A controller's parameters; plain data, so that a constant one can stay in flash. */
typedef struct eft_parameters {
  uint32_t table_length;      /* points of the flow table in use */
  uint8_t mode;               /* EFT_MODE_... */
  uint8_t sign_from;          /* EFT_SIGN_FROM_... */
  uint16_t reserved;          /* 0 */
  double level;               /* compensation level, 1 */
  double piston_area;         /* m2 */
  double supply_pressure;     /* Pa */
  double flow_gain;           /* of the linear mode, m3/s */
  double valve_gain;          /* 1/V */
  double response_delay;      /* s */
  double lead_alpha;          /* 1 */
  double sample_rate;         /* Hz */
  double force_sensitivity;   /* V/N */
  double proportional_gain;   /* V/V */
  double derivative_gain;     /* s */
  double valve_command;       /* largest, V; DBL_MAX for no limit */
  double valve_command_rate;  /* largest, V/s; DBL_MAX for no limit */
  double spool_warning;       /* opening that raises EFT_SPOOL_WARNING, 1 */
  double velocity_range;      /* beyond it a measurement is invalid, m/s */
  double force_range;         /* beyond it a measurement is invalid, N */
  double spool_range;         /* beyond it a measurement is invalid, 1 */
  double openings[EFT_TABLE_CAPACITY]; /* spool openings, strictly increasing, 1 */
  double flows[EFT_TABLE_CAPACITY];    /* flows, strictly increasing, m3/s */
} eft_parameters;

/* Why a configuration was refused. */
typedef struct eft_error {
  double value;       /* the refused value */
  double lowest;      /* the lowest allowed */
  double highest;     /* the highest allowed */
  uint32_t index;     /* the entry of a table */
  char parameter[28]; /* its name */
} eft_error;

/* A configuration: opaque, filled by eft_configure_f32 only. One drives any number of states. */
typedef struct eft_controller_f32 {
  float words[100];
} eft_controller_f32;
/* What the controller remembers; all zero bytes are a rig at rest. */
typedef struct eft_state_f32 {
  float words[5];
} eft_state_f32;
/* One tick's command and measurements. */
typedef struct eft_input_f32 {
  float command;      /* force command, N */
  float velocity;     /* piston velocity, m/s */
  float force;        /* N */
  float spool;        /* spool opening, 1 */
  float further_flow; /* wanted on top of the piston's, m3/s; 0 for none */
} eft_input_f32;
/* One tick's result. */
typedef struct eft_output_f32 {
  float valve_command; /* V */
  float compensation;  /* the part of it that compensates the piston's motion, V */
  uint32_t status;   /* EFT_SPOOL_WARNING and its siblings */
} eft_output_f32;
/* Two configurations: the interrupt steps with one while the other is written. */
typedef struct eft_shadow_f32 {
  eft_controller_f32 copies[2];
  uint32_t turn[2];
} eft_shadow_f32;

/* Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and *why (may be
   null) says what was wrong. Not for the interrupt: it computes in double precision. */
uint8_t eft_configure_f32(const eft_parameters *parameters, eft_controller_f32 *config, eft_error *why);
/* Puts a state to rest. */
uint8_t eft_reset_f32(eft_state_f32 *state);
/* The state of a rig that has long been at this operating point: the next step starts without a bump. */
uint8_t eft_prime_f32(const eft_controller_f32 *config, eft_state_f32 *state, const eft_input_f32 *input);
/* Repeats the last valve command; the state stays. */
uint8_t eft_hold_f32(const eft_controller_f32 *config, const eft_state_f32 *state, eft_output_f32 *output);
/* In place of a tick that was missed: the last valve command stays, and the output says so. */
uint8_t eft_missed_f32(const eft_controller_f32 *config, const eft_state_f32 *state, eft_output_f32 *output);
/* One tick. A measurement or command that is NaN, infinite or out of its range leaves the state as it was, repeats the
   last valve command and raises EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND; the next good tick continues. */
uint8_t eft_step_f32(const eft_controller_f32 *config, eft_state_f32 *state, const eft_input_f32 *input,
                     eft_output_f32 *output);
/* The compensation alone, for a force loop that another controller closes: the command does not count, and
   output->valve_command is the compensation signal. */
uint8_t eft_compensation_step_f32(const eft_controller_f32 *config, eft_state_f32 *state,
                                  const eft_input_f32 *input, eft_output_f32 *output);
/* Both copies become *config, and none waits. Before the interrupt is enabled. */
uint8_t eft_shadow_init_f32(eft_shadow_f32 *shadow, const eft_controller_f32 *config);
/* Offers a configuration to the interrupt; EFT_BUSY while the one before still waits. From one thread at a time. */
uint8_t eft_shadow_offer_f32(eft_shadow_f32 *shadow, const eft_controller_f32 *config);
/* In the interrupt, before the step: the configuration to step with. */
const eft_controller_f32 *eft_shadow_take_f32(const eft_shadow_f32 *shadow);

/* A configuration: opaque, filled by eft_configure_f64 only. One drives any number of states. */
typedef struct eft_controller_f64 {
  double words[92];
} eft_controller_f64;
/* What the controller remembers; all zero bytes are a rig at rest. */
typedef struct eft_state_f64 {
  double words[5];
} eft_state_f64;
/* One tick's command and measurements. */
typedef struct eft_input_f64 {
  double command;      /* force command, N */
  double velocity;     /* piston velocity, m/s */
  double force;        /* N */
  double spool;        /* spool opening, 1 */
  double further_flow; /* wanted on top of the piston's, m3/s; 0 for none */
} eft_input_f64;
/* One tick's result. */
typedef struct eft_output_f64 {
  double valve_command; /* V */
  double compensation;  /* the part of it that compensates the piston's motion, V */
  uint32_t status;   /* EFT_SPOOL_WARNING and its siblings */
} eft_output_f64;
/* Two configurations: the interrupt steps with one while the other is written. */
typedef struct eft_shadow_f64 {
  eft_controller_f64 copies[2];
  uint32_t turn[2];
} eft_shadow_f64;

/* Checks parameters and makes a configuration of them; on refusal the configuration stays as it was and *why (may be
   null) says what was wrong. Not for the interrupt: it computes in double precision. */
uint8_t eft_configure_f64(const eft_parameters *parameters, eft_controller_f64 *config, eft_error *why);
/* Puts a state to rest. */
uint8_t eft_reset_f64(eft_state_f64 *state);
/* The state of a rig that has long been at this operating point: the next step starts without a bump. */
uint8_t eft_prime_f64(const eft_controller_f64 *config, eft_state_f64 *state, const eft_input_f64 *input);
/* Repeats the last valve command; the state stays. */
uint8_t eft_hold_f64(const eft_controller_f64 *config, const eft_state_f64 *state, eft_output_f64 *output);
/* In place of a tick that was missed: the last valve command stays, and the output says so. */
uint8_t eft_missed_f64(const eft_controller_f64 *config, const eft_state_f64 *state, eft_output_f64 *output);
/* One tick. A measurement or command that is NaN, infinite or out of its range leaves the state as it was, repeats the
   last valve command and raises EFT_INVALID_MEASUREMENT or EFT_INVALID_COMMAND; the next good tick continues. */
uint8_t eft_step_f64(const eft_controller_f64 *config, eft_state_f64 *state, const eft_input_f64 *input,
                     eft_output_f64 *output);
/* The compensation alone, for a force loop that another controller closes: the command does not count, and
   output->valve_command is the compensation signal. */
uint8_t eft_compensation_step_f64(const eft_controller_f64 *config, eft_state_f64 *state,
                                  const eft_input_f64 *input, eft_output_f64 *output);
/* Both copies become *config, and none waits. Before the interrupt is enabled. */
uint8_t eft_shadow_init_f64(eft_shadow_f64 *shadow, const eft_controller_f64 *config);
/* Offers a configuration to the interrupt; EFT_BUSY while the one before still waits. From one thread at a time. */
uint8_t eft_shadow_offer_f64(eft_shadow_f64 *shadow, const eft_controller_f64 *config);
/* In the interrupt, before the step: the configuration to step with. */
const eft_controller_f64 *eft_shadow_take_f64(const eft_shadow_f64 *shadow);

EFT_STATIC_ASSERT(sizeof(eft_parameters) == 480);
EFT_STATIC_ASSERT(offsetof(eft_parameters, level) == 8);
EFT_STATIC_ASSERT(offsetof(eft_parameters, openings) == 144);
EFT_STATIC_ASSERT(offsetof(eft_parameters, flows) == 312);
EFT_STATIC_ASSERT(sizeof(eft_error) == 56);
EFT_STATIC_ASSERT(sizeof(eft_controller_f32) == 400);
EFT_STATIC_ASSERT(sizeof(eft_controller_f64) == 736);
EFT_STATIC_ASSERT(sizeof(eft_state_f32) == 20);
EFT_STATIC_ASSERT(sizeof(eft_state_f64) == 40);
EFT_STATIC_ASSERT(sizeof(eft_input_f32) == 20);
EFT_STATIC_ASSERT(sizeof(eft_input_f64) == 40);
EFT_STATIC_ASSERT(sizeof(eft_output_f32) == 12);
EFT_STATIC_ASSERT(sizeof(eft_output_f64) == 24);
EFT_STATIC_ASSERT(sizeof(eft_shadow_f32) == 808);
EFT_STATIC_ASSERT(sizeof(eft_shadow_f64) == 1480);

#ifdef __cplusplus
}
#endif
#endif
