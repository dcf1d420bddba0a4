"""The FMUs in fmi-sim, which shares no code with FMPy: `cargo install fmi-sim`, which needs libclang."""

import csv
import io
import re
import shutil
import subprocess
import zipfile

import numpy as np
import pytest

import eft

IMPORTER = shutil.which("fmi-sim")
if IMPORTER is None:
    pytest.skip("fmi-sim is not installed: cargo install fmi-sim", allow_module_level=True)

RATE, SAMPLES = 4096.0, 1024
RIG = eft.Rig.zhao2005().replace({"controller.realization": "digital", "compensation.adaptive": True})
SENSED = ("velocity", "force", "spool", "displacement")


def fmu(part, fmi):
    """The file of an FMU; fmi-sim 0.7 knows no units in a description of FMI 3.0."""
    content = eft.firmware.export(RIG, "fmu", part=part, fmi=fmi)
    if fmi == 2:
        return content
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as given, zipfile.ZipFile(file, "w") as without:
        for name in given.namelist():
            data = given.read(name)
            if name == "modelDescription.xml":
                data = re.sub(rb"<UnitDefinitions>.*</UnitDefinitions>", b"", data, flags=re.DOTALL)
                data = re.sub(rb' (unit|min|max)="[^"]*"', b"", data)
            without.writestr(name, data)
    return file.getvalue()


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("part", ["rig", "controller"])
def test_each_half_has_the_bits_of_a_test(part, fmi, tmp_path):
    command = eft.sine_sweep(8900.0, 0.5, 8.0, SAMPLES / RATE, RATE)
    run = eft.simulate(RIG, command)
    if part == "rig":
        inputs, output, wanted = {"valve_command": run.valve_command}, "force", run.force[1:]
    else:
        sensed = {name: getattr(run, name) for name in SENSED}
        inputs, output, wanted = {"command": command.values, **sensed}, "valve_command", run.valve_command
    # An input of FMI 2.0 takes effect one step late, and the last row never does.
    early = 0.5 if fmi == 2 else 0.0
    times = [max(tick - early, 0.0) / RATE for tick in range(SAMPLES)] + [2.0]
    with (tmp_path / "inputs.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time", *inputs])
        for row in zip(times, *(np.append(trace, 0.0) for trace in inputs.values()), strict=True):
            writer.writerow([repr(float(value)) for value in row])
    (tmp_path / "half.fmu").write_bytes(fmu(part, fmi))
    files = ["-i", tmp_path / "inputs.csv", "-o", tmp_path / "outputs.csv"]
    done = subprocess.run(
        [IMPORTER, "--model", tmp_path / "half.fmu", *files, "co-simulation", "-f", str(SAMPLES / RATE)],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    with (tmp_path / "outputs.csv").open() as file:
        found = [float(row[output]) for row in csv.DictReader(file)]
    # The first row is the time zero; each other one the end of a step.
    np.testing.assert_array_equal(found[1 : 1 + len(wanted)], wanted)
    assert len(found) == SAMPLES + 1
