"""The benchmark: every controller gets a row, a failing one does not end it, equal seeds give equal rows."""

import json
import math
import sys
import tomllib
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import numpy as np
import pytest

import eft
from eft.benchmark import _loop_shaping
from eft.cli._main import main

CASES = {case.name: case for case in eft.benchmark.named_cases()}
NOMINAL = [CASES["nominal"]]
SWEEP = [eft.benchmark.Excitation("sweep 2.2 kN", scale=2200.0)]

MINE = """
class Mine:
    def __init__(self, rig, sample_rate):
        self.gain = 2e-5
    def step(self, command, velocity, force, spool, **_):
        return self.gain * (command - force)
"""


def judged(*controllers, cases=NOMINAL):
    return eft.benchmark.run(controllers, on=cases, under=SWEEP).rows


@pytest.fixture
def mine(tmp_path, monkeypatch):
    (tmp_path / "my_package.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.modules.pop("my_package", None)


def test_a_controller_of_five_lines_gets_a_row(mine, capsys):
    arguments = ["benchmark", "--short", "--controller", "my_package:Mine", "--controller", "pd"]
    assert main([*arguments, "-o", "found.csv"]) == 0
    lines = capsys.readouterr().out.splitlines()
    row = next(line for line in lines if line.startswith("my_package:Mine"))
    assert "0 of 10" in row
    found = eft.benchmark.Benchmark.load("found.csv")
    assert {row.controller for row in found.rows} == {"my_package:Mine", "pd"}
    rows = [row for row in found.rows if row.controller == "my_package:Mine"]
    # Without compensation the specimen's motion takes most of the force at its resonance.
    assert len(rows) == 10 and all(0.3 < row.nrmse < 1.0 for row in rows)
    assert sorted(path.name for path in mine.iterdir() if path.suffix) == ["found.csv", "my_package.py"]


INTERRUPTED = """
import signal

class Mine:
    made = 0
    def __init__(self, rig, sample_rate):
        Mine.made += 1
    def step(self, command, velocity, force, spool, **_):
        if self.made == 3 and command > 1000.0:
            signal.raise_signal(signal.SIGINT)
        return 2e-5 * (command - force)
"""


def test_an_interrupt_keeps_the_rows_of_the_tests_that_are_done(mine, capsys):
    (mine / "my_package.py").write_text(INTERRUPTED)
    arguments = ["benchmark", "--short", "--controller", "my_package:Mine", "-o", "rows.csv"]
    assert main(arguments) == 130
    said = capsys.readouterr()
    assert said.err.split("\n\n") == ["2 of 10 tests are kept in rows.csv", "eft benchmark: interrupted\n"]
    assert not said.out
    kept = eft.benchmark.Benchmark.load("rows.csv").rows
    assert [row.test for row in kept] == ["sweep 8.9 kN", "El Centro"]
    assert all(row.case == "nominal" and not row.lost for row in kept)
    assert sorted(path.name for path in mine.iterdir() if path.suffix) == ["my_package.py", "rows.csv"]


def test_an_interrupt_in_the_first_test_changes_no_file(mine, capsys):
    (mine / "my_package.py").write_text(INTERRUPTED.replace("== 3", "== 1"))
    (mine / "rows.csv").write_text("mine")
    assert main(["benchmark", "--short", "--controller", "my_package:Mine", "-o", "rows.csv"]) == 130
    assert "kept" not in capsys.readouterr().err and (mine / "rows.csv").read_text() == "mine"


def test_an_exception_of_the_callback_keeps_the_rows_too(tmp_path):
    def ends(done, total):
        if done == 1:
            raise TimeoutError

    with pytest.raises(TimeoutError):
        eft.benchmark.run(
            ["pd", "fixed"], on=NOMINAL, under=SWEEP, progress=ends, output=tmp_path / "rows.csv"
        )
    [row] = eft.benchmark.Benchmark.load(tmp_path / "rows.csv").rows
    assert row.controller == "pd"


def test_rows_have_a_file_in_a_folder_that_exists(tmp_path):
    found = eft.benchmark.run(["pd"], on=NOMINAL, under=SWEEP, output=tmp_path / "rows.csv")
    assert (tmp_path / "rows.csv").read_bytes() == found.save(tmp_path / "again.csv").read_bytes()
    with pytest.raises(FileNotFoundError, match="no such folder"):
        eft.benchmark.run(["pd"], on=NOMINAL, under=SWEEP, output=tmp_path / "none" / "rows.csv")


class Answers:
    def __init__(self, rig, sample_rate):
        del rig, sample_rate

    def step(self, command, velocity, force, spool, **_):
        return self.answer(command - force)


class Nan(Answers):
    def answer(self, error):
        return math.nan if error > 100.0 else 2e-5 * error


class Raises(Answers):
    def answer(self, error):
        raise ZeroDivisionError("in the\nmiddle")


class WrongShape(Answers):
    def answer(self, error):
        return np.array([error, error])


class Unstable(Answers):
    def answer(self, error):
        return -1e-3 * error


class NoStep:
    def __init__(self, rig, sample_rate):
        del rig, sample_rate


class NeverMade:
    def __init__(self, rig):
        del rig


@pytest.mark.parametrize(
    ("controller", "says"),
    [
        (Nan, "ValueError: controller.step = NaN: must return a finite number of single precision, in V"),
        (Raises, "ZeroDivisionError: in the middle"),
        (WrongShape, "ValueError: controller.step = an object of type ndarray: must return one number, in V"),
        (NoStep, "ValueError: controller = 'NoStep': must have a method step"),
        (NeverMade, "TypeError: NeverMade.__init__() got an unexpected keyword argument 'sample_rate'"),
    ],
)
def test_a_controller_that_fails_loses_its_test_in_one_sentence(controller, says):
    lost, kept = judged(controller, "fixed")
    assert lost.lost == says and math.isnan(lost.nrmse)
    assert not kept.lost and kept.nrmse < 0.2


def test_an_unstable_controller_loses_its_test_and_ranks_last():
    found = eft.benchmark.run([Unstable, "fixed"], on=NOMINAL, under=SWEEP)
    assert found.rows[0].lost.startswith(("unstable", "the piston left", "the simulated state"))
    best, worst = found.summary()
    assert (best.controller, worst.controller) == ("fixed", "Unstable")
    assert worst.lost == 1 and worst.nrmse == math.inf and worst.within_band == 0.0
    with pytest.raises(FrozenInstanceError):
        best.lost = 0


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (
            "nobody",
            r"^controller = 'nobody': must be package:Class, an entry point of eft.controllers, or one",
        ),
        ("no_such:Thing", r"^controller = 'no_such:Thing': cannot be imported: ModuleNotFoundError"),
        ("math:nothing", r"^controller = 'math:nothing': cannot be imported: AttributeError"),
        ("math:pi", r"^controller = 'math:pi': must be a class that is made as Class"),
    ],
)
def test_a_missing_controller_is_an_error_of_one_sentence(asked, says, capsys):
    with pytest.raises(ValueError, match=says):
        eft.benchmark.run([asked])
    assert main(["benchmark", "--controller", asked]) == 2
    assert capsys.readouterr().err.startswith("eft benchmark: controller = ")


