"""The designed force loop, compared with python-control, and on rigs that deviate from the configuration."""

from pathlib import Path

import numpy as np
import pytest

import eft
from eft.cli import main

RIG = eft.Rig.zhao2005()
ADAPTIVE = {
    "compensation.adaptive": True,
    "compensation.feedforward": True,
    "compensation.look_ahead": True,
}


def test_margins_are_those_of_python_control():
    control = pytest.importorskip("control")
    loop = eft.design_force_loop(RIG)
    opened = loop.to_control()

    def largest_pole(factor):
        return np.abs(control.poles(control.feedback(factor * opened, 1))).max()

    assert largest_pole(loop.margins.gain) == pytest.approx(1.0, abs=1e-6)
    assert largest_pole(0.99 * loop.margins.gain) < 1.0
    wanted = np.sort_complex(control.poles(control.feedback(opened, 1)))
    assert np.sort_complex(loop.poles()) == pytest.approx(wanted, abs=1e-8)
    frequency = np.geomspace(1.0, 2000.0, 4000)
    gain = opened(np.exp(2j * np.pi * frequency / 4096.0))
    ratio = np.abs(1 + gain) / np.sqrt(2 * (1 + np.abs(gain) ** 2))
    assert loop.margins.e_max == pytest.approx(ratio.min(), rel=2e-3)
    crossing = np.flatnonzero(np.diff(np.abs(gain) > 1))
    phase = np.angle(gain[crossing]) + np.pi
    wanted = (phase / (2 * np.pi * frequency[crossing])).min()
    assert loop.margins.delay == pytest.approx(wanted, rel=1e-2)


def test_a_rig_takes_the_design_and_its_file_keeps_what_was_written():
    robust = RIG.replace({"controller.force_loop": "robust"})
    assert robust["controller.proportional_gain"] == RIG["controller.proportional_gain"]
    given = RIG.replace(eft.design_force_loop(RIG).coefficients | {"controller.realization": "digital"})
    command = eft.sine_sweep(2200.0, 0.5, 10.0, 2.0, 4096.0)
    assert np.array_equal(eft.simulate(robust, command).force, eft.simulate(given, command).force)


# Force over command, 0.5 to 9.5 Hz; the paper's gains are unstable on each of these rigs.
@pytest.mark.parametrize(
    "truth",
    [
        {"servovalve.pilot_time_constant": 2.8e-3},
        {"actuator.compressibility": 7.56e-13 / 1.5},
        {"sensors.force.bandwidth": 300.0},
        {
            "servovalve.pilot_time_constant": 2.8e-3,
            "actuator.compressibility": 7.56e-13 / 1.5,
            "dac.delay": 2,
        },
    ],
    ids=["slow pilot", "stiff oil", "slow load cell", "all at once"],
)
def test_rigs_on_which_the_paper_s_gains_are_unstable(truth):
    truth = {f"truth.{key}": value for key, value in truth.items()}
    rig = RIG.replace(ADAPTIVE | truth | {"controller.force_loop": "robust"})
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 16.0, 4096.0)
    run = eft.simulate(rig, command)
    ratio = run.fft_ratio(0.5, 9.5).ratio
    assert ratio.min() > 0.95 and ratio.max() < 1.05 and run.metrics()["nrmse"] < 0.04
    paper = rig.replace({"controller.force_loop": "pd", "controller.realization": "digital"})
    assert eft.simulate(paper, command).metrics()["nrmse"] > 1.0


# 0.05 % of the range and 16 bits on every sensor, which the controller does not know.
RANGES = {"force": 156e3, "displacement": 0.127, "spool": 1.0, "velocity": 1.05}
NOISE = {
    f"truth.sensors.{sensor}.{key}": value
    for sensor, size in RANGES.items()
    for key, value in (("noise", 5e-4 * size), ("range", size), ("bits", 16))
}
RECORD = Path(eft.__file__).parent / "data" / "RSN6_IMPVALL.I_I-ELC180-hor1.AT2"


def earthquake():
    return eft.effective_force(eft.read_record(RECORD), mass=7040.0, sample_rate=4096.0)


