"""Runs of buildings: arrays with a leading axis, in metrics, files, figures and reports."""

import pickle
import re

import numpy as np
import pytest

import eft
from buildings import RATE, building, command_of, record
from eft import plots


@pytest.fixture(scope="module")
def run():
    rig = building(3, **{"sensors.velocity.noise": 1e-4})
    return eft.simulate(rig, command_of(rig, record(seconds=4.0)))


def test_every_array_has_a_row_for_each_actuator(run):
    for name in ("command", "force", "displacement", "measured_velocity", "supply_pressure", "status"):
        assert getattr(run, name).shape == (3, len(run)), name
    assert run.time.shape == (len(run),)
    time, force = run
    assert time is run.time and force is run.force
    assert not np.array_equal(
        run.measured_velocity[0] - run.velocity[0], run.measured_velocity[1] - run.velocity[1]
    )
    assert run.success and run.message.startswith("completed")


def test_metrics_and_ratios_are_those_of_each_actuator(run):
    metrics, ratio = run.metrics(), run.fft_ratio(1.0, 5.0)
    assert ratio.ratio.shape == (3, ratio.frequency.size)
    for i in range(3):
        one = run.actuator(i)
        assert one.command.shape == (len(run),)
        alone = one.metrics()
        assert metrics.keys() == alone.keys()
        for name, value in alone.items():
            assert metrics[name][i] == value, name
        expected = one.fft_ratio(1.0, 5.0)
        at = np.isin(expected.frequency, ratio.frequency)
        np.testing.assert_array_equal(ratio.ratio[i], expected.ratio[at])
    with pytest.raises(IndexError, match="actuator = 3: must be from 0 to 2"):
        run.actuator(3)
    # For a run of one actuator it is the run itself.
    single = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2e3, 0.0, 5.0, 1.0, RATE))
    assert single.actuator(0) is single


def test_a_building_s_run_goes_where_others_go(run, tmp_path):
    path = run.save(tmp_path / "building.eft")
    for back in (eft.TestRun.load(path), pickle.loads(pickle.dumps(run))):
        np.testing.assert_array_equal(back.force, run.force)
        np.testing.assert_array_equal(back.status, run.status)
        assert back.rig == run.rig
    frame = run.to_pandas()
    np.testing.assert_array_equal(frame["force"][2], run.force[1])
    assert frame.columns.names == ["signal", "actuator"]
    dataset = run.to_xarray()
    assert dataset["force"].dims == ("actuator", "time") and list(dataset["actuator"]) == [1, 2, 3]
    np.testing.assert_array_equal(dataset["force"].sel(actuator=2), run.force[1])
    control = pytest.importorskip("control")
    response = run.to_control()
    assert isinstance(response, control.TimeResponseData)
    np.testing.assert_array_equal(response.outputs, run.force)
    np.testing.assert_array_equal(response.inputs, run.command)
    assert response.output_labels == ["force_1", "force_2", "force_3"]


def test_figures_and_reports_show_every_actuator(run, tmp_path):
    from eft import report

    ax = plots.force_history(run)
    labels = ax.get_legend_handles_labels()[1]
    assert labels == ["commands", "actuator 1", "actuator 2", "actuator 3"]
    assert len(ax.get_lines()) == 6
    assert len(plots.spool_history(run).get_lines()) >= 3
    ideal = eft.ideal_response(run.rig, eft.Command(run.command, RATE))
    shown = plots.displacement_history(run, ideal=ideal)
    assert shown.get_legend_handles_labels()[1] == ["ideal", "actuator 1", "actuator 2", "actuator 3"]
    np.testing.assert_array_equal(shown.get_lines()[2].get_ydata(), ideal.displacement[2] * 1e3)
    assert len(plots.force_ratio(run).get_lines()) >= 3
    text = report.write_report(run, tmp_path / "building.html").read_text(encoding="utf-8")
    assert "actuator 3" in text
    row = re.search(r"<tr><td>largest drift of the story</td>(.*?)</tr>", text)[1]
    assert re.findall(r"<td>([\d.]+) mm</td>", row) == [f"{d * 1e3:.4g}" for d in run.metrics()["drift"]]
    assert "<p>actuator 1, actuator 2, actuator 3:</p>" in text and "where it differs" not in text
    with pytest.raises(ValueError, match=r"structure\.kind"):
        plots.hysteresis(run.actuator(0))


def test_a_floor_that_is_not_pushed_has_no_error_and_the_others_theirs():
    rig = building(2)
    tone = eft.sine_sweep(2e3, 0.5, 5.0, 4.0, RATE).values
    run = eft.simulate(rig, eft.Command([0.0 * tone, tone], RATE))
    metrics = run.metrics()
    assert np.isnan(metrics["nrmse"][0]) and metrics["nrmse"][1] == run.actuator(1).metrics()["nrmse"]
    assert (metrics["max_spool"] > 0.0).all()
    for answer in (run.fft_ratio(1.0, 4.0).ratio, run.coherence(1.0).coherence):
        assert np.isnan(answer[0]).all() and np.isfinite(answer[1]).all()
    assert run.verdict.ok
    still = eft.simulate(rig, eft.Command([0.0 * tone, 0.0 * tone], RATE))
    with pytest.raises(ValueError, match="zero at every sample of every actuator"):
        still.metrics()
