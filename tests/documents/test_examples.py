"""The examples run unchanged, and their results are as described."""

import re
import runpy
from pathlib import Path

import pytest

pytestmark = pytest.mark.usefixtures("quick_pictures")

FOLDER = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_example_is_tested_and_made_of_cells():
    tested = set(
        re.findall(r'runpy\.run_path\(FOLDER / "(\w+\.py)"', Path(__file__).read_text(encoding="utf-8"))
    )
    assert tested == {path.name for path in FOLDER.glob("*.py")}
    for path in FOLDER.glob("*.py"):
        assert path.read_text(encoding="utf-8").startswith("# %% [markdown]\n# # ")


def test_plan_a_test(folder, capsys):
    names = runpy.run_path(FOLDER / "plan_a_test.py")
    verdicts = list(names["verdicts"].values())
    # The larger the earthquake, the worse.
    order = [("go", "caution", "no").index(verdict) for verdict in verdicts]
    assert order == sorted(order) and verdicts[0] == "go" and verdicts[-1] == "no"
    assert names["metrics"]["nrmse"] < 0.1 and 0.9 < names["reached"] < 1.1
    assert (folder / "plan.png").stat().st_size > 10_000


def test_identify_and_tune(folder, capsys):
    names = runpy.run_path(FOLDER / "identify_and_tune.py")
    assert names["ratio"].mean() == pytest.approx(1.06, abs=0.01)
    assert names["margins"].flow_gain[1] < 1.06, "the valve must be beyond the margin before"
    assert not names["before"].success or names["before"].flags or names["before"].metrics()["nrmse"] > 0.3
    assert names["after"].metrics()["nrmse"] < 0.1 < names["before"].metrics()["nrmse"]
    assert (folder / "tuned.png").stat().st_size > 10_000


def test_robustness(folder, capsys):
    names = runpy.run_path(FOLDER / "robustness.py")
    lost = {name: (study["status"] != "completed").mean() for name, study in names["studies"].items()}
    assert lost["level 0.95"] < lost["level 1"]
    assert lost["adaptive"] < lost["level 1"]
    assert (folder / "robustness.png").stat().st_size > 10_000
