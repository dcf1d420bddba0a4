"""`eft.study`: its rows and their values."""

import itertools
import math

import numpy as np
import pytest

import eft
from studies import COMMAND, GRID, RANGES, RIG, rows


def test_a_grid_has_every_value_with_every_other_and_the_metrics_of_each_run():
    study = eft.study(RIG, COMMAND, GRID)
    expected = list(itertools.product(*GRID.values()))
    assert len(study) == 6 and study.complete and study.parameters == tuple(GRID)
    for number, (row, (mode, scale)) in enumerate(zip(study, expected, strict=True)):
        run = eft.simulate(
            RIG.replace({"compensation.mode": mode, "servovalve.flow_gain_scale": scale}), COMMAND
        )
        assert (row["index"], row["compensation.mode"], row["servovalve.flow_gain_scale"]) == (
            number,
            mode,
            scale,
        )
        assert {name: row[name] for name in run.metrics()} == {
            name: None if math.isnan(value) else value for name, value in run.metrics().items()
        }
        assert (row["status"], row["error"], row["flags"], row["samples"]) == (
            "completed", None, int(run.flags), len(run),
        )  # fmt: skip


def test_the_columns_of_metrics_are_the_metrics_of_a_run():
    study = eft.study(RIG, COMMAND, [{}])
    numbers = [c.name for c in study.columns if c.type == "float"]
    assert numbers == list(eft.simulate(RIG, COMMAND).metrics())
    assert tuple(rows(study)[0]) == tuple(c.name for c in study.columns)


def test_of_rigs_that_adapt_the_last_estimates_are_columns(tmp_path):
    parameters = {"compensation.adaptive": [False, True], "servovalve.flow_gain_scale": [1.05]}
    rig = RIG.replace({"compensation.feedforward": True})
    names = ["flow_gain_estimate", "response_delay_estimate", "valve_gain_estimate", "level"]
    command = eft.sine_sweep(8900.0, 0.5, 4.0, 4.0, 1024.0)
    for output in (None, tmp_path / "a.study"):
        study = eft.study(rig, command, parameters, output=output)
        fixed, adaptive = study
        assert [fixed[name] for name in names] == [None] * 4
        run = eft.simulate(study.rig(1), command)
        assert [adaptive[name] for name in names] == [getattr(run, name)[-1] for name in names]
        assert 1.02 < adaptive["flow_gain_estimate"] < 1.08
        assert [c.name for c in study.columns if c.name in names] == names


def test_several_commands_and_their_scale_are_axes_too():
    half = eft.Command(COMMAND.values * 0.5, COMMAND.sample_rate)
    study = eft.study(RIG, {"whole": COMMAND, "half": half}, {"command.scale": [1.0, 0.5]})
    assert [(r["command"], r["command.scale"]) for r in study] == [
        ("whole", 1.0), ("whole", 0.5), ("half", 1.0), ("half", 0.5),
    ]  # fmt: skip
    by_scale, by_name = study.row(1), study.row(2)
    assert by_scale["nrmse"] == by_name["nrmse"] != study.row(0)["nrmse"]


def test_a_scaled_command_keeps_its_ground_motion():
    record = eft.Record(np.sin(np.arange(100) / 8), 0.02, "tone")
    command = eft.effective_force(record, mass=6000.0, sample_rate=1024.0)
    study = eft.study(RIG, command, {"command.scale": [1.0, 0.5]}, traces=True)
    # The rig's structure has another mass, of which the verdict warns.
    assert study["verdict"].tolist() == ["caution", "caution"]
    run = study.run(1)
    assert (run.record, run.scale, run.mass) == ("tone", 0.5, 6000.0)


@pytest.mark.filterwarnings("error")
def test_a_scale_that_is_no_number_is_refused_by_its_name():
    study = eft.study(RIG, COMMAND, {"command.scale": [math.inf, math.nan, 1.0]})
    assert study["status"].tolist() == ["refused", "refused", "completed"]
    assert study["error"][0] == "command.scale = inf: must be finite"


def test_a_list_fills_in_what_a_combination_does_not_name():
    study = eft.study(RIG, COMMAND, [{"structure.damping": 5000}, {"compensation.level": np.float64(0.9)}])
    assert list(study["structure.damping"]) == [5000.0, RIG["structure.damping"]]
    assert list(study["compensation.level"]) == [RIG["compensation.level"], 0.9]
    assert study.rig(1) == RIG.replace({"compensation.level": 0.9})


