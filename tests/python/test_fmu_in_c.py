"""An importer in C without Python loads an FMU's library, in `make firmware` also under valgrind."""

import os
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


HALVES = {"rig": ("valve_command", "force"), "controller": ("command", "valve_command")}


@pytest.fixture(scope="module", params=[(part, fmi) for part in HALVES for fmi in (2, 3)], ids=str)
def importer(request, tmp_path_factory):
    """The command of an importer on an FMU of the paper's rig or of its controller, and which of them."""
    part, fmi = request.param
    folder = tmp_path_factory.mktemp("an importer")
    rig = eft.Rig.zhao2005().replace({"compensation.adaptive": True})
    (folder / "one.fmu").write_bytes(eft.firmware.export(rig, "fmu", part=part, fmi=fmi))
    with zipfile.ZipFile(folder / "one.fmu") as fmu:
        fmu.extractall(folder)
    options = ["-O1", "-Wall", "-Werror", f"-DFMI={fmi}"]
    subprocess.run(["cc", *options, SOURCE, "-o", folder / "importer", "-ldl"], check=True)
    description = ElementTree.parse(folder / "modelDescription.xml").getroot()
    references = {one.get("name"): one.get("valueReference") for one in description.iter() if one.get("name")}
    (library,) = (folder / "binaries").glob(f"*/eft_{part}.so")
    resources = folder / "resources"
    return part, [
        folder / "importer",
        library,
        resources.as_uri() if fmi == 2 else f"{resources}/",
        description.get("guid") or description.get("instantiationToken"),
        *(references[name] for name in HALVES[part]),
        str(PERIOD),
    ]


def expected(part):
    """The last output of the importer's test, computed in this process."""
    inputs = [0.01 * (tick % 17) for tick in range(100)]
    rig = eft.Rig.zhao2005().replace({"compensation.adaptive": True, "controller.realization": "digital"})
    if part == "controller":
        controller = eft.Controller(rig)
        for value in inputs:
            voltage = controller.step(command=value, velocity=0.0, force=0.0, spool=0.0)
        return voltage
    plant = eft.Plant(rig)
    for value in inputs:
        state = plant.step(value)
    return state.force


def test_an_importer_without_python_runs_it(importer):
    part, command = importer
    bits = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    # The plant of `eft.Plant` takes Runge–Kutta steps, and the FMU those of `eft.simulate`.
    share = 1e-3 if part == "rig" else 0.0
    assert struct.unpack(">d", bytes.fromhex(bits)) == pytest.approx((expected(part),), rel=share, abs=0.0)


@pytest.mark.skipif("EFT_FIRMWARE" not in os.environ, reason="`make firmware` runs it")
def test_valgrind_finds_nothing(importer):
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    _, own = importer
    command = [
        "valgrind",
        "--quiet",
        "--leak-check=full",
        "--errors-for-leak-kinds=definite",
        "--error-exitcode=9",
    ]
    done = subprocess.run([*command, *own], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout == subprocess.run(own, check=True, capture_output=True, text=True).stdout
