"""Tables of the page on faults of random rigs."""

from collections.abc import Callable, Sequence
from itertools import permutations
from pathlib import Path

import numpy as np
from safety import SIGNALS
from safety_early import FAULTS as EARLY_FAULTS
from safety_early import VARIANTS
from safety_random_rigs import FAULTS, LOWEST_RATE, RIGS, RUN, SENSOR
from safety_second import SECOND
from safety_tables import BEYOND, LATE, Row, beyond, by_estimate, head, read

from eft._files import write_text
from eft._findings_of_protection import LEAST_SAMPLES


def _of_faults(rows: Sequence[Row]) -> str:
    """One line per fault."""
    lines = head(
        "sensor, fault",
        "noticed after: median, worst",
        f"later than {LATE} s",
        "right sensor named",
        "worst force over its level",
        f"beyond {BEYOND}",
    )
    for signal, kind in RUN:
        found = [row for row in rows if (row["signal"], row["kind"]) == (signal, kind)]
        times = np.array([float(row["time"]) for row in found])
        cells = (
            f"{signal} {kind}",
            f"{1e3 * np.median(times):.1f} ms, {1e3 * times[times < np.inf].max():.0f} ms",
            f"{(times > LATE).sum()} of {len(found)}",
            f"{sum(row['named'] == '1' for row in found)} of {len(found)}",
            f"{max(float(row['force']) for row in found):.2f}",
            f"{beyond(found)}",
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def conditions(rigs: dict[str, Row], rows: Sequence[Row]) -> dict[str, tuple[list[Row], list[Row]]]:
    """The faults with and without each condition of the rig, of its levels and of the lost samples."""
    usual = [row for row in rows if row["setting"] == "usual"]

    def split(judge: Callable[[float, float], bool]) -> tuple[list[Row], list[Row]]:
        halves: tuple[list[Row], list[Row]] = ([], [])
        for row in usual:
            rate, own = (float(rigs[row["rig"]][name]) for name in ("sample_rate", "frequency"))
            halves[not judge(rate, own)].append(row)
        return halves

    def pairs(setting: str) -> tuple[list[Row], list[Row]]:
        changed = [row for row in rows if row["setting"] == setting]
        same = {(row["rig"], row["signal"], row["kind"]) for row in changed}
        return changed, [row for row in usual if (row["rig"], row["signal"], row["kind"]) in same]

    return {
        "sample rate below 250 times the natural frequency": split(
            lambda rate, own: rate < LEAST_SAMPLES * own
        ),
        "sample rate of 1,024 Hz, at least 250 times the frequency": split(
            lambda rate, own: LEAST_SAMPLES * own <= rate < LOWEST_RATE
        ),
        "frequency above 7 Hz, and a rate of at least 250 times it": split(
            lambda rate, own: own > 7.0 and rate >= LEAST_SAMPLES * own
        ),
        "load-cell faults, level down to a sixteenth of the capacity": pairs("low"),
        "rate of 1,024 Hz, `lost_samples` of 3 instead of 10": pairs("few"),
    }


def _of_random_rigs() -> str:
    """The faults of random rigs, and how much a condition of the rig or its levels matters."""
    rigs = {row["rig"]: row for row in read(RIGS)}
    every = read(FAULTS)
    rows = [row for row in every if row["source"] == SENSOR]
    text = [_of_faults([row for row in rows if row["setting"] == "usual"])]
    text += ["| condition | with it | without it |", "| --- | --- | --- |"]
    for name, halves in conditions(rigs, rows).items():
        counts = ((beyond(half), len(half)) for half in halves)
        cells = (f"{count} of {of} ({100 * count / of:.1f} %)" for count, of in counts)
        text.append(f"| {name} | {' | '.join(cells)} |")
    text += ["", *by_estimate([row for row in every if row["source"] != SENSOR])]
    return "\n".join([*text, ""])


def early() -> list[list[Row]]:
    """The early faults with each null and source of the velocity, in the order of the variants."""
    rows = read(EARLY_FAULTS)
    return [
        [row for row in rows if (float(row["off"]), row["source"] == SENSOR) == (off, source == SENSOR)]
        for source, off in VARIANTS
    ]


def _of_early() -> str:
    """The largest force over its level for each early fault, and how often it is beyond."""
    variants = early()
    text = head(
        "sensor, fault",
        "noticed after: median, worst",
        "null up to 0.5 % off",
        "null up to 2 % off",
        "estimated velocity",
    )
    for case in RUN:
        cells = []
        for rows in variants:
            of = [row for row in rows if (row["signal"], row["kind"]) == case]
            worst = max((float(row["force"]) for row in of), default=0.0)
            cells.append(f"{worst:.1f}; {beyond(of)} of {len(of)}" if of else "–")
        of = [row for row in variants[0] if (row["signal"], row["kind"]) == case]
        times = np.array([float(row["time"]) for row in of])
        late = f", {(times == np.inf).sum()} not noticed" if np.inf in times else ""
        noticed = f"{1e3 * np.median(times):.1f} ms, {1e3 * times[times < np.inf].max():.0f} ms{late}"
        text.append(f"| {' '.join(case)} | {noticed} | {' | '.join(cells)} |")
    text += ["", "A cell has the largest force over its level, and how often it exceeds 1.75."]
    return "\n".join([*text, ""])


def _of_second() -> str:
    """The largest force over its level after a second fault, and how often it is beyond."""
    rows = read(SECOND)
    text = head("first sensor, second one", "with a velocity sensor", "estimated velocity")
    for pair in permutations(SIGNALS, 2):
        cells = []
        for sensed in (True, False):
            of = [row for row in rows if (row["first"], row["second"]) == pair]
            of = [row for row in of if (row["source"] == SENSOR) == sensed]
            worst = max((float(row["force"]) for row in of), default=0.0)
            cells.append(f"{worst:.1f}; {beyond(of)} of {len(of)}" if of else "–")
        text.append(f"| {', '.join(pair)} | {' | '.join(cells)} |")
    text += [
        "",
        "A cell has the largest force over its level after the second fault, and how often it exceeds 1.75.",
    ]
    return "\n".join([*text, ""])


TABLES = {"random_rigs": _of_random_rigs, "early": _of_early, "second": _of_second}


def report(folder: Path) -> None:
    """The generated tables of the page."""
    for name, table in TABLES.items():
        write_text(folder / f"safety_{name}.md", table())
