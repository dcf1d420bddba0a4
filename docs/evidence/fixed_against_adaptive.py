"""The paper's fixed scheme and self-calibration, with errors of all parameters of the controller.

``python docs/evidence/fixed_against_adaptive.py`` runs every test (some minutes of one core) and writes
``data/fixed_against_adaptive.csv``. `report` makes the table and the pictures for the page. The random rows
are those of `random_rigs`. `eft.study` is not used, because its rows have no ratio over a band and no ideal
displacement, and the traces of all tests need gigabytes.
"""

import csv
import io
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import fixed_against_adaptive_pictures as pictures
import numpy as np
import random_rigs
from fixed_against_adaptive_cases import Case, cases, command
from random_rigs import SCHEMES, swings_up

import eft
from eft._files import write_text

RESULTS = Path(__file__).parent / "data" / "fixed_against_adaptive.csv"


@dataclass(frozen=True)
class Row:
    """A row of the table: the judged quantity, and its bounds without and with noise."""

    title: str
    quantity: str
    asked: dict[bool, tuple[float, float]]
    band: tuple[float, float] = (0.5, 9.5)


SLIGHT = {False: (0.97, 1.03), True: (0.95, 1.05)}
WIDER = {False: (0.95, 1.05), True: (0.95, 1.05)}
ROWS = {
    "sweep": Row("8.9 kN sweep: force NRMSE", "nrmse", {False: (0.0, 0.01), True: (0.0, 0.02)}),
    "gain": Row("true flow gain 0.90 … 1.10, sweeps of 2.2 and 8.9 kN", "ratio", SLIGHT),
    "delay": Row("response delay 3 … 8 ms, the same sweeps, 1.2–2.0 Hz", "ratio", WIDER, (1.2, 2.0)),
    "supply": Row(
        "El Centro, supply falling by 20 %: NRMSE over that of constant supply",
        "supply",
        {False: (0.0, 1.5), True: (0.0, 1.5)},
    ),
    "structure": Row("damping 1 … 20 %, half the stiffness, springs that yield", "ratio", WIDER),
    "building": Row("three-story building, an actuator per floor, 2 kN sweeps", "ratio", WIDER),
    "level": Row(
        "level 1.05 and 1.10 by mistake: displacement over the ideal one",
        "overshoot",
        {False: (0.0, 1.2), True: (0.0, 1.2)},
    ),
}


def overshoot(run: eft.TestRun, wanted: eft.Command) -> float:
    """Largest ratio of the running peak of the displacement to that of the ideal one, after the start."""
    ideal = np.maximum.accumulate(np.abs(eft.ideal_response(run.rig, wanted).displacement), axis=-1)
    ideal = ideal[..., : run.displacement.shape[-1]]
    peak = np.maximum.accumulate(np.abs(run.displacement), axis=-1)
    began = ideal > 0.2 * ideal.max()
    return float((peak[began] / ideal[began]).max())


def tested(case: Case) -> dict[str, str]:
    """The test with both schemes, four digits."""
    rig, wanted = case.rig(), command(case.command)
    delay = "" if case.response_delay is None else f"{case.response_delay:.4g}"
    row = {"row": case.row, "label": case.label, "command": case.command, "seed": str(case.seed)}
    row |= {"flow_gain": f"{case.flow_gain:.4g}", "response_delay": delay}
    band = ROWS[case.row].band if case.row in ROWS else random_rigs.BAND
    for scheme, changes in SCHEMES.items():
        run = eft.simulate(rig.replace(changes), wanted)
        ratio = np.array([np.nan]) if case.command == "El Centro" else run.fft_ratio(*band).ratio
        found = {"lowest": ratio.min(), "highest": ratio.max(), "nrmse": np.max(run.metrics()["nrmse"])}
        found |= {"overshoot": overshoot(run, wanted), "unstable": float(swings_up(run, wanted))}
        row |= {f"{scheme}_{name}": f"{value:.4g}" for name, value in found.items()}
    return row


def read() -> list[dict[str, str]]:
    """The stored rows."""
    with RESULTS.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def report(folder: Path) -> None:
    """The generated parts of the page, and its pictures."""
    rows = read()
    write_text(folder / "fixed_against_adaptive_table.md", table(rows))
    write_text(folder / "fixed_against_adaptive.md", pictures.write(rows, folder))


