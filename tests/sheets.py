"""The rigs of the page on data sheets, by its commands, and the commands' answers."""

import json
from contextlib import contextmanager
from pathlib import Path

import pytest

from eft.cli import main

SMALL = """
name = "small rig"
structure = { mass = "500 kg", frequency = "5 Hz", damping_ratio = "2 %" }
actuator = { force = "25 kN", stroke = "150 mm" }
servovalve = { rated_flow = "10 gpm", rated_drop = "1000 psi", phase_90_frequency = "100 Hz" }
[supply]
pressure = "3000 psi"
pump_flow = "10 gpm"
accumulator_volume = "1 gal"
precharge = "1500 psi"
"""
INIT = [["init", "sheet.toml", "--data-sheet"], ["init", "large.toml", "--from-data-sheet", "sheet.toml"]]
QUAKE = ["--record", "elcentro", "--scale", "0.5"]


@contextmanager
def rigs(folder):
    """In the folder: `large.toml` as on the page, and `small.toml`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert [main(arguments) for arguments in INIT] == [0, 0]
        Path("small-sheet.toml").write_text(SMALL, encoding="utf-8")
        assert main(["init", "small.toml", "--from-data-sheet", "small-sheet.toml"]) == 0
        yield


def answer(capsys, *arguments, code=0):
    """What a command answers with `--json`."""
    capsys.readouterr()
    assert main([*arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)
