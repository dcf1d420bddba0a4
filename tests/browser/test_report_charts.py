"""The charts of a report draw in a browser, and can be zoomed."""

import base64
import hashlib
import re

import pytest

import reports
from browsers import CHROMIUM
from eft.report import write_report, write_study_report

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: on Debian, apt-get install chromium")

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


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    return write_report(reports.both_modes(), tmp_path_factory.mktemp("report") / "both.html")


def test_every_figure_draws_and_zooms_without_an_error(page, browser, tmp_path):
    answer = opened(browser, page, tmp_path)
    assert answer["errors"] == [] and answer["missing"] == [0] * 9
    assert len(answer["before"]) == 9 and min(answer["before"]) > 10
    # From a quarter to half of 32 s, in every history and in no other chart.
    time_charts, others = answer["zoomed"][:7], answer["zoomed"][7:]
    for view in time_charts:
        assert view == pytest.approx([8.0, 16.0], abs=0.1)
    assert others == [None, None]
    assert answer["after"] == [None] * 9


def test_a_narrow_page_has_three_numbers_at_least_on_every_axis(page, browser, tmp_path):
    charts = opened(browser, page, tmp_path, TICKS, TOLD)
    assert len(charts) == 9 and all(chart["width"] <= 400 for chart in charts)
    for chart in charts:
        assert 3 <= len(set(chart["center"])) <= 8 and 3 <= len(set(chart["right"])) <= 16, chart


def test_a_trip_is_marked_in_its_place(browser, tmp_path):
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
    answer = opened(browser, write_report(reports.tripped(), tmp_path / "a.html"), tmp_path, told, seen)
    assert abs(answer["marked"] - answer["place"]) <= 6 and answer["count"] >= answer["charts"]


def test_the_estimates_are_drawn_without_an_error(browser, tmp_path):
    page = write_report(reports.learned(), tmp_path / "a.html")
    answer = opened(browser, page, tmp_path)
    assert answer["errors"] == []
    assert len(answer["before"]) == len(reports.charts(page.read_text(encoding="utf-8")))
    # The charts of the estimates come last. A level that stays 1 is hidden by its rule.
    assert answer["missing"][-3:] == [0] * 3 and min(answer["before"][-4:]) > 3


def test_the_report_of_a_study_draws(browser, tmp_path):
    answer = opened(browser, write_study_report(reports.study(), tmp_path / "s.html"), tmp_path)
    assert answer["errors"] == [] and answer["missing"] == [0] * 6
    first, *others = answer["zoomed"]
    assert first is not None and others == [None] * 5
