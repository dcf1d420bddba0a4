/* The controller of adaptive at 4096 Hz, exported by eft.
 *
 * An analog controller closes the force loop of this rig: eft_adaptive_compensation_step gives the
 * compensation signal, V, that is added to its force error; eft_adaptive_step would close the loop
 * as well. The analog controller's valve command, V, is sampled with the rest. The supply pressure
 * that is given with every sample is 19000000.0 Pa: none is measured.
 */
#include <float.h>
#include "eft.h"

static const eft_adaptive_parameters EFT_RIG = {
  .compressibility = 7.56e-13, /* m3/Pa */
  .leakage = 1.3e-11, /* m3/(s Pa) */
  .velocity_delay = 0.0, /* s */
  .computation_delay = 0, /* samples */
  .parts = EFT_FEEDFORWARD | EFT_ESTIMATORS | EFT_GUARD,
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
