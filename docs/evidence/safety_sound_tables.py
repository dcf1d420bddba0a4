"""Tables and sentences of the page on the tests without a fault, from the files that the scripts write."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from safety import SOUND
from safety_laboratory import LABORATORY
from safety_play import PLAY, PLAYS, SIDES
from safety_tables import Row, read

from eft._files import write_text


def by_measurements(rows: Sequence[Row]) -> list[Row]:
    """The trips by measurements that disagree."""
    return [row for row in rows if row["cause"] != "none" and not row["cause"].endswith("_level")]


def false_alarms(rows: Sequence[Row]) -> list[Row]:
    """The alarms of tests without a fault that neither an unstable oil column nor a range explains."""
    alarms = by_measurements(rows)
    return [row for row in alarms if row.get("unstable", "0") == "0" and row["out_of_range"] == "0"]


def of_play(play: float, side: str) -> list[Row]:
    """The tests with a play (m) of the attachment and the motion measured at one side of it."""
    return [row for row in read(PLAY) if (float(row["play"]), row["side"]) == (play, side)]


def _of_play() -> str:
    """False alarms and force error with each play, and with the motion measured at either side of it."""
    text = ["| play | " + " | ".join(f"motion at the {side} | force error" for side in SIDES) + " |"]
    text += ["| --- " * (1 + 2 * len(SIDES)) + "|"]
    for play in PLAYS:
        cells = []
        for side in SIDES:
            rows = of_play(play, side)
            false = false_alarms(rows)
            needless = sum(row["unwatched"] == "none" for row in false)
            error = 100 * float(np.median([float(row["error"]) for row in rows]))
            cells += [f"{len(false)} of {len(rows)}, {needless}", f"{error:.0f} %"]
        text.append(f"| {f'{1e3 * play:g} mm' if play else 'none'} | {' | '.join(cells)} |")
    text += [
        "",
        "A cell has the false alarms, and how many of them end a test that no level ends without the",
        "plausibility watch. The force error is the median of the tests without the watch, rms over rms.",
    ]
    return "\n".join([*text, ""])


def report(folder: Path) -> None:
    """Write the tables and sentences of the page."""
    write_text(folder / "safety_play.md", _of_play())
    rows = read(SOUND)
    by_level = sum(row["cause"].endswith("_level") for row in rows)
    alarms, false = by_measurements(rows), false_alarms(rows)
    text = (
        f"\nOf {len(rows)} tests without a fault, {by_level} trip by a level. {len(alarms)} trip because "
        f"measurements disagree. In {len(alarms) - len(false)} of these a signal is beyond the range of its "
        f"sensor, which therefore does lie. False alarms: {len(false)}.\n"
    )
    write_text(folder / "safety_sound.md", text)
    rows = read(LABORATORY)
    by_level = sum(row["cause"].endswith("_level") for row in rows)
    alarms, false = by_measurements(rows), false_alarms(rows)
    unstable = [row for row in rows if row["unstable"] == "1"]
    swings = [row for row in alarms if row["unstable"] == "1"]
    designed = [row for row in rows if row["loop"] == "designed"]
    wrong = [row for row in false if row["loop"] == "designed"]
    text = (
        f"Of {len(rows)} tests on laboratory rigs, {by_level} trip by a level. In {len(alarms)} measurements "
        f"disagree, and in {len(swings)} of these the oil column is unstable. "
        f"False alarms: {len(false)}, and {len(wrong)} among the {len(designed)} tests with the designed "
        f"loop. The oil column is unstable in {len(unstable)} of all tests.\n"
    )
    write_text(folder / "safety_laboratory.md", text)
