"""The report: its content, and its charts in a headless Chromium if that is installed."""

import base64
import dataclasses
import hashlib
import json
import re

import numpy as np
import pytest

import eft
from browsers import CHROMIUM
from eft.cli import main
from eft.report import write_report, write_study_report
from eft.report._charts import MOST, _thin


@pytest.fixture(scope="module")
def runs():
    rig = eft.Rig.zhao2005()
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)
    return {
        mode: eft.simulate(rig.replace({"compensation.mode": mode}), command)
        for mode in ("nonlinear", "linear")
    }


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


def charts(text):
    return [json.loads(_unescape(spec)) for spec in re.findall(r'data-chart="([^"]*)"', text)]


def _unescape(text):
    return text.replace("&quot;", '"').replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")


def stored(text, name):
    data = re.search(rf'id="{name}">([^<]*)<', text)[1]
    return np.frombuffer(base64.b64decode(data), dtype="<f4")


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
    rig = eft.Rig.zhao2005().replace({"protection.enabled": True, "protection.force_trip": 4000.0})
    return eft.simulate(rig, eft.sine_sweep(8900.0, 0.5, 6.0, 6.0, 1024.0))


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


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_in_chromium_a_trip_is_marked_in_its_place(tripped, browser, tmp_path):
    told = """<script>
      const marked = [];
      const fillText = CanvasRenderingContext2D.prototype.fillText;
      CanvasRenderingContext2D.prototype.fillText = function (words, x, y) {
        if (words.startsWith("tripped")) marked.push(x);
        return fillText.call(this, words, x, y);
      };
    </script>"""
    seen = """<script>
      const first = window.eftCharts[0];
      const place = 70 + (first.spec.marks[0].x / first.map.x1) * first.map.inner.w;
      const answer = { marked: marked[0], place, charts: window.eftCharts.filter((c) => c.spec.link).length,
        count: marked.length };
      document.body.insertAdjacentHTML("beforeend", `<pre id="probe">${btoa(JSON.stringify(answer))}</pre>`);
    </script>"""
    answer = opened(browser, write_report(tripped, tmp_path / "a.html"), tmp_path, told, seen)
    assert abs(answer["marked"] - answer["place"]) <= 6 and answer["count"] >= answer["charts"]


def test_command_line_writes_the_report(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--sweep", "2000", "0", "10", "4", "-o", "a.eft"]) == 0
    assert main(["report", "a.eft"]) == 0
    assert len(charts((tmp_path / "a.html").read_text(encoding="utf-8"))) == 9


ONE_GAIN = {"compensation.curve_correction": False}
ADAPTIVE = {"compensation.adaptive": True, "compensation.feedforward": True} | ONE_GAIN
FOUND = (
    "over the configured (1)",
    "response delay (ms)",
    "no-load flow (L/min)",
    "flow over the configured (1)",
)


@pytest.fixture(scope="module")
def learned():
    """A fixed controller, one that adapts, and one that corrects its curve as well."""
    rig = eft.Rig.zhao2005().replace({"servovalve.flow_gain_scale": 1.05})
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 16.0, 4096.0)
    changes = {"fixed": {}, "adaptive": ADAPTIVE, "curve": ADAPTIVE | {"compensation.curve_correction": True}}
    return {name: eft.simulate(rig.replace(change), command) for name, change in changes.items()}


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


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_in_chromium_the_estimates_are_drawn_without_an_error(learned, browser, tmp_path):
    page = write_report(learned, tmp_path / "a.html")
    answer = opened(browser, page, tmp_path)
    assert answer["errors"] == []
    assert len(answer["before"]) == len(charts(page.read_text(encoding="utf-8")))
    # The charts of the estimates come last. A level that stays 1 is hidden by its rule.
    assert answer["missing"][-3:] == [0] * 3 and min(answer["before"][-4:]) > 3


