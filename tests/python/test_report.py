"""The report: its content. `tests/browser` draws its charts."""

import dataclasses
import re

import numpy as np
import pytest

import eft
import reports
from eft.cli import main
from eft.report import write_report, write_study_report
from eft.report._charts import MOST, _thin
from reports import charts, stored


@pytest.fixture(scope="module")
def runs():
    return reports.both_modes()


@pytest.fixture(scope="module")
def page(runs, tmp_path_factory):
    return write_report(runs, tmp_path_factory.mktemp("report") / "both.html", "Sweep <8.9 kN> & co")


def test_what_is_no_run_is_refused(runs, tmp_path):
    for wrong in (list(runs.values()), "both.eft", {"one": None}):
        with pytest.raises(
            TypeError, match=r"^runs = an object of type \w+: must be a TestRun, or a mapping of"
        ):
            write_report(wrong, tmp_path / "wrong.html")
    assert not list(tmp_path.iterdir())


def test_page_holds_all_and_reaches_for_nothing(page):
    text = page.read_text(encoding="utf-8")
    assert not re.search(r'(?:src|href|action)\s*=\s*"(?!data:)|url\(|@import|https?://|fetch\(', text)
    for words in ("nonlinear", "largest spool opening", "flow_table.openings", f"eft {eft.__version__}"):
        assert words in text
    assert "compensation.mode = linear" in text
    assert "<h1>Sweep &lt;8.9 kN&gt; &amp; co</h1>" in text


def test_metrics_of_the_page_are_those_of_the_runs(page, runs):
    text = page.read_text(encoding="utf-8")
    row = re.search(r"<tr><td>largest spool opening</td>(.*?)</tr>", text)[1]
    assert re.findall(r"<td>([\d.]+) %</td>", row) == [
        f"{run.metrics()['max_spool'] * 100:.4g}" for run in runs.values()
    ]


def test_curves_are_those_of_the_runs(page, runs):
    text = page.read_text(encoding="utf-8")
    specs = {spec["ylabel"]: spec for spec in charts(text)}
    assert len(specs) == 9
    spool = specs["spool opening (%)"]
    assert [rule["y"] for rule in spool["rules"]] == [60.0, -60.0]
    for series in spool["series"]:
        run = runs[series["label"]]
        values = stored(text, series["y"])
        assert np.abs(values).max() == pytest.approx(100 * np.abs(run.spool).max(), rel=1e-6)
        assert values.size * series["x"]["step"] == pytest.approx(run.time[-1], rel=1e-3)
    for series in specs["force error (kN)"]["series"]:
        run = runs[series["label"]]
        largest = run.metrics()["peak_error"] * np.abs(run.command).max() / 1e3
        assert np.abs(stored(text, series["y"])).max() == pytest.approx(largest, rel=1e-6)
    ratio = specs["|FFT(force)| / |FFT(command)|"]["series"][0]
    frequency, values = stored(text, ratio["x"]), stored(text, ratio["y"])
    wanted = runs["nonlinear"].fft_ratio(1.2, 2.0)
    inside = (frequency >= 1.2) & (frequency <= 2.0)
    assert values[inside] == pytest.approx(wanted.ratio, rel=1e-5)


