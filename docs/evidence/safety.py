"""Sensor faults against the protection, and sound tests that it must leave alone.

``python docs/evidence/safety.py [MOMENTS] [RIGS]`` runs each fault of each sensor at random moments of
three tests, with either scheme, and sound tests of random rigs. It writes ``data/safety_*.csv``,
and `report` makes the page's tables of them. The same seed makes the same tests on every machine.
"""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import random_rigs

import eft
from eft._files import write_text
from eft.demo.experiments import EL_CENTRO

DATA = Path(__file__).parent / "data"
FAULTS, SOUND = DATA / "safety_faults.csv", DATA / "safety_sound.csv"
SEED, MOMENTS, RIGS = 1509, 200, 200
RATE = 4096.0
SIGNALS = ("force", "displacement", "velocity", "spool")
KINDS = ("lost", "zero", "stuck", "sign")
FORCE_TRIP, DISPLACEMENT_TRIP = 20e3, 0.115
LEVELS = {
    "protection.enabled": True,
    "protection.force_trip": FORCE_TRIP,
    "protection.displacement_trip": DISPLACEMENT_TRIP,
    "protection.velocity_trip": 1.2,
    "protection.spool_trip": 0.8,
    "limits.valve_command": 10.0,
}
# Effects that no controller of these knows, one a rig in turn.
EFFECTS: tuple[dict[str, object], ...] = (
    {},
    {"truth.actuator.friction": 500.0},
    {"truth.actuator.friction": 1500.0},
    {"truth.servovalve.overlap": 0.01},
    {"truth.actuator.compressibility": 7.56e-13 / 1.3},
    {"truth.actuator.compressibility": 7.56e-13 / 0.7},
    {"truth.sensors.force.bandwidth": 1000.0},
    {"truth.sensors.velocity.delay": 4},
    {"truth.sensors.spool.delay": 4},
    {"truth.servovalve.leakage.constant": 4e-5},
    {"truth.sensors.velocity.gain": 1.02},
    {"truth.servovalve.pilot_flow_limit": 1.2e-4},
    {
        "structure.kind": "bouc_wen",
        "structure.bouc_wen.yield_displacement": 0.02,
        "structure.bouc_wen.post_yield_ratio": 0.1,
        "structure.bouc_wen.exponent": 2.0,
        "structure.bouc_wen.shape": 0.5,
    },
    {"limits.valve_command": 2.0},
)


def quake(mass: float) -> eft.Command:
    """The El Centro test."""
    return eft.effective_force(eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO), mass, RATE)


def tests() -> list[tuple[np.ndarray, float, float]]:
    """Commands, and the time within which faults begin (s)."""
    sine = eft.sine_sweep(6000.0, 1.5, 1.5, 8.0, RATE)
    sweep = eft.sine_sweep(8900.0, 0.0, 10.0, 32.0, RATE)
    return [
        (np.asarray(sine.values), 2.0, 6.0),
        (np.asarray(sweep.values), 3.0, 12.0),
        (np.asarray(quake(7040.0).values), 1.5, 20.0),
    ]


