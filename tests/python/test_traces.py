"""Measured signals: units, headers, the formats of laboratories, clocks."""

import numpy as np
import pytest

import eft
from eft.traces import read_traces
from eft.traces._units import parse_header, to_si

TIME = np.arange(50) / 100.0


@pytest.mark.parametrize(
    ("quantity", "unit", "factor"),
    [
        ("force", "kip", 4448.2216152605),
        ("force", "kips", 4448.2216152605),
        ("force", "KN", 1000.0),
        ("force", "lbf", 4.4482216152605),
        ("force", "kgf", 9.80665),
        ("load_pressure", "kgf/cm²", 98066.5),
        ("displacement", "in", 0.0254),
        ("displacement", "inches", 0.0254),
        ("velocity", "in/s", 0.0254),
        ("acceleration", "g", 9.80665),
        ("acceleration", "m/s^2", 1.0),
        ("acceleration", "cm/s²", 0.01),
        ("load_pressure", "ksi", 6.894757293168e6),
        ("load_pressure", "MPa", 1e6),
        ("flow", "gpm", 6.30901964e-5),
        ("flow", "L/min", 1e-3 / 60),
        ("time", "ms", 1e-3),
        ("spool", "%", 0.01),
        ("time", "Sec", 1.0),
        ("time", "seconds", 1.0),
        ("valve_command", "Volts", 1.0),
        ("spool", "percent", 0.01),
        ("velocity", "in/sec", 0.0254),
    ],
)
def test_unit_is_that_of_the_tables(quantity, unit, factor):
    assert to_si(quantity, unit) == pytest.approx(factor, rel=1e-9)


@pytest.mark.parametrize("unit", ["mN", "MPA", "mpa"])
def test_a_spelling_that_could_mean_another_unit_is_refused(unit):
    quantity = "force" if unit == "mN" else "load_pressure"
    with pytest.raises(ValueError, match=f"`{unit}`.*must be one of"):
        to_si(quantity, unit)


@pytest.mark.parametrize(
    ("header", "quantity", "unit"),
    [
        ("Force (kip)", "force", "kip"),
        ("disp [in]", "displacement", "in"),
        ("force_kN", "force", "kN"),
        ("Load Pressure (ksi)", "load_pressure", "ksi"),
        ("load_pressure", "load_pressure", None),
        ('"Time (s)"', "time", "s"),
        ("Temperature (C)", None, "C"),
        ("force_command", "command", None),
        ("Force, kN", "force", "kN"),
        ("Ch 1 Force", "force", None),
        ("Channel 2 Displacement (mm)", "displacement", "mm"),
        ("Axial Force Command", "command", None),
        ("Axial Displacement Feedback [mm]", "displacement", "mm"),
        ("velocity_mps", "velocity", "mps"),
    ],
)
def test_header(header, quantity, unit):
    assert parse_header(header)[:2] == (quantity, unit)


