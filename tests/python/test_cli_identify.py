"""`eft identify`: parameters from files of laboratories, compared with those of the simulated rig."""

import json
import tomllib

import numpy as np
import pytest

import eft
from eft.cli import main

RIG = eft.Rig.zhao2005()


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(name, **columns):
    values = np.column_stack(list(columns.values()))
    np.savetxt(name, values, "%.12g", ",", header=",".join(columns), comments="")


def test_delay_is_the_one_put_in(capsys):
    time = np.arange(8192) / 1024.0
    command = np.sin(2 * np.pi * (0.5 + time) * time)
    write(
        "a.csv",
        **{"t (ms)": 1e3 * time, "cmd (kip)": command, "load (kN)": np.interp(time - 0.012, time, command)},
    )
    assert main(["identify", "delay", "a.csv", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["delay"] == pytest.approx(0.012, abs=2e-4)


def test_flow_curve_in_inches_is_that_of_the_rig(folder, capsys):
    names = []
    for share in (0.9, 0.8, 0.6, 0.4, 0.2):
        _, displacement, spool = eft.identification.flow_test(RIG, amplitude=share * RIG["actuator.stroke"])
        names.append(f"{share}.csv")
        time = np.arange(spool.size) / 2048.0
        write(names[-1], **{"time (s)": time, "spool (%)": 100 * spool, "disp (in)": displacement / 0.0254})
    assert main(["init"]) == 0
    assert main(["identify", "curve", *names, "--rig", "rig.toml", "-o", "curve.toml"]) == 0
    written = tomllib.loads((folder / "curve.toml").read_text())
    curve = written["servovalve"]["flow_table"]
    assert written["actuator"] == {"area_ratio": 1.0}
    truth = np.array(RIG["servovalve.flow_table.flows"])
    inner = np.abs(RIG["servovalve.flow_table.openings"]) < 0.65
    assert np.abs(np.array(curve["flows"]) - truth)[inner].max() < 0.01 * truth[-1]
    assert "extrapolated" in capsys.readouterr().out


def test_damping_is_that_of_the_structure(capsys):
    free = eft.identification.free_vibration(RIG, 0.02)
    write("a.csv", **{"time (s)": np.arange(free.size) / 512.0, "displacement (mm)": 1e3 * free})
    assert main(["identify", "damping", "a.csv", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    structure = RIG["structure"]
    critical = 2 * np.sqrt(structure["stiffness"] * structure["mass"])
    assert answer["damping_ratio"] == pytest.approx(structure["damping"] / critical, rel=1e-3)
