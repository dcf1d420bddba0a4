"""A saved run: the same bits again, its origin, files of older versions, and files that are refused."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import eft
from eft.report import write_report
from eft.traces import write_run

DATA = Path(__file__).parent / "data"
RIG = eft.Rig.zhao2005()
SHORT = eft.sine_sweep(2200.0, 0.0, 10.0, 4.0, 1024.0)


@pytest.fixture(scope="module")
def run():
    return eft.simulate(RIG, SHORT)


def test_a_saved_run_comes_back_bit_for_bit(tmp_path):
    rig = RIG.replace({"sensors.seed": 17, "name": "Fußgängerbrücke"})
    run = eft.simulate(rig, SHORT, dtype="f32")
    path = tmp_path / "test.eft"
    assert run.save(path) == path
    assert list(tmp_path.iterdir()) == [path]
    for back in (eft.TestRun.load(str(path)), pickle.loads(pickle.dumps(run))):
        for name in run._traces:
            np.testing.assert_array_equal(getattr(back, name), getattr(run, name))
        assert back.rig == rig and back.seed == 17 and back.dtype == "f32"
        assert back.version == eft.__version__ and back.sample_rate == 1024.0
        assert back.metrics() == run.metrics()
    with np.load(path, allow_pickle=False) as archive:
        assert str(archive["version"]) == eft.__version__
        assert int(archive["seed"]) == 17
        assert eft.Rig(str(archive["rig"])) == rig


@pytest.mark.parametrize("suffix", [".csv", ".h5", ".hdf5", ".parquet", ".mat", ".MAT", ".tdms"])
def test_a_run_is_not_saved_under_the_name_of_another_format(tmp_path, run, suffix):
    expected = rf"run\{suffix}: `save` writes a run file, not .*`eft\.traces\.write_run"
    with pytest.raises(ValueError, match=expected):
        run.save(tmp_path / f"run{suffix}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["run.eft", "run.npz", "run", "test.2026-11"])
def test_a_run_is_saved_under_any_other_name(tmp_path, run, name):
    assert eft.TestRun.load(run.save(tmp_path / name)).rig == run.rig


def test_a_run_saved_by_the_first_format_is_still_read(tmp_path):
    run = eft.TestRun.load(DATA / "single-format-1.eft")
    assert (len(run), run.sample_rate, run.dtype, run.version) == (256, 1024.0, "f32", "0.1.0")
    assert run.rig["name"] == "kept from before" and run.seed == 5
    assert run.force.sum() == 247004.07438617744 and run.measured_force.sum() == 247454.35777115411
    assert run.acceleration is not None and run.acceleration.sum() == -5.141331472450961
    assert np.abs(run.spool).max() == 0.01644341060636544 and run.found_flows.sum() == -0.0011179206194356084
    assert "test_ratio" not in run and run.energy is None
    assert (run.date, run.record, run.scale, run.mass) == ("", "", None, None)
    again = eft.TestRun.load(run.save(tmp_path / "again.eft"))
    for name in run._traces:
        np.testing.assert_array_equal(getattr(again, name), getattr(run, name))
    building = eft.TestRun.load(DATA / "building-format-1.eft")
    assert building.command.shape == (2, 128) and building.force.sum() == 221893.32686160645
    assert building.metrics()["nrmse"].shape == (2,)


def test_a_saved_run_says_where_it_comes_from(tmp_path):
    motion = eft.Record(0.5 * np.sin(np.arange(200) / 5.0), 0.02, "a quake")
    command = eft.effective_force(motion, mass=7040.0, sample_rate=1024.0, scale=0.5)
    run = eft.simulate(RIG, command)
    path = run.save(tmp_path / "run.eft")
    back = eft.TestRun.load(path)
    for one in (run, back):
        assert (one.record, one.scale, one.mass) == ("a quake", 0.5, 7040.0)
        assert one.date.startswith("20") and one.date.endswith("+00:00")
    assert back.date == run.date and back.measured_force is back.force
    with np.load(path, allow_pickle=False) as archive:
        about = json.loads(str(archive["about"]))
        assert about["units"]["force"] == "N" and about["record"] == "a quake"
        # Traces that refer to another one, and constant ones.
        assert str(archive["measured_force"]) == "force" and float(archive["supply_pressure"]) == 1.9e7
        traces = sum(archive[name].nbytes for name in archive.files)
    assert path.stat().st_size < 0.95 * traces
    stories = {"masses": [7e3, 8e3], "dampings": [4e3, 4e3], "stiffnesses": [7e5, 7e5]}
    rig = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    run = eft.simulate(rig, eft.effective_force(motion, mass=[7e3, 8e3], sample_rate=512.0))
    back = eft.TestRun.load(run.save(path))
    np.testing.assert_array_equal(back.mass, [7e3, 8e3])
    assert back.actuator(1).mass == 8e3 and back.energy == run.energy


def test_a_saved_floor_of_a_building_keeps_its_place(tmp_path):
    stories = {"masses": [7e3, 8e3], "dampings": [4e3, 4e3], "stiffnesses": [7e5, 7e5]}
    rig = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    motion = eft.Record(0.1 * np.sin(np.arange(100) / 5.0), 0.02, "a quake")
    run = eft.simulate(rig, eft.effective_force(motion, mass=[7e3, 8e3], sample_rate=512.0))
    path = run.actuator(1).save(tmp_path / "floor.eft")
    back = eft.TestRun.load(path)
    assert back.verdict == run.actuator(1).verdict
    assert np.isnan(back.metrics()["displacement_error"])
    for wrong in (2, -1, "1", 1.0):
        with pytest.raises(ValueError, match="not a test saved by eft: floor is"):
            eft.TestRun.load(rewritten(path, floor=wrong))


def test_saving_over_a_file_leaves_the_old_one_when_it_fails(tmp_path, run, monkeypatch):
    path = tmp_path / "test.npz"
    run.save(path)
    before = path.read_bytes()

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np.lib.format, "write_array", full)
    with pytest.raises(OSError, match="No space left"):
        run.save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_files_that_are_no_saved_runs_are_refused(tmp_path, run):
    with pytest.raises(FileNotFoundError):
        eft.TestRun.load(tmp_path / "nowhere.npz")
    path = tmp_path / "test.npz"
    run.save(path)
    whole = path.read_bytes()
    with np.load(path) as archive:
        stored = dict(archive)

    def refused(says):
        with pytest.raises(ValueError, match=rf"test\.npz: not a test saved by eft: .*{says}"):
            eft.TestRun.load(path)

    for cut in (0, 1, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:cut])
        refused("")
    path.write_bytes(b"time,force\n0,1\n")
    refused("")
    with path.open("wb") as file:
        np.save(file, np.zeros(3))
    refused("no archive of arrays")
    for spoil, says in [
        ({"format": np.int64(99)}, "format 99 is later than 2"),
        ({"force": stored["force"][:-1]}, "force is float64 of shape"),
        ({"status": stored["status"].astype(float)}, "status is float64"),
        ({"rig": np.array("a = ")}, "line 1, column"),
        ({"dtype": np.array("f16")}, "dtype is 'f16'"),
    ]:
        np.savez(path, **(stored | spoil))
        refused(says)
    np.savez(path, **{name: value for name, value in stored.items() if name != "spool"})
    refused("has no 'spool'")
    np.savez(path, **(stored | {"force": np.array([{}], dtype=object)}))
    refused("")


def rewritten(path, leave_out=(), **about):
    """The saved run without some members, and with other entries of its origin."""
    with np.load(path, allow_pickle=False) as archive:
        stored = {name: archive[name] for name in archive.files if name not in leave_out}
    told = json.loads(str(stored.get("about", "{}"))) | about
    with path.open("wb") as file:
        np.savez(file, **(stored | ({} if "about" in leave_out else {"about": np.array(json.dumps(told))})))
    return path


def before(path, *later):
    """The saved run as a version without some traces would have written it."""
    with np.load(path, allow_pickle=False) as archive:
        about = json.loads(str(archive["about"]))
    units = {name: unit for name, unit in about["units"].items() if name not in later}
    absent = [name for name in about["absent"] if name not in later]
    return rewritten(path, later, units=units, absent=absent)


def test_a_run_of_a_version_without_a_trace_is_read(tmp_path):
    rig = RIG.replace({"compensation.adaptive": True, "sensors.force.noise": 10.0})
    run = eft.simulate(rig, SHORT)
    later = (
        "velocity_delay_estimate",
        "valve_gain_estimate",
        "measured_load_pressure",
        "null_offset_deviation",
    )
    path = before(run.save(tmp_path / "old.eft"), *later)
    old = eft.TestRun.load(path)
    again = eft.TestRun.load(old.save(tmp_path / "again.eft"))
    for one in (old, again, old.to_its_end(), pickle.loads(pickle.dumps(old))):
        for name in later:
            said = rf"^{name} .*: eft 0\.1\.0, .* did not record it\. Run the test again"
            with pytest.raises(AttributeError, match=said):
                getattr(one, name)
            assert name not in one and not hasattr(one, name)
        # A trace that the version knew and the rig has not is no error.
        assert one.acceleration is None and "acceleration" not in one
        assert "force" in one and "status" in one and "flow_gain_estimate" in one
        assert one.metrics() == run.metrics() and one.verdict.ok == run.verdict.ok
    assert list(old.to_pandas().columns) == [name for name in run._traces if name not in later]
    assert list(old.to_xarray().data_vars) == list(old.to_pandas().columns) == list(again._traces)
    old.plot()
    page = write_report(old, tmp_path / "old.html").read_text(encoding="utf-8")
    whole = write_report(run, tmp_path / "new.html").read_text(encoding="utf-8")
    assert "Velocity delay that" in whole and "Velocity delay that" not in page
    assert "Response delay that" in page
    written = write_run(old, tmp_path / "old.csv").read_text(encoding="utf-8")
    assert "flow_gain_estimate" in written and "valve_gain_estimate" not in written


@pytest.mark.parametrize("version", [2, 3])
def test_a_run_of_a_version_whose_calibrations_had_no_evidence_is_read(tmp_path, version):
    run = eft.simulate(RIG.replace({"compensation.adaptive": True}), SHORT)
    saved = run.save(tmp_path / "old.eft")
    with np.load(saved, allow_pickle=False) as archive:
        (told,) = json.loads(str(archive["about"]))["calibrations"]
    of_version = ["asymmetry", "asymmetry_deviation", "departures", "departure_deviations", "error"]
    share = 0.0 if version == 2 else told["curve"]["flow_gain_share"]
    of_version += ["flow_gain_share"] * (version - 2)
    told["curve"] = {name: told["curve"][name] for name in of_version}
    del told["evidence"]
    told |= {"version": version, "deviations": dict.fromkeys(run.calibration.evidence.distances, 1e-3)}
    old = eft.TestRun.load(rewritten(saved, calibrations=[told])).calibration
    assert old.version == version and old.curve.flow_gain_share == share
    assert old.evidence.time == 0.0 and old.curve.time == 0.0
    assert old.flow_gain == run.calibration.flow_gain
    # A controller does not start from it.
    with pytest.raises(ValueError, match=rf"calibration\.version = {version}: must be 4: repeat the test"):
        RIG.replace({"compensation.adaptive": True, "calibration": old})


def test_a_floor_of_an_old_run_lacks_the_same_traces(tmp_path):
    stories = {"masses": [7e3, 8e3], "dampings": [4e3, 4e3], "stiffnesses": [7e5, 7e5]}
    rig = RIG.replace({"structure.kind": "shear_building", "structure.stories": stories})
    run = eft.simulate(rig, eft.Command(np.full((2, 64), 500.0), 1024.0))
    old = eft.TestRun.load(before(run.save(tmp_path / "old.eft"), "test_ratio")).actuator(1)
    assert "test_ratio" not in old and "force" in old
    with pytest.raises(AttributeError, match=r"^test_ratio is not in this file"):
        _ = old.test_ratio


def test_a_trace_that_its_version_recorded_is_damage_where_it_is_missing(tmp_path, run):
    for name in ("test_ratio", "velocity_delay_estimate", "force", "measured_spool"):
        path = rewritten(run.save(tmp_path / "test.eft"), [name])
        with pytest.raises(ValueError, match=rf"test\.eft: not a test saved by eft: has no '{name}'"):
            eft.TestRun.load(path)
    # No version was without the traces of the plant.
    with pytest.raises(ValueError, match="has no 'spool'"):
        eft.TestRun.load(before(run.save(tmp_path / "test.eft"), "spool"))
    sensed = eft.simulate(RIG.replace({"controller.velocity_source": "accelerometer"}), SHORT)
    path = rewritten(sensed.save(tmp_path / "test.eft"), ["acceleration"])
    with pytest.raises(ValueError, match="has no 'acceleration'"):
        eft.TestRun.load(path)
    path = rewritten(run.save(tmp_path / "test.eft"), ["about"])
    with pytest.raises(ValueError, match="has no 'about'"):
        eft.TestRun.load(path)


def test_wrong_tables_of_traces_are_refused(tmp_path, run):
    for wrong in ({"units": 3}, {"absent": 3}, {"absent": [3]}, {"absent": "acceleration"}):
        path = rewritten(run.save(tmp_path / "test.eft"), **wrong)
        with pytest.raises(ValueError, match=r"test\.eft: not a test saved by eft: "):
            eft.TestRun.load(path)
