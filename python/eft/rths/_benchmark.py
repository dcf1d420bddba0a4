"""The benchmark's plant, buildings and a controller like its sample controller, as one linear model."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eft._extras import need
from eft._native import Record
from eft._numbers import real_number, whole_number
from eft._read_only import ReadOnly
from eft.rths._criteria import Criteria, criteria

Array = NDArray[np.float64]

_RATE = 4096.0
"""Sample rate of the benchmark, Hz."""
_STIFFNESS = 1e7 * np.array(
    [[2.6055, -2.3134, 0.5937], [-2.3134, 3.2561, -1.4420], [0.5937, -1.4420, 0.9267]]
)
"""Stiffness of the reference building, N/m."""


class Building(NamedTuple):
    """A partitioning case of the benchmark: the three-story building that is tested."""

    mass: float
    """Mass of each floor, kg."""
    damping_ratio: float
    """Damping ratio of each mode."""

    def matrices(self) -> tuple[Array, Array, Array]:
        """Mass (kg), damping (N·s/m) and stiffness (N/m), each (3, 3).

        Returns
        -------
        tuple of numpy.ndarray

        Examples
        --------
        >>> import eft
        >>> mass, damping, stiffness = eft.rths.BUILDINGS[0].matrices()
        >>> mass.diagonal().tolist()
        [1000.0, 1000.0, 1000.0]
        """
        squares, modes = np.linalg.eigh(_STIFFNESS / self.mass)
        damping = 2.0 * self.damping_ratio * np.sqrt(squares) * self.mass
        return self.mass * np.eye(3), (modes * damping) @ modes.T, _STIFFNESS.copy()


BUILDINGS = (Building(1000.0, 0.05), Building(1100.0, 0.04), Building(1300.0, 0.03), Building(1000.0, 0.03))
"""Cases 1 to 4 of the benchmark."""


@dataclass(frozen=True, kw_only=True)
class TransferSystem:
    """Servovalve, actuator and specimen of the benchmark, linear; the defaults are its nominal values.

    The command u and the displacement x (m) of the specimen obey ``f = G_a (G_s (g u − x) − a2 s x)`` and
    ``(m s² + c s + k) x = f`` with ``G_s = a1 b0/(s² + b1 s + b2)`` and ``G_a = 1/(s + a3)``. The term of
    a2 is the natural velocity feedback.
    """

    a1_b0: float = 2.1283e13
    """a1·b0, N/(m·s³)."""
    a2: float = 4.2297e6
    """Natural velocity feedback, N/m."""
    a3: float = 3.3
    """1/s."""
    b1: float = 425.0
    """1/s."""
    b2: float = 9.9976e4
    """1/s²."""
    gain: float = 1.0261
    """Gain g of the command's calibration."""
    mass: float = 29.13
    """Of the specimen, kg."""
    stiffness: float = 1.19e6
    """Of the specimen, N/m."""
    damping_ratio: float = 0.0097
    """Of the specimen."""

    @property
    def damping(self) -> float:
        """Of the specimen, N·s/m."""
        return 2.0 * self.damping_ratio * float(np.sqrt(self.stiffness * self.mass))

    def perturbed(self, seed: int) -> TransferSystem:
        """One of the benchmark's uncertain plants: normal a3 ± 1.3, b1 ± 3.3, b2 ± 3300 and k ± 50 kN/m.

        Parameters
        ----------
        seed : int
            Seed of the draws, at least 0.

        Returns
        -------
        TransferSystem

        Examples
        --------
        >>> import eft
        >>> nominal = eft.rths.TransferSystem()
        >>> nominal.perturbed(1) == nominal.perturbed(1) != nominal
        True
        """
        normal = np.random.default_rng(whole_number("seed", seed)).standard_normal(4)
        return replace(
            self,
            a3=self.a3 + 1.3 * normal[0],
            b1=self.b1 + 3.3 * normal[1],
            b2=self.b2 + 3.3e3 * normal[2],
            stiffness=self.stiffness + 5e4 * normal[3],
        )

    def state_space(self) -> tuple[Array, Array]:
        """A (5, 5) and B (5, 1), SI; the states: servovalve (2), force, displacement and velocity.

        Returns
        -------
        tuple of numpy.ndarray

        Examples
        --------
        >>> import eft
        >>> a, b = eft.rths.TransferSystem().state_space()
        >>> a.shape, b.shape
        ((5, 5), (5, 1))
        """
        a = np.zeros((5, 5))
        a[0, 1] = 1.0
        a[1, [0, 1, 3]] = -self.b2, -self.b1, -self.a1_b0
        a[2, [0, 2, 4]] = 1.0, -self.a3, -self.a2
        a[3, 4] = 1.0
        a[4, 2:] = np.array([1.0, -self.stiffness, -self.damping]) / self.mass
        return a, np.array([[0.0], [self.a1_b0 * self.gain], [0.0], [0.0], [0.0]])


