"""A study for several tests."""

import eft

RIG = eft.Rig.zhao2005()
COMMAND = eft.sine_sweep(amplitude=8900.0, f_start=0.5, f_end=4.0, duration=1.0, sample_rate=1024.0)
GRID = {"compensation.mode": ["off", "linear", "nonlinear"], "servovalve.flow_gain_scale": [0.95, 1.0]}
RANGES = {
    "servovalve.flow_gain_scale": (0.9, 1.1),
    "actuator.leakage": (1e-13, 1e-11, "log"),
    "compensation.mode": ["linear", "nonlinear"],
}


def rows(study):
    return list(study)
