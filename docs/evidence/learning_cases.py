"""Self-calibration with late or noisy sensors, and with valves of another curve.

``python docs/evidence/learning_cases.py`` runs every test and stores the results in ``data``.
`report` makes the tables of the page.
"""

import csv
import io
import math
import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from random_rigs import ADAPTIVE, RATE, noise, true, valve_delay

import eft
from eft._files import write_text

RESULTS = Path(__file__).parent / "data" / "learning_cases.csv"
BAND = (0.5, 9.5)
AMPLITUDES = (2200.0, 8900.0)
COLUMNS = ["table", "case", "scheme", "amplitude", "lowest", "highest"]
SCHEMES: dict[str, dict[str, object]] = {
    "fixed, with feedforward": {"compensation.feedforward": True},
    "one gain": ADAPTIVE,
    "curve": ADAPTIVE | {"compensation.curve_correction": True},
}


@dataclass(frozen=True)
class Case:
    """The true values of a rig, its controller's changes, and a tone (Hz, share of the range) on a sensor."""

    name: str
    truth: dict[str, object] = field(default_factory=dict)
    told: dict[str, object] = field(default_factory=dict)
    seed: int = 1
    tone: tuple[str, float, float] | None = None

    def rig(self, scheme: str) -> eft.Rig:
        """The rig; all other values of its controller are the paper's."""
        rig = eft.Rig.zhao2005().replace(true(self.truth) | noise(self.seed))
        if self.tone is not None:
            rig = rig.replace({"controller.realization": "digital"})
        return rig.replace(self.told | SCHEMES[scheme])

    def run(self, scheme: str, amplitude: float) -> tuple[float, float]:
        """Least and largest force over command."""
        rig, sweep = self.rig(scheme), eft.sine_sweep(amplitude, 0.0, 10.0, 32.0, RATE)
        if self.tone is None:
            ratio = eft.simulate(rig, sweep).fft_ratio(*BAND).ratio
        else:
            command, force = (np.abs(np.fft.rfft(v)) for v in (sweep.values, self.with_tone(rig, sweep)))
            frequency = np.fft.rfftfreq(len(sweep.values), 1 / RATE)
            ratio = (force / command)[(frequency >= BAND[0]) & (frequency <= BAND[1])]
        return float(ratio.min()), float(ratio.max())

    def with_tone(self, rig: eft.Rig, command: eft.Command) -> np.ndarray:
        """The force of a test with a tone on a sensor's reading."""
        assert self.tone is not None
        signal, frequency, size = self.tone
        plant, controller = eft.Plant(rig), eft.Controller(rig)
        force = np.empty(len(command.values))
        for n, wanted in enumerate(command.values):
            now = plant.state
            force[n] = now.force
            read = {"velocity": now.velocity, "force": now.force, "spool": now.spool}
            read[signal] += size * math.sin(2 * math.pi * frequency * n / RATE)
            plant.step(controller.step(wanted, read["velocity"], read["force"], read["spool"]))
        return force


def late(sensor: str, delay: float) -> dict[str, object]:
    """A sensor with a delay (s) of whole samples."""
    return {f"sensors.{sensor}.delay": round(delay * RATE)}


def by_direction(share: float) -> dict[str, object]:
    """A valve with more flow in one direction and less in the other."""
    table = eft.Rig.zhao2005()["servovalve.flow_table"]
    pairs = zip(table["openings"], table["flows"], strict=True)
    flows = [(1 + share if x > 0 else 1 - share) * q for x, q in pairs]
    return {"servovalve.flow_table.flows": flows}


def with_kink(share: float) -> dict[str, object]:
    """A valve with a share less flow up to 15 % of opening, and the table's flow from the next knot on."""
    table = eft.Rig.zhao2005()["servovalve.flow_table"]
    openings = sorted({*table["openings"], -0.15, 0.15})
    flows = np.interp(openings, table["openings"], table["flows"])
    flows = [float(q) * (1 - share if abs(x) <= 0.15 else 1) for x, q in zip(openings, flows, strict=True)]
    return {"servovalve.flow_table.openings": openings, "servovalve.flow_table.flows": flows}