@dataclass(frozen=True, kw_only=True)
class SampleController:
    """A proportional-integral tracking controller after a phase lead, like the benchmark's sample controller.

    ``u = (P + I/s) ((1 + T s)/(1 + T s/10) x_target − x)``, discretized by Tustin. The benchmark's own gains
    were published in a binary file only. The defaults are a design of this package: a zero on the plant's
    slowest pole (48.2 1/s), 60° of phase margin, and a remaining delay of 4.6 ms at low frequency.
    """

    proportional: float = 2.07
    """P."""
    integral: float = 99.8
    """I, 1/s."""
    lead: float = 5.94e-3
    """T, s."""


@dataclass(frozen=True)
class Simulation(ReadOnly):
    """A virtual hybrid test."""

    sample_rate: float
    """Hz."""
    time: Array
    """s."""
    target: Array
    """Displacements of the numerical substructure, (3, samples), m; the first row is the target."""
    measured: Array
    """Displacement of the specimen, m."""
    force: Array
    """Of the actuator on the specimen, N."""
    reference: Array
    """Displacements of the whole building, (3, samples), m."""

    @property
    def criteria(self) -> Criteria:
        """J1 to J9."""
        return criteria(self.target, self.measured, self.reference, self.sample_rate)


def simulate(
    record: Record,
    building: Building = BUILDINGS[0],
    transfer_system: TransferSystem | None = None,
    controller: SampleController | None = None,
    *,
    scale: float = 0.4,
    rest: float = 10.0,
) -> Simulation:
    """Run the benchmark's virtual hybrid test at 4096 Hz.

    Building, transfer system and controller are linear. Command, force and ground acceleration are held
    over a sample. The sensors are ideal: the noise, the saturation at 3.8 V and the converters of 18 bit
    are left out.

    Parameters
    ----------
    record : Record
        Ground motion, m/s².
    building : Building
        The building; one of `BUILDINGS`.
    transfer_system : TransferSystem, optional
        The plant; the nominal one where it is left out.
    controller : SampleController, optional
        The controller.
    scale : float
        Factor on the ground motion; the benchmark takes 0.4.
    rest : float
        Time without ground motion after the record, s.

    Returns
    -------
    Simulation
        The displacements, and the criteria.

    Raises
    ------
    ValueError
        If scale, rest or a value of the parts is not allowed, or the test is unstable.

    Examples
    --------
    >>> import numpy as np
    >>> import eft
    >>> pulse = eft.Record(np.sin(np.arange(300) * 0.02 * 9.0), 0.02, "made up")
    >>> test = eft.rths.simulate(pulse, eft.rths.BUILDINGS[0], rest=2.0)
    >>> f"delay {1e3 * test.criteria.j1:.1f} ms, error {test.criteria.j2:.0%}"
    'delay 4.6 ms, error 5%'
    """
    scale, rest = real_number("scale", scale), real_number("rest", rest)
    for name, value in (("scale", scale), ("rest", rest)):
        if not (np.isfinite(value) and value >= 0.0):
            raise ValueError(f"{name} = {value!r}: must be at least 0 and finite")
    plant, control = transfer_system or TransferSystem(), controller or SampleController()
    for part, values in (
        ("building", building._asdict()),
        ("transfer_system", asdict(plant)),
        ("controller", asdict(control)),
    ):
        for name, value in values.items():
            positive = name in ("mass", "stiffness")
            if not np.isfinite(value) or (positive and value <= 0.0):
                allowed = "positive and finite" if positive else "finite"
                raise ValueError(f"{part}.{name} = {value!r}: must be {allowed}")
    mass, damping, stiffness = building.matrices()
    shares = np.zeros((3, 3))
    shares[0, 0] = 1.0
    ground = mass @ np.ones((3, 1))
    whole = _held(*_motion(mass, damping, stiffness, -ground))
    # Mass, damping and stiffness of the specimen are in the laboratory.
    numerical = _held(
        *_motion(
            mass - plant.mass * shares,
            damping - plant.damping * shares,
            stiffness - plant.stiffness * shares,
            np.hstack([-ground, -shares[:, :1]]),
        )
    )
    step, drive = _closed(numerical, _held(*plant.state_space()), control)
    if np.abs(np.linalg.eigvals(step)).max() >= 1.0:
        raise ValueError(f"controller = {control}: the virtual hybrid test is unstable with it")

    length = len(record.acceleration)
    samples = int(np.ceil(((length - 1) * record.dt + rest) * _RATE)) + 1
    time = np.arange(samples) / _RATE
    motion = scale * np.interp(time, np.arange(length) * record.dt, record.acceleration, right=0.0)
    *target, measured, force = _run(step, drive, motion, [0, 1, 2, 9, 8])
    return Simulation(
        sample_rate=_RATE,
        time=time,
        target=np.array(target),
        measured=measured,
        force=force,
        reference=_run(*whole, motion, [0, 1, 2]),
    )


