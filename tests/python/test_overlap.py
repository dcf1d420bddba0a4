"""Overlap of the spool: identified from slow strokes, and compensated in the inverse flow curve."""

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import least_squares

import eft
from eft.cli import main
from eft.identification import FlowTest
from eft.traces import Traces

RIG = eft.Rig.zhao2005()
AREA = RIG["actuator.piston_area"]
RATE = 2048.0
OPENINGS = np.array(RIG["servovalve.flow_table.openings"])
FLOWS = np.array(RIG["servovalve.flow_table.flows"])
Array = NDArray[np.float64]


@cache
def quiet_strokes(overlap: float, bias: float) -> FlowTest:
    worn = RIG.replace({"servovalve.overlap": overlap, "servovalve.null_bias": bias})
    return eft.identification.flow_test(worn, amplitude=0.02, frequency=0.5, duration=8.0)


def strokes(overlap: float, bias: float, noise: float, seed: int = 3) -> tuple[Array, Array]:
    """Spool and displacement of slow strokes within some 3 % of null; noise over 0.05 % of the ranges."""
    test = quiet_strokes(overlap, bias)
    random = np.random.default_rng(seed)
    spool = test.spool + noise * 5e-4 * random.standard_normal(test.spool.size)
    return spool, test.displacement + noise * 6e-5 * random.standard_normal(spool.size)


