/* The controller of guarded at 4096 Hz, exported by eft.
 *
 * The force loop is closed here: eft_step gives the valve command, V. The measured displacement,
 * m, is given with every sample. The measured supply pressure, Pa, is given with every sample.
 */
#ifndef EFT_RIG_GUARDED_H
#define EFT_RIG_GUARDED_H
#define EFT_RIG_GUARDED_CHECKSUM 0x51256687

#include <float.h>

#include "eft.h"

static const eft_parameters EFT_RIG_GUARDED = {
  4096.0, /* sample_rate, Hz */
  EFT_REALIZATION_DIGITAL, /* realization */
  EFT_MODE_NONLINEAR, /* mode */
  1.0, /* level, 1 */
  EFT_SIGN_FROM_SPOOL, /* sign_from */
  0.008212, /* piston_area, m2 */
  19000000.0, /* supply_pressure, Pa */
  1, /* supply_correction */
  7.56e-13, /* compressibility, m3/Pa */
  1.3e-11, /* leakage, m3/(s Pa) */
  0.0, /* friction, N */
  0.001, /* friction_velocity, m/s */
  0.0, /* overlap, 1 */
  0.0, /* null_bias, 1 */
  21u, /* table_length */
  {-1.0, -0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0}, /* openings, 1 */
  {-0.008786743716800001, -0.008327905924799999, -0.0078690681328, -0.0074118690472, -0.0068809281735999995, -0.0061795618344, -0.0053126861488, -0.004275384997599999, -0.0030840454447999995, -0.001655093464, 0.0, 0.0016747579408, 0.0030676583807999996, 0.0042671914656, 0.0052618862504, 0.0060599362672, 0.006738360716799999, 0.007226695224, 0.0076740620712, 0.0081230676248, 0.008570434472}, /* flows, m3/s */
  0.0164, /* flow_gain, m3/s */
  0.1, /* valve_gain, 1/V */
  0.005, /* response_delay, s */
  0.1, /* lead_alpha, 1 */
  EFT_VELOCITY_OBSERVER, /* velocity_source */
  0.0, /* corner, Hz */
  0.0688998387462796, /* gain_on_displacement, 1 */
  10.072327505043758, /* gain_on_velocity, 1/s */
  736.1872211790367, /* gain_on_drift, 1/s2 */
  7040.0, /* mass, kg */
  1.1254828530642381e-7, /* velocity_delay, s */
  0u, /* computation_delay, samples */
  1, /* feedforward */
  0, /* look_ahead */
  5.6e-5, /* force_sensitivity, V/N */
  0.8059, /* proportional_gain, V/V */
  0.0002, /* derivative_gain, s */
  0.0, /* integral_gain, 1/s */
  10.0, /* valve_command, V */
  20000.0, /* valve_command_rate, V/s */
  0.6, /* spool_warning, 1 */
  3.0, /* velocity_range, m/s */
  200000.0, /* force_range, N */
  1.2, /* spool_range, 1 */
  0.0025, /* gap_time, s */
  { /* learning */
    1, /* adaptive */
    1, /* curve_correction */
    1, /* guard */
    0.0005, /* excitation, 1 */
    {0.7, 1.35}, /* flow_gain_bounds, 1 */
    {0.8, 1.25}, /* valve_gain_bounds, 1 */
    {0.2, 4.0}, /* response_delay_bounds, 1 */
    1.0, /* age_limit, s */
  },
  { /* protection */
    1, /* enabled */
    40000.0, /* force_warning, N */
    60000.0, /* force_trip, N */
    0.1, /* displacement_warning, m */
    0.12, /* displacement_trip, m */
    DBL_MAX, /* velocity_warning, m/s */
    DBL_MAX, /* velocity_trip, m/s */
    0.95, /* spool_warning, 1 */
    0.95, /* spool_trip, 1 */
    0.5, /* start_time, s */
    0.3, /* ramp_time, s */
    0.1, /* shutdown_time, s */
    5u, /* lost_samples, samples */
    0.5, /* fault_time, s */
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

#elif EFT_RIG_GUARDED_CHECKSUM != 0x51256687
#error "two rigs are called EFT_RIG_GUARDED: export one of them with another --name"
#endif
