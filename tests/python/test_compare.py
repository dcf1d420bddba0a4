"""Comparison of a measured test with a virtual one: alignment, numbers, pictures, units."""

import dataclasses
import json
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import eft
from eft import _display, plots
from eft.cli import main
from eft.demo import tables as demo_tables
from eft.traces import Traces, read_traces, write_run

pytestmark = pytest.mark.usefixtures("quick_pictures")

RATE = 512.0
RIG = eft.Rig.zhao2005()
RUN = eft.simulate(RIG, eft.sine_sweep(4000.0, 0.2, 8.0, 8.0, RATE))


def measured(late=0.0, gain=1.0, start=0.0):
    """The run as measured by a laboratory, with another clock, gain and rate."""
    time = np.arange(0.0, RUN.time[-1] + late, 1 / 400.0)
    columns = {
        name: gain * np.interp(time - late, RUN.time, getattr(RUN, name), left=0.0)
        for name in ("command", "force", "displacement")
    }
    return Traces("measured", 400.0, columns, start)


@pytest.mark.parametrize(("late", "start"), [(0.0, 0.0), (1.3, 0.0), (-0.25, 0.0), (0.7, 100.0), (3.2, -4.0)])
def test_alignment_finds_the_shift_that_was_there(late, start):
    found = eft.compare(measured(late=late, start=start), RUN, align=True)
    assert found.aligned_by == "command"
    assert found.shift == pytest.approx(-(late + start), abs=2e-4)
    assert found["force"].nrmse < 0.01 and abs(found["force"].delay) < 2e-4
    assert set(found) == {"command", "force", "displacement"}


@pytest.mark.parametrize("cut", [1, 2, 300, 1024])
def test_alignment_does_not_depend_on_the_end_of_a_test(cut):
    whole = Traces.from_run(RUN)
    part = dataclasses.replace(whole, columns={"command": RUN.command[:-cut].copy()})
    for one, other in ((whole, part), (part, whole)):
        assert abs(eft.compare(one, other, align=True).shift) < 1e-3 / RATE


def in_other_times(traces, factor, start=0.0):
    """The traces with times of another unit."""
    return dataclasses.replace(
        traces, name="wrong", sample_rate=traces.sample_rate / factor, start=start + factor * traces.start
    )


@pytest.mark.parametrize("factor", [1e3, 1e-3, 1e6, 60.0])
@pytest.mark.parametrize("late", [0.0, 1.3, -0.25])
@pytest.mark.parametrize("align", [False, True])
def test_times_in_another_unit_are_refused(factor, late, align):
    right = Traces.from_run(RUN)
    wrong = in_other_times(measured(late=late), factor)
    wrong = dataclasses.replace(wrong, columns={"command": wrong["command"], "force": wrong["force"]})
    for one, other in ((right, wrong), (wrong, right)):
        with pytest.raises(ValueError, match=r"with the same command: check the unit of the times"):
            eft.compare(one, other, align=align)


def test_times_that_contradict_velocity_and_displacement_are_refused():
    wrong = in_other_times(Traces.from_run(RUN), 1e3)
    other = Traces("other", RATE, {"displacement": RUN.displacement[::-1].copy()})
    with pytest.raises(ValueError, match=r"^wrong: displacement = 0\.001 times that by the velocity.*times"):
        eft.compare(wrong, other)


def test_noise_of_an_idle_velocity_sensor_is_no_motion():
    rate, displacement = 100.0, 0.05 * np.sin(np.pi * np.arange(6000) / 6000)
    for seed in range(40):
        idle = 1e-5 * np.random.default_rng(seed).standard_normal(displacement.size)
        test = Traces("slow", rate, {"displacement": displacement, "velocity": idle})
        assert eft.compare(test, test)["displacement"].nrmse == 0.0


def test_tests_of_another_length_are_compared():
    short = eft.simulate(RIG, eft.sine_sweep(4000.0, 0.2, 8.0, 0.25, 4096.0))
    assert eft.compare(RUN, short)["command"].nrmse > 0.1 and eft.compare(short, RUN)["command"].nrmse > 0.1
    still = Traces("still", RATE / 1e3, {"command": np.zeros(RUN.time.size)})
    assert eft.compare(still, RUN)["command"].reference_peak == 0.0


def test_a_part_of_a_ramp_is_no_ramp_in_another_unit():
    time = np.arange(60_001) / 1000.0
    for force in (100.0 * time, 1e3 * np.sin(0.02 * time)):
        whole = Traces("whole", 1000.0, {"force": force})
        part = Traces("part", 1000.0, {"force": force[:1001].copy()})
        for one, other in ((whole, part), (part, whole)):
            assert eft.compare(one, other)["force"].nrmse < 1e-12
        for factor in (1e3, 1.0 / 60.0):
            with pytest.raises(ValueError, match="with the same force"):
                eft.compare(whole, in_other_times(whole, factor))


