"""`eft run --calibration` and `--save-calibration`: what one test learned, for the next one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

import eft
from eft._files import write_text
from eft._test_file import TestPlan, parse_toml, read_text
from eft._toml_lines import pointed
from eft.cli._output import FILE
from eft.cli._save_rig import check_own_file

calibration_option = click.option(
    "--calibration",
    type=FILE,
    metavar="FILE",
    help="Start from this calibration, a file of --save-calibration.",
)


def start_from(plan: TestPlan, path: Path) -> TestPlan:
    """Return the test with the calibration of a file.

    Raises
    ------
    ValueError
        If the file holds something else, or the rig learns nothing.
    OSError
        If the file cannot be read.
    """
    text = read_text(path)
    sections = parse_toml(path, text)
    if list(sections) != ["calibration"] or not sections["calibration"]:
        raise ValueError(
            f"--calibration {path}: must have a section [calibration], or one for each floor, "
            "and nothing else"
        )
    _check_adaptive("--calibration", path, plan)
    try:
        return replace(plan, rig=plan.rig.replace(sections))
    except ValueError as error:
        raise pointed(path, text, error) from None


def check_save_calibration(path: Path, plan: TestPlan, others: tuple[Path | None, ...]) -> None:
    """Refuse, before the test, anything that would prevent saving the calibration.

    Raises
    ------
    ValueError
        If the rig does not learn; if `path` is another file of the test.
    OSError
        If the folder does not exist.
    """
    check_own_file("--save-calibration", path, others)
    _check_adaptive("--save-calibration", path, plan)


def save_calibration(path: Path, run: eft.TestRun) -> str | None:
    """Write what a test learned; return the reason if it is not written."""
    if None in run.calibrations:
        several = len(run.calibrations) > 1
        return "a floor learned nothing" if several else "nothing was learned"
    if not run.success:
        return "the test diverged"
    sections = run.rig.replace({"calibration": run.calibrations}).to_toml().split("\n\n")
    kept = [one.strip() for one in sections if one.lstrip("[").startswith("calibration]")]
    runs = [run] if len(kept) == 1 else [run.actuator(i) for i in range(len(kept))]
    text = "\n\n".join(f"{_deviations(one)}\n{section}" for one, section in zip(runs, kept, strict=True))
    write_text(path, text + "\n")
    return None


def _deviations(run: eft.TestRun) -> str:
    """The standard deviations as comments, because the learner that starts from the file finds its own."""
    units = {"response_delay": " s", "velocity_delay": " s"}
    lines = ["# Standard deviations at the end of the test:"]
    for name in ("flow_gain", "valve_gain", "response_delay", "velocity_delay", "null_offset"):
        lines.append(f"# {name} {getattr(run, f'{name}_deviation')[-1]:.2g}{units.get(name, '')}")
    return "\n".join(lines)


def _check_adaptive(option: str, path: Path, plan: TestPlan) -> None:
    if not plan.rig["compensation.adaptive"]:
        raise ValueError(
            f"{option} {path}: compensation.adaptive = false: must be true, or nothing is learned"
        )