PROBE = """
<script>
  const errors = [];
  window.addEventListener("error", (event) => errors.push(event.message));
  console.error = (...words) => errors.push(words.join(" "));
</script>
"""
ACT = """
<script>
  const point = (type, target, x, y) => target.dispatchEvent(
    new PointerEvent(type, { clientX: x, clientY: y, bubbles: true, cancelable: true }));
  const painted = (canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    // Whole pixels: alpha, blue, green and red from the highest byte on.
    const pixels = [...new Set(new Uint32Array(data.buffer))].filter((pixel) => pixel >>> 24 === 255);
    return pixels.map((pixel) => [0, 8, 16].map((place) => (pixel >> place) & 255).join());
  };
  const charts = window.eftCharts;
  const before = charts.map((c) => painted(c.canvas).length);
  const used = charts.map((c) => c.series.map((s) => s.color));
  const first = charts[0], box = first.canvas.getBoundingClientRect();
  const inner = first.map.inner;
  point("pointerdown", first.canvas, box.left + 70 + inner.w * 0.25, box.top + 100);
  point("pointermove", window, box.left + 70 + inner.w * 0.5, box.top + 100);
  point("pointerup", window, box.left + 70 + inner.w * 0.5, box.top + 100);
  const zoomed = charts.map((c) => c.view && c.view.x);
  const vertical = [first.map.y0, first.map.y1];
  first.canvas.dispatchEvent(new MouseEvent("dblclick", { bubbles: true }));
  const after = charts.map((c) => c.view);
  const bytes = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16)).join();
  const unseen = (c, colors) => c.series.filter((s) => !colors.includes(bytes(s.color)));
  const missing = charts.map((c) => unseen(c, painted(c.canvas)).length);
  const answer = { errors, missing, before, used, zoomed, vertical, after };
  document.body.insertAdjacentHTML("beforeend", `<pre id="probe">${btoa(JSON.stringify(answer))}</pre>`);
</script>
"""


TICKS = """
<style>body { max-width: 368px; padding: 0; }</style>
<script>
  // Numbers below the charts are centred, those beside them stand to the right.
  const told = new Map();
  const fillText = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (words, ...place) {
    if (!told.has(this.canvas)) told.set(this.canvas, { center: [], right: [] });
    if (/^-?[0-9.]+$/.test(words)) told.get(this.canvas)[this.textAlign].push(words);
    return fillText.call(this, words, ...place);
  };
</script>
"""
TOLD = """
<script>
  const answer = window.eftCharts.map((c) => ({ ...told.get(c.canvas), width: c.canvas.clientWidth }));
  document.body.insertAdjacentHTML("beforeend", `<pre id="probe">${btoa(JSON.stringify(answer))}</pre>`);
</script>
"""


def opened(browser, page, folder, probe=PROBE, act=ACT):
    """The state of a page in a headless Chromium after a zoom into its first figure."""
    text = page.read_text(encoding="utf-8")
    probed = folder / "probed.html"
    # In its own scope, so that its names differ from those of the page.
    text = text.replace("</head>", probe + "</head>", 1).replace("</body>", act + "</body>", 1)
    # The page allows its own script only, so these two are added to its policy.
    for script in re.findall(r"<script>(.*?)</script>", probe + act, re.DOTALL):
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
        text = text.replace("; script-src ", f"; script-src 'sha256-{digest}' ", 1)
    probed.write_text(text, encoding="utf-8")
    with browser.page(probed.as_uri(), height=2400) as shown:
        return shown.probe()


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_in_chromium_every_figure_draws_and_zooms_without_an_error(page, browser, tmp_path):
    answer = opened(browser, page, tmp_path)
    assert answer["errors"] == [] and answer["missing"] == [0] * 9
    assert len(answer["before"]) == 9 and min(answer["before"]) > 10
    # From a quarter to half of 32 s, in every history and in no other chart.
    time_charts, others = answer["zoomed"][:7], answer["zoomed"][7:]
    for view in time_charts:
        assert view == pytest.approx([8.0, 16.0], abs=0.1)
    assert others == [None, None]
    assert answer["after"] == [None] * 9


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_in_chromium_a_narrow_page_has_three_numbers_at_least_on_every_axis(page, browser, tmp_path):
    charts = opened(browser, page, tmp_path, TICKS, TOLD)
    assert len(charts) == 9 and all(chart["width"] <= 400 for chart in charts)
    for chart in charts:
        assert 3 <= len(set(chart["center"])) <= 8 and 3 <= len(set(chart["right"])) <= 16, chart


@pytest.fixture(scope="module")
def study():
    command = eft.sine_sweep(8900.0, 0.5, 4.0, 1.0, 1024.0)
    grid = {
        "compensation.mode": ["linear", "nonlinear"],
        "structure.mass": [6000.0, 7040.0],
        "actuator.stroke": [0.127, 0.001],
    }
    return eft.study(eft.Rig.zhao2005(), {"<a>": command}, grid)


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


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_in_chromium_the_report_of_a_study_draws(study, browser, tmp_path):
    answer = opened(browser, write_study_report(study, tmp_path / "s.html"), tmp_path)
    assert answer["errors"] == [] and answer["missing"] == [0] * 6
    first, *others = answer["zoomed"]
    assert first is not None and others == [None] * 5


def test_report_of_a_study_on_the_command_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    command = eft.sine_sweep(8900.0, 0.5, 4.0, 1.0, 1024.0)
    eft.study(eft.Rig.zhao2005(), command, {"structure.mass": [7000.0, -1.0]}, output="s.study")
    assert main(["report", "s.study"]) == 0
    assert "1 × structure.mass = -1" in (tmp_path / "s.html").read_text(encoding="utf-8")