def with_s(share: float) -> dict[str, object]:
    """A valve with up to a share more flow below 30 % of opening, and less from there to 60 %."""
    table = eft.Rig.zhao2005()["servovalve.flow_table"]
    pairs = zip(table["openings"], table["flows"], strict=True)
    flows = [q * (1 + share * math.sin(math.pi * min(abs(x), 0.6) / 0.3)) for x, q in pairs]
    return {"servovalve.flow_table.flows": flows}


def designed() -> Iterator[Case]:
    """Every row of the table of the designed loop."""
    loop = {"controller.force_loop": "robust", "compensation.look_ahead": True}
    yield Case("sound calibration", {}, loop)
    yield Case("flow ±8 % by direction", by_direction(0.08), loop)
    yield Case("S curve of ±10 %", with_s(0.1), loop)
    yield Case("kink: 20 % less up to 15 % of opening", with_kink(0.2), loop)


def late_or_noisy() -> Iterator[Case]:
    """Every row of the table of the paper's loop."""
    yield Case("sound calibration")
    yield Case("flow gain 0.9, valve 8 ms", {"servovalve.flow_gain_scale": 0.9} | late_valve(8e-3))
    yield Case("flow gain 1.1, valve 3 ms", {"servovalve.flow_gain_scale": 1.1} | late_valve(3e-3))
    for delay in (1e-3, 2e-3, 5e-3):
        yield Case(f"velocity {1e3 * delay:.0f} ms late", late("velocity", delay))
    told = {"compensation.velocity_delay": round(2e-3 * RATE) / RATE}
    yield Case("velocity 2 ms late, configured", late("velocity", 2e-3), told)
    yield Case("spool sensor 2 ms late", late("spool", 2e-3))
    yield Case("force sensor 1 ms late", late("force", 1e-3))
    for seed in range(1, 5):
        source = {"controller.velocity_source": "derivative"}
        yield Case(f"derivative of a noisy displacement, seed {seed}", {}, source, seed)
    for share in (0.05, 0.08):
        yield Case(f"flow ±{100 * share:.0f} % by direction", by_direction(share))
    yield Case("50 Hz on the velocity, 1 % of range", tone=("velocity", 50.0, 0.01 * 1.05))
    yield Case("6 Hz on the spool, 0.5 % of range", tone=("spool", 6.0, 0.005))


def late_valve(delay: float) -> dict[str, object]:
    """A true valve of this response delay (s)."""
    return {key.removeprefix("truth."): value for key, value in valve_delay(delay).items()}


TABLES = {"cases": late_or_noisy, "curves": designed}


def main() -> None:
    """Runs every test, and stores the results."""
    jobs = [
        (table, case, scheme, amplitude)
        for table, cases in TABLES.items()
        for case in cases()
        for scheme in SCHEMES
        for amplitude in AMPLITUDES
    ]

    def row(job: tuple[str, Case, str, float]) -> list[str]:
        table, case, scheme, amplitude = job
        lowest, highest = case.run(scheme, amplitude)
        return [table, case.name, scheme, f"{amplitude:.0f}", f"{lowest:.3f}", f"{highest:.3f}"]

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = list(pool.map(row, jobs))
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([COLUMNS, *rows])
    write_text(RESULTS, text.getvalue())


def table(name: str) -> str:
    """Force over command, 2.2 and 8.9 kN in each cell, with a scheme in each column."""
    with RESULTS.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    found = {
        (
            row["table"],
            row["case"],
            row["scheme"],
            float(row["amplitude"]),
        ): f"{row['lowest']}–{row['highest']}"
        for row in rows
    }
    lines = [f"| case | {' | '.join(SCHEMES)} |", "| --- " * (1 + len(SCHEMES)) + "|"]
    for case in TABLES[name]():
        cells = [
            " / ".join(found[name, case.name, scheme, amplitude] for amplitude in AMPLITUDES)
            for scheme in SCHEMES
        ]
        lines.append(f"| {case.name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def report(folder: Path) -> None:
    """The tables that the page includes."""
    for name in TABLES:
        write_text(folder / f"learning_{name}.md", table(name))


if __name__ == "__main__":
    main()