def table(rows: list[dict[str, str]]) -> str:
    """The requirement, and the results of both schemes."""
    lines = ["| case | noise | goal | fixed scheme | self-calibrating | met |", "| --- " * 6 + "|"]
    for name, row in ROWS.items():
        for noisy in (False, True):
            of_it = [one for one in rows if one["row"] == name and (one["seed"] != "0") == noisy]
            for part, chosen in judged(row, of_it):
                low, high = row.asked[noisy]
                reached = {scheme: span(row, chosen, scheme) for scheme in SCHEMES}
                least, most, unstable = reached["adaptive"]
                met = not unstable and low <= least and most <= high
                cells = (row.title + part, "yes" if noisy else "no", asked(row, low, high))
                cells += tuple(told(row, *reached[scheme]) for scheme in SCHEMES)
                lines.append(joined(cells, met))
    return "\n".join(lines + chance()) + "\n"


def judged(row: Row, rows: list[dict[str, str]]) -> list[tuple[str, list[dict[str, str]]]]:
    """The tests of a row, grouped by their lines in the table."""
    if row.quantity != "supply":
        return [("", rows)]
    constant, *falling = rows
    for one in falling:
        for scheme in SCHEMES:
            one[f"{scheme}_supply"] = str(float(one[f"{scheme}_nrmse"]) / float(constant[f"{scheme}_nrmse"]))
    return [(f", {one['label']}", [one]) for one in falling]


def span(row: Row, rows: list[dict[str, str]], scheme: str) -> tuple[float, float, bool]:
    """Least and largest judged value of the stable tests, and whether all tests were unstable."""
    names = ("lowest", "highest") if row.quantity == "ratio" else (row.quantity, row.quantity)
    stable = [one for one in rows if float(one[f"{scheme}_unstable"]) == 0.0]
    least, most = (
        choose((float(one[f"{scheme}_{name}"]) for one in stable), default=np.nan)
        for choose, name in zip((min, max), names, strict=True)
    )
    return least, most, len(stable) < len(rows)


def asked(row: Row, low: float, high: float) -> str:
    """The bounds as text."""
    if row.quantity == "ratio":
        return f"{low:.2f}–{high:.2f}"
    return f"≤ {100 * high:.0f} %" if row.quantity == "nrmse" else f"≤ {high:.1f}"


def told(row: Row, least: float, most: float, unstable: bool) -> str:
    """The results as text."""
    if row.quantity == "ratio":
        low, high = f"{least:.3f}", f"{most:.3f}"
        return (f"{low} … unstable" if least < np.inf else "unstable") if unstable else f"{low}–{high}"
    if unstable:
        return "unstable"
    return f"{100 * most:.2f} %" if row.quantity == "nrmse" else f"{most:.2f}"


def chance() -> list[str]:
    """The random rows: the noise of an earthquake test, and a thousand rigs."""
    lines = []
    title = "Northridge × 0.6: displacement against the ideal response"
    for noisy, bound, part in ((False, 0.02, ""), (True, 0.05, ", median of the seeds")):
        reached = random_rigs.northridge_errors(noisy)
        cells = (title + part, "yes" if noisy else "no", f"≤ {100 * bound:.0f} %")
        cells += tuple(f"{100 * value:.2f} %" for value in reached.values())
        lines.append(joined(cells, reached["adaptive"] <= bound))
    rigs = random_rigs.read(random_rigs.RESULTS)
    for one in random_rigs.asked(rigs):
        cells = (f"{len(rigs['supply'])} random rigs, {one.what}", "yes", one.wanted)
        cells += tuple(f"{100 * value:.1f} %" for value in one.reached.values())
        lines.append(joined(cells, one.met))
    return lines


def joined(cells: tuple[str, ...], met: bool) -> str:
    """A line of the table."""
    return "| " + " | ".join((*cells, "yes" if met else "**no**")) + " |"


def main() -> None:
    """Run all of it."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = list(pool.map(tested, cases()))
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(RESULTS, text.getvalue())


if __name__ == "__main__":
    main()