def test_controllers_are_distinguished_by_their_names():
    """The same class twice is one controller. Another class of the same name, or no class, is refused."""
    again = type("Unstable", (Nan,), {})
    assert len(eft.benchmark.run(["pd", "pd"], on=NOMINAL, under=SWEEP).rows) == 1
    with pytest.raises(ValueError, match=r"^controller = 'Unstable': two controllers have this name"):
        eft.benchmark.run([Unstable, again], on=NOMINAL, under=SWEEP)
    with pytest.raises(ValueError, match=r"^controllers = none: must be at least one"):
        eft.benchmark.run([], on=NOMINAL, under=SWEEP)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"controllers": "pd"}, r"^controllers = 'pd': must be a list of names or classes"),
        ({"controllers": Unstable}, r"^controllers = 'Unstable': must be a list"),
        ({"on": [eft.Rig.zhao2005()]}, r"^on = \[.*\]: must be a list of at least one eft.benchmark.Case"),
        ({"on": []}, r"^on = \[\]: must be a list of at least one"),
        ({"under": "sweep"}, r"^under = 'sweep': must be a list of at least one eft.benchmark.Excitation"),
    ],
)
def test_other_than_a_list_of_its_kind_is_refused(given, says):
    with pytest.raises(ValueError, match=says):
        eft.benchmark.run(**{"controllers": ["pd"], "on": NOMINAL, "under": SWEEP} | given)


def test_a_controller_that_loses_every_test_has_no_numbers(mine, capsys):
    (mine / "my_package.py").write_text("class Mine:\n    pass\n", encoding="utf-8")
    assert main(["benchmark", "--short", "--controller", "my_package:Mine"]) == 0
    out = capsys.readouterr().out
    assert "10 of 10" in out and "nan" not in out


def test_an_entry_point_is_found(monkeypatch):
    class Entry:
        @staticmethod
        def load():
            return Nan

    monkeypatch.setattr(
        "importlib.metadata.entry_points", lambda **asked: [Entry] if asked["name"] == "theirs" else []
    )
    [row] = judged("theirs")
    assert row.controller == "theirs" and row.lost.startswith("ValueError: controller.step = NaN")


def test_the_same_seeds_give_the_same_table(tmp_path):
    def once():
        return eft.benchmark.run(["robust-curve"], on=eft.benchmark.drawn_cases(1, seed=3), under=SWEEP)

    first, second = once(), once()
    assert first == second
    kept = eft.benchmark.Benchmark.load(first.save(tmp_path / "rows.csv"))
    assert [row.case for row in kept.rows] == [row.case for row in first.rows]
    np.testing.assert_allclose([row.nrmse for row in kept.rows], [row.nrmse for row in first.rows], rtol=1e-4)
    assert eft.benchmark.drawn_cases(2, seed=3)[0] == eft.benchmark.drawn_cases(1, seed=3)[0]
    assert eft.benchmark.drawn_cases(1, seed=4)[0].drawn != eft.benchmark.drawn_cases(1, seed=3)[0].drawn
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match="not a benchmark saved by eft"):
        eft.benchmark.Benchmark.load(wrong)


