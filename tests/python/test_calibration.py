"""A saved calibration: from a run, through a file, into the next test."""

import dataclasses
import json
import pickle
import tomllib
import typing
from pathlib import Path

import numpy as np
import pytest

import eft
from eft import _sections
from eft.cli import main

ON = {"compensation.adaptive": True, "compensation.feedforward": True, "compensation.curve_correction": True}
TRUTH = {
    "truth.servovalve.flow_gain_scale": 0.93,
    "sensors.velocity.noise": 5e-4,
    "sensors.spool.noise": 5e-4,
}
SWEEP = eft.sine_sweep(4000.0, 0.0, 10.0, 8.0, 4096.0)


@pytest.fixture(scope="module")
def rig() -> eft.Rig:
    return eft.Rig.zhao2005().replace(ON | TRUTH)


@pytest.fixture(scope="module")
def run(rig: eft.Rig) -> eft.TestRun:
    return eft.simulate(rig, SWEEP)


def test_the_saved_values_are_those_of_the_traces(run: eft.TestRun) -> None:
    kept = run.calibration
    assert kept is not None
    assert isinstance(kept, eft.Calibration) and kept["version"] == kept.version == 4
    assert kept.evidence.time == kept["evidence"]["time"] > 0.0 and len(kept.curve.departures) == 17
    assert {**kept} == kept == pickle.loads(pickle.dumps(kept)) and dict(kept)["flow_gain"] == kept.flow_gain
    with pytest.raises(dataclasses.FrozenInstanceError):
        kept.flow_gain = 1.0  # type: ignore[misc]
    with pytest.raises(KeyError):
        kept["flow_gian"]
    for name in ("flow_gain", "valve_gain", "response_delay", "velocity_delay", "null_offset"):
        # The saved calibration is of the window after the one in use, and differs little.
        now, deviation = (run._values[f"{name}_{what}"][-1] for what in ("estimate", "deviation"))
        assert abs(kept[name] - now) < max(deviation, 1e-12), name
    assert kept["greatest_flow"] == pytest.approx(max(map(abs, run.rig["servovalve.flow_table.flows"])))


@pytest.mark.parametrize("dtype", ["f64", "f32"])
def test_the_next_test_starts_from_it(rig: eft.Rig, run: eft.TestRun, dtype: str) -> None:
    again = eft.simulate(rig, SWEEP, dtype, calibration=run.calibration)  # type: ignore[arg-type]
    assert again.flow_gain_estimate[0] == pytest.approx(run.calibration["flow_gain"], rel=1e-7)
    assert np.abs(again.flow_gain_estimate - 0.93).max() < 0.005
    assert np.abs(run.flow_gain_estimate[:2000] - 0.93).max() > 0.06
    for name in ("flow_gain", "valve_gain", "response_delay", "velocity_delay", "null_offset"):
        # It is of the window after the one whose estimates were in use.
        before, after = run._values[f"{name}_deviation"][-1], again._values[f"{name}_deviation"][0]
        assert after == pytest.approx(before, rel=0.05), name
    assert again.rig["calibration"] == run.calibration
    study = eft.study(again.rig, SWEEP, {"compensation.level": [1.0] * 3})
    assert study["nrmse"][2] == pytest.approx(again.metrics()["nrmse"], rel=1e-3)


