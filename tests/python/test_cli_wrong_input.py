"""The command line with wrong input: one line, exit code 2, no file, no traceback."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import eft
from eft.cli import main
from mistakes import SWEEP, WRONG, paper


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_input_is_one_clear_line(name, tmp_path, monkeypatch, capfd):
    arguments, files, expected = WRONG[name]
    for file, text in files.items():
        (tmp_path / file).write_bytes(text if isinstance(text, bytes) else text.encode())
    before = contents(tmp_path)
    monkeypatch.chdir(tmp_path)
    code = main(arguments)
    said = capfd.readouterr()
    assert code == 2, said
    assert said.out == ""
    assert said.err.startswith("eft") and said.err.count("\n") == 1, said.err
    assert "Traceback" not in said.err and "Errno" not in said.err and "os error" not in said.err
    for word in expected:
        assert word in said.err
    assert contents(tmp_path) == before


def test_the_table_is_long_enough():
    assert len(WRONG) >= 40


def test_a_test_larger_than_the_memory_is_refused_before_it_runs(monkeypatch, capfd, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "sysconf", lambda _name: 1000)
    assert main(["run", "--sweep", "1", "0", "10", "10"]) == 2
    assert "40960 samples need" in capfd.readouterr().err
    assert main(SWEEP) == 0


def test_simulate_and_study_refuse_a_test_larger_than_the_memory(monkeypatch):
    rig, command = eft.Rig.zhao2005(), eft.sine_sweep(1.0, 0.0, 10.0, duration=10.0, sample_rate=4096.0)
    for name, pages, refused in (("too small", 1, True), ("large enough", 1_000_000, False)):
        monkeypatch.setattr(os, "sysconf", {"SC_PHYS_PAGES": pages, "SC_PAGE_SIZE": 4096}.__getitem__)
        for run in (
            lambda: eft.simulate(rig, command),
            lambda: eft.study(rig, command, {"compensation.level": [1.0]}, progress=False),
        ):
            if refused:
                with pytest.raises(ValueError, match=r"40960 samples .*need"):
                    run()
            else:
                assert len(run()) in (1, 40960), name


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_folder_that_lets_nobody_in(tmp_path, monkeypatch, capfd):
    tmp_path.chmod(0o500)
    monkeypatch.chdir(tmp_path)
    assert main(SWEEP) == 2
    assert capfd.readouterr().err.count("\n") == 1


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
@pytest.mark.parametrize(
    "arguments",
    [
        ["init", "--force", "pipe"],
        ["export", "rig.toml", "--target", "c", "-o", "pipe"],
        [*SWEEP, "-o", "pipe.eft"],
    ],
)
def test_a_device_is_not_replaced_by_a_file(arguments, tmp_path, monkeypatch, capfd):
    # A pipe replaces /dev/null, which a process of root could destroy.
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.toml").write_text(eft.Rig.zhao2005().to_toml())
    for name in ("pipe", "pipe.eft"):
        os.mkfifo(name)
    assert main(arguments) == 2
    assert "is no ordinary file" in capfd.readouterr().err
    assert {path.name for path in tmp_path.iterdir()} == {"rig.toml", "pipe", "pipe.eft"}
    assert not any(Path(name).is_file() for name in ("pipe", "pipe.eft"))


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    text = paper().replace("\n", "\r\n")
    Path("test.toml").write_bytes(text.encode("utf-8-sig"))
    assert main(["run", "test.toml"]) == 0, capfd.readouterr().err


# Files of this process may have 20 kB, so that writing fails midway as on a full disk.
CRAMPED = """
import resource, sys

from eft.cli import main

resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
sys.exit(main(["run", "--sweep", "1000", "0.5", "5", "2", "-o", sys.argv[1]]))
"""


@pytest.mark.skipif(os.name != "posix", reason="limits the size of files")
@pytest.mark.parametrize("suffix", [".eft", ".csv", ".h5", ".parquet", ".mat", ".tdms"])
def test_a_file_that_cannot_be_finished_is_named_in_one_line(suffix, tmp_path):
    call = [sys.executable, "-c", CRAMPED, f"run{suffix}"]
    process = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True)
    assert process.returncode == 2
    (line,) = process.stderr.splitlines()
    assert line.startswith(f"eft run: run{suffix}: ") and "File too large" in line
    assert not list(tmp_path.iterdir())


def test_a_full_disk_leaves_the_old_file(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.csv").write_text("old")

    def full(*_args, **_options):
        raise OSError(28, "No space left on device", "run.csv")

    monkeypatch.setattr(np, "savetxt", full)
    assert main([*SWEEP, "-o", "run.csv"]) == 2
    assert (tmp_path / "run.csv").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]
    assert "No space left" in capfd.readouterr().err