@pytest.mark.parametrize("size", [MOST, MOST + 1, 3 * MOST + 7])
def test_thinning_loses_no_peak(size):
    values = np.random.default_rng(1).normal(size=size)
    thin, step = _thin(values, MOST)
    assert thin.size <= MOST + 2
    assert (thin.min(), thin.max()) == (values.min(), values.max())
    if step > 1:
        for part in range(0, size // step, 997):
            stretch = values[part * step : (part + 1) * step]
            assert set(thin[2 * part : 2 * part + 2]) == {stretch.min(), stretch.max()}


def test_report_of_a_run_that_left_its_stroke_says_so(tmp_path):
    rig = eft.Rig.zhao2005().replace({"compensation.level": 2.0})
    run = eft.simulate(rig, eft.sine_sweep(2000.0, 0.0, 10.0, 4.0, 1024.0))
    text = write_report(run, tmp_path / "a.html").read_text(encoding="utf-8")
    assert '<div class="verdict unusable"><b>No</b><ul><li>The piston left its stroke' in text
    assert "<code>compensation.adaptive = true</code>" in text


def test_metrics_of_a_test_that_ended_are_those_up_to_there(runs, tmp_path):
    run = runs["nonlinear"]
    status = run.status.copy()
    status[65536:] |= np.uint32(eft.Status.TRIPPED)
    # The force after a trip does not count.
    force = np.where(np.arange(len(run)) < 65536, run.force, -5 * run.command)
    ended = dataclasses.replace(run, status=status, _values={**run._values, "force": force})
    text = write_report({"ended": ended, "whole": run}, tmp_path / "a.html").read_text(encoding="utf-8")
    assert "<td>the test ended after; up to there:</td><td>16 s</td><td>32 s</td>" in text
    part = ended.to_its_end()
    assert len(part) == 65536 and len(run.to_its_end()) == len(run)
    shown = [f"{100 * one.metrics()['nrmse']:.4g} %" for one in (part, run)]
    assert f"<td>force error, rms over rms of the command</td><td>{shown[0]}</td><td>{shown[1]}</td>" in text
    largest = [f"{np.abs(one.force).max() / 1e3:.4g} kN" for one in (part, run)]
    assert f"<td>largest force</td><td>{largest[0]}</td><td>{largest[1]}</td>" in text


def test_tests_under_different_commands_are_said_to_be(runs, tmp_path, capsys):
    words = "These tests have different commands"
    one = runs["nonlinear"]
    other = eft.simulate(one.rig, eft.sine_sweep(4000.0, 0.0, 10.0, 4.0, 4096.0))
    assert words in write_report({"a": one, "b": other}, tmp_path / "a.html").read_text(encoding="utf-8")
    assert words not in write_report(runs, tmp_path / "b.html").read_text(encoding="utf-8")
    files = [str(run.save(tmp_path / f"{n}.eft")) for n, run in enumerate((one, other))]
    assert main(["report", *files, "-o", str(tmp_path / "c.html")]) == 0
    assert words in capsys.readouterr().err


def test_a_run_that_tripped_is_no_whole_test(runs):
    run = runs["nonlinear"]
    status = run.status.copy()
    status[5000:] |= np.uint32(eft.Status.TRIPPED)
    assert run.verdict.ok
    verdict = dataclasses.replace(run, status=status).verdict
    assert not verdict.ok and "tripped" in verdict.text


@pytest.fixture(scope="module")
def tripped():
    return reports.tripped()


def test_charts_mark_the_moment_of_a_trip_with_its_cause(tripped, runs, tmp_path):
    at = int(((tripped.status & np.uint32(eft.Status.TRIPPED)) != 0).argmax())
    assert 0 < at < len(tripped) - 1
    shown = charts(write_report(tripped, tmp_path / "a.html").read_text(encoding="utf-8"))
    over_time = [spec for spec in shown if spec["link"] == "time"]
    assert len(over_time) >= 6
    for spec in shown:
        marks = [{"x": at / 1024.0, "label": "tripped: force level"}] if spec in over_time else []
        assert spec["marks"] == marks
    both = write_report({"plain": runs["linear"], "guarded": tripped}, tmp_path / "b.html")
    assert charts(both.read_text(encoding="utf-8"))[0]["marks"][0]["label"] == "guarded tripped: force level"


def test_command_line_writes_the_report(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--sweep", "2000", "0", "10", "4", "-o", "a.eft"]) == 0
    assert main(["report", "a.eft"]) == 0
    assert len(charts((tmp_path / "a.html").read_text(encoding="utf-8"))) == 9


FOUND = (
    "over the configured (1)",
    "response delay (ms)",
    "no-load flow (L/min)",
    "flow over the configured (1)",
)


@pytest.fixture(scope="module")
def learned():
    return reports.learned()


def test_what_an_adaptive_controller_found_is_shown_and_of_it_alone(learned, tmp_path):
    def specs(runs):
        text = write_report(runs, tmp_path / "a.html").read_text(encoding="utf-8")
        return text, {spec["ylabel"]: spec for spec in charts(text)}

    assert not set(FOUND) & set(specs(learned["fixed"])[1])
    assert set(FOUND) & set(specs(learned["adaptive"])[1]) == set(FOUND[:2])
    text, found = specs(learned)
    gains = found[FOUND[0]]
    wanted = ["adaptive: flow gain", "curve: flow gain", "adaptive: valve gain", "curve: valve gain"]
    assert [s["label"] for s in gains["series"]] == [*wanted, "adaptive: level", "curve: level"]
    last = stored(text, gains["series"][0]["y"])[-1]
    assert last == pytest.approx(learned["adaptive"].flow_gain_estimate[-1], rel=1e-6)
    delay = stored(text, found[FOUND[1]]["series"][0]["y"])
    assert delay[-1] == pytest.approx(1e3 * learned["adaptive"].response_delay_estimate[-1], rel=1e-6)
    configured, curve = found[FOUND[2]]["series"]
    run = learned["curve"]
    table = run.rig["servovalve.flow_table"]
    assert stored(text, curve["y"]) == pytest.approx(6e4 * run.found_flows, rel=1e-6)
    assert stored(text, configured["y"]) == pytest.approx(6e4 * np.array(table["flows"]), rel=1e-6)
    assert stored(text, curve["x"]) == pytest.approx(100 * np.array(table["openings"]), rel=1e-6)
    (ratio,) = found[FOUND[3]]["series"]
    assert stored(text, ratio["y"]).size == len(table["flows"]) - 1
    # The sweep visited the openings around the middle, where the valve passes 5 % more.
    assert 1.03 < stored(text, ratio["y"])[8:12].mean() < 1.07


@pytest.fixture(scope="module")
def study():
    return reports.study()


def test_the_report_of_a_study_shows_its_rows(study, tmp_path):
    text = write_study_report(study, tmp_path / "s.html", "<Study>").read_text(encoding="utf-8")
    assert not re.search(r'(?:src|href|action)\s*=\s*"(?!data:)|url\(|@import|https?://|fetch\(', text)
    assert "<h1>&lt;Study&gt;</h1>" in text and "command &lt;a&gt;: 1024 samples" in text
    assert "<tr><td>completed</td><td>4</td></tr>" in text and "4 × the piston left its stroke" in text
    specs = {(spec["xlabel"], spec["ylabel"]): spec for spec in charts(text)}
    assert len(specs) == 6
    spool = specs["structure.mass (kg)", "spool opening (%)"]
    assert [s["label"] for s in spool["series"]] == ["linear", "nonlinear", "no whole test"]
    chosen = (study["compensation.mode"] == "nonlinear") & (study["status"] == "completed")
    assert stored(text, spool["series"][1]["x"]) == pytest.approx(study["structure.mass"][chosen])
    assert stored(text, spool["series"][1]["y"]) == pytest.approx(100 * study["max_spool"][chosen])
    assert stored(text, spool["series"][2]["x"]).size == 4
    ranked = specs["share of the completed tests up to there (%)", "force error (%)"]["series"][0]
    assert stored(text, ranked["y"]) == pytest.approx(
        100
        * np.sort(study["nrmse"][(study["compensation.mode"] == "linear") & (study["status"] == "completed")])
    )


def test_report_of_a_study_on_the_command_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    command = eft.sine_sweep(8900.0, 0.5, 4.0, 1.0, 1024.0)
    eft.study(eft.Rig.zhao2005(), command, {"structure.mass": [7000.0, -1.0]}, output="s.study")
    assert main(["report", "s.study"]) == 0
    assert "1 × structure.mass = -1" in (tmp_path / "s.html").read_text(encoding="utf-8")
