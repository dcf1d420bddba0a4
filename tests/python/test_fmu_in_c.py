"""An importer in C, which has no Python, on an FMU's library; under valgrind where that is installed."""

import shutil
import struct
import subprocess
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import pytest

import eft

SOURCE = Path(__file__).parent / "data/fmu_importer.c"
PERIOD = 1.0 / 4096.0

if shutil.which("cc") is None:
    pytest.skip("there is no C compiler", allow_module_level=True)


@pytest.fixture(scope="module")
def importer(tmp_path_factory):
    """The command of an importer on an FMU of the paper's rig."""
    folder = tmp_path_factory.mktemp("an importer")
    (folder / "rig.fmu").write_bytes(eft.firmware.export(eft.Rig.zhao2005(), "fmu"))
    with zipfile.ZipFile(folder / "rig.fmu") as fmu:
        fmu.extractall(folder)
    subprocess.run(["cc", "-O1", "-Wall", "-Werror", SOURCE, "-o", folder / "importer", "-ldl"], check=True)
    description = ElementTree.parse(folder / "modelDescription.xml").getroot()
    references = {one.get("name"): one.get("valueReference") for one in description.iter("ScalarVariable")}
    (library,) = (folder / "binaries").glob("*/eft_rig.so")
    return [
        folder / "importer",
        library,
        (folder / "resources").as_uri(),
        description.get("guid"),
        references["valve_command"],
        references["force"],
        str(PERIOD),
    ]


def force():
    """The last force of what the importer does, in this process."""
    command = eft.Command([0.01 * (tick % 17) for tick in range(100)], 4096.0)
    plant = eft.Plant(eft.Rig.zhao2005().replace({"controller.realization": "digital"}))
    for value in command.values:
        state = plant.step(value)
    return state.force


def test_an_importer_without_python_runs_the_rig(importer):
    bits = subprocess.run(importer, check=True, capture_output=True, text=True).stdout
    # The plant of `eft.Plant` takes Runge–Kutta steps, and the FMU those of `eft.simulate`.
    assert struct.unpack(">d", bytes.fromhex(bits)) == pytest.approx((force(),), rel=1e-3)


def test_valgrind_finds_nothing(importer):
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    command = [
        "valgrind",
        "--quiet",
        "--leak-check=full",
        "--errors-for-leak-kinds=definite",
        "--error-exitcode=9",
    ]
    done = subprocess.run([*command, *importer], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout == subprocess.run(importer, check=True, capture_output=True, text=True).stdout