def test_semicolons_comments_a_unit_line_and_unknown_columns(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{t:.2f};{i};{2 * i}" for i, t in enumerate(TIME)]
    path.write_text("# made by us\nTime;Load;Mood\ns;kip;-\n" + "\n".join(rows) + "\n")
    traces = read_traces(path)
    assert traces.sample_rate == pytest.approx(100.0)
    assert traces.columns["force"] == pytest.approx(np.arange(50) * 4448.2216152605)
    assert list(traces.columns) == ["force"] and traces.ignored == ("Mood",)


def test_mat_file_with_units_in_names_and_by_option(tmp_path):
    from scipy.io import savemat

    path = tmp_path / "a.mat"
    savemat(path, {"t_s": TIME, "force_kip": TIME * 2, "x": TIME * 3, "note": "words", "gain": 4.0})
    traces = read_traces(path, units={"displacement": "in"})
    assert traces.columns["force"] == pytest.approx(TIME * 2 * 4448.2216152605)
    assert traces.columns["displacement"] == pytest.approx(TIME * 3 * 0.0254)
    with pytest.raises(ValueError, match=r"column `x` names no unit: .*--unit displacement=m.*mm"):
        read_traces(path)


def test_hdf5_file_with_units_as_attributes(tmp_path):
    import h5py

    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("test 1")
        group["force"] = TIME * 2
        group["force"].attrs["units"] = "kN"
        group["image"] = np.zeros((4, 4))
    with pytest.raises(ValueError, match=r"no column `time"):
        read_traces(path)
    traces = read_traces(path, sample_rate=100.0)
    assert traces.columns["force"] == pytest.approx(TIME * 2000.0)


def test_a_clock_written_with_few_digits_is_even(tmp_path):
    path = tmp_path / "a.csv"
    time = np.arange(5000) / 4096.0
    path.write_text("time (s),force (N)\n" + "\n".join(f"{t:.4f},1" for t in time) + "\n")
    assert read_traces(path).sample_rate == pytest.approx(4096.0, rel=1e-4)


def test_a_lost_sample_is_found(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{t:.2f},1" for i, t in enumerate(TIME) if i != 20]
    path.write_text("time (s),force (N)\n" + "\n".join(rows) + "\n")
    with pytest.raises(ValueError, match=r"sample 21 comes 0\.02 s"):
        read_traces(path)


def test_a_lost_sample_of_a_coarse_clock_is_found_too(tmp_path):
    path = tmp_path / "a.csv"
    time = np.delete(np.arange(5000) / 4096.0, range(3000, 3010))
    path.write_text("time (s),force (N)\n" + "\n".join(f"{t:.4f},1" for t in time) + "\n")
    with pytest.raises(ValueError, match=r"sample 3001 comes 0\.00[0-9]+ s"):
        read_traces(path)


MTS = (
    "MTS793|MPT|ENU|1|0|.|/|:|1|0|0|A\n\nData Header:\tTest 7\tTime:\t0.55\tSec\t12/3/2004 10:12:13 AM\n"
    "Data Acquisition\nTime\tCh 1 Displacement\tCh 1 Force\tCh 1 Force Command\t\nSec\tmm\tkN\tkN\t\n"
)


def test_text_of_a_testing_machine_with_its_preamble(tmp_path):
    path = tmp_path / "a.dat"
    path.write_text(MTS + "".join(f"{t:.6f}\t{i}\t{2 * i}\t{3 * i}\t\n" for i, t in enumerate(TIME)))
    traces = read_traces(path)
    assert traces.sample_rate == pytest.approx(100.0)
    assert traces["displacement"] == pytest.approx(np.arange(50) * 1e-3)
    assert traces["force"] == pytest.approx(np.arange(50) * 2e3)
    assert traces["command"] == pytest.approx(np.arange(50) * 3e3)


LABVIEW = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nTime\t10:12:13\n"
    "***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t50\t50\t\nDate\t2026/03/01\t2026/03/01\t\n"
    "Time\t10:12:13,1\t10:12:13,1\t\nY_Unit_Label\tVolts\tVolts\t\nX_Dimension\tTime\tTime\t\n"
    "X0\t0.0E+0\t0.0E+0\t\nDelta_X\t0.010000\t0.010000\t\n***End_of_Header***\t\t\t\n"
    "X_Value\tForce (kN)\tValve (Volts)\tComment\n"
)


@pytest.mark.parametrize("end", ["", "\t"])
def test_text_of_labview_with_its_preamble(end, tmp_path):
    path = tmp_path / "a.lvm"
    path.write_text(LABVIEW + "".join(f"{t:.6f}\t{i}\t{2 * i}{end}\n" for i, t in enumerate(TIME)))
    traces = read_traces(path, units={"time": "s"})
    assert traces.sample_rate == pytest.approx(100.0)
    assert traces["force"] == pytest.approx(np.arange(50) * 1e3)
    assert traces["valve_command"] == pytest.approx(np.arange(50) * 2.0)


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("Time (s);Force (kN)", "{t};{f}"),
        ("Time (s)\tForce (kN)", "{t}\t{f}"),
        ("Time (s)  Force (kN)", "{t}   {f}"),
        ('"Time (s)";"Force (kN)"', '"{t}";"{f}"'),
    ],
)
def test_decimal_commas(header, row, tmp_path):
    path = tmp_path / "a.txt"
    rows = [row.format(t=f"{t:.2f}", f=f"{2.5 * i:.3f}").replace(".", ",") for i, t in enumerate(TIME)]
    path.write_text("\n".join(["Versuch 3, 12.3.2004", "", header, *rows]))
    assert read_traces(path)["force"] == pytest.approx(np.arange(50) * 2500.0)


def test_a_unit_with_an_exponent_of_windows_and_a_column_of_words(tmp_path):
    path = tmp_path / "a.csv"
    rows = "".join(f"{t:.2f},{i},mark\n" for i, t in enumerate(TIME))
    path.write_bytes("time (s),acceleration (m/s²),note\n".encode("cp1252") + rows.encode())
    traces = read_traces(path)
    assert traces["acceleration"] == pytest.approx(np.arange(50.0)) and traces.ignored == ("note",)


