"""Signals of others: units, headers, MAT and HDF5 files, clocks."""

import numpy as np
import pytest

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
    with pytest.raises(ValueError, match=r"column `x` has no unit"):
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