def faults(moments: int) -> Iterator[dict[str, object]]:
    """A row a fault and scheme: how often it was noticed, when, and the worst that the specimen saw."""
    commands = tests()
    base = eft.Rig.zhao2005().replace(LEVELS | random_rigs.noise(1))
    for scheme, changes in random_rigs.SCHEMES.items():
        for signal in SIGNALS:
            for kind in KINDS:
                random = np.random.default_rng([SEED, SIGNALS.index(signal), KINDS.index(kind)])
                noticed, blamed = [], 0
                force, displacement, beyond = 0.0, 0.0, 0
                for moment in range(moments):
                    values, first, last = commands[moment % len(commands)]
                    start = random.uniform(first, last)
                    rig = base.replace(
                        changes
                        | {
                            "controller.realization": ("digital", "analog")[moment // 3 % 2],
                            "sensors.fault.signal": signal,
                            "sensors.fault.kind": kind,
                            "sensors.fault.start": start,
                        }
                    )
                    begin = int(np.ceil(start * RATE))
                    run = eft.simulate(rig, eft.Command(values[: begin + int(2.0 * RATE)], RATE))
                    tripped = (run.status & eft.Status.TRIPPED) != 0
                    noticed.append((tripped.argmax() - begin) / RATE if tripped.any() else np.inf)
                    blamed += run.cause.name.lower().startswith(signal)
                    worst = float(np.abs(run.force[begin:]).max())
                    force = max(force, worst)
                    displacement = max(displacement, float(np.abs(run.displacement[begin:]).max()))
                    beyond += worst > 1.75 * FORCE_TRIP
                times = np.array(noticed)
                yield {
                    "scheme": scheme,
                    "signal": signal,
                    "kind": kind,
                    "moments": moments,
                    "unnoticed": int((times > 0.6).sum()),
                    "median": float(np.median(times)),
                    "worst": float(times.max()),
                    "blamed": blamed / moments,
                    "force": force,
                    "beyond": beyond / moments,
                    "displacement": displacement,
                }


def sound(rigs: int) -> Iterator[dict[str, object]]:
    """A row a test without a fault: the cause of its trip, and whether a sensor was out of its range."""
    levels = LEVELS | {
        "protection.force_trip": 40e3,
        "protection.displacement_trip": 0.126,
        "protection.velocity_trip": 1.5,
        "protection.spool_trip": 0.98,
    }
    for number, truth in enumerate(random_rigs.draw(rigs)):
        rig = random_rigs.true_rig(truth, number + 1)
        rig = rig.replace(levels | EFFECTS[number % len(EFFECTS)])
        sweep = eft.sine_sweep(truth["amplitude"], 0.0, 10.0, 16.0, RATE)
        for scheme, changes in random_rigs.SCHEMES.items():
            realization = ("digital", "analog")[number // 14 % 2]
            variant = rig.replace(changes | {"controller.realization": realization})
            for test, command in (("sweep", sweep), ("quake", quake(rig["structure.mass"]))):
                run = eft.simulate(variant, command)
                ranges = random_rigs.RANGES
                ended = any(
                    bool((np.abs(getattr(run, name)) > limit).any()) for name, limit in ranges.items()
                )
                yield {
                    "rig": number,
                    "effect": number % len(EFFECTS),
                    "scheme": scheme,
                    "realization": realization,
                    "test": test,
                    "cause": run.cause.name.lower(),
                    "out_of_range": int(ended),
                }


def write(path: Path, rows: Iterator[dict[str, object]]) -> None:
    """As CSV, four digits."""
    kept = [
        {name: f"{value:.4g}" if isinstance(value, float) else value for name, value in row.items()}
        for row in rows
    ]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, kept[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept)


def read(path: Path) -> list[dict[str, str]]:
    """Rows by column."""
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def report(folder: Path) -> None:
    """The generated tables of the page."""
    head = "| sensor, fault | scheme | unnoticed | noticed after: median, worst | right sensor named "
    text = [f"{head}| worst force | beyond 35 kN | worst displacement |", "| --- " * 8 + "|"]
    for row in read(FAULTS):
        text.append(
            f"| {row['signal']} {row['kind']} | {row['scheme']} | {row['unnoticed']} of {row['moments']} "
            f"| {1e3 * float(row['median']):.1f} ms, {1e3 * float(row['worst']):.0f} ms "
            f"| {100 * float(row['blamed']):.0f} % | {float(row['force']) / 1e3:.0f} kN "
            f"| {100 * float(row['beyond']):.1f} % | {1e3 * float(row['displacement']):.0f} mm |"
        )
    rows = read(SOUND)
    by_level = sum(row["cause"].endswith("_level") for row in rows)
    alarms = [row for row in rows if row["cause"] != "none" and not row["cause"].endswith("_level")]
    ranged = sum(row["out_of_range"] == "1" for row in alarms)
    text += [
        "",
        f"Of {len(rows)} tests without a fault, {by_level} trip by a level (the fixed scheme swings many "
        f"of these rigs up). {len(alarms)} trip because measurements disagree. In {ranged} of these a signal "
        f"is beyond the range of its sensor, which therefore does lie. False alarms: {len(alarms) - ranged}.",
        "",
    ]
    write_text(folder / "safety.md", "\n".join(text))


def main(moments: int, rigs: int) -> None:
    """Run everything."""
    write(FAULTS, faults(moments))
    write(SOUND, sound(rigs))


if __name__ == "__main__":
    main(*(int(count) for count in (sys.argv[1:] + [str(MOMENTS), str(RIGS)][len(sys.argv) - 1 :])))
