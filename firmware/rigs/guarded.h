/* The controller of guarded at 4096 Hz, exported by eft.
 *
 * The force loop is closed here: eft_adaptive_step gives the valve command, V. The supply pressure
 * that is given with every sample is the measured one, Pa.
 */
#include <float.h>
#include "eft.h"

static const eft_adaptive_parameters EFT_RIG = {
  .compressibility = 7.56e-13, /* m3/Pa */
  .leakage = 1.3e-11, /* m3/(s Pa) */
  .velocity_delay = 1.1254828529960618e-7, /* s */
  .computation_delay = 0, /* samples */
  .parts = EFT_FEEDFORWARD | EFT_ESTIMATORS | EFT_CURVE | EFT_GUARD,
  .rig = {
  .table_length = 21,
  .mode = EFT_MODE_NONLINEAR,
  .sign_from = EFT_SIGN_FROM_SPOOL,
  .level = 1.0, /* 1 */
  .piston_area = 0.008212, /* m2 */
  .supply_pressure = 19000000.0, /* Pa */
  .flow_gain = 0.0164, /* m3/s */
  .valve_gain = 0.1, /* 1/V */
  .response_delay = 0.005, /* s */
  .lead_alpha = 0.1, /* 1 */
  .spool_warning = 0.6, /* 1 */
  .velocity_range = 3.0, /* m/s */
  .force_range = 200000.0, /* N */
  .spool_range = 1.2, /* 1 */
  .sample_rate = 4096.0, /* Hz */
  .proportional_gain = 0.8059, /* V/V */
  .force_sensitivity = 5.6e-5, /* V/N */
  .derivative_gain = 0.0002, /* s */
  .valve_command = 10.0, /* V */
  .valve_command_rate = 20000.0, /* V/s */
  .openings = {-1.0, -0.9, -0.8, -0.7, -0.6, -0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0},
  .flows = {-0.008786743716800001, -0.008327905924799999, -0.0078690681328, -0.0074118690472, -0.0068809281735999995, -0.0061795618344, -0.0053126861488, -0.004275384997599999, -0.0030840454447999995, -0.001655093464, 0.0, 0.0016747579408, 0.0030676583807999996, 0.0042671914656, 0.0052618862504, 0.0060599362672, 0.006738360716799999, 0.007226695224, 0.0076740620712, 0.0081230676248, 0.008570434472}, /* m3/s */
} };

static const eft_observer_parameters EFT_VELOCITY = {
  .sample_rate = 4096.0, /* Hz */
  .gain_on_displacement = 0.0688998387462796, /* 1 */
  .gain_on_velocity = 10.072327505043758, /* 1/s */
  .gain_on_drift = 736.1872211790367, /* 1/s2 */
};
/* Times the force, the acceleration that the observer takes, 1/kg. */
static const double EFT_PER_MASS = 0.00014204545454545454;

static const eft_protection_parameters EFT_PROTECTION = {
  .sample_rate = 4096.0, /* Hz */
  .force_warning = 40000.0, /* N */
  .force_trip = 60000.0, /* N */
  .displacement_warning = 0.1, /* m */
  .displacement_trip = 0.12, /* m */
  .velocity_warning = DBL_MAX, /* m/s */
  .velocity_trip = DBL_MAX, /* m/s */
  .spool_warning = 0.95, /* 1 */
  .spool_trip = 0.95, /* 1 */
  .start_time = 0.5, /* s */
  .ramp_time = 0.3, /* s */
  .shutdown_time = 0.1, /* s */
  .lost_samples = 5.0, /* 1 */
  .fault_time = 0.5, /* s */
};
