"""Tables of pages that state what the package computes, and a loop that needs another package."""

import importlib.util
import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eft

DOCS = Path(__file__).resolve().parents[2] / "docs"
RIG = eft.Rig.zhao2005()
COMMAND = eft.sine_sweep(amplitude=8900.0, f_start=0.5, f_end=4.0, duration=1.0, sample_rate=1024.0)


def page(name):
    return (DOCS / name).read_text(encoding="utf-8")


def test_the_levels_of_stiff_specimens_are_those_of_the_linear_model():
    text = page("how-to/force-loop.md")
    rows = [line.split("|")[1:-1] for line in text.split("| natural frequency, Hz")[1].splitlines()[:4]]
    frequencies, paper, designed = rows[0], rows[2], rows[3]
    loops = ((paper, {"controller.realization": "digital"}), (designed, {"controller.force_loop": "robust"}))
    for row, loop in loops:
        for told, frequency in zip(row[1:], frequencies, strict=True):
            omega = 2 * np.pi * float(frequency)
            specimen = {"structure.kind": "linear", "structure.stiffness": 7040 * omega**2}
            rig = RIG.replace(loop | specimen | {"structure.damping": 0.04 * 7040 * omega})
            assert eft.stability_margin(rig) == pytest.approx(float(told), abs=0.0051)


def test_the_errors_of_a_constant_leakage_are_those_of_the_virtual_rig():
    text = " ".join(page("explanation/rig-effects.md").split())
    leaking = RIG.replace({"servovalve.leakage.constant": 0.005 * RIG["servovalve.flow_table.flows"][-1]})
    sweep = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, 4096.0)
    without, leaked = (100 * eft.simulate(rig, sweep).metrics(fft=False).nrmse for rig in (RIG, leaking))
    assert f"NRMSE of the 8.9 kN sweep from {without:.1f} to {leaked:.1f} %." in text
    held = eft.simulate(leaking, eft.Command.step(5000.0, 12.0, 4096.0))
    missed = (held.command - held.force)[-4096:].mean()
    assert f"misses a constant command of 5 kN by {missed:.0f} N." in text


def test_a_damping_with_friction_is_as_uncertain_as_told():
    omega, rate = 2 * np.pi * 1.58, 512.0

    def motion(_, state):
        x, v = state
        return v, -(omega**2) * (x + 0.005 * np.tanh(v / 1e-3)) - 2 * 0.02 * omega * v

    times = np.arange(5120) / rate
    moved = solve_ivp(motion, (0.0, 10.0), (1.0, 0.0), t_eval=times, rtol=1e-8, atol=1e-10, max_step=1 / rate)
    found = eft.identification.identify_damping(moved.y[0], rate)
    text = " ".join(page("how-to/identification.md").split())
    assert f"a damping ratio of 2 % is found as {100 * found:.1f} %" in text
    assert f"of the recording, here {100 * found.uncertainty:.1f} %." in text


def test_the_page_on_studies_shows_every_column_as_it_is():
    text = page("how-to/studies.md")
    types = {"int": "int64", "flags": "uint32", "float": "double", "str": "string"}
    adaptive = {"compensation.adaptive": [False, True]}
    shown = [c for c in eft.study(RIG, COMMAND, adaptive).columns if c.name not in adaptive]
    assert len(shown) == len(eft.study(RIG, COMMAND, [{}]).columns) + 12
    for column in shown:
        unit = f" {column.unit} " if column.unit else " "
        assert f"| `{column.name}` | {types[column.type]} |{unit}| {column.doc} |" in text


def test_the_page_on_files_has_every_key_of_the_origin(tmp_path):
    run = eft.simulate(RIG, COMMAND)
    with np.load(run.save(tmp_path / "run.eft"), allow_pickle=False) as archive:
        about = json.loads(str(archive["about"]))
    table = page("reference/python/files.md").split("| key | content |")[1].split("\n\n")[0]
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == list(about)


@pytest.mark.skipif(importlib.util.find_spec("fmpy") is None, reason="fmpy is not installed")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_the_loop_of_fmus_runs_as_printed(capsys):
    fences = re.compile(r"^```(?:\{code-block\} python|text)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
    code, printed = fences.findall(page("how-to/fmu.md"))
    exec(compile(code, "fmu.md", "exec"), {})
    assert capsys.readouterr().out == printed
