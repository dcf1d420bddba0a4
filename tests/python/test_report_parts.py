"""The parts of a report besides its charts: heading, verdict, margins, floors, ranking; and its size."""

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

import eft
from buildings import building
from eft.report import write_report, write_study_report
from eft.report._ranking import _spearman, ranking

RIG = eft.Rig.zhao2005()
VOID = {"meta", "link", "br", "img", "hr", "input", "wbr"}


class Balanced(HTMLParser):
    """Every tag that opens closes, in its order."""

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag, tag


def checked(path):
    text = path.read_text(encoding="utf-8")
    parser = Balanced()
    parser.feed(text)
    assert parser.open == []
    return text


def charts(text):
    return [
        json.loads(spec.replace("&quot;", '"').replace("&amp;", "&"))
        for spec in re.findall(r'data-chart="([^"]*)"', text)
    ]


@pytest.fixture(scope="module")
def quake():
    times = np.arange(0.0, 40.0, 0.01)
    record = eft.Record(
        0.5 * np.sin(2 * np.pi * 1.3 * times) * np.exp(-(((times - 15) / 8) ** 2)), 0.01, "<a> quake"
    )
    small = eft.data_sheets.supply("19 MPa", "5 gpm", "2 gal", "9 MPa")
    command = eft.effective_force(record, 7040.0, 4096.0, 0.5)
    return eft.simulate(RIG.replace(small | {"name": "a & b"}), command)


@pytest.fixture(scope="module")
def page(quake, tmp_path_factory):
    """The report of the earthquake test."""
    return checked(write_report(quake, tmp_path_factory.mktemp("report") / "a.html"))


def test_the_heading_names_what_was_tested(quake, page):
    for cell in ("a &amp; b", "&lt;a&gt; quake", "0.5", "7040 kg"):
        assert f"<td>{cell}</td>" in page, cell
    assert quake.date[:10] in page


def test_a_test_of_40_s_takes_at_most_1_5_mb(quake, page):
    assert len(quake) > 160_000
    assert len(page.encode()) < 1.5e6


def test_a_building_of_40_s_takes_at_most_2_5_mb(tmp_path):
    tone = np.sin(2 * np.pi * 1.5 * np.arange(40 * 1024) / 1024.0)
    rig = building(4, **{"compensation.adaptive": True})
    run = eft.simulate(rig, eft.Command([1e3 * (n + 1) * tone for n in range(4)], 1024.0))
    text = checked(write_report(run, tmp_path / "a.html"))
    assert len(text) < 2.5e6
    # The page contains each signal once, even if several charts draw it.
    data = re.findall(r'<script type="text/plain" id="\w+">([^<]*)<', text)
    assert len(data) == len(set(data)) > 20


def test_ideal_response_supply_and_margins_are_there(quake, page, tmp_path):
    found = {spec["ylabel"]: spec for spec in charts(page)}
    assert [s["label"] for s in found["displacement (mm)"]["series"]] == ["ideal", "test"]
    assert found["supply pressure (MPa)"]["rules"][0]["y"] == pytest.approx(19.0)
    # With the steeper side of the flow curve, as the verdict takes them.
    margins = eft.linear.stability_margins(quake.rig, sample_rate=4096.0, flow_gain="steeper")
    assert f"<td>{margins.loop_gain:.4g}</td>" in page
    demands = eft.check_feasibility(quake.rig, eft.Command(quake.command, 4096.0)).demands
    assert all(f"<td>{demand.name}</td>" in page for demand in demands)
    plain = eft.simulate(RIG, eft.sine_sweep(2000.0, 0.5, 5.0, 2.0, 1024.0))
    rest = {spec["ylabel"] for spec in charts(checked(write_report(plain, tmp_path / "b.html")))}
    assert "supply pressure (MPa)" not in rest