def sweep(amplitude):
    return eft.sine_sweep(amplitude, 0.0, 10.0, 32.0, 4096.0)


@pytest.mark.parametrize("curve", [False, True], ids=["one gain", "curve"])
@pytest.mark.parametrize(
    ("command", "noise", "bound"),
    [
        (lambda: sweep(8900.0), {}, 0.007),
        (lambda: sweep(8900.0), NOISE, 0.012),
        (lambda: sweep(2200.0), NOISE, 0.035),
        (earthquake, NOISE, 0.022),
    ],
    ids=["8.9 kN without noise", "8.9 kN", "2.2 kN", "El Centro"],
)
def test_the_force_error_of_a_rig_that_is_as_configured(command, noise, bound, curve):
    rig = RIG.replace(ADAPTIVE | {"controller.force_loop": "robust", "compensation.curve_correction": curve})
    command = command()
    for seed in (1, 2) if noise else (0,):
        run = eft.simulate(rig.replace(noise | {"truth.sensors.seed": seed}), command)
        assert run.metrics(fft=False)["nrmse"] <= bound


@pytest.mark.parametrize("scheme", [{}, ADAPTIVE], ids=["fixed", "self-calibrating"])
def test_a_null_bias_leaves_no_force(scheme):
    rig = RIG.replace(scheme | {"controller.force_loop": "robust", "truth.servovalve.null_bias": 0.02})
    command = eft.Command(np.zeros(32768), 4096.0)
    run = eft.simulate(rig, command)
    # The force that holds the spool without an integral part, by hand.
    gain = eft.design_force_loop(RIG).coefficients["controller.proportional_gain"]
    without = 0.02 / (gain * RIG["compensation.valve_gain"] * RIG["controller.force_sensitivity"])
    # The specimen still swings a little about zero.
    assert abs(run.force[16384:].mean()) < 1e-3 * without


def test_a_rate_that_is_too_low_is_refused_by_name(tmp_path, capsys):
    with pytest.raises(ValueError, match=r"controller\.force_loop = \"robust\".*controller\.sample_rate"):
        eft.design_force_loop(RIG, 40.0)
    path = tmp_path / "rig.toml"
    path.write_text(RIG.replace({"controller.sample_rate": 40.0}).to_toml(), encoding="utf-8")
    assert main(["design", str(path)]) == 2
    assert "controller.force_loop" in capsys.readouterr().err


def test_the_command_prints_gains_and_margins(tmp_path, capsys):
    path = tmp_path / "rig.toml"
    path.write_text(RIG.to_toml(), encoding="utf-8")
    assert main(["design", str(path)]) == 0
    out = capsys.readouterr().out
    wanted = eft.design_force_loop(RIG).coefficients["controller.proportional_gain"]
    assert f"{wanted:.4g}" in out and "0.8059" in out


@pytest.mark.parametrize("delay", [14, 17])
def test_the_verdict_keeps_the_gains_of_a_loop_that_cannot_be_designed_for_the_true_rig(delay):
    # The verdict on the calibrated rig must have the gains in use, even where the true rig has no design.
    rig = RIG.replace(ADAPTIVE | {"controller.force_loop": "robust", "truth.dac.delay": delay})
    run = eft.simulate(rig, eft.sine_sweep(2200.0, 0.0, 10.0, 1.0, 4096.0))
    assert run.verdict.grade in ("caution", "no")
    with pytest.raises(ValueError, match="robust"):
        rig.plant.replace({"servovalve.flow_gain_scale": 1.0})


def test_the_designed_loop_tolerates_a_flow_gain_that_would_make_the_paper_s_unstable():
    designed = {"controller.force_loop": "robust", "compensation.feedforward": True}
    wrong = RIG.replace(
        designed | {"compensation.look_ahead": True, "truth.servovalve.flow_gain_scale": 1.05}
    )
    run = eft.simulate(wrong, eft.sine_sweep(2200.0, 0.0, 10.0, 32.0, 4096.0))
    assert run.metrics()["nrmse"] == pytest.approx(0.051, abs=0.001)
    level = eft.linear.stability_margins(RIG.replace(designed), sampled=True).level
    assert level == pytest.approx(2.39, abs=0.01)
