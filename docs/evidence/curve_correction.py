"""Self-calibration with and without the correction of the flow curve, on the same rigs and tests.

``python docs/evidence/curve_correction.py`` runs every test and writes ``data/curve_correction.csv``, a row
for each test and scheme. `report` makes the table of the page, with the results of ``laboratory_rigs.py``.
The same seeds make the same rigs everywhere.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import random_rigs
from laboratory_rigs import LAST, ROBUST, results
from random_rigs import ADAPTIVE, BAND, RATE, draw, noise, truths

import eft
from eft._files import write_text
from eft.benchmark import drawn_cases
from eft.benchmark._criteria import slow_error
from eft.benchmark._excitations import within_the_rig
from eft.benchmark._rigs import laboratory
from eft.demo.experiments import EL_CENTRO

RESULTS = Path(__file__).parent / "data" / "curve_correction.csv"
CURVE = ADAPTIVE | {"compensation.curve_correction": True}
SCHEMES: dict[str, dict[str, object]] = {"one gain": ADAPTIVE, "curve": CURVE}
SEED = 4712
AMPLITUDES = (200.0, 2200.0, 8900.0)
SEEDS, RANDOM, LABORATORY = 20, 100, 60
"""Number of noise seeds on the paper's rig, of random rigs, and of laboratory rigs with a right table."""
MEASURES = ("lowest", "highest", "nrmse", "error", "displacement")
DIGITS = 4


@dataclass(frozen=True)
class Test:
    """A rig whose scheme is still to be set, and the two commands' size and the sweep's duration."""

    group: str
    number: int
    rig: eft.Rig
    amplitude: float
    """Largest force (N) of the sweep."""
    quake: float | None
    """Largest force (N) of the earthquake; without it the whole record."""
    duration: float

    def commands(self) -> dict[str, eft.Command]:
        """The sweep and El Centro, as far as the rig reaches."""
        known = self.rig.replace({"truth": None})
        record = eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO)
        quake = eft.effective_force(record, known["structure.mass"], RATE)[: int(16.0 * RATE)]
        if self.quake is not None:
            quake = self.quake / float(np.abs(quake.values).max()) * quake
        sweep = eft.sine_sweep(self.amplitude, 0.0, 10.0, self.duration, RATE)
        return {"sweep": within_the_rig(known, sweep), "El Centro": within_the_rig(known, quake)}

    def rows(self) -> Iterator[list[str]]:
        """The measures of each command and scheme."""
        for name, command in self.commands().items():
            wanted = eft.ideal_response(self.rig, command).displacement
            for scheme, changes in SCHEMES.items():
                run = eft.simulate(self.rig.replace(changes), command)
                ratio = run.fft_ratio(*BAND).ratio
                missed = run.displacement - wanted[: len(run)]
                found = (
                    ratio.min(),
                    ratio.max(),
                    run.metrics(fft=False).nrmse,
                    slow_error(run.command, run.force, RATE),
                    np.linalg.norm(missed) / np.linalg.norm(wanted),
                )
                cells = [f"{value:.{DIGITS}g}" for value in found]
                yield [self.group, str(self.number), name, scheme, *cells]


def tests() -> Iterator[Test]:
    """Every rig."""
    base = eft.Rig.zhao2005()
    for amplitude in AMPLITUDES:
        group = f"paper's rig, right table, {1e-3 * amplitude:g} kN"
        for seed in range(1, SEEDS + 1):
            yield Test(group, seed, base.replace(noise(seed)), amplitude, amplitude, 32.0)
    for number, truth in enumerate(draw(RANDOM), 1):
        rig = base.replace(truths(truth, number))
        yield Test("random rigs, table's shape right", number, rig, truth["amplitude"], None, 32.0)
    amplitudes = np.random.default_rng(SEED + 1).choice(AMPLITUDES[1:], LABORATORY)
    for number, case in enumerate(drawn_cases(LABORATORY, SEED)):
        straight = {**case.drawn, "direction": 0.0, "bend": 0.0}
        rig = base.replace(laboratory(straight, case.rig.plant["sensors.seed"])).replace(ROBUST)
        group = "laboratory's rigs, designed loop, table's shape right"
        yield Test(group, number, rig, float(amplitudes[number]), None, 16.0)


def main() -> None:
    """Run every test."""
    lines = [",".join(["group", "rig", "test", "scheme", *MEASURES])]
    for test in tests():
        lines += [",".join(f'"{cell}"' if "," in cell else cell for cell in row) for row in test.rows()]
        print(test.group, test.number, flush=True)
    write_text(RESULTS, "\n".join(lines) + "\n")


def read() -> list[dict[str, str]]:
    """The stored results."""
    with RESULTS.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def kept() -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """Rigs and test, and the measures with one gain and with the curve, a row for each rig."""
    rows = read()
    for group, test in dict.fromkeys((row["group"], row["test"]) for row in rows):
        one, curve = (
            np.array(
                [
                    [float(row[key]) for key in MEASURES]
                    for row in rows
                    if (row["group"], row["test"], row["scheme"]) == (group, test, scheme)
                ]
            )
            for scheme in SCHEMES
        )
        yield group, test, one, curve
    data = random_rigs.read(results(LAST))
    loops = {"paper's gains": ("adaptive", "curve"), "designed loop": ("robust", "robust_curve")}
    for loop, schemes in loops.items():
        stable = sum(data[f"{scheme}_unstable"] for scheme in schemes) == 0
        for test, name in (("sweep", "sweep"), ("quake", "El Centro")):
            errors = [f"{test}_{key}" for key in ("nrmse", "error", "displacement")]
            one, curve = (
                np.array([data[f"{scheme}_{key}"][stable] for key in ("lowest", "highest", *errors)]).T
                for scheme in schemes
            )
            yield f"laboratory's rigs, {loop}", name, one, curve


def table() -> str:
    """Medians with one gain and with the curve, and on how many rigs the curve is better and worse."""
    titles = ["rigs", "number", "test", "error below 20 Hz", "displacement error", "NRMSE"]
    titles += ["within 0.93–1.07", "displacement error smaller / larger by 1 % or more"]
    lines = ["| " + " | ".join(titles) + " |", "| --- " * len(titles) + "|"]
    for group, test, one, curve in kept():
        cells = [group, str(len(one)), test]
        for key in ("error", "displacement", "nrmse"):
            column = MEASURES.index(key)
            medians = (100 * np.median(of[:, column]) for of in (one, curve))
            cells.append(" → ".join(f"{median:.1f}" for median in medians) + " %")
        inside = (100 * np.mean((of[:, 0] >= 0.93) & (of[:, 1] <= 1.07)) for of in (one, curve))
        cells.append(" → ".join(f"{share:.0f}" for share in inside) + " %" if test == "sweep" else "–")
        change = (curve - one)[:, MEASURES.index("displacement")]
        cells.append(f"{np.sum(change <= -0.01)} / {np.sum(change >= 0.01)}")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def report(folder: Path) -> None:
    """The table that the page includes."""
    write_text(folder / "curve_correction.md", table())


if __name__ == "__main__":
    main()
    print(table())
