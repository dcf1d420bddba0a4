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


def test_empty_cells_are_gaps_as_in_eft_identify(folder, capsys):
    def lose(name, column):
        lines = (folder / name).read_text().splitlines()
        for row in range(500, len(lines), 97):
            cells = lines[row].split(",")
            cells[column] = ""
            lines[row] = ",".join(cells)
        (folder / name).write_text("\n".join(lines))

    command, spool = eft.identification.valve_test(RIG, sample_rate=1024.0)
    write(
        "valve.csv",
        **{"time (s)": np.arange(spool.size) / 1024.0, "valve command (V)": command, "spool": spool},
    )
    _, displacement, spool = eft.identification.flow_test(RIG, amplitude=0.6 * RIG["actuator.stroke"])
    write(
        "flow.csv",
        **{"time (s)": np.arange(spool.size) / 2048.0, "spool": spool, "displacement (m)": displacement},
    )
    free = eft.identification.free_vibration(RIG, 0.02)
    write("free.csv", **{"time (s)": np.arange(free.size) / 512.0, "displacement (m)": free})
    (folder / "rig.toml").write_text(RIG.to_toml())
    calls = {
        "valve.csv": ["delay", "--reference", "valve_command", "--response", "spool"],
        "flow.csv": ["curve", "--rig", "rig.toml"],
        "free.csv": ["damping"],
    }
    for name, (what, *options) in calls.items():
        answers = []
        for lost in (False, True):
            if lost:
                lose(name, -1)
            assert main(["identify", what, name, *options, "--json"]) == 0
            answers.append(json.loads(capsys.readouterr().out))
        whole, gapped = answers
        number = next(key for key in ("delay", "flows", "damping_ratio") if key in whole)
        assert np.allclose(gapped[number], whole[number], rtol=0.02, atol=1e-5), what


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


@pytest.mark.parametrize("command", ["friction", "force-loop", "load-cell"])
def test_a_force_against_its_command_has_the_wrong_sign(command, folder, capsys):
    run = eft.simulate(RIG, eft.sine_sweep(2000.0, 0.5, 5.0, 4.0, 1024.0))
    names = ("command", "force", "displacement", "velocity", "spool", "valve_command")
    units = ("N", "N", "m", "m/s", "1", "V")
    signals = {f"{name} ({unit})": getattr(run, name) for name, unit in zip(names, units, strict=True)}
    write("a.csv", **{"time (s)": run.time, **signals, "force (N)": -run.force})
    (folder / "rig.toml").write_text(RIG.to_toml())
    assert main(["identify", command, "a.csv", "--rig", "rig.toml"]) == 2
    assert "force = against the command" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["curve", "overlap"])
def test_a_displacement_beyond_the_stroke_is_of_another_unit(command, folder, capsys):
    test = eft.identification.flow_test(RIG, amplitude=0.1 * RIG["actuator.stroke"], frequency=0.5)
    time = np.arange(test.spool.size) / 2048.0
    write("mm.csv", **{"time (s)": time, "spool": test.spool, "displacement (m)": 1e3 * test.displacement})
    (folder / "rig.toml").write_text(RIG.to_toml())
    assert main(["identify", command, "mm.csv", "--rig", "rig.toml"]) == 2
    assert "mm.csv: displacement = 25 m from end to end" in capsys.readouterr().err
    for sources in ({"flow": ["mm.csv"]}, {"null": ["mm.csv"]}):
        with pytest.raises(ValueError, match=r"must be within actuator\.stroke, ±0\.127 m: check its unit"):
            eft.identify(RIG, **sources)


def test_a_flow_test_with_times_in_another_unit_is_refused(folder, capsys):
    test = eft.identification.flow_test(RIG, amplitude=0.6 * RIG["actuator.stroke"])
    columns = {"spool": test.spool, "displacement (m)": test.displacement}
    time = np.arange(test.spool.size) / 2048.0
    write("fast.csv", **{"time (ms)": time, **columns})
    write("slow.csv", **{"time (s)": 1e3 * time, **columns})
    inches = {"displacement (mm)": test.displacement / 0.0254}
    write("inches.csv", **{"time (s)": time, "spool": test.spool, **inches})
    (folder / "rig.toml").write_text(RIG.to_toml())
    assert main(["identify", "curve", "fast.csv", "--piston-area", "0.008212"]) == 2
    assert "must be at most 20 at the full opening: check the unit of the times" in capsys.readouterr().err
    for name in ("slow.csv", "inches.csv"):
        assert main(["identify", "curve", name, "--rig", "rig.toml"]) == 2
        assert (
            "times that of servovalve.flow_table at the full opening: must be 0.05" in capsys.readouterr().err
        )


def test_a_piston_area_may_have_its_unit(capsys):
    test = eft.identification.flow_test(RIG, amplitude=0.6 * RIG["actuator.stroke"])
    time = np.arange(test.spool.size) / 2048.0
    write("a.csv", **{"time (s)": time, "spool": test.spool, "displacement (m)": test.displacement})
    answers = []
    for area in ("0.0082128868", "12.73 in2"):
        assert main(["identify", "curve", "a.csv", "--piston-area", area, "--json"]) == 0
        answers.append(json.loads(capsys.readouterr().out)["flows"])
    assert answers[0] == pytest.approx(answers[1])
    assert main(["identify", "curve", "a.csv", "--piston-area", "12.73 in"]) == 2
    assert "--piston-area = '12.73 in': must be a finite number in m²" in capsys.readouterr().err


def test_damping_is_that_of_the_structure(capsys):
    free = eft.identification.free_vibration(RIG, 0.02)
    write("a.csv", **{"time (s)": np.arange(free.size) / 512.0, "displacement (mm)": 1e3 * free})
    assert main(["identify", "damping", "a.csv", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    structure = RIG["structure"]
    critical = 2 * np.sqrt(structure["stiffness"] * structure["mass"])
    assert answer["damping_ratio"] == pytest.approx(structure["damping"] / critical, rel=1e-3)