@pytest.mark.parametrize("overlap", [1e-3, -2e-3])
def test_the_fit_is_scipys(overlap: float) -> None:
    spool, moved = strokes(overlap, 5e-4, 1.0)
    found = eft.identification.identify_overlap(spool, moved, RATE, AREA)

    def missed(p: Array) -> Array:
        flow = 1e-2 * (
            p[0] * np.maximum(spool - 1e-3 * p[2], 0.0) + p[1] * np.minimum(spool - 1e-3 * p[3], 0.0)
        )
        rest = AREA * moved - cumulative_trapezoid(flow, dx=1.0 / RATE, initial=0.0)
        return np.asarray(1e6 * (rest - rest.mean()))

    best = least_squares(missed, [1.6, 1.6, 0.3, -0.3], xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    above, below = 1e-3 * best[2], 1e-3 * best[3]
    assert found == pytest.approx((above - below) / 2.0, abs=1e-8)
    assert found.null_bias == pytest.approx((above + below) / 2.0, abs=1e-8)
    assert [float(gain) for gain in found.flow_gains] == pytest.approx(1e-2 * best[[1, 0]], rel=1e-6)


def test_the_uncertainty_covers_over_seeds() -> None:
    sigma = []
    for seed in range(15):
        found = eft.identification.identify_overlap(*strokes(1e-3, 0.0, 1.0, seed), RATE, AREA)
        sigma += [(found - 1e-3) / found.uncertainty, found.null_bias / found.null_bias.uncertainty]
    assert np.mean(np.abs(sigma) < 2.0) > 0.8
    assert 0.3 < np.sqrt(np.mean(np.square(sigma))) < 2.0


def test_the_inverse_is_the_curves_behind_a_smooth_step() -> None:
    overlap = 2e-3
    rig = RIG.replace({"servovalve.overlap": overlap, "compensation.sign_from": "demand"})
    per_volt = rig["compensation.valve_gain"] * rig["controller.proportional_gain"]
    for velocity in (-0.4, -0.02, -0.004, -1e-3, 2e-4, 3e-3, 0.012, 0.03, 0.5):
        compensator, plain = eft.Compensator(rig), eft.Compensator(RIG)
        for _ in range(400):
            volt, before = compensator.step(velocity, 0.0, 0.0), plain.step(velocity, 0.0, 0.0)
        inner = np.interp(AREA * velocity, FLOWS, OPENINGS)
        expected = inner + overlap * np.clip(inner / (4.0 * overlap), -1.0, 1.0)
        assert per_volt * volt == pytest.approx(expected, rel=1e-9), velocity
        assert per_volt * before == pytest.approx(inner, rel=1e-9), velocity


def test_a_known_overlap_costs_little_and_does_not_chatter() -> None:
    sensors = {
        f"truth.sensors.{name}.noise": 5e-4 * size
        for name, size in {"force": 156e3, "velocity": 1.05, "spool": 1.0, "displacement": 0.127}.items()
    }
    scheme = {
        "controller.force_loop": "robust",
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
    }
    sweep = eft.sine_sweep(2200.0, 0.0, 10.0, 16.0, 4096.0)
    ratio, rough = {}, {}
    for name, changes in {
        "none": {},
        "unknown": {"truth.servovalve.overlap": 1e-3},
        "known": {"servovalve.overlap": 1e-3},
        "30 % less": {"servovalve.overlap": 0.7e-3, "truth.servovalve.overlap": 1e-3},
    }.items():
        run = eft.simulate(RIG.replace(sensors | scheme | changes), sweep)
        found = run.fft_ratio(0.5, 9.5).ratio
        ratio[name] = max(found.max() - 1.0, 1.0 - found.min())
        rough[name] = np.diff(run.valve_command).std()
    assert ratio["unknown"] > 0.12
    assert ratio["known"] < 0.03
    assert ratio["30 % less"] < 0.08
    assert rough["known"] < 1.3 * rough["none"]


def test_a_piston_at_rest_does_not_oscillate_over_a_known_overlap() -> None:
    """The sign of the step is that of both openings. Two steps would let the force oscillate by 130 N."""
    rate = 4096.0
    command = np.where(np.arange(20 * 4096) < 400, 3000.0, 2000.0)
    scheme = {"controller.force_loop": "robust", "compensation.feedforward": True, "servovalve.overlap": 1e-3}
    critical = 2.0 * float(np.sqrt(RIG["structure.mass"] * RIG["structure.stiffness"]))
    rig = RIG.replace(scheme | {"structure.damping": 0.03 * critical})
    run = eft.simulate(rig, eft.Command(command, rate))
    rest = run.force[int(16 * rate) :]
    assert np.std(rest) < 25.0 and abs(np.mean(rest) - 2000.0) < 25.0


def test_curve_and_overlap_are_found_together_and_the_command_line_agrees(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spool, moved = strokes(4e-3, 1e-3, 0.0)
    worn = RIG.replace({"servovalve.overlap": 4e-3, "servovalve.null_bias": 1e-3})
    fast = eft.identification.flow_test(worn, amplitude=0.1)
    found = eft.identify(
        RIG,
        null=[Traces("null", RATE, {"spool": spool, "displacement": moved})],
        flow=[Traces("flow", RATE, {"spool": fast.spool, "displacement": fast.displacement})],
    )
    assert found.overlap is not None and found.flow_curve is not None
    assert found.rig["servovalve.overlap"] == pytest.approx(4e-3, abs=5e-5)
    seen = found.flow_curve.measured
    assert np.abs(np.array(found.flow_curve.flows) - FLOWS)[seen].max() < 0.01 * FLOWS.max()
    file, keys = tmp_path / "null.csv", tmp_path / "overlap.toml"
    columns = np.column_stack([np.arange(spool.size) / RATE, spool, moved])
    np.savetxt(file, columns, "%.12g", ",", header="time (s),spool,displacement (m)", comments="")
    assert main(["identify", "overlap", str(file), "--piston-area", str(AREA), "-o", str(keys)]) == 0
    printed = capsys.readouterr().out
    assert "overlap 0.399" in printed and "null bias 0.100" in printed
    read = tomllib.loads(keys.read_text())["servovalve"]
    assert read["overlap"] == pytest.approx(float(found.overlap), abs=1e-8)
    assert RIG.replace({"servovalve.null_bias": read["null_bias"]})["servovalve.null_bias"] > 0.0
