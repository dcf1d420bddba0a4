/* The controller of uneven at 5000 Hz, exported by eft.
 *
 * The force loop is closed here: eft_step gives the valve command, V.
 */
#include <float.h>
#include "eft.h"

static const eft_parameters EFT_RIG = {
  .table_length = 9,
  .mode = EFT_MODE_NONLINEAR,
  .sign_from = EFT_SIGN_FROM_DEMAND,
  .level = 1.02, /* 1 */
  .piston_area = 0.0113, /* m2 */
  .supply_pressure = 20700000.0, /* Pa */
  .flow_gain = 0.0164, /* m3/s */
  .valve_gain = 0.12, /* 1/V */
  .response_delay = 0.0041, /* s */
  .lead_alpha = 0.15, /* 1 */
  .spool_warning = 0.5, /* 1 */
  .velocity_range = 1.1, /* m/s */
  .force_range = 220000.0, /* N */
  .spool_range = 1.15, /* 1 */
  .sample_rate = 5000.0, /* Hz */
  .proportional_gain = 0.61, /* V/V */
  .force_sensitivity = 7.1e-5, /* V/N */
  .derivative_gain = 0.0002, /* s */
  .valve_command = 8.0, /* V */
  .valve_command_rate = 4000.0, /* V/s */
  .openings = {-1.0, -0.62, -0.2, -0.05, -0.04, 0.0, 0.03, 0.25, 1.0},
  .flows = {-0.0101, -0.0083, -0.0034, -0.0006, -0.0004, 0.0, 0.0005, 0.0045, 0.0107}, /* m3/s */
};
