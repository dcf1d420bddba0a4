"""Saved runs of unknown origin or with damage: an error of one sentence, and bounded memory."""

import io
import json
import os
import random
import zipfile
from pathlib import Path

import numpy as np
import pytest

import eft
from eft.cli import main

RIG = eft.Rig.zhao2005()


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    run = eft.simulate(RIG, eft.sine_sweep(8900.0, 0.5, 4.0, 0.5, 256.0))
    return run.save(tmp_path_factory.mktemp("run") / "run.eft").read_bytes()


def contents(saved):
    with np.load(io.BytesIO(saved), allow_pickle=False) as archive:
        return dict(archive)


def refused(path, capsys):
    """The error of the command line for a file, which must be one line with exit code 2."""
    capsys.readouterr()
    assert main(["report", str(path), "-o", str(path.with_suffix(".html"))]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and str(path) in said and len(said) < 600, said
    return said


def test_an_archive_that_unpacks_to_far_more_is_refused_before(saved, tmp_path, peak_memory):
    arrays = contents(saved)
    for name in ("command", "force"):
        arrays[name] = np.zeros(12_000_000)
    bomb = tmp_path / "bomb.eft"
    with bomb.open("wb") as file:
        np.savez_compressed(file, **arrays)
    del arrays
    assert bomb.stat().st_size < 2_000_000
    with peak_memory(64), pytest.raises(ValueError, match="its arrays declare"):
        eft.TestRun.load(bomb)


def test_what_is_not_asked_for_is_not_read(saved, tmp_path, peak_memory):
    file = tmp_path / "more.eft"
    with file.open("wb") as target:
        np.savez(target, **contents(saved), more=np.zeros(20_000_000))
    with peak_memory(16):
        assert len(eft.TestRun.load(file)) == 128


@pytest.mark.parametrize(
    ("name", "value"),
    [("scale", value) for value in ("1e999", "2", True, float("nan"), 10**400, [1.0])]
    + [("mass", value) for value in (-5.0, 0.0, float("inf"), True, "7040", [True], [], [[7040.0]])],
)
def test_a_ground_motion_of_impossible_scale_or_mass_is_refused(saved, name, value, tmp_path, capsys):
    arrays, file = contents(saved), tmp_path / "run.eft"
    arrays["about"] = json.dumps(json.loads(str(arrays["about"])) | {name: value})
    with file.open("wb") as target:
        np.savez(target, **arrays)
    assert f"{name} is " in refused(file, capsys)


def member(header):
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header


@pytest.mark.parametrize(
    "header",
    [
        b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,)}\n",
        b"{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}\n",
        b"{'descr': '|O', 'fortran_order': False, 'shape': (3,)}\n",
        b"{'descr': '<f8', 'fortran_order': False, 'shape': (3,)",
        b"{'descr': '<U100000000', 'fortran_order': False, 'shape': ()}\n",
        b"(" * 5000,
        b"",
    ],
)
def test_an_array_that_declares_what_it_does_not_hold(saved, header, tmp_path, peak_memory, capsys):
    file = tmp_path / "run.eft"
    with zipfile.ZipFile(io.BytesIO(saved)) as old, zipfile.ZipFile(file, "w") as new:
        for name in old.namelist():
            new.writestr(name, member(header) if name == "force.npy" else old.read(name))
    with peak_memory(64), pytest.raises(ValueError, match="not a test saved by eft"):
        eft.TestRun.load(file)
    refused(file, capsys)


def test_a_directory_of_many_entries_is_refused(tmp_path, peak_memory):
    file = tmp_path / "many.eft"
    with zipfile.ZipFile(file, "w") as archive:
        for number in range(30_000):
            archive.writestr(str(number), b"")
    with peak_memory(4), pytest.raises(ValueError, match="directory of the archive"):
        eft.TestRun.load(file)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sample_rate", np.float64(1e300)),
        ("sample_rate", np.float64("nan")),
        ("sample_rate", np.array([1.0, 2.0])),
        ("format", np.array("one")),
        ("format", np.int64(99)),
        ("rig", np.array("a = [")),
        ("rig", np.array("a." * 100_000 + "a = 1")),
        ("rig", np.zeros(3)),
        ("dtype", np.array("<script>")),
        ("command", np.zeros((2, 2, 2))),
        ("force", np.full(128, np.nan)),
        ("status", np.zeros(3)),
        ("found_flows", np.zeros(3)),
    ],
)
def test_a_field_of_another_kind_is_one_sentence(saved, name, value, tmp_path, capsys):
    file = tmp_path / "run.eft"
    with file.open("wb") as target:
        np.savez(target, **contents(saved) | {name: value})
    refused(file, capsys)


