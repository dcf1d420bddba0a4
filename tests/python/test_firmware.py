"""Export of a rig to firmware, and the firmware in the loop."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import eft
from eft.cli import main

RIGS = Path(__file__).resolve().parents[2] / "firmware" / "rigs"


@pytest.mark.parametrize("name", ["uneven", "adaptive", "guarded", "worn"])
@pytest.mark.parametrize(("target", "file"), [("rust", "src/{}.rs"), ("c", "{}.h")])
def test_export_is_what_the_firmware_holds(target, file, name, tmp_path):
    rig, file = RIGS / f"{name}.toml", file.format(name)
    text = eft.firmware.export(eft.Rig.from_toml(rig), target)
    assert text == (RIGS / file).read_text(encoding="utf-8")
    assert main(["export", str(rig), "--target", target, "-o", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out").read_text(encoding="utf-8") == text


def test_an_observer_s_mass_is_exported_with_it():
    by_force = {"controller.velocity_source": "observer", "controller.observer_mass": 7041.0}
    for target in ("rust", "c"):
        force = eft.firmware.export(eft.Rig.zhao2005().replace(by_force), target)
        measured = eft.firmware.export(
            eft.Rig.zhao2005().replace({"controller.velocity_source": "accelerometer"}), target
        )
        assert "7041.0" in force
        assert "7041.0" not in measured
        gains = eft.linear.observer_gains(
            eft.Rig.zhao2005().replace({"controller.velocity_source": "accelerometer"})
        )
        assert all(repr(gain) in measured for gain in gains)


def test_export_goes_beside_the_rig(tmp_path, capsys):
    shutil.copy(RIGS / "uneven.toml", tmp_path / "mine.toml")
    assert main(["export", str(tmp_path / "mine.toml"), "--target", "c"]) == 0
    assert "controller of uneven at 5000 Hz" in (tmp_path / "mine.h").read_text(encoding="utf-8")
    assert capsys.readouterr().out == f"{tmp_path / 'mine.h'} written\n"


def test_what_firmware_has_not_is_refused():
    rig = eft.Rig.zhao2005().replace({"compensation.computation_delay": 2})
    with pytest.raises(ValueError, match=r"compensation\.computation_delay = 2: must be 0 for firmware"):
        eft.firmware.export(rig, "rust")
    with pytest.raises(ValueError, match='target = ada: must be "rust", "c" or "fmu"'):
        eft.firmware.export(eft.Rig.zhao2005(), "ada")


def test_a_table_that_is_too_long_for_c_is_refused_with_the_remedy():
    openings, flows = (eft.Rig.zhao2005()[f"servovalve.flow_table.{name}"] for name in ("openings", "flows"))
    rig = eft.Rig.zhao2005().replace({"servovalve.overlap": -0.01})
    said = (
        r"^servovalve\.overlap = -0\.01: needs 22 points, and C has 21: leave at least 1 of the 21 out of "
        r"`servovalve\.flow_table`, or export for Rust$"
    )
    with pytest.raises(ValueError, match=said):
        eft.firmware.export(rig, "c")
    shorter = {"openings": openings[:4] + openings[5:], "flows": flows[:4] + flows[5:]}
    text = eft.firmware.export(rig.replace({"servovalve.flow_table": shorter}), "c")
    assert "21u, /* table_length */" in text
    assert "openings" in eft.firmware.export(rig, "rust")
    steps = range(-12, 13)
    longer = {"openings": [i / 12 for i in steps], "flows": [i / 1e3 for i in steps]}
    with pytest.raises(ValueError, match=r"^servovalve\.flow_table = 25 points: needs 25 points, and C "):
        eft.firmware.export(eft.Rig.zhao2005().replace({"servovalve.flow_table": longer}), "c")


def test_image_that_is_not_there_is_named(tmp_path):
    rig = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 0.1, 4096.0)
    with pytest.raises(OSError, match=r"nowhere\.elf"):
        eft.firmware.ProcessorInTheLoop(tmp_path / "nowhere.elf").simulate(rig, command)
    with pytest.raises(ValueError, match=r"controller\.realization"):
        eft.firmware.ProcessorInTheLoop(RIGS / "uneven.toml").simulate(eft.Rig.zhao2005(), command)


UNABLE = """
import eft
rig = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
command = eft.sine_sweep(8900.0, 0.0, 10.0, 0.1, 4096.0)
loop = eft.firmware.ProcessorInTheLoop(IMAGE, "no-such-machine")
for _ in range(30):
    try:
        loop.simulate(rig, command)
    except ValueError as error:
        print(error)
