"""A type checker finds misspelt names of results. `make lint` runs this file, `make test` does not."""

import re
import subprocess
import sys

MISSPELT = """
import eft

rig = eft.Rig.zhao2005()
command = eft.sine_sweep(8900.0, 0.0, 10.0, 4.0, 4096.0)
run = eft.simulate(rig, command)
calibration = eft.simulate(rig, command, calibration=run.calibration).calibration
assert calibration is not None
print(run.metrics()["nrmse"], run.metrics().delay, run.force.max(), run.test_ratio[-1])
print(calibration["evidence"], {"calibration": calibration}, eft.rig_keys()[0]["unit"])
"""
LINE = MISSPELT.count("\n") + 1


MISTAKES = [
    ('run.metrics()["nrsme"]', "nrsme|index type"),
    ("run.metrics().displacment_error", "displacment_error"),
    ("run.forse", "forse"),
    ('calibration["deviation"]', "deviation|index type"),
    ('calibration.evidence["flow_rtae"]', "flow_rtae|index type"),
    ('calibration.curve["asymetry"]', "asymetry|index type"),
    ('eft.rig_keys()[0]["unti"]', "unti|index type"),
    ("run.mesured_force", "mesured_force"),
    ("eft.linear.stability_margins(rig).levle", "levle"),
    ('eft.linear.stability_margins(rig)["level"]', "not indexable"),
    ("eft.check_feasibility(rig, command).verdikt", "verdikt"),
    ('assert eft.check_feasibility(rig, command).verdict == "cautoin"', "cautoin"),
    ("eft.identify_delay([0.0], [0.0], 1.0).intercep", "intercep"),
]


def test_mypy_finds_what_is_misspelt(tmp_path):
    # One script for each, all in one run, so that mypy reads the package once.
    scripts = [tmp_path / f"script_{number}.py" for number in range(len(MISTAKES))]
    for script, (line, _) in zip(scripts, MISTAKES, strict=True):
        script.write_text(f"{MISSPELT}{line}\n", encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "mypy"), *scripts]
    answer = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=300)
    errors = [text for text in answer.stdout.splitlines() if ": error:" in text]
    for script, (_, says) in zip(scripts, MISTAKES, strict=True):
        found = [error for error in errors if f"{script.name}:{LINE}:" in error]
        assert len(found) == 1 and re.search(says, found[0]), answer.stdout
    assert len(errors) == len(MISTAKES), answer.stdout