def test_what_is_different_stays_after_alignment():
    found = eft.compare(measured(late=0.5, gain=0.8), RUN, align=True)["force"]
    assert found.band_ratio == pytest.approx(1.25, rel=1e-3)
    assert found.peak / found.reference_peak == pytest.approx(1.25, rel=5e-3)
    assert found.nrmse == pytest.approx(0.25, abs=0.01)


def test_a_late_force_is_not_hidden_by_the_alignment():
    late = measured()
    force = np.interp(late.time - 0.02, late.time, late["force"])
    other = dataclasses.replace(late, name="other", columns=late.columns | {"force": force})
    found = eft.compare(late, other, align=True)
    assert found.shift == pytest.approx(0.0, abs=1e-6)
    assert found["force"].delay == pytest.approx(0.02, abs=2e-4)


def test_without_a_command_the_force_aligns():
    lone = measured(late=0.4)
    lone = dataclasses.replace(lone, columns={"force": lone["force"]})
    assert eft.compare(lone, RUN, align=True).aligned_by == "force"
    silent = dataclasses.replace(lone, columns={"force": np.zeros(len(lone))})
    with pytest.raises(ValueError, match="align: the force"):
        eft.compare(silent, RUN, align=True)
    with pytest.raises(ValueError, match="no signal in common"):
        eft.compare(dataclasses.replace(lone, columns={"flow": lone["force"]}), RUN)
    with pytest.raises(ValueError, match=r"^band = \(5, 1\)"):
        eft.compare(lone, RUN, band=(5.0, 1.0))


def test_a_comparison_never_changes_and_can_be_kept():
    found = eft.compare(measured(), RUN)
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.shift = 1.0
    with pytest.raises(TypeError):
        found["force"] = found["command"]
    assert pickle.loads(pickle.dumps(found))["force"] == found["force"]
    assert "<table>" in found._repr_html_()


def test_two_tests_of_the_same_name_can_be_told_apart(tmp_path):
    def legend(found):
        return [text.get_text() for text in found.plot("force").axes[0].get_legend().get_texts()]

    other = eft.simulate(RIG.replace({"compensation.mode": "linear"}), eft.Command(RUN.command, RATE))
    assert legend(eft.compare(RUN, other)) == ["reference", "run"]
    paths = [str(tmp_path / folder / "test.eft") for folder in ("monday", "tuesday")]
    for run, path in zip((RUN, other), paths, strict=True):
        Path(path).parent.mkdir()
        run.save(path)
    assert legend(eft.compare(*paths)) == paths


@pytest.mark.parametrize("system", ["si", "us"])
def test_the_picture_has_a_panel_and_its_difference_for_each_signal(system):
    found = eft.compare(measured(late=0.1), RUN, align=True)
    figure = found.plot("force", "displacement", units=system)
    assert len(figure.axes) == 4
    factor = {"si": 1e-3, "us": 1e-3 / 4.4482216152605}[system]
    line = figure.axes[0].lines[1]
    np.testing.assert_allclose(line.get_ydata(), found.other["force"] * factor)
    assert {"si": "kN", "us": "kip"}[system] in figure.axes[0].get_ylabel()
    assert len(found.plot().axes) == 4
    with pytest.raises(ValueError, match="mood was not compared"):
        found.plot("mood")


def test_units_are_chosen_for_all_or_for_a_block():
    assert _display.shown("force").unit == "kN"
    with eft.use_units("us"):
        assert _display.shown("force").unit == "kip" and _display.shown("m").unit == "in"
    assert _display.shown("force").unit == "kN"
    with pytest.raises(ValueError, match=r"^system = .imperial."):
        eft.use_units("imperial")


