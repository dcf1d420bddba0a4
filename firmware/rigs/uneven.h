/* The controller of uneven at 5000 Hz, exported by eft.
 *
 * The force loop is closed here: eft_step gives the valve command, V. The protection is off: no
 * level, fault or request trips.
 */
#ifndef EFT_RIG_UNEVEN_H
#define EFT_RIG_UNEVEN_H
#define EFT_RIG_UNEVEN_CHECKSUM 0x2b54b397

#include <float.h>

#include "eft.h"

static const eft_parameters EFT_RIG_UNEVEN = {
  5000.0, /* sample_rate, Hz */
  EFT_REALIZATION_DIGITAL, /* realization */
  EFT_MODE_NONLINEAR, /* mode */
  1.02, /* level, 1 */
  EFT_SIGN_FROM_DEMAND, /* sign_from */
  0.0113, /* piston_area, m2 */
  20700000.0, /* supply_pressure, Pa */
  0, /* supply_correction */
  7.56e-13, /* compressibility, m3/Pa */
  1.3e-11, /* leakage, m3/(s Pa) */
  0.0, /* friction, N */
  0.001, /* friction_velocity, m/s */
  0.0, /* overlap, 1 */
  0.0, /* null_bias, 1 */
  9u, /* table_length */
  {-1.0, -0.62, -0.2, -0.05, -0.04, 0.0, 0.03, 0.25, 1.0}, /* openings, 1 */
  {-0.0101, -0.0083, -0.0034, -0.0006, -0.0004, 0.0, 0.0005, 0.0045, 0.0107}, /* flows, m3/s */
  0.0164, /* flow_gain, m3/s */
  0.12, /* valve_gain, 1/V */
  0.0041, /* response_delay, s */
  0.15, /* lead_alpha, 1 */
  EFT_VELOCITY_SENSOR, /* velocity_source */
  0.0, /* corner, Hz */
  0.0, /* gain_on_displacement, 1 */
  0.0, /* gain_on_velocity, 1/s */
  0.0, /* gain_on_drift, 1/s2 */
  0.0, /* mass, kg */
  0.0, /* velocity_delay, s */
  0u, /* computation_delay, samples */
  0, /* feedforward */
  0, /* look_ahead */
  7.1e-5, /* force_sensitivity, V/N */
  0.61, /* proportional_gain, V/V */
  0.0002, /* derivative_gain, s */
  0.0, /* integral_gain, 1/s */
  8.0, /* valve_command, V */
  4000.0, /* valve_command_rate, V/s */
  0.5, /* spool_warning, 1 */
  1.1, /* velocity_range, m/s */
  220000.0, /* force_range, N */
  1.15, /* spool_range, 1 */
  0.0025, /* gap_time, s */
  { /* learning */
    0, /* adaptive */
    0, /* curve_correction */
    0, /* guard */
    0.0005, /* excitation, 1 */
    {0.7, 1.35}, /* flow_gain_bounds, 1 */
    {0.8, 1.25}, /* valve_gain_bounds, 1 */
    {0.2, 4.0}, /* response_delay_bounds, 1 */
    1.0, /* age_limit, s */
  },
  { /* protection */
    0, /* enabled */
    DBL_MAX, /* force_warning, N */
    DBL_MAX, /* force_trip, N */
    DBL_MAX, /* displacement_warning, m */
    DBL_MAX, /* displacement_trip, m */
    DBL_MAX, /* velocity_warning, m/s */
    DBL_MAX, /* velocity_trip, m/s */
    DBL_MAX, /* spool_warning, 1 */
    DBL_MAX, /* spool_trip, 1 */
    0.0, /* start_time, s */
    0.5, /* ramp_time, s */
    0.1, /* shutdown_time, s */
    10u, /* lost_samples, samples */
    DBL_MAX, /* fault_time, s */
    0.1, /* period_tolerance, 1 */
    DBL_MAX, /* oscillation_limit, N */
    { /* plausibility */
      0, /* enabled */
      78.0, /* force_noise, N */
      6.35e-5, /* displacement_noise, m */
      0.000525, /* velocity_noise, m/s */
      0.0005, /* spool_noise, 1 */
      DBL_MAX, /* load_pressure_tolerance, N */
      0.001, /* false_alarms, 1/h */
      1.5, /* settle_time, s */
    },
  },
  0u, /* stuck_samples, samples */
};

#elif EFT_RIG_UNEVEN_CHECKSUM != 0x2b54b397
#error "two rigs are called EFT_RIG_UNEVEN: export one of them with another --name"
#endif
