"""The benchmark of real-time hybrid simulation: its criteria, its plant, the sample controller's range."""

from pathlib import Path

import control
import numpy as np
import pytest
from scipy.linalg import expm

import eft
from eft import rths

pytestmark = pytest.mark.usefixtures("quick_pictures")

NAN = float("nan")
RATE = 4096.0
RECORD = Path(eft.__file__).parent / "data" / "RSN6_IMPVALL.I_I-ELC180-hor1.AT2"
TIME = np.arange(8192) / RATE


def test_the_criteria_of_a_known_pair():
    first = np.sin(2.0 * np.pi * 3.0 * TIME)
    target = np.array([first, 1.8 * first, 2.2 * first])
    reference = np.array([0.8, 1.0, 1.1])[:, None] * target
    found = rths.criteria(target, 0.9 * first + 0.5, reference, RATE)
    # An offset has a peak, and no deviation.
    wanted = [0.0, 0.1, 0.6, 0.125, 0.625 + 0.125, 0.0, 0.1 / 1.1, 0.0, 0.1 / 1.1]
    peak = np.abs(0.5 - 0.1 * first).max(), np.abs(0.5 + 0.1 * first).max() / 0.8
    wanted[2], wanted[4] = peak
    np.testing.assert_allclose(found, wanted, atol=1e-4)


@pytest.mark.parametrize("samples", [0, 1, 18, 49])
def test_the_delay_is_a_number_of_samples(samples):
    target = np.random.default_rng(3).standard_normal(4096).cumsum()
    measured = np.concatenate([np.full(samples, target[0]), target])[:4096]
    assert rths.delay(target, measured, RATE) == samples / RATE


@pytest.mark.parametrize(
    ("target", "measured", "says"),
    [
        ([1.0, 2.0, 3.0], [1.0, 2.0], "measured = 2 samples"),
        ([1.0, np.nan, 3.0], [1.0, 2.0, 3.0], r"target\[1\]"),
        ([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], "measured = 1 throughout"),
        ([[1.0], [2.0]], [1.0, 2.0], r"target has the shape \(2, 1\)"),
        ([1.0, 2.0, 3.0], [1.0, 2.0, 2.0], "lags = 50"),
    ],
)
def test_signals_that_cannot_be_judged_are_named(target, measured, says):
    with pytest.raises(ValueError, match=f"^{says}"):
        rths.delay(target, measured, RATE)


def test_a_test_of_two_floors_is_refused():
    with pytest.raises(ValueError, match=r"^reference has the shape \(2, 8192\)"):
        rths.criteria(np.tile(TIME, (3, 1)), TIME, np.tile(TIME, (2, 1)), RATE)


def test_the_plant_is_that_of_the_block_diagram():
    plant = rths.TransferSystem(a3=4.0, b1=430.0)
    specimen = control.tf([1.0], [plant.mass, plant.damping, plant.stiffness])
    inner = control.feedback(
        control.tf([1.0], [1.0, plant.a3]) * specimen, control.tf([plant.a2, 0.0], [1.0])
    )
    servo = control.tf([plant.a1_b0], [1.0, plant.b1, plant.b2])
    wanted = plant.gain * control.feedback(servo * inner, 1.0)
    a, b = plant.state_space()
    for frequency in (0.1, 1.0, 5.0, 20.0, 60.0):
        s = 2j * np.pi * frequency
        found = np.linalg.solve(s * np.eye(5) - a, b)[3, 0]
        assert found == pytest.approx(wanted(s), rel=1e-9)


def test_the_buildings_have_the_published_first_frequency():
    mass, damping, stiffness = rths.BUILDINGS[0].matrices()
    squares, modes = np.linalg.eigh(stiffness / mass[0, 0])
    frequencies = np.sqrt(squares)
    assert frequencies[0] / (2.0 * np.pi) == pytest.approx(3.61, abs=5e-3)
    ratios = np.diag(modes.T @ damping @ modes) / (2.0 * mass[0, 0] * frequencies)
    np.testing.assert_allclose(ratios, 0.05)


