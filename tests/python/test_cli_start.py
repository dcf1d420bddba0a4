"""Start of the script `eft`: fast, and without a traceback after an interrupt."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import eft

SCRIPT = "import sys, _eft_script; sys.exit(_eft_script.main())"
# Says when the test runs: a busy machine takes any time until then.
TELLING = f"""
import eft

simulate = eft.simulate


def telling(*arguments, progress=None, **named):
    def told(samples, total):
        if samples > 1:
            print("running", flush=True)
        progress(samples, total)

    return simulate(*arguments, progress=progress and told, **named)


eft.simulate = telling
{SCRIPT}
"""


@pytest.mark.skipif(os.name != "posix", reason="interrupts are sent as signals")
def test_an_interrupt_while_the_package_loads_is_one_line(tmp_path):
    package = tmp_path / "eft"
    package.mkdir()
    (package / "__init__.py").write_text("import time\nprint('loading', flush=True)\ntime.sleep(60)\n")
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, "--help"],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stdout.readline() == "loading\n"
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=30)[1] == "eft: interrupted\n"
    assert process.returncode == 130


@pytest.mark.skipif(os.name != "posix", reason="closes a stream in a shell")
@pytest.mark.parametrize("closed", ["2>&-", ">&-", ">&- 2>&-"])
def test_a_closed_stream_does_not_change_the_answer(closed, tmp_path):
    words = f"{sys.executable} -c '{SCRIPT}' run --sweep 1000 0.5 5 1 {closed}"
    assert subprocess.run(["sh", "-c", words], cwd=tmp_path).returncode == 0
    assert (tmp_path / "run.eft").exists()


@pytest.mark.skipif(os.name != "posix", reason="closes a pipe in a shell")
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no full device")
@pytest.mark.parametrize("words", ["", "chek", "check nowhere.toml"])
def test_an_error_that_cannot_be_written_is_no_answer(words, tmp_path):
    with Path("/dev/full").open("w") as full:
        process = subprocess.run([sys.executable, "-m", "eft", *words.split()], cwd=tmp_path, stderr=full)
    assert process.returncode == 2


def test_a_reader_that_ends_early_is_not_an_answer(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, "run", "--sweep", "1000", "0.5", "5", "1"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=tmp_path,
    )
    with process:
        process.stdout.close()
        assert process.stderr.read() == b""
    # As of a program that SIGPIPE ends; 1 is the verdict no.
    assert process.returncode == 141
    assert (tmp_path / "run.eft").exists()


# Friction needs very short steps, so only few samples are simulated and written.
SLOW = ["--set", "actuator.friction=2000", "--set", "actuator.friction_velocity=1e-5"]
SWEEP = ["--sweep", "8900", "0.5", "10"]
LONG = [*SWEEP, "1000", *SLOW]
STUDY = "[command]\nkind='sweep'\namplitude=1.0\nf_start=0.5\nf_end=9.0\nduration=6.0\n" + (
    "[study.grid]\n'compensation.level' = { low = 0.5, high = 1.0, count = 400 }\n"
)
# At once, and so far apart that later ones meet what the first has begun to save.
INTERRUPTED = [(command, gap) for command in (["run", *LONG], ["study", "a.toml"]) for gap in (0.0, 0.05)]


@pytest.mark.skipif(os.name != "posix", reason="interrupts are sent as signals")
@pytest.mark.parametrize(
    ("command", "gap"),
    [*INTERRUPTED, (["check", *SWEEP, "60", *SLOW], 0.003)],
    ids=lambda it: it[0] if isinstance(it, list) else it,
)
def test_five_interrupts_in_a_row_leave_whole_files_and_no_traceback(command, gap, tmp_path):
    (tmp_path / "a.toml").write_text(eft.Rig.zhao2005().to_toml() + STUDY)
    study = tmp_path / "a.study"
    process = subprocess.Popen(
        [sys.executable, "-c", TELLING, *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
    )
    with process:
        if command[0] == "study":
            deadline = time.monotonic() + 100
            while not list(study.glob("part-*")) and time.monotonic() < deadline:
                time.sleep(0.02)
        else:
            assert process.stdout.readline() == "running\n"
        for _ in range(5):
            process.send_signal(signal.SIGINT)
            time.sleep(gap)
        said = process.communicate(timeout=30)[1]
    assert process.returncode == 130, said
    assert "interrupted" in said and "Traceback" not in said and "panicked" not in said, said
    # What was finished is kept and whole; of the rest there is nothing, and no temporary file.
    left = {path.name for path in tmp_path.iterdir()} - {"a.toml"}
    if command[0] == "study":
        assert left == {"a.study"} and not list(study.glob(".*"))
        assert 0 < len(eft.Study.load(study)) < 400
    else:
        assert left <= ({"run.eft"} if command[0] == "run" else set())
        assert not left or len(eft.TestRun.load(tmp_path / "run.eft")) > 1


def test_help_loads_neither_plots_nor_tables_nor_files_of_others():
    heavy = ("matplotlib", "scipy", "pandas", "pyarrow", "h5py", "distributed")
    program = (
        f"import sys, eft.cli; eft.cli.main(['--help']); print([m for m in {heavy} if m in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "eft init test.toml" in answer.stdout
    assert answer.stdout.splitlines()[-1] == "[]"


def test_the_package_runs_as_the_script_does():
    told = [
        subprocess.run([sys.executable, *start, "run", "--bogus"], capture_output=True, text=True)
        for start in (["-m", "eft"], ["-c", SCRIPT])
    ]
    assert told[0].returncode == told[1].returncode == 2
    assert told[0].stderr == told[1].stderr and "--bogus" in told[0].stderr