@pytest.mark.parametrize("dtype", ["f64", "f32"])
def test_a_restart_of_a_small_fast_rig_keeps_the_motion(dtype: str) -> None:
    # Most of the response delay's deviation is systematic, so it does not show the motion's frequency.
    rig = eft.data_sheets.rig(
        {
            "structure": {"mass": "500 kg", "frequency": "5 Hz", "damping_ratio": "2 %"},
            "actuator": {"force": "25 kN", "stroke": "250 mm"},
            "servovalve": {"rated_flow": "10 gpm", "rated_drop": "1000 psi", "phase_90_frequency": "100 Hz"},
            "supply": {
                "pressure": "3000 psi",
                "pump_flow": "60 gpm",
                "accumulator_volume": "20 gal",
                "precharge": "1500 psi",
            },
        }
    ).replace(ON | {"truth.sensors.velocity.delay": 6, "truth.servovalve.flow_gain_scale": 1.05})
    run = eft.simulate(rig, eft.sine_sweep(1400.0, 0.0, 6.0, 12.0, 4096.0), dtype)  # type: ignore[arg-type]
    # Two windows, in which nothing is learned.
    rest = eft.Command(np.zeros(32), 4096.0)
    again = eft.simulate(rig, rest, dtype, calibration=run.calibration)  # type: ignore[arg-type]
    before, after = run.calibration.evidence, again.calibration.evidence
    assert before.mean_square_frequency > (2 * np.pi * 4.0) ** 2 and run.calibration.excitation > 1e-4
    for name, value in before.items():
        if name != "distances":
            assert after[name] == pytest.approx(value, rel=1e-5), name
    for name in ("flow_gain", "valve_gain", "response_delay", "velocity_delay", "null_offset"):
        assert again.calibration[name] == pytest.approx(run.calibration[name], rel=1e-5, abs=1e-9), name


def test_a_chain_of_small_tests_keeps_the_flow_gain(rig: eft.Rig) -> None:
    # The departures' share of the flow gain would grow if a restart forgot how much of it they have.
    truth = {"truth.servovalve.flow_gain_scale": 1.05}
    reach = {"force": 150e3, "displacement": 0.127, "velocity": 1.0, "spool": 1.0}
    truth |= {f"sensors.{name}.noise": 5e-4 * most for name, most in reach.items()}
    kept, shares = None, []
    for seed in range(8):
        test = rig.replace(truth | {"sensors.seed": seed, "calibration": kept})
        kept = eft.simulate(test, eft.sine_sweep(2200.0, 0.0, 10.0, 8.0, 4096.0)).calibration
        assert kept is not None
        shares.append(kept.curve.flow_gain_share)
        assert kept.flow_gain == pytest.approx(1.05, abs=1.5e-3), seed
    assert abs(shares[-1] - shares[0]) < 1e-3, shares


@pytest.mark.parametrize(
    "loop",
    [
        {"controller.realization": "analog"},
        {"controller.realization": "digital"},
        {
            "controller.realization": "digital",
            "controller.force_loop": "robust",
            "compensation.look_ahead": True,
        },
    ],
)
def test_the_valve_starts_at_the_saved_null(loop: dict[str, object]) -> None:
    rig = eft.Rig.zhao2005().replace(ON | TRUTH | loop | {"truth.servovalve.null_bias": 0.02})
    run = eft.simulate(rig, SWEEP)
    again = eft.simulate(rig, SWEEP, calibration=run.calibration)
    early = [np.abs(test.force - test.command)[:400].max() for test in (run, again)]
    # An open valve of 2 % loads the oil to 10 kN.
    assert early[0] > 9000.0 and early[1] < 300.0, early
    errors = [test.metrics()["displacement_error"] for test in (run, again)]
    assert errors[1] < 0.05 * errors[0], errors


def test_a_biased_displacement_starts_an_estimate_without_a_jump() -> None:
    rig = eft.Rig.zhao2005().replace({"controller.velocity_source": "derivative"})
    sound, biased = (eft.simulate(rig.replace({"sensors.displacement.bias": b}), SWEEP) for b in (0.0, 0.02))
    assert np.abs(biased.force - sound.force).max() < 1e-6


def test_it_survives_files_and_a_rig_of_toml(run: eft.TestRun, tmp_path: Path) -> None:
    assert eft.TestRun.load(run.save(tmp_path / "run.eft")).calibration == run.calibration
    started = run.rig.replace({"calibration": run.calibration})
    assert eft.Rig(started.to_toml()) == started
    assert eft.replay(run.rig, run).calibration is not None