@pytest.mark.parametrize(("gain", "kind", "word"), [(1.0, " concern", "Caution"), (0.7, " unusable", "No")])
def test_the_verdict_has_its_color_reasons_and_remedies(gain, kind, word, tmp_path):
    rig = RIG.replace({"truth.servovalve.flow_gain_scale": gain})
    run = eft.simulate(rig, eft.sine_sweep(8900.0, 0.0, 10.0, 16.0, 2048.0))
    text = checked(write_report(run, tmp_path / "a.html"))
    box = re.search(r'<div class="verdict([^"]*)"><b>(\w+)</b>(.*?)</div>', text)
    assert (box[1], box[2]) == (kind, word)
    assert box[3].count("<code>") == len(run.verdict.remedies)
    assert box[3].count("<li>") == len(run.verdict.remedies) + len(run.verdict.reasons)


def test_a_go_is_green(tmp_path):
    run = eft.simulate(RIG, eft.sine_sweep(4000.0, 0.5, 3.0, 8.0, 4096.0))
    assert run.verdict.grade == "go"
    assert '<div class="verdict"><b>Go</b>' in checked(write_report(run, tmp_path / "a.html"))


def test_a_building_is_one_test_with_a_small_chart_for_each_floor(tmp_path):
    tone = eft.sine_sweep(2e3, 0.5, 5.0, 2.0, 1024.0).values
    run = eft.simulate(building(3), eft.Command([tone, tone, tone], 1024.0))
    text = checked(write_report(run, tmp_path / "a.html"))
    assert text.count('<div class="verdict') == 1
    small = re.search(r'<div class="multiples">(.*?)</div>', text, re.DOTALL)[1]
    shown = charts(small)
    assert [s["label"] for spec in shown for s in spec["series"]] == ["command", "force"] * 3 + [
        "ideal",
        "test",
    ] * 3


def test_a_study_ranks_its_settings_and_has_verdicts(tmp_path):
    stats = pytest.importorskip("scipy.stats")
    settings = {"truth.servovalve.flow_gain_scale": [0.9, 0.95, 1.0], "structure.mass": [7e3, 7.1e3],
                "compensation.mode": ["linear", "nonlinear"]}  # fmt: skip
    study = eft.study(RIG, eft.sine_sweep(8900.0, 0.5, 4.0, 4.0, 1024.0), settings)
    found = {name: told for name, told, _ in ranking(study)}
    done = study["status"] == "completed"
    for name in ("truth.servovalve.flow_gain_scale", "structure.mass"):
        exact = stats.spearmanr(study[name][done], study["nrmse"][done]).statistic
        assert found[name] == pytest.approx(exact)
    assert 0.0 <= found["compensation.mode"] <= 1.0
    text = checked(write_study_report(study, tmp_path / "s.html"))
    assert all(f"<td>{name}</td>" in text for name in found)
    for index in range(len(study)):
        run = eft.simulate(study.rig(index), eft.sine_sweep(8900.0, 0.5, 4.0, 4.0, 1024.0))
        assert study["verdict"][index] == run.verdict.grade
    assert "<th>verdict</th>" in text


def test_a_study_ranks_a_setting_that_is_a_list(tmp_path):
    flows = RIG["servovalve.flow_table.flows"]
    settings = {"servovalve.flow_table.flows": [flows, [1.1 * flow for flow in flows]],
                "compensation.level": [0.9, 1.0]}  # fmt: skip
    study = eft.study(RIG, eft.sine_sweep(8900.0, 0.5, 4.0, 1.0, 1024.0), settings)
    told = {name: value for name, value, _ in ranking(study)}["servovalve.flow_table.flows"]
    assert 0.0 < told <= 1.0
    text = checked(write_study_report(study, tmp_path / "s.html"))
    assert f"<td>servovalve.flow_table.flows</td><td>{told:.2f}</td>" in text


def test_ranks_of_equal_values_are_shared():
    stats = pytest.importorskip("scipy.stats")
    rng = np.random.default_rng(4)
    x, y = rng.integers(0, 4, 50).astype(float), rng.standard_normal(50)
    assert _spearman(x, y) == pytest.approx(stats.spearmanr(x, y).statistic)
