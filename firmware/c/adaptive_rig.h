/* The controller of zhao2005 at 4096 Hz, exported by eft. */
#include <float.h>
#include "eft.h"

static const eft_adaptive_parameters EFT_RIG = {
  .compressibility = 7.56e-13, /* m3/Pa */
  .leakage = 1.3e-11, /* m3/(s Pa) */
  .computation_delay = 0, /* samples */
  .parts = EFT_FEEDFORWARD | EFT_ESTIMATORS | EFT_GUARD,
  .rig = {
  .table_length = 21,
  .mode = EFT_MODE_NONLINEAR,
  .sign_from = EFT_SIGN_FROM_SPOOL,
  .level = 1e0, /* 1 */
  .piston_area = 8.212e-3, /* m2 */
  .supply_pressure = 1.9e7, /* Pa */
  .flow_gain = 1.64e-2, /* m3/s */
  .valve_gain = 1e-1, /* 1/V */
  .response_delay = 5e-3, /* s */
  .lead_alpha = 1e-1, /* 1 */
  .spool_warning = 6e-1, /* 1 */
  .velocity_range = 3e0, /* m/s */
  .force_range = 2e5, /* N */
  .spool_range = 1.2e0, /* 1 */
  .sample_rate = 4.096e3, /* Hz */
  .proportional_gain = 8.059e-1, /* V/V */
  .force_sensitivity = 5.6e-5, /* V/N */
  .derivative_gain = 2e-4, /* s */
  .valve_command = 1e1, /* V */
  .valve_command_rate = 2e4, /* V/s */
  .openings = {-1e0, -9e-1, -8e-1, -7e-1, -6e-1, -5e-1, -4e-1, -3e-1, -2e-1, -1e-1, 0e0, 1e-1, 2e-1, 3e-1, 4e-1, 5e-1, 6e-1, 7e-1, 8e-1, 9e-1, 1e0},
  .flows = {-8.786743716800001e-3, -8.327905924799999e-3, -7.8690681328e-3, -7.4118690472e-3, -6.8809281735999995e-3, -6.1795618344e-3, -5.3126861488e-3, -4.275384997599999e-3, -3.0840454447999995e-3, -1.655093464e-3, 0e0, 1.6747579408e-3, 3.0676583807999996e-3, 4.2671914656e-3, 5.2618862504e-3, 6.0599362672e-3, 6.738360716799999e-3, 7.226695224e-3, 7.6740620712e-3, 8.1230676248e-3, 8.570434472e-3}, /* m3/s */
} };