def _motion(mass: Array, damping: Array, stiffness: Array, forces: Array) -> tuple[Array, Array]:
    """A and B of a structure under `forces` (3, inputs); the states are displacements and velocities."""
    count = len(mass)
    a = np.block(
        [
            [np.zeros((count, count)), np.eye(count)],
            [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)],
        ]
    )
    return a, np.vstack([np.zeros_like(forces), np.linalg.solve(mass, forces)])


def _held(a: Array, b: Array) -> tuple[Array, Array]:
    """The sampled system with held inputs."""
    need("scipy", "study")
    from scipy.linalg import expm

    size, inputs = b.shape
    exponential = expm(np.block([[a, b], [np.zeros((inputs, size + inputs))]]) / _RATE)
    return exponential[:size, :size], exponential[:size, size:]


def _closed(
    numerical: tuple[Array, Array], plant: tuple[Array, Array], control: SampleController
) -> tuple[Array, Array]:
    """The closed loop: numerical substructure (6), plant (5), state of the lead and of the integral."""
    (a_n, b_n), (a_p, b_p) = numerical, plant
    half = 0.5 / _RATE
    # In transposed direct form II each part of the controller has one state, (b0 + b1/z)/(1 + a1/z).
    lag = control.lead / 10.0 + half
    lead_b0, lead_b1, lead_a1 = (
        (control.lead + half) / lag,
        (half - control.lead) / lag,
        2.0 * half / lag - 1.0,
    )
    rise = control.integral * half
    target, force, measured, lead, integral = 0, 8, 9, 11, 12
    size = 13
    row = np.eye(size)
    led = lead_b0 * row[target] + row[lead]
    error = led - row[measured]
    command = (control.proportional + rise) * error + row[integral]
    step = np.zeros((size, size))
    step[:6, :6] = a_n
    step[:6, force] = b_n[:, 1]
    step[6:11, 6:11] = a_p
    step[6:11] += b_p * command
    step[lead] = lead_b1 * row[target] - lead_a1 * led
    step[integral] = 2.0 * rise * error + row[integral]
    drive = np.zeros((size, 1))
    drive[:6, 0] = b_n[:, 0]
    return step, drive


def _run(step: Array, drive: Array, values: Array, rows: list[int]) -> Array:
    """States (rows, samples) from rest; each mode is a separate first-order filter."""
    need("scipy", "study")
    from scipy.signal import lfilter

    poles, modes = np.linalg.eig(step)
    shares = np.linalg.solve(modes, drive[:, 0].astype(complex))
    answer = np.zeros((len(rows), values.size))
    for pole, share, mode in zip(poles, shares, modes.T, strict=True):
        answer += (mode[rows, None] * lfilter([0.0, share], [1.0, -pole], values)).real
    return answer
