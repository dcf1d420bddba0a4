"""The paper's rig as plain numbers, for the peers.

They are independent of the package, so that an agreement is a proof.
"""

import ctypes

import numpy as np

KNOTS = 21
FIELDS = [
    "A",
    "Av",
    "c",
    "Cl",
    "CF",
    "Gp",
    "Gd",
    "k",
    "K3",
    "Ka",
    "Kv_per",
    "Ks",
    "Kvp",
    "m",
    "Ps",
    "Td",
    "xvmax",
    "alpha",
    "tau",
    "kink",
    "k2",
    "level",
    "mode",
]
VALUES = {
    "A": 8.212e-3, "Av": 1.964e-4, "c": 4330.0, "Cl": 1.3e-11, "CF": 5.6e-5, "Gp": 0.8059, "Gd": 2.0e-4,
    "k": 693.8e3, "K3": 3579.13, "Ka": 7.56e-13, "Kv_per": 1 / 1.64e-2, "Ks": 0.1,
    "Kvp": 1.06e-5, "m": 7040.0,
    "Ps": 1.9e7, "Td": 5.0e-3, "xvmax": 2.79e-3, "alpha": 0.1, "tau": 1.4e-3, "kink": 25e-3, "k2": 350e3,
    "level": 1.0, "mode": 2.0,
}  # fmt: skip
EXTENDING = [102.2, 187.2, 260.4, 321.1, 369.8, 411.2, 441.0, 468.3, 495.7, 523.0]
RETRACTING = [101.0, 188.2, 260.9, 324.2, 377.1, 419.9, 452.3, 480.2, 508.2, 536.2]
OPENINGS = np.arange(-10, 11) / 10
FLOWS = 1.6387064e-5 * np.array([-q for q in RETRACTING[::-1]] + [0.0, *EXTENDING])


class Rig(ctypes.Structure):
    """As in `peer.c`."""

    _fields_ = [(name, ctypes.c_double) for name in FIELDS] + [
        ("x", ctypes.c_double * KNOTS),
        ("y", ctypes.c_double * KNOTS),
    ]


def rig(**changes: float) -> Rig:
    """The paper's rig, with some values changed."""
    values = VALUES | changes
    return Rig(
        *(values[name] for name in FIELDS),
        (ctypes.c_double * KNOTS)(*OPENINGS),
        (ctypes.c_double * KNOTS)(*FLOWS),
    )


def sweep(amplitude: float = 8900.0, duration: float = 32.0, sample_rate: float = 4096.0) -> np.ndarray:
    """The paper's sweep, 0 to 10 Hz."""
    t = np.arange(round(duration * sample_rate)) / sample_rate
    return amplitude * np.sin(2 * np.pi * (0.5 * 10.0 / duration * t) * t)