def test_a_latin_hypercube_visits_every_part_once():
    study = eft.study(RIG, COMMAND, eft.studies.LatinHypercube(RANGES, n=8, seed=3))
    parts = np.floor((study["servovalve.flow_gain_scale"] - 0.9) / 0.2 * 8).astype(int)
    assert sorted(parts) == list(range(8))
    logs = np.floor((np.log10(study["actuator.leakage"]) + 13) / 2 * 8).astype(int)
    assert sorted(logs) == list(range(8))
    assert sorted(study["compensation.mode"]) == ["linear"] * 4 + ["nonlinear"] * 4
    again = eft.study(RIG, COMMAND, eft.studies.LatinHypercube(RANGES, n=8, seed=3))
    other = eft.study(RIG, COMMAND, eft.studies.LatinHypercube(RANGES, n=8, seed=4))
    assert rows(again) == rows(study) != rows(other)


def test_sobol_points_are_those_of_scipy():
    from scipy.stats import qmc

    study = eft.study(RIG, COMMAND, eft.studies.Sobol({"structure.damping": (1e3, 9e3)}, n=4, seed=5))
    points = qmc.Sobol(1, seed=np.random.default_rng(5)).random(4)[:, 0]
    assert study["structure.damping"] == pytest.approx(1e3 + 8e3 * points, rel=1e-15)


def test_a_combination_that_fails_is_a_row_with_its_reason_and_loses_no_other():
    study = eft.study(
        RIG,
        COMMAND,
        {"structure.mass": [7040.0, -1.0], "actuator.stroke": [RIG["actuator.stroke"], 1e-3]},
    )
    assert [row["status"] for row in study] == ["completed", "stroke_exceeded", "refused", "refused"]
    assert "structure.mass = -1" in study.row(2)["error"]
    assert "left its stroke" in study.row(1)["error"] and study.row(1)["nrmse"] > 0
    assert study.row(2)["nrmse"] is None and np.isnan(study["nrmse"][2])
    assert study.count() == {"completed": 1, "refused": 2, "stroke_exceeded": 1}


def test_a_tripped_test_has_the_metrics_of_all_its_samples():
    levels = {"protection.enabled": True, "protection.displacement_trip": 1e-4}
    study = eft.study(RIG.replace(levels), COMMAND, {"compensation.level": [1.0]}, traces=True)
    row, run = study.row(0), study.run(0)
    assert (row["status"], row["samples"]) == ("tripped", len(COMMAND))
    part = run.to_its_end().metrics()
    assert row["nrmse"] == pytest.approx(run.metrics().nrmse) and row["nrmse"] > 2.0 * part.nrmse


def test_a_diverged_test_says_so():
    study = eft.study(RIG, COMMAND, {"compensation.level": [1.0, 3.0], "structure.damping": [0.0]})
    words = set(study["status"])
    assert words <= {"completed", "diverged", "stroke_exceeded"} and study.row(1)["status"] != "completed"


def test_values_may_have_their_unit():
    curve = "servovalve.flow_table.flows"
    flows = RIG[curve]
    texts = [f"{flow * 6e4!r} L/min" for flow in flows]
    study = eft.study(RIG, COMMAND, {"truth.structure.mass": ["7 t", 7000.0], curve: [texts, flows]})
    assert study["truth.structure.mass"].tolist() == [7000.0] * 4
    assert study["nrmse"] == pytest.approx(np.full(4, study["nrmse"][3]), rel=1e-9)
    drawn = eft.studies.LatinHypercube(
        {"structure.mass": ("7 t", "8 t", "log"), "truth.structure.damping": ["4 kN*s/m"]}, n=8
    )
    masses = [drawn.combinations(RIG)[i]["structure.mass"] for i in range(8)]
    assert 7000.0 < min(masses) < 7200.0 < 7800.0 < max(masses) < 8000.0
    assert drawn.combinations(RIG)[0]["truth.structure.damping"] == pytest.approx(4000.0)


