"""Studies of buildings: a row a test, on all cores."""

import _thread
import threading
import time

import numpy as np
import pytest

import eft
from eft._table import METRICS
from studies import COMMAND, RIG, rows

STORIES = {"masses": [7e3, 6e3], "dampings": [5e3, 4e3], "stiffnesses": [2.6e6, 2.3e6]}
BUILDING = RIG.replace({"structure.kind": "shear_building", "structure.stories": STORIES})
COMMANDS = eft.Command(np.stack([COMMAND.values * 0.2, COMMAND.values * 0.1]), COMMAND.sample_rate)
LEVELS = {"compensation.level": [0.9, -1.0]}


def test_a_building_has_one_row_with_its_worst_floor():
    study = eft.study(BUILDING, COMMANDS, LEVELS, traces=True)
    run = eft.simulate(BUILDING.replace({"compensation.level": 0.9}), COMMANDS)
    assert study.row(0)["nrmse"] == run.metrics()["nrmse"].max()
    assert study.row(1)["status"] == "refused" and (study.run(0).force == run.force).all()


def test_its_estimates_are_those_of_the_floor_where_they_moved_farthest():
    rig = BUILDING.replace({"compensation.feedforward": True})
    study = eft.study(rig, COMMANDS, {"compensation.adaptive": [True]})
    run = eft.simulate(study.rig(0), COMMANDS)
    row = study.row(0)
    found = run.flow_gain_estimate[:, -1]
    assert found[0] != found[1]
    assert row["flow_gain_estimate"] == pytest.approx(found[np.abs(found - 1).argmax()], rel=1e-12)
    moved = np.abs(run.response_delay_estimate[:, -1] - RIG["compensation.response_delay"])
    expected = run.response_delay_estimate[moved.argmax(), -1]
    assert row["response_delay_estimate"] == pytest.approx(expected, rel=1e-12)


def test_without_transforms_their_columns_are_empty_and_the_others_the_same():
    whole, part = (eft.study(BUILDING, COMMANDS, LEVELS, fft=fft).row(0) for fft in (True, False))
    transforms = {name for name, metric in METRICS.items() if metric.costly}
    assert {name for name in whole if part[name] is None} == transforms | {"error"}
    assert {name: value for name, value in whole.items() if name not in transforms} == {
        name: value for name, value in part.items() if name not in transforms
    }


def test_what_diverged_is_a_row_that_says_so():
    row = eft.study(BUILDING, COMMANDS, [{"actuator.compressibility": 1e-18}]).row(0)
    assert row["status"] == "diverged" and row["nrmse"] > 1e6 and row["max_spool"] > 0.0


def test_a_row_does_not_depend_on_the_tests_beside_it():
    levels = np.linspace(0.8, 0.96, 5).tolist()
    together = rows(eft.study(BUILDING, COMMANDS, {"compensation.level": levels}))
    alone = [
        row | {"index": i}
        for i, level in enumerate(levels)
        for row in rows(eft.study(BUILDING, COMMANDS, {"compensation.level": [level]}))
    ]
    assert together == alone


def test_ctrl_c_stops_all_of_them():
    long = eft.Command(np.tile(COMMANDS.values, 200), COMMANDS.sample_rate)
    timer = threading.Timer(0.5, _thread.interrupt_main)
    timer.start()
    start = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        eft.study(BUILDING, long, {"compensation.level": np.linspace(0.5, 1.0, 100)}, progress=False)
    timer.join()
    assert time.perf_counter() - start < 5.0
