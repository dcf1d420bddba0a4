"""Shear buildings with an actuator on every floor, and the ground motion that they share."""

import numpy as np

import eft

RATE = 2048.0
MASSES = [7040.0, 6000.0, 5200.0, 5000.0, 4000.0]
DAMPINGS = [5200.0, 5000.0, 4600.0, 4300.0, 4000.0]
STIFFNESSES = [2.6e6, 2.4e6, 2.2e6, 1.9e6, 1.6e6]


def building(stories, **changes):
    return eft.Rig.zhao2005().replace(
        {
            "structure.kind": "shear_building",
            "structure.stories.masses": MASSES[:stories],
            "structure.stories.dampings": DAMPINGS[:stories],
            "structure.stories.stiffnesses": STIFFNESSES[:stories],
            **changes,
        }
    )


def matrices(stories):
    """Mass, damping and stiffness matrices, assembled here story by story."""
    m, c, k = np.diag(MASSES[:stories]), np.zeros((stories,) * 2), np.zeros((stories,) * 2)
    for i in range(stories):
        for matrix, value in ((c, DAMPINGS[i]), (k, STIFFNESSES[i])):
            matrix[i, i] += value
            if i:
                matrix[i - 1, i - 1] += value
                matrix[i, i - 1] -= value
                matrix[i - 1, i] -= value
    return m, c, k


def record(dt=1 / 128, seconds=8.0):
    """A ground motion with everything from 0.3 to 8 Hz in it; its points are samples of the command."""
    rng = np.random.default_rng(5)
    time = np.arange(round(seconds / dt)) * dt
    envelope = np.sin(np.pi * time / seconds) ** 2
    tones = rng.uniform(0.3, 8.0, 40)
    motion = sum(np.cos(2 * np.pi * f * time + p) for f, p in zip(tones, rng.uniform(0, 6, 40), strict=True))
    return eft.Record(0.2 * envelope * motion, dt, "made up")


def command_of(rig, ground, scale=1.0):
    return eft.effective_force(ground, mass=rig["structure.stories.masses"], sample_rate=RATE, scale=scale)