def test_the_simulation_is_the_loop_sample_by_sample():
    record = eft.Record(np.sin(np.arange(150) * 0.02 * 20.0), 0.02, "made up")
    plant, control_ = rths.TransferSystem(), rths.SampleController(lead=4e-3)
    test = rths.simulate(record, rths.BUILDINGS[2], plant, control_, rest=0.5)
    mass, damping, stiffness = rths.BUILDINGS[2].matrices()
    share = np.diag([1.0, 0.0, 0.0])
    mass_n, damping_n = mass - plant.mass * share, damping - plant.damping * share
    stiffness_n = stiffness - plant.stiffness * share

    def held(a, b):
        whole = np.zeros((len(a) + b.shape[1],) * 2)
        whole[: len(a)] = np.hstack([a, b]) / RATE
        return expm(whole)[: len(a), : len(a)], expm(whole)[: len(a), len(a) :]

    inverse = np.linalg.inv(mass_n)
    motion = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness_n, -inverse @ damping_n]])
    forces = np.zeros((6, 2))
    forces[3:, 0], forces[3:, 1] = -inverse @ mass @ np.ones(3), -inverse[:, 0]
    (a_n, b_n), (a_p, b_p) = held(motion, forces), held(*plant.state_space())
    floors, inside, last_error, last_target, led, integral = np.zeros(6), np.zeros(5), 0.0, 0.0, 0.0, 0.0
    ground = 0.4 * np.interp(test.time, np.arange(150) * 0.02, record.acceleration, right=0.0)
    slow = control_.lead / 10.0
    for i, acceleration in enumerate(ground):
        assert np.abs(test.target[:, i] - floors[:3]).max() < 1e-9
        assert abs(test.measured[i] - inside[3]) < 1e-9
        assert abs(test.force[i] - inside[2]) < 1e-2
        # Tustin, written as a rate over a sample: T·ẏ/10 + y = T·ẋ + x.
        h = 1.0 / RATE
        rise = (floors[0] - last_target) * control_.lead / h + 0.5 * (floors[0] + last_target) - 0.5 * led
        led = (rise + slow / h * led) / (slow / h + 0.5)
        last_target = floors[0]
        error = led - inside[3]
        integral += 0.5 * h * control_.integral * (error + last_error)
        last_error = error
        command = control_.proportional * error + integral
        floors, inside = (
            a_n @ floors + b_n @ np.array([acceleration, inside[2]]),
            a_p @ inside + b_p[:, 0] * command,
        )


def test_an_unstable_controller_is_refused():
    record = eft.Record([0.0, 1.0, 0.0], 0.1, "made up")
    with pytest.raises(ValueError, match="unstable"):
        rths.simulate(record, controller=rths.SampleController(proportional=6.0))
    with pytest.raises(ValueError, match=r"^scale = nan"):
        rths.simulate(record, scale=float("nan"))


@pytest.mark.parametrize(
    ("part", "says"),
    [
        ({"building": rths.Building(-1.0, 0.05)}, "building.mass = -1.0: must be positive and finite"),
        ({"building": rths.Building(1e3, NAN)}, "building.damping_ratio = nan: must be finite"),
        ({"transfer_system": rths.TransferSystem(stiffness=0.0)}, "transfer_system.stiffness = 0.0"),
        ({"controller": rths.SampleController(integral=NAN)}, "controller.integral = nan"),
    ],
)
def test_a_value_of_a_part_that_is_not_allowed_is_named(part, says):
    record = eft.Record([0.0, 1.0, 0.0], 0.1, "made up")
    with pytest.raises(ValueError, match=f"^{says}"):
        rths.simulate(record, **part)


def test_a_perturbed_plant_is_repeatable():
    one, other = (rths.TransferSystem().perturbed(seed) for seed in (1, 2))
    assert one == rths.TransferSystem().perturbed(1) != other
    assert one.a2 == other.a2 == rths.TransferSystem().a2


def test_the_sample_controller_lies_in_the_published_range():
    found = rths.simulate(eft.read_record(RECORD), rths.BUILDINGS[0]).criteria
    assert 0.09 <= found.j2 <= 0.105