def test_it_is_refused_where_it_does_not_belong(rig: eft.Rig, run: eft.TestRun) -> None:
    kept = run.calibration
    assert kept is not None
    wrong = {
        "calibration.flow_gain": kept | {"flow_gain": 1.5},
        r"calibration.greatest_flow = 0.010000: must be 0.008787 m³/s, the greatest flow of the flow table, "
        r"as compensation.mode is not \"linear\"; leave out the calibration of another table or mode": kept
        | {"greatest_flow": 0.01},
        "calibration.version = 3: must be 4: repeat the test": kept | {"version": 3},
        r"calibration.evidence.distances.flow_gain": kept
        | {"evidence": kept.evidence | {"distances": kept.evidence.distances | {"flow_gain": 2e6}}},
        "calibration.curve.departures = 0.1: must lie in": kept
        | {"curve": kept["curve"] | {"departures": [0.1] + 16 * [0.0]}},
        "unknown key `calibration.deviations": kept | {"deviations": {"flow_gain": 1e-3}},
        "missing key `calibration.": {"flow_gain": 1.0},
    }
    for name, calibration in wrong.items():
        with pytest.raises(ValueError, match=name):
            eft.simulate(rig, SWEEP, calibration=calibration)
    linear = rig.replace({"compensation.mode": "linear"})
    with pytest.raises(
        ValueError,
        match=r"0.008787: must be 0.016400 m³/s, compensation.flow_gain, as compensation.mode is \"linear\"; "
        r"leave out the calibration of another flow gain or mode",
    ):
        eft.simulate(linear, SWEEP, calibration=kept)
    # The corrected table differs from that of the calibration.
    started = eft.simulate(rig, SWEEP, calibration=kept)
    assert started.corrected_rig()["calibration"] is None
    assert eft.simulate(eft.Rig.zhao2005(), SWEEP).calibration is None


def test_each_floor_of_a_building_has_its_own(rig: eft.Rig) -> None:
    stories = {"masses": [7040.0] * 2, "dampings": [5.6e3] * 2, "stiffnesses": [2.8e6] * 2}
    building = rig.replace({"structure.kind": "shear_building", "structure.stories": stories})
    values = np.vstack([SWEEP.values, 0.5 * SWEEP.values])[:, : 2 * 4096]
    run = eft.simulate(building, eft.Command(values, 4096.0))
    with pytest.raises(ValueError, match="a run of 2 actuators has one calibration for each"):
        _ = run.calibration
    floors = [run.actuator(i).calibration for i in range(2)]
    assert floors[0] is not None
    assert floors[0] != floors[1]
    assert run.calibrations == tuple(floors)