def test_rows_keep_what_a_controller_called_them(tmp_path):
    row = eft.benchmark.Row("a, b", 'oil "stiff"', "sweep", "raised: no, never")
    [back] = eft.benchmark.Benchmark.load(eft.benchmark.Benchmark((row,)).save(tmp_path / "rows.csv")).rows
    assert [getattr(back, field.name) for field in fields(row)][:4] == [
        row.controller,
        row.case,
        row.test,
        row.lost,
    ]


def test_a_controller_gets_no_true_values():
    seen = []

    class Looks(Raises):
        def __init__(self, rig, sample_rate):
            seen.append((rig, sample_rate))

    judged(Looks, cases=[CASES["oil 1.5 times as stiff"]])
    [(rig, rate)] = seen
    assert rig["actuator.compressibility"] == rig.plant["actuator.compressibility"]
    assert rig.plant["sensors.force.noise"] == 0.0 and rate == 4096.0


def test_every_case_is_a_rig_and_every_command_is_within_it():
    assert 12 <= len(CASES) <= 20 and len({case.changes.__str__() for case in CASES.values()}) == len(CASES)
    for case in eft.benchmark.drawn_cases(3, seed=5):
        known = case.rig.replace({"truth": None})
        for excitation in eft.benchmark.excitations():
            demands = eft.check_feasibility(known, excitation.command(known)).demands
            assert all(demand.required <= demand.advised for demand in demands)


def test_the_instructions_are_the_budgets_of_the_ticks():
    text = (Path(__file__).parents[2] / "firmware" / "budgets.toml").read_text(encoding="utf-8")
    ticks = {
        "nonlinear": "paper_tick",
        "analog": "paper_tick",
        "adaptive": "self_calibrating_tick",
        "curve": "self_calibrating_curve_tick",
        "robust-adaptive": "robust_tick",
    }
    budgets = {name: tomllib.loads(text)[tick]["instructions"] for name, tick in ticks.items()}
    told = {name: one.instructions for name, one in eft.benchmark.COMPETITORS.items() if one.instructions}
    assert told == budgets


def test_the_energy_is_that_of_the_balance():
    # A stiff oil column stores little energy, so the pump's energy is pressure times flow.
    [row] = judged("fixed", cases=[CASES["ideal sensors"]])
    rig = CASES["ideal sensors"].rig.replace(dict(eft.benchmark.COMPETITORS["fixed"].settings))
    balance = eft.energy_balance(rig, SWEEP[0].command(rig))
    assert row.energy == pytest.approx(balance.supplied, rel=0.02)


@pytest.mark.parametrize("changes", [{}, {"sensors.force.bandwidth": 1000.0, "dac.delay": 1}])
def test_loop_shaping_agrees_with_independent_solutions(changes):
    import control

    rig = eft.Rig.zhao2005().replace(changes)
    loop, period = _loop_shaping.shape_loop(rig, 4096.0), 1.0 / 4096.0
    x, z, e_max = loop.riccati
    assert e_max == pytest.approx(_loop_shaping.E_MAX, abs=1e-5)
    # The stable invariant subspace of each Hamiltonian, by its eigenvectors.
    for solution, system in ((x, loop.shaped), (z, loop.shaped.dual())):
        a, b, c, d = system.a, system.b[:, None], system.c[None, :], system.d
        scale = 1.0 + d * d
        a = a - b @ c * (d / scale)
        hamiltonian = np.block([[a, -b @ b.T / scale], [-c.T @ c / scale, -a.T]])
        values, vectors = np.linalg.eig(hamiltonian)
        stable = vectors[:, values.real < 0.0]
        size = len(a)
        found = (stable[size:] @ np.linalg.inv(stable[:size])).real
        np.testing.assert_allclose(solution, found, rtol=0.0, atol=1e-8 * np.abs(found).max())
    plant, controller = (
        control.ss(s.a, s.b[:, None], s.c[None, :], s.d, period) for s in (loop.plant, loop.controller)
    )
    opened = plant * controller
    for factor, stable in ((1.0, True), (1.0 - 1e-6, True), (1.0 + 1e-6, False)):
        closed = control.feedback(opened * (1.0 if factor == 1.0 else factor * loop.margins.gain))
        assert (np.abs(closed.poles()).max() < 1.0) == stable
    # The controller is at γ = 1.1/e_max, and reaches that margin.
    assert loop.margins.e_max >= e_max / 1.1 * (1.0 - 1e-6)


def test_the_command_lists_controllers_and_rigs_for_scripts_too(capsys):
    assert main(["benchmark", "--list", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["controllers"]["pd"] == "PD alone" and told["rigs"] == list(CASES)
    assert main(["benchmark", "--list"]) == 0
    shown = capsys.readouterr().out
    assert all(word in shown for word in (*told["controllers"], *told["rigs"]))
