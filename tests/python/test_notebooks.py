"""Every result has a figure and valid HTML for a notebook; every option is called once."""

import base64
import inspect
import re
from contextlib import nullcontext
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.figure import Figure

import eft
import pictures
from buildings import building
from eft import plots
from eft.identification import identify_valve
from eft.traces import Traces

RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(4000.0, 0.5, 5.0, 4.0, 1024.0)
VOID = {"img", "br"}


class Valid(HTMLParser):
    """Every tag that opens closes, in its order; only tags that a notebook's cell may have."""

    def __init__(self):
        super().__init__()
        self.open, self.seen = [], []

    def handle_starttag(self, tag, attrs):
        assert tag in {"div", "b", "table", "tbody", "tr", "td", "img"}, tag
        assert all(value is not None for _, value in attrs)
        self.seen.append(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag, tag


@pytest.fixture(scope="module")
def results():
    run = eft.simulate(RIG, SWEEP)
    tone = SWEEP.values
    times = np.arange(400) / 100.0
    record = eft.Record(np.sin(9 * times), 0.01, "<b>quake & co")
    test = eft.identification.flow_test(RIG, amplitude=0.1)
    flow = Traces("flow", 2048.0, {"spool": test.spool, "displacement": test.displacement})
    valve = eft.identification.valve_test(RIG)
    sweep = Traces("valve", 2048.0, {"valve_command": valve.valve_command, "spool": valve.spool})
    f = np.geomspace(2, 100, 20)
    h = 1 / (1 + 1.8j * f / 60 - (f / 60) ** 2)
    sheet = {"rated_flow": "90 gpm", "rated_drop": "1000 psi", "phase_90_frequency": "60 Hz"}
    settings = {"structure.mass": [6e3, 7e3], "compensation.mode": ["linear", "off"]}
    return {
        "rig": RIG,
        "run": run,
        "bad run": eft.simulate(RIG.replace({"compensation.level": 2.0}), SWEEP),
        "building": eft.simulate(building(2), eft.Command([tone, tone], 1024.0)),
        "record": record,
        "command": SWEEP,
        "quake": eft.effective_force(record, 7e3, 1024.0),
        "commands": eft.Command([tone, tone], 1024.0),
        "study": eft.study(RIG, SWEEP, settings),
        "map": eft.linear.stability_map(
            RIG, ("compensation.level", [0.9, 1.2]), ("structure.damping", [2e3, 4e3])
        ),
        "levels": eft.linear.stability_map(RIG, "rate-realization"),
        "identification": eft.identify(RIG, flow=[flow], valve=sweep),
        "nothing identified": eft.identify(RIG),
        "linear model": eft.linearize(RIG),
        "sampled model": eft.linearize(RIG, sampled=True),
        "force loop": eft.design_force_loop(RIG),
        "gains": eft.tune_force_loop(RIG),
        "drive": eft.iterate(RIG, SWEEP, repeats=1),
        "valves": eft.compare_valves(RIG, {"a": SWEEP}, {"<one>": sheet}),
        "valve": identify_valve(f, abs(h), np.angle(h)),
        "verdict": run.verdict,
        "scale": eft.largest_scale(RIG, SWEEP, tolerance=0.5),
        "feasibility": eft.check_feasibility(RIG, SWEEP),
        "margins": eft.linear.stability_margins(RIG),
        "budget": eft.linear.delay_budget(RIG),
        "curve": eft.FlowTable([-1.0, 0.0, 1.0], [-1e-3, 0.0, 1e-3]),
    }


NAMES = [
    "rig", "run", "bad run", "building", "record", "command", "quake", "commands", "study", "map", "levels",
    "identification", "nothing identified", "linear model", "sampled model", "force loop", "gains", "drive",
    "valves", "valve", "verdict", "scale", "feasibility", "margins", "budget", "curve",
]  # fmt: skip
PICTURES = [
    "run", "bad run", "building", "record", "command", "quake", "commands", "study", "map", "levels",
    "identification", "linear model", "sampled model", "force loop", "gains", "drive", "curve",
]  # fmt: skip


SECOND = {"bad run", "quake", "commands", "levels", "nothing identified", "sampled model"}
"""Results of a kind that has another one."""


@pytest.mark.parametrize(
    ("name", "system"),
    [(name, "si") for name in NAMES] + [(name, "us") for name in NAMES if name not in SECOND],
)
def test_a_result_shows_itself_as_valid_html(results, name, system):
    # Of a kind one picture is drawn with its layout.
    cheap = pictures.blank() if system == "us" else pictures.quick() if name in SECOND else nullcontext()
    with eft.use_units(system), cheap:
        text = results[name]._repr_html_()
    parser = Valid()
    parser.feed(text)
    parser.close()
    assert parser.open == [] and parser.seen[0] == "div"
    assert ("img" in parser.seen) == (name in PICTURES)
    for picture in re.findall(r'base64,([^"]*)"', text):
        assert base64.b64decode(picture).startswith(b"\x89PNG") and len(picture) < 300_000


def test_the_list_of_results_is_whole(results):
    assert set(NAMES) == set(results)


def test_names_are_escaped(results):
    assert "&lt;b&gt;quake &amp; co" in results["record"]._repr_html_()
    assert "&lt;one&gt;" in results["valves"]._repr_html_()


@pytest.mark.parametrize("name", PICTURES)
def test_a_result_draws_itself(results, name):
    result = results[name]
    figure = Figure(layout="constrained")
    whole = name in ("run", "bad run", "building", "study", "identification", "linear model", "sampled model")
    drawn = result.plot(figure=figure) if whole else result.plot(ax=figure.subplots())
    assert drawn is not None
    axes = [ax for ax in figure.axes if ax.lines or ax.collections]
    assert axes
    for ax in axes:
        _, labels = ax.get_legend_handles_labels()
        assert len(labels) == len(set(labels)), "one name a curve"


def test_a_run_has_letters_the_error_and_the_natural_frequency(results):
    figure = plots.run_page(results["run"], figure=Figure(layout="constrained"))
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["(a)", "(b)", "(c)", "(d)", "(e)"]
    run = results["run"]
    np.testing.assert_allclose(figure.axes[1].get_lines()[0].get_ydata(), (run.force - run.command) / 1e3)
    natural = np.sqrt(693.8e3 / 7040.0) / (2 * np.pi)
    assert any(line.get_xdata()[0] == pytest.approx(natural) for line in figure.axes[4].get_lines())


def test_the_nyquist_diagram_has_the_margin(results):
    loop = results["force loop"]
    ax = loop.plot(ax=Figure().subplots())
    curve = ax.get_lines()[0]
    x, y = np.array(curve.get_data())
    # The crossing of the negative real axis next to -1 gives the gain margin.
    crossings = np.flatnonzero((y[1:] * y[:-1] < 0) & (x[1:] < 0))
    reach = max(-x[index + 1] for index in crossings)
    assert 1.0 / reach == pytest.approx(loop.margins.gain, rel=0.02)


def options(draw):
    """The options of a figure, except its axes."""
    parameters = inspect.signature(draw).parameters.values()
    return {
        one.name
        for one in parameters
        if one.kind is one.KEYWORD_ONLY and one.name not in ("ax", "axes", "figure")
    }


FUNCTIONS = {name: draw for name in plots.__all__ if inspect.isroutine(draw := getattr(plots, name))}
TEST = {
    "spool": None,
    "displacement": None,
    "sample_rate": 2048.0,
    "piston_area": RIG["actuator.piston_area"],
}
"""A test of the valve's flow: its arrays are those of the fixture."""
CALLS = [
    ("command", "command", {}),
    ("displacement_history", "run", {"ideal": "ideal"}),
    ("displacement_history", "run", {"window": (1.0, 2.0)}),
    ("drive_response", "drive", {"band": (1.0, 3.0)}),
    ("figure_4", ("delay", "curve"), TEST),
    ("figure_6", "rig", {}),
    ("figure_8", "runs", {"window": (1.0, 2.0)}),
    ("figure_8_ratio", "runs", {}),
    ("figure_9", "runs", {"window": (1.0, 2.0)}),
    ("figure_10", ("runs", "ideal"), {"window": (1.0, 2.0)}),
    ("figure_11", "runs", {"band": (1.0, 2.0)}),
    ("figure_maps", "map", {}),
    ("figure_structure", "run", {"window": (1.0, 2.0)}),
    ("flow_curve", "curve", TEST),
    ("force_history", "runs", {"window": (1.0, 2.0)}),
    ("force_loop", "force loop", {}),
    ("force_loop_gains", "gains", {}),
    ("force_ratio", "run", {"band": (1.0, 2.0)}),
    ("force_spectrum", "run", {"band": (1.0, 2.0)}),
    ("hysteresis", "run", {"window": (1.0, 2.0)}),
    ("identification", "identification", {}),
    ("inverse_dynamics", "rig", {"band": (1.0, 50.0)}),
    ("linear_model", "linear model", {"band": (1.0, 50.0)}),
    ("linear_model", "sampled model", {"output": "displacement"}),
    ("linear_model", "linear model", {"source": "command"}),
    ("record", "record", {}),
    ("response_delay", "delay", {}),
    ("run_page", "building", {}),
    ("spool_history", "run", {"advice": 0.4}),
    ("spool_history", "run", {"window": (1.0, 2.0)}),
    ("stability_map", "levels", {}),
    ("study", "study", {"metric": "max_spool"}),
    ("velocity_history", "run", {"ideal": "ideal"}),
    ("velocity_history", "run", {"window": (1.0, 2.0)}),
]  # fmt: skip
"""Each figure function with its argument and each of its options."""


def test_every_option_of_every_figure_is_called():
    called = {(name, option) for name, _, given in CALLS for option in given}
    assert called == {(name, option) for name, draw in FUNCTIONS.items() for option in options(draw)}
    assert {name for name, *_ in CALLS} == set(FUNCTIONS)


@pytest.mark.parametrize(("name", "what", "given"), CALLS, ids=range(len(CALLS)))
def test_every_option_draws(results, drawn, name, what, given):
    pool, figure = results | drawn, Figure(layout="constrained")
    chosen = {
        option: drawn[option] if option in ("ideal", "spool", "displacement") else value
        for option, value in given.items()
    }
    takes = inspect.signature(FUNCTIONS[name]).parameters
    if "ax" in takes:
        chosen["ax"] = figure.subplots()
    elif "axes" in takes:
        chosen["axes"] = figure.subplots(2, 1)
    elif "figure" in takes:
        chosen["figure"] = figure
    answer = FUNCTIONS[name](*(pool[one] for one in ([what] if isinstance(what, str) else what)), **chosen)
    for one in answer if isinstance(answer, tuple) else (answer if isinstance(answer, Figure) else figure,):
        pictures.drawn(one, layout=False)
        assert any(ax.lines or ax.collections for ax in one.axes)


@pytest.fixture(scope="module")
def drawn(results):
    """Further arguments of figures."""
    test = eft.identification.flow_test(RIG, amplitude=0.1)
    linear = eft.simulate(RIG.replace({"compensation.mode": "linear"}), SWEEP)
    return {
        "runs": {"nonlinear": results["run"], "linear": linear},
        "ideal": eft.ideal_response(RIG, SWEEP),
        "delay": eft.identify_delay(*eft.identification.valve_test(RIG), 2048.0),
        "spool": test.spool,
        "displacement": test.displacement,
    }


def test_without_a_figure_a_new_one_is_made(results):
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    for name in ("run", "record", "force loop"):
        assert results[name].plot() is not None
    pyplot.close("all")


@pytest.mark.filterwarnings("error")
def test_a_study_over_lists_has_short_labels():
    flows = RIG["servovalve.flow_table.flows"]
    settings = {"servovalve.flow_table.flows": [flows, [0.9 * flow for flow in flows]]}
    found = eft.study(RIG, SWEEP, settings, progress=False)
    assert "<img" in found._repr_html_()
    [axes] = plots.study(found).axes
    labels = [label.get_text() for label in axes.get_xticklabels()]
    assert [label[:2] for label in labels] == ["0:", "1:"] and max(map(len, labels)) < 30