def test_each_floor_of_a_building_starts_from_its_own(
    rig: eft.Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stories = {"masses": [7040.0] * 2, "dampings": [5.6e3] * 2, "stiffnesses": [2.8e6] * 2}
    building = rig.replace({"structure.kind": "shear_building", "structure.stories": stories})
    command = eft.Command(np.vstack([SWEEP.values, 0.5 * SWEEP.values])[:, : 2 * 4096], 4096.0)
    first = eft.simulate(building, command)
    moved = [dict(one) | {"null_offset": 0.01 - 0.03 * i} for i, one in enumerate(first.calibrations)]
    again = eft.simulate(building, command, calibration=moved)
    for i, kept in enumerate(moved):
        floor = again.actuator(i)
        assert floor.flow_gain_estimate[0] == pytest.approx(kept["flow_gain"], rel=1e-9)
        # The null is learned with the curve, and the spool rests there.
        assert floor.spool[0] == pytest.approx(kept["null_offset"], rel=1e-2)
    assert again.rig["calibration"] == moved
    (tmp_path / "again.toml").write_text(again.rig.to_toml())
    assert eft.Rig.from_toml(tmp_path / "again.toml") == again.rig
    assert eft.TestRun.load(again.save(tmp_path / "run.eft")).rig == again.rig
    repeated = eft.simulate(again.rig, command)
    np.testing.assert_array_equal(repeated.force, again.force)
    one = eft.replay(again.rig, again.actuator(1))
    alone = eft.replay(building.replace({"calibration": moved[1]}), again.actuator(1))
    np.testing.assert_array_equal(one.flow_gain_estimate, alone.flow_gain_estimate)
    with pytest.raises(
        ValueError, match=r"^calibration = a list of 1: must be one section for all actuators"
    ):
        eft.simulate(building, command, calibration=moved[:1])
    # A floor that learned nothing has None, and starts anew.
    mixed = eft.simulate(building, command, calibration=[None, moved[1]])
    np.testing.assert_array_equal(mixed.flow_gain_estimate[:, 0], [1.0, again.flow_gain_estimate[1, 0]])
    anew = eft.simulate(building, command, calibration=[None, None])
    np.testing.assert_array_equal(anew.force, first.force)
    with pytest.raises(ValueError, match=r"^calibration\[1\] = 3"):
        eft.simulate(building, command, calibration=[moved[0], 3])
    with pytest.raises(
        ValueError, match=r"^calibration = 2 calibrations: must be one for a single controller"
    ):
        eft.Controller(again.rig)

    monkeypatch.chdir(tmp_path)
    Path("building.toml").write_text(building.to_toml())
    ground = [f"{i / 100},{np.sin(i / 8.0):.6f}" for i in range(400)]
    Path("short.csv").write_text("\n".join(["time (s),acceleration (m/s²)", *ground]))
    test = [
        "run",
        "--rig",
        "building.toml",
        "--record",
        "short.csv",
        "--scale",
        "0.2",
        "-o",
        "one.eft",
        "--json",
    ]
    assert main([*test, "--save-calibration", "first.toml"]) == 0
    kept = tomllib.loads(Path("first.toml").read_text())
    assert list(kept) == ["calibration"] and len(kept["calibration"]) == 2
    assert kept["calibration"] == list(eft.TestRun.load("one.eft").calibrations)
    assert main([*test, "--calibration", "first.toml"]) == 0
    assert eft.TestRun.load("one.eft").rig["calibration"] == kept["calibration"]


def test_the_command_line_saves_it_and_starts_from_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    sets = [f"--set={key}={str(value).lower()}" for key, value in (ON | TRUTH).items()]
    test = ["run", "--sweep", "4000", "0", "10", "8", *sets, "-o", "test.eft", "--json"]
    assert main([*test, "--save-calibration", "first.toml"]) == 0
    assert json.loads(capsys.readouterr().out)["saved_calibration"] == "first.toml"
    kept = Path("first.toml").read_text()
    assert list(tomllib.loads(kept)) == ["calibration"]
    deviation = eft.TestRun.load("test.eft").response_delay_deviation[-1]
    assert f"# response_delay {deviation:.2g} s\n" in kept
    assert main([*test, "--calibration", "first.toml", "--save-calibration", "second.toml"]) == 0
    assert np.abs(eft.TestRun.load("test.eft").flow_gain_estimate[32:] - 0.93).max() < 0.005
    Path("rig.toml").write_text(eft.Rig.zhao2005().to_toml())
    Path("broken.toml").write_text("[calibration\n")
    capsys.readouterr()
    for options, message in (
        (["--save-calibration", "test.eft"], "must be another file"),
        (["--set=compensation.adaptive=false", "--calibration", "first.toml"], "nothing is learned"),
        (["--calibration", "rig.toml"], "section [calibration], or one for each floor, and nothing else"),
        (["--calibration", "broken.toml"], "broken.toml, line 1, column 13: unclosed table"),
    ):
        assert main([*test, *options]) != 0
        assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("names", "section"),
    [
        (_sections.EstimateName, eft.CalibrationDistances),
        (_sections.EvidenceName, eft.CalibrationEvidence),
        (_sections.CurveName, eft.CurveCorrection),
        (_sections.CalibrationName, eft.Calibration),
        (_sections.RigKeyName, eft.RigKey),
    ],
)
def test_a_type_checker_knows_the_names_of_a_section(names, section):
    assert set(typing.get_args(names)) == {field.name for field in dataclasses.fields(section)}


def test_an_external_controller_starts_from_its_own_calibration(rig: eft.Rig, run: eft.TestRun) -> None:
    started = rig.replace({"calibration": run.calibration, "controller.realization": "digital"})
    with pytest.raises(ValueError, match="calibration: must be left out with an external controller"):
        eft.simulate(started, SWEEP, controller=eft.Controller(started))