"""


@pytest.mark.skipif(shutil.which("qemu-system-arm") is None, reason="QEMU is not installed")
def test_the_end_of_qemu_is_the_reason_and_nothing_waits_for_it():
    """On one processor, where QEMU could end before the pipes were open."""
    image = RIGS / "uneven.toml"
    script = UNABLE.replace("IMAGE", repr(str(image)))
    one = None if not hasattr(os, "sched_setaffinity") else lambda: os.sched_setaffinity(0, [0])
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, preexec_fn=one
    )
    lines = done.stdout.splitlines()
    assert len(lines) == 30 and len(set(lines)) == 1
    assert f"{image}: QEMU's no-such-machine ended with code 1: no image for this machine" in lines[0]


FIRMWARE = os.environ.get("EFT_FIRMWARE")


@pytest.mark.skipif(FIRMWARE is None, reason="EFT_FIRMWARE names no image; `make firmware` does")
@pytest.mark.parametrize("machine", ["mps2-an386", "mps2-an500"])
def test_the_processors_run_is_the_simulation(machine):
    rig = eft.Rig.zhao2005().replace({"controller.realization": "digital", "sensors.force.noise": 20.0})
    record = eft.read_record(Path(eft.__file__).parent / "data" / "RSN6_IMPVALL.I_I-ELC180-hor1.AT2")
    loop = eft.firmware.ProcessorInTheLoop(FIRMWARE, machine)
    for command in (
        eft.sine_sweep(8900.0, 0.0, 10.0, 2.0, 4096.0),
        eft.effective_force(record, mass=7040.0, sample_rate=4096.0),
    ):
        run = loop.simulate(rig, command)
        expected = eft.simulate(rig, command, dtype="f32")
        for name in ("force", "displacement", "spool", "valve_command", "compensation", "measured_force"):
            np.testing.assert_array_equal(getattr(run, name), getattr(expected, name), err_msg=name)
        np.testing.assert_array_equal(run.status, expected.status)
    # A rig other than the firmware's, which shows that the firmware computes the run.
    other = eft.simulate(rig.replace({"compensation.level": 1.000001}), command, dtype="f32")
    assert (other.force != run.force).any()


@pytest.mark.skipif(FIRMWARE is None, reason="EFT_FIRMWARE names no image; `make firmware` does")
def test_the_page_s_loop_runs_as_printed(monkeypatch):
    root = Path(__file__).resolve().parents[2]
    page = (root / "docs" / "how-to" / "firmware-rust.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```py\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    monkeypatch.chdir(root)
    names = {
        "eft": eft,
        "rig": eft.Rig.zhao2005().replace({"controller.realization": "digital"}),
        "command": eft.sine_sweep(8900.0, 0.0, 10.0, 0.5, 4096.0),
    }
    exec(block, names)
    expected = eft.simulate(names["rig"], names["command"], dtype="f32")
    np.testing.assert_array_equal(names["run"].force, expected.force)


def test_two_rigs_fit_into_one_program_by_their_names(tmp_path):
    for name in ("north", "south"):
        (tmp_path / f"{name}.h").write_text(eft.firmware.export(eft.Rig.zhao2005(), "c", name))
    sum_of_both = "EFT_RIG_NORTH.level + EFT_RIG_SOUTH.level"
    (tmp_path / "both.c").write_text(
        '#include "north.h"\n#include "south.h"\n#include "north.h"\n'
        f"double both(void);\ndouble both(void) {{ return {sum_of_both}; }}\n"
    )
    include = Path(__file__).parents[2] / "crates/eft-ffi/include"
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wno-unused", "-fsyntax-only"]
    subprocess.run([*command, f"-I{include}", str(tmp_path / "both.c")], check=True)
    with pytest.raises(ValueError, match="name = north-2: must be an identifier"):
        eft.firmware.export(eft.Rig.zhao2005(), "c", "north-2")
