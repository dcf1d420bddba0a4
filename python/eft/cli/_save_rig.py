"""`eft run --save-rig`: the rig with the flow curve from a test, for the next test."""

from __future__ import annotations

from pathlib import Path

import eft
from eft._files import write_text
from eft._test_file import TestPlan
from eft.traces._write import check_folder

_ASKED = ("compensation.adaptive", "compensation.curve_correction")


def check_save_rig(path: Path, plan: TestPlan, others: tuple[Path | None, ...]) -> None:
    """Refuse, before the test, what would prevent saving its flow curve; `others` are its other files.

    Raises
    ------
    ValueError
        If no curve will be found, or one for each floor; if `path` is another file of the test.
    OSError
        If the folder does not exist.
    """
    check_own_file("--save-rig", path, others)
    for key in _ASKED:
        if not plan.rig[key]:
            raise ValueError(f"--save-rig {path}: {key} = false: must be true, or no flow curve is found")
    if plan.rig["structure.kind"] == "shear_building":
        raise ValueError(
            f"--save-rig {path}: a building's rig file has one flow table for all floors, and each "
            "floor finds its own: take run.actuator(i).found_flows in Python"
        )


def check_own_file(option: str, path: Path, others: tuple[Path | None, ...]) -> None:
    """Refuse a file in no folder, or another file of the test."""
    check_folder(path)
    for other in others:
        if other is not None and path.resolve() == other.resolve():
            raise ValueError(f"{option} {path}: must be another file than that of the test")


def save_rig(path: Path, run: eft.TestRun, interrupted: bool) -> str | None:
    """Write the corrected rig of a whole test, or return the reason why it is not written."""
    if interrupted:
        return "the test was interrupted"
    if not (verdict := run.verdict).ok:
        return verdict.text[0].lower() + verdict.text[1:].rstrip(".")
    try:
        corrected = run.corrected_rig()
    except ValueError as error:
        return str(error)
    write_text(path, corrected.to_toml())
    return None
