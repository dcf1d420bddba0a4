"""Self-calibration in long tests and after failures: one row for each case.

``python docs/evidence/learning_lasts.py`` runs every test and stores its results in
``data/learning_lasts.csv``.
`report` makes the table of the page.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from random_rigs import ADAPTIVE, RATE, noise, true

import eft
from eft._files import write_text

RESULTS = Path(__file__).parent / "data" / "learning_lasts.csv"
PRESSURE = 1.9e7
FAULT = 10.0
"""Time at which a sensor fails, s."""


@dataclass(frozen=True)
class Case:
    """The true values of a rig and those of its controller, under a sweep from 0 to 10 Hz."""

    name: str
    truth: dict[str, object] = field(default_factory=dict)
    told: dict[str, object] = field(default_factory=dict)
    amplitude: float = 8900.0
    duration: float = 32.0
    flow_gain: float = 1.0

    def run(self) -> eft.TestRun:
        """The test."""
        scale = {"servovalve.flow_gain_scale": self.flow_gain}
        rig = eft.Rig.zhao2005().replace(ADAPTIVE | self.told | noise(1) | true(scale | self.truth))
        return eft.simulate(rig, eft.sine_sweep(self.amplitude, 0.0, 10.0, self.duration, RATE))

    def true_flow_gain(self, run: eft.TestRun) -> np.ndarray:
        """The exact estimate at each sample, which includes the root of the pressure."""
        schedule = self.truth.get("supply.schedule.pressures")
        if not isinstance(schedule, list):
            return np.full(len(run), self.flow_gain)
        share = np.interp(run.time, [0.0, self.duration], schedule) / PRESSURE
        return self.flow_gain * np.sqrt(share)

    def row(self) -> dict[str, str]:
        """Errors and events of the test."""
        run = self.run()
        off = np.abs(run.flow_gain_estimate - self.true_flow_gain(run))[round(5 * RATE) :]
        frozen = (run.status & eft.Status.ADAPTATION_FROZEN) != 0
        frozen_now = int(frozen[: round(FAULT * RATE)].sum())
        return {
            "case": self.name,
            "force error": f"{run.metrics()['nrmse']:.1%}",
            "flow gain, largest error after 5 s": f"{off.max():.3f}",
            "at the end": f"{off[-1]:.3f}",
            "time without learning": f"{(frozen.sum() - frozen_now) / RATE:.2f} s",
            "largest opening": f"{np.abs(run.spool).max():.2f}",
            "ends": run.message.split(";")[0],
        }


def fault(signal: str, kind: str, duration: float | None = None) -> dict[str, object]:
    """A sensor that fails."""
    changes: dict[str, object] = {
        "sensors.fault.signal": signal,
        "sensors.fault.kind": kind,
        "sensors.fault.start": FAULT,
    }
    return changes if duration is None else changes | {"sensors.fault.duration": duration}


def cases() -> Iterator[Case]:
    """Every row of the table."""
    yield Case("sound")
    falls: dict[str, object] = {
        "supply.schedule.times": [0.0, 60.0],
        "supply.schedule.pressures": [PRESSURE, 0.8 * PRESSURE],
    }
    for amplitude in (2200.0, 8900.0):
        name = f"supply falls by 20 % in 60 s, {amplitude / 1e3:g} kN"
        yield Case(name, falls, amplitude=amplitude, duration=60.0)
    for time in (2e-3, 10e-3, 50e-3, 0.2):
        yield Case(f"velocity lost for {1e3 * time:g} ms", fault("velocity", "lost", time), flow_gain=0.95)
    for share in (1e-3, 1e-2):
        lost: dict[str, object] = {
            f"sensors.{name}.dropout": share for name in ("velocity", "force", "spool")
        }
        yield Case(f"{share:.1%} of the samples of each sensor lost", lost, flow_gain=0.95)
    for amplitude in (15e3, 20e3, 40e3):
        name = f"{amplitude / 1e3:g} kN, the valve saturates"
        yield Case(name, {"actuator.stroke": 1.0}, amplitude=amplitude, flow_gain=0.95)
    correction: dict[str, object] = {"compensation.supply_correction": True}
    stuck = falls | fault("supply_pressure", "stuck")
    yield Case("supply transducer stuck, supply falls", stuck, correction, duration=60.0)
    yield Case("supply transducer lost", fault("supply_pressure", "lost"), correction)
    protected = correction | {"protection.enabled": True}
    yield Case("supply transducer lost, protection on", fault("supply_pressure", "lost"), protected)


def main() -> None:
    """Runs every test and stores its results."""
    rows = [case.row() for case in cases()]
    cells = [list(rows[0]), *(list(row.values()) for row in rows)]
    lines = [",".join(f'"{cell}"' if "," in cell else cell for cell in line) for line in cells]
    write_text(RESULTS, "\n".join(lines) + "\n")


def report(folder: Path) -> None:
    """The table that the page includes."""
    with RESULTS.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    lines = ["| " + " | ".join(rows[0]) + " |", "| --- " * len(rows[0]) + "|"]
    lines += ["| " + " | ".join(row.values()) + " |" for row in rows]
    write_text(folder / "learning_lasts.md", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
