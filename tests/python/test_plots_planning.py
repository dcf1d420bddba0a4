"""Figs. 4a, 4b, 6 and the maps: what they draw, beside what the paper says of it."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import eft
from eft import plots

RIG = eft.Rig.zhao2005()


def lines(ax):
    return {line.get_label(): np.array(line.get_data()) for line in ax.get_lines()}


def test_figure_4a_phase_is_linear_in_frequency():
    delay = eft.identify_delay(*eft.valve_test(RIG), 2048.0)
    drawn = lines(plots.response_delay(delay, ax=Figure().subplots()))
    frequency, lag = drawn["measured"]
    fitted = next(line for label, line in drawn.items() if label.startswith("delay"))
    assert (frequency[0], frequency[-1]) == pytest.approx((0.25, 10.0), abs=0.05)
    assert abs(lag - fitted[1]).max() < 0.03
    assert lag[-1] == pytest.approx(2 * np.pi * 10 * 5.2e-3, rel=0.1)


def test_figure_4b_is_table_2_over_the_measured_points():
    _, displacement, spool = eft.flow_test(RIG, amplitude=0.9 * 0.127)
    table = RIG["servovalve.flow_table"]
    ax = plots.flow_curve(
        eft.FlowTable(table["openings"], table["flows"]),
        spool=spool,
        displacement=displacement,
        sample_rate=2048.0,
        piston_area=RIG["actuator.piston_area"],
        ax=Figure().subplots(),
    )
    x, flow = lines(ax)["measured"]
    at = np.interp(x, table["openings"], np.array(table["flows"]) * 1e3)
    assert np.median(abs(flow - at)) < 0.02 * 8.6


def test_figure_6_is_flat_to_20_hz():
    axes = Figure().subplots(2, 1)
    plots.inverse_dynamics(RIG, axes=axes)
    frequency, both = lines(axes[0])["both"]
    assert abs(both[frequency < 20] - 1).max() < 0.11
    assert lines(axes[0])["valve"][1][-1] < 0.6


def test_map_of_level_and_damping_shows_where_it_is_stable():
    levels, dampings = np.linspace(0.95, 1.1, 7), [1000.0, 4330.0, 10e3]
    ax = plots.stability_map(
        RIG, ("compensation.level", levels), ("structure.damping", dampings), ax=Figure().subplots()
    )
    growth = np.asarray(ax.collections[0].get_array()).reshape(3, 7)
    margins = [
        eft.stability_margin(RIG.replace({"structure.damping": damping}), sampled=True)
        for damping in dampings
    ]
    np.testing.assert_array_equal(growth < 0, levels < np.array(margins)[:, None])
    assert np.diff(margins).min() > 0, "the paper: higher damping raises the tolerable level"