def test_a_run_of_no_samples_is_one_sentence(saved, tmp_path, capsys):
    file = tmp_path / "run.eft"
    with file.open("wb") as target:
        np.savez(
            target, **{name: array[:0] if array.shape else array for name, array in contents(saved).items()}
        )
    refused(file, capsys)


def complaint(read, path):
    """The error of a reader for a file; empty if it reads the file."""
    try:
        read(path)
    except ValueError as error:
        return str(error)
    return ""


def test_damaged_runs_are_one_sentence(saved, tmp_path, capsys):
    chance = random.Random(5)
    file = tmp_path / "run.eft"
    whole = 0
    for _ in range(150):
        data = bytearray(saved)
        if chance.random() < 0.3:
            del data[chance.randrange(len(data)) :]
        # The headers and the directory, where a flipped byte has the most effect.
        for _ in range(chance.randint(1, 4)):
            at = chance.randrange(-min(len(data), 3000), min(len(data), 3000)) if data else 0
            data[at : at + 1] = bytes([chance.randrange(256)])
        file.write_bytes(data)
        said = complaint(eft.TestRun.load, file)
        whole += not said
        assert not said or (said.startswith(f"{file}: ") and "\n" not in said)
    assert whole < 75


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes in the file system")
def test_pipes_and_devices_are_refused_at_once(tmp_path, capsys):
    for name in ("pipe.eft", "pipe.csv", "pipe.mat", "pipe.h5", "pipe.parquet", "pipe.toml"):
        os.mkfifo(tmp_path / name)
        command = "run" if name.endswith("toml") else "compare"
        arguments = [str(tmp_path / name)] * (2 if command == "compare" else 1)
        assert main([command, *arguments]) == 2
        assert "is a pipe or a device, must be an ordinary file" in capsys.readouterr().err
    assert main(["run", "--record", "/dev/zero"]) == 2
    assert main(["run", "--rig", "/dev/zero", "--record", "elcentro"]) == 2
    assert capsys.readouterr().err.count("is a pipe or a device") == 2


@pytest.mark.skipif(not Path("/proc/kmsg").exists(), reason="no file of the kernel that waits")
def test_files_of_the_kernel_are_refused_at_once(tmp_path, capsys):
    (tmp_path / "a.csv").symlink_to("/proc/kmsg")
    for arguments in (
        ["check", "/proc/kmsg"],
        ["check", "/proc/self/status"],
        ["run", "--record", "/proc/kmsg"],
        ["compare", str(tmp_path / "a.csv"), str(tmp_path / "a.csv")],
    ):
        assert main(arguments) == 2
        said = capsys.readouterr().err
        assert "is a file of the kernel, must be an ordinary file" in said and said.count("\n") == 1, said


@pytest.mark.parametrize("code", [0xD800, 0xDFFF, 0x110000, 0xFFFFFFFF])
def test_a_text_of_numbers_that_are_no_characters_is_refused(code, saved, tmp_path, capsys):
    arrays = contents(saved)
    texts = [name for name, array in arrays.items() if array.dtype.kind == "U"]
    assert texts
    for name in texts:
        codes = np.frombuffer(arrays[name].tobytes(), np.uint32).copy()
        codes[codes.size // 2] = code
        file = tmp_path / f"{name}.eft"
        with file.open("wb") as target:
            np.savez(
                target, **arrays | {name: np.frombuffer(codes.tobytes(), arrays[name].dtype).reshape(())}
            )
        assert f"{name} is no text" in refused(file, capsys)