def test_the_command_draws_and_shows_the_units_asked_for(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    RUN.save("run.eft")
    late = measured(late=0.5)
    rows = np.column_stack([late.time, late["command"] / 4448.2216152605, late["force"] / 1e3])
    np.savetxt("measured.csv", rows, "%.9g", ";", header="Time (s);Command (kip);Force (kN)", comments="")
    command = ["compare", "measured.csv", "run.eft", "--align", "--plot", "out.png", "--units", "us"]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "force (kip)" in said and (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")
    assert _display.current_units() == "si"
    assert main([*command, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["shift"] == pytest.approx(-0.5, abs=1e-3)
    assert {signal["unit"] for signal in answer["signals"]} == {"N"}


@pytest.mark.parametrize("suffix", [".csv", ".h5", ".parquet", ".mat", ".tdms"])
def test_what_is_written_for_others_is_read_with_its_units(suffix, tmp_path):
    path = write_run(RUN, tmp_path / f"run{suffix}")
    traces = read_traces(path)
    assert traces.sample_rate == pytest.approx(RATE)
    for name in ("command", "force", "displacement", "velocity", "spool", "load_pressure", "valve_command"):
        np.testing.assert_allclose(traces[name], getattr(RUN, name), rtol=1e-8, atol=1e-9, err_msg=name)


def test_a_data_frame_keeps_its_units_in_parquet(tmp_path):
    frame = RUN.to_pandas()
    assert frame.attrs["units"] | {"time": "s", "force": "N", "spool": "1"} == frame.attrs["units"]
    frame.to_parquet(tmp_path / "run.parquet")
    traces = read_traces(tmp_path / "run.parquet")
    assert traces.sample_rate == pytest.approx(RATE)
    for name in ("command", "force", "displacement", "velocity", "spool", "load_pressure", "valve_command"):
        np.testing.assert_allclose(traces[name], getattr(RUN, name), rtol=1e-12, err_msg=name)
    frame.attrs = {"units": ["N"]}
    frame.to_parquet(tmp_path / "none.parquet")
    with pytest.raises(ValueError, match="column `command` names no unit"):
        read_traces(tmp_path / "none.parquet")


def test_a_report_has_the_measured_test_over_the_virtual_one(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    RUN.save("run.eft")
    late = measured(late=0.5, gain=0.9)
    rows = np.column_stack([late.time, late["command"] / 1e3, late["force"]])
    np.savetxt("a.csv", rows, "%.9g", ",", header="time (s),command (kN),load", comments="")
    assert main(["report", "run.eft", "a.csv", "-o", "a.html"]) == 2
    assert "`load`" in capsys.readouterr().err
    before = len(re.findall("<figure", written(main(["report", "run.eft"]), "run.html")))
    page = written(main(["report", "run.eft", "a.csv", "--unit", "force=N", "-o", "a.html"]), "a.html")
    assert len(re.findall("<figure", page)) == before + 2
    assert "run against a.csv" in page and "(kN)" in page
    us = written(main(["report", "run.eft", "a.csv", "--unit", "force=N", "--units", "us"]), "run.html")
    assert "kip" in us and "kN" not in us.partition("<pre>")[0]
    assert main(["report", "a.csv", "--unit", "force=N"]) == 2
    assert "run.eft" in capsys.readouterr().err


def written(code, name):
    assert code == 0
    return Path(name).read_text(encoding="utf-8")


@pytest.mark.parametrize("system", ["si", "us"])
def test_a_quantity_has_one_unit_in_every_picture(system):
    table = RIG["servovalve.flow_table"]
    curve = eft.FlowTable(table["openings"], table["flows"])
    unit = {
        "si": {"force": "kN", "length": "mm", "velocity": "m/s", "flow": "L/min", "acceleration": "m/s²"},
        "us": {"force": "kip", "length": "in", "velocity": "in/s", "flow": "gpm", "acceleration": "g"},
    }[system]
    motion = eft.Record(np.sin(np.arange(400) / 9.0), 0.02, "a quake")
    with eft.use_units(system):
        for draw, what, quantity in (
            (plots.force_history, RUN, "force"),
            (plots.displacement_history, RUN, "length"),
            (plots.velocity_history, RUN, "velocity"),
            (plots.flow_curve, curve, "flow"),
            (plots.record, motion, "acceleration"),
        ):
            ax = draw(what, ax=Figure().subplots())
            assert f"({unit[quantity]})" in ax.get_ylabel(), draw.__name__
        high = eft.check_feasibility(RIG, eft.sine_sweep(40e3, 0.0, 10.0, 8.0, RATE))
    moved = next(reason for reason in high.reasons if reason.startswith("Displacement"))
    assert f" {unit['length']} of " in moved
    demand = next(one for one in high.demands if one.name == "displacement")
    shown = _display.shown("length", system)(demand.required)
    assert shown in moved and demand.unit == "m"


@pytest.mark.parametrize(("system", "length", "damping"), [("si", "mm", "N·s/m"), ("us", "in", "kip·s/in")])
def test_maps_and_the_demo_s_tables_have_the_units_in_use(system, length, damping):
    found = eft.linear.stability_map(
        RIG, ("compensation.level", [0.9, 1.1]), ("structure.damping", [2e3, 4e3])
    )
    with eft.use_units(system):
        ax = plots.stability_map(found, ax=Figure().subplots())
        table = demo_tables.sweeps([])
    assert ax.get_ylabel() == f"structure damping ({damping})" and f"|x| {length}" in table.columns
    low, high = ax.get_ylim()
    factor = _display.shown("damping", system).factor
    assert low < 2e3 * factor < 4e3 * factor < high < 8e3 * factor


def test_the_option_is_taken_by_every_command_that_shows_quantities(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    axes = ["--x", "compensation.level", "0.9", "1.1", "2", "--y", "structure.damping", "1", "9", "2"]
    assert main(["map", *axes, "--units", "us", "-o", "map.svg"]) == 0