SIGNALS = ("force", "velocity", "displacement", "spool", "supply_pressure")
MANY = {f"sensors.{signal}.bits": range(1, 33) for signal in SIGNALS} | {"structure.mass": range(1, 33)}


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"structure.mas": [1.0]}, ["structure.mas", "`structure.mass`"]),
        ({"command.scal": [1.0]}, ["command.scal", "`command.scale`"]),
        ({"structure": [{}]}, ["`structure` is a section", "structure."]),
        ({"structure.mass": []}, ["structure.mass", "empty"]),
        ({"structure.mass": 7040.0}, ["structure.mass", "list of values"]),
        ({"structure.mass": ["heavy"]}, ["structure.mass'][0] = 'heavy'", "number"]),
        ({"structure.mass": ["7 kN"]}, ["structure.mass'][0] = '7 kN'", "kg", "lb"]),
        ({"structure.mass": [True]}, ["structure.mass'][0] = True", "number"]),
        ({"controller.sample_rate": [2048.0]}, ["controller.sample_rate", "the sample rate of its command"]),
        ([{"controller.sample_rate": 2048.0}], ["controller.sample_rate", "the sample rate of its command"]),
        ({"compensation.mode": [1]}, ["compensation.mode", "string"]),
        ({"sensors.seed": [1.5]}, ["sensors.seed", "1.5", "whole number"]),
        ({"sensors.seed": [0, 2**63]}, ["sensors.seed'][1] = 9223372036854775808", "64 bits"]),
        ({"structure.mass": [10**400]}, ["structure.mass", "64 bits"]),
        ({3: [1.0]}, ["3", "string"]),
        ([], ["empty"]),
        ([1], ["parameters[0] = 1", "mapping"]),
        ("structure.mass", ["'structure.mass'", "sampler"]),
        (MANY, ["1073741824 combinations", "at most"]),
    ],
)
def test_what_is_wrong_with_all_is_said_before_anything_runs(parameters, words):
    with pytest.raises(ValueError, match=r".") as caught:
        eft.study(RIG, COMMAND, parameters)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: eft.studies.Sobol({"structure.mass": (1, 2)}, n=100), ["n = 100", "64 or 128"]),
        (lambda: eft.studies.LatinHypercube({}, n=3), ["ranges"]),
        (
            lambda: eft.studies.LatinHypercube({"structure.mass": (1, 2)}, n=0),
            ["n = 0", "whole number from 1"],
        ),
        (lambda: eft.studies.LatinHypercube({"structure.mass": (1, 2)}, n=3, seed=-1), ["seed = -1"]),
        (lambda: eft.studies.LatinHypercube({"structure.mass": (2, 1)}, n=3), ["structure.mass", "below"]),
        (lambda: eft.studies.LatinHypercube({"structure.mass": (0, 1, "log")}, n=3), ["above zero"]),
        (lambda: eft.studies.LatinHypercube({"structure.mass": (0, 1, "lin")}, n=3), ['"log"']),
        (
            lambda: eft.studies.LatinHypercube({"compensation.mode": (0, 1)}, n=3),
            ["compensation.mode", "choices"],
        ),
        (lambda: eft.studies.LatinHypercube({"sensors.seed": (0, 9)}, n=3), ["sensors.seed", "choices"]),
    ],
)
def test_samplers_refuse_what_they_cannot_draw(make, words):
    with pytest.raises(ValueError, match=r".") as caught:
        eft.study(RIG, COMMAND, make())
    for word in words:
        assert word in str(caught.value)


def test_traces_are_kept_on_request_only(tmp_path):
    grid = {"compensation.level": [0.9, 1.0], "structure.mass": [7040.0, -1.0]}
    expected = eft.simulate(RIG.replace({"compensation.level": 1.0}), COMMAND).force
    for output in (None, tmp_path / "kept"):
        kept = eft.study(RIG, COMMAND, grid, traces=True, output=output)
        assert (kept.run(2).force == expected).all()
        with pytest.raises(ValueError, match=r"structure\.mass"):
            kept.run(1)
    assert len(list((tmp_path / "kept" / "_traces").iterdir())) == 2
    with pytest.raises(ValueError, match="traces=True"):
        eft.study(RIG, COMMAND, grid).run(0)


def test_progress_counts_up_to_the_total():
    seen = []
    eft.study(RIG, COMMAND, GRID, chunk=4, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(4, 6), (6, 6)]


def test_the_repr_tells_how_it_went():
    assert repr(eft.study(RIG, COMMAND, GRID)) == (
        "<eft.Study over compensation.mode, servovalve.flow_gain_scale: 6 completed>"
    )
