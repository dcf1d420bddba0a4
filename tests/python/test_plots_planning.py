"""Figs. 4a, 4b, 6 and the maps: their content, compared with the paper."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import eft
from eft import plots

RIG = eft.Rig.zhao2005()


def lines(ax):
    return {line.get_label(): np.array(line.get_data()) for line in ax.get_lines()}


def test_figure_4a_phase_is_linear_in_frequency():
    delay = eft.identify_delay(*eft.identification.valve_test(RIG), 2048.0)
    drawn = lines(plots.response_delay(delay, ax=Figure().subplots()))
    frequency, lag = drawn["measured"]
    fitted = next(line for label, line in drawn.items() if label.startswith("delay"))
    assert (frequency[0], frequency[-1]) == pytest.approx((0.25, 10.0), abs=0.05)
    assert abs(lag - fitted[1]).max() < 0.03
    assert lag[-1] == pytest.approx(2 * np.pi * 10 * 5.2e-3, rel=0.1)


def test_figure_4b_is_table_2_over_the_measured_points():
    _, displacement, spool = eft.identification.flow_test(RIG, amplitude=0.9 * 0.127)
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
    at = np.interp(x, table["openings"], np.array(table["flows"]) * 6e4)
    assert np.median(abs(flow - at)) < 0.02 * 8.6 * 60.0


def test_figure_6_is_flat_to_20_hz():
    axes = Figure().subplots(2, 1)
    plots.inverse_dynamics(RIG, axes=axes)
    frequency, both = lines(axes[0])["both"]
    assert abs(both[frequency < 20] - 1).max() < 0.11
    assert lines(axes[0])["valve"][1][-1] < 0.6


def test_map_of_level_and_damping_shows_where_it_is_stable():
    levels, dampings = np.linspace(0.95, 1.1, 7), [1000.0, 4330.0, 10e3]
    found = eft.linear.stability_map(RIG, ("compensation.level", levels), ("structure.damping", dampings))
    ax = plots.stability_map(found, ax=Figure().subplots())
    growth = np.asarray(ax.collections[0].get_array()).reshape(3, 7)
    margins = [
        eft.stability_margin(RIG.replace({"structure.damping": damping}), sampled=True)
        for damping in dampings
    ]
    np.testing.assert_array_equal(growth < 0, levels < np.array(margins)[:, None])
    np.testing.assert_array_equal(found.stable, growth < 0)
    assert np.diff(margins).min() > 0, "the paper: higher damping raises the tolerable level"
    assert ax.get_xlabel() == "compensation level" and ax.get_ylabel() == "structure damping (N·s/m)"


def test_map_of_delay_and_rate_is_the_linear_model_at_each_point():
    delays, rates = [0.0, 5e-3, 0.02], np.geomspace(300.0, 10e3, 4)
    found = eft.linear.stability_map(
        RIG, ("controller.sample_rate", rates), ("compensation.response_delay", delays)
    )
    for row, delay in zip(found.values, delays, strict=True):
        for value, rate in zip(row, rates, strict=True):
            model = eft.linearize(RIG.replace({"compensation.response_delay": delay}), sample_rate=rate)
            assert value == pytest.approx(model.growth_rate, rel=1e-9)
    ax = plots.stability_map(found, ax=Figure().subplots())
    assert ax.get_xscale() == "log" and ax.get_yscale() == "linear"
    frame = found.to_pandas()
    assert frame.loc[5e-3, rates[1]] == found.values[1, 1]
    assert (frame.index.name, frame.columns.name) == (found.vertical_key, found.horizontal_key)


def test_map_of_rate_and_realization_is_the_margin_of_each():
    rates = [500.0, 2048.0]
    found = eft.linear.stability_map(
        RIG,
        ("controller.sample_rate", rates),
        ("controller.realization", ["analog", "digital"]),
        quantity="level",
    )
    digital = RIG.replace({"controller.realization": "digital"})
    for rig, row, at in ((RIG, 0, 0), (RIG, 0, 1), (digital, 1, 1)):
        expected = eft.stability_margin(rig, sample_rate=rates[at])
        assert found.values[row, at] == pytest.approx(expected, rel=1e-12)
    # No level stabilises a digital force loop at this low rate.
    assert np.isnan(found.values[1, 0])
    with pytest.raises(ValueError, match="no compensation level"):
        eft.stability_margin(digital, sample_rate=rates[0])
    drawn = lines(plots.stability_map(found, ax=Figure().subplots()))
    assert list(drawn) == ["analog", "digital"]


@pytest.mark.parametrize("quantity", ["growth_rate", "level"])
def test_a_map_over_words_has_them_along_its_axis(quantity):
    modes = ("compensation.mode", ["off", "linear", "nonlinear"])
    found = eft.linear.stability_map(RIG, modes, ("structure.damping", [2e3, 4e3]), quantity=quantity)
    ax = plots.stability_map(found, ax=Figure().subplots())
    assert [label.get_text() for label in ax.get_xticklabels()] == modes[1]
    assert list(ax.get_xticks()) == [0, 1, 2] and ax.get_xlabel() == "compensation mode"
    if quantity == "growth_rate":
        assert ax.collections[0].get_array().shape == (2, 3)


def test_the_named_maps_need_only_a_rig():
    for name, make in eft.linear.STABILITY_MAPS.items():
        found = make(RIG)
        assert found.values.shape == (found.vertical.size, found.horizontal.size), name
        assert found.stable.any()
        if name != "rate-realization":
            assert not found.stable.all(), f"{name} must show the edge"


def test_what_cannot_be_mapped_is_named():
    with pytest.raises(ValueError, match=r"quantity = .speed.: must be"):
        eft.linear.stability_map(
            RIG, ("compensation.level", [1.0]), ("structure.mass", [1e3]), quantity="speed"
        )
    with pytest.raises(ValueError, match=r"structure.mass = -1"):
        eft.linear.stability_map(RIG, ("compensation.level", [1.0]), ("structure.mass", [-1.0]))
    with pytest.raises(ValueError, match="must have at least one value"):
        eft.linear.stability_map(RIG, ("compensation.level", []), ("structure.mass", [1.0]))