def test_spool_in_volts_takes_the_sensor_of_the_rig(tmp_path):
    path = tmp_path / "a.csv"
    rig = eft.Rig.zhao2005()
    full = rig["servovalve.spool_sensitivity"] * rig["servovalve.spool_stroke"]
    path.write_text("time (s),spool (Volts)\n" + "".join(f"{t:.2f},{full * float(t)!r}\n" for t in TIME))
    assert read_traces(path, rig=rig)["spool"] == pytest.approx(TIME)
    with pytest.raises(ValueError, match=r"servovalve\.spool_sensitivity"):
        read_traces(path)


@pytest.mark.parametrize(
    ("rate", "form"),
    [
        *((rate, form) for rate in (1024.0, 4096.0) for form in (".6g", ".4f")),
        *((rate, ".3f") for rate in (256.0, 512.0, 1024.0, 1200.0)),
    ],
)
def test_a_clock_rounded_to_its_digits_is_even(form, rate, tmp_path):
    path = tmp_path / "a.csv"
    time = 3.0 + np.arange(60_000) / rate
    path.write_text("time (s),force (N)\n" + "".join(f"{t:{form}},1\n" for t in time))
    traces = read_traces(path)
    assert traces.sample_rate == rate and traces.start == pytest.approx(3.0, abs=1e-3)


@pytest.mark.parametrize(
    ("rate", "form", "lost"),
    [
        *((1024.0, ".6g", 1), (1024.0, ".6g", 3), (4096.0, ".4f", 1)),
        *((1000.0, ".3f", 1), (1000.0, ".3f", 10), (1024.0, ".3f", 1), (512.0, ".3f", 1)),
    ],
)
def test_a_lost_sample_of_a_rounded_clock_is_found(rate, form, lost, tmp_path):
    path = tmp_path / "a.csv"
    time = np.delete(np.arange(60_000) / rate, range(30_000, 30_000 + lost))
    path.write_text("time (s),force (N)\n" + "".join(f"{t:{form}},1\n" for t in time))
    with pytest.raises(ValueError, match="time is not evenly spaced"):
        read_traces(path)


def test_a_tdms_file_is_a_waveform_with_units(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "a.tdms"
    about = {"wf_increment": 0.01, "wf_start_offset": 2.0}
    channels = [
        nptdms.ChannelObject("test", "Load", TIME * 2, properties={"unit_string": "kN", **about}),
        nptdms.ChannelObject("test", "Mood", TIME.astype("f4"), properties=about),
    ]
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(channels)
    traces = read_traces(path)
    assert (traces.sample_rate, traces.start) == (pytest.approx(100.0), 2.0)
    assert traces["force"] == pytest.approx(TIME * 2000.0) and traces.ignored == ("Mood",)


def test_a_universal_file_holds_signals_over_time(tmp_path):
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "a.uff"
    common = {
        "type": 58, "func_type": 1, "rsp_node": 1, "rsp_dir": 1,
        "ref_node": 1, "ref_dir": 1,
        "abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 0.01, "num_pts": TIME.size,
        "x": TIME,
        "ord_data_type": 4, "abscissa_spec_data_type": 17, "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0,
        "id2": "", "id3": "", "id4": "", "id5": "",
    }  # fmt: skip
    sets = [
        {"id1": "Force", "ordinate_axis_units_lab": "kN", "data": TIME * 2},
        {"id1": "Disp", "ordinate_axis_units_lab": "mm", "data": TIME * 3},
    ]
    pyuff.UFF(str(path)).write_sets([common | one for one in sets], "overwrite")
    traces = read_traces(path)
    assert traces.sample_rate == pytest.approx(100.0)
    assert traces["force"] == pytest.approx(TIME * 2000.0)
    assert traces["displacement"] == pytest.approx(TIME * 3e-3)


def test_signals_are_shown_in_one_line_without_their_samples():
    run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(2000.0, 0.5, 5.0, 1.0, 1024.0))
    shown = repr(eft.traces.Traces.from_run(run, "mine"))
    assert shown.startswith("<eft.traces.Traces of mine: 1024 samples at 1024 Hz, command, force, ")
    assert len(shown) < 600 and "array" not in shown
    assert "array" not in repr(eft.replay(run.rig, run)) and "array" not in repr(eft.compare(run, run))


def test_signals_are_found_by_name():
    run = eft.simulate(eft.Rig.zhao2005(), eft.sine_sweep(1000.0, 0.5, 5.0, 0.5, 1024.0))
    traces = eft.traces.Traces.from_run(run)
    assert "force" in traces
    assert not any(name in traces for name in ("forc", 0, [], None))
    with pytest.raises(TypeError, match="'Traces' object is not iterable"):
        list(traces)
