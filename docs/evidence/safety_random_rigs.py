"""Sensor faults on random rigs of data sheets: on what the limits of the protection depend.

``python docs/evidence/safety_random_rigs.py [COUNT] [SEED]`` draws rigs, and runs a sweep or El Centro on
each, once with a velocity sensor and once with an estimate of the velocity. If neither the check before it
nor its verdict is a "no", each fault of each sensor begins at a random moment. The levels are those of the
how-to. With a velocity sensor faults of the load cell run again with a level of a sixteenth of the capacity,
and those at the lowest sample rate with fewer lost samples. It writes ``data/safety_rigs.csv`` and
``data/safety_rig_faults.csv``, from which `safety_rig_tables` makes three tables of the page (half
an hour of one core). The same seed makes the same tests on every machine.
"""

import sys
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import coverage
import numpy as np
import safety
from drawn_sheets import data_sheets, log_uniform
from safety import KINDS, SIGNALS, largest
from safety_estimates import SOURCES, G, estimate, leading

import eft
from eft._findings_of_protection import LEAST_LEVEL
from eft.benchmark._excitations import within_the_rig
from eft.demo.experiments import EL_CENTRO

DATA = Path(__file__).parent / "data"
RIGS, FAULTS = DATA / "safety_rigs.csv", DATA / "safety_rig_faults.csv"
SEED, COUNT = 2, 260
PRESSURE = 3000 * 6894.757293168361
"""Supply pressure, Pa."""
RATES = (1024.0, 2048.0, 4096.0, 10000.0)
DURATION = 12.0
"""Duration (s) of a test."""
PD: dict[str, object] = {"controller.force_loop": "pd", "controller.integral_gain": 0.0}
LOOPS: dict[str, dict[str, object]] = {
    "robust": {"controller.force_loop": "robust", "controller.realization": "digital"},
    "pd digital": PD | {"controller.realization": "digital"},
    "pd analog": PD | {"controller.realization": "analog"},
}
MARGIN = 1.5
"""Levels over the largest expected values."""
LOW = 1 / 16
"""A level of the force over the capacity that is lower than advised."""
LOWEST_RATE, LOST = 2000.0, 2.5e-3
"""The sample rate (Hz) below which the how-to advises fewer lost samples, and their time (s)."""
CASES = tuple((signal, kind) for signal in SIGNALS for kind in (*KINDS, "gain", "transient"))
RUN = tuple(case for case in CASES if case[1] != "gain" or case[0] == "velocity")
SENSOR = "sensor"
"""The source of the velocity that is no estimate."""
LATER = (2.0, 9.5)
"""Times (s) between which a fault begins."""

Drawn = dict[str, Any]


def draw(number: int, seed: int = SEED) -> tuple[Drawn, np.random.Generator]:
    """The sheets of a rig with its loop and test, and the generator for the moments of its faults."""
    random = np.random.default_rng([seed, number])

    log = partial(log_uniform, random)
    rig: Drawn = {
        "capacity": (capacity := log(16e3, 1.6e6)),
        "frequency": log(0.5, 10.0),
        "damping_ratio": log(0.005, 0.1),
        "corner": random.uniform(60.0, 150.0),
        "speed": log(0.3, 1.2),
        "mass": capacity * log(0.02, 0.08),
        "stroke": random.uniform(0.15, 0.5),
        "sample_rate": (rate := float(random.choice(RATES))),
        "loop": str(random.choice(list(LOOPS), p=[0.6, 0.15, 0.25])),
        "scheme": str(random.choice(["fixed", "adaptive"])),
        "test": str(random.choice(["sweep", "quake"])),
        "flow_gain": random.uniform(0.97, 1.03),
    }
    rig |= {f"{signal}_delay": round(random.uniform(0, 1e-3) * rate) for signal in SIGNALS}
    more = np.random.default_rng([seed, number, 1])
    rig |= {"estimate": str(more.choice(SOURCES)), "null_bias": more.uniform(-0.005, 0.005)}
    return rig | {name: more.uniform(-0.04, 0.04) for name in ("asymmetry", "bend")}, random


def configured(drawn: Drawn) -> eft.Rig:
    """The rig of the sheets, with a supply that does not sag."""
    flow = drawn["capacity"] / PRESSURE * drawn["speed"] / np.sqrt(3.0)
    sheets = data_sheets(drawn, PRESSURE, flow, flow) | {"controller": {"sample_rate": drawn["sample_rate"]}}
    adaptive = drawn["scheme"] != "fixed"
    scheme = {"compensation.adaptive": adaptive, "compensation.feedforward": adaptive}
    stiff = dict.fromkeys(("supply.droop", "supply.accumulator", "supply.pump_flow"))
    curve = drawn["scheme"] == "curve"
    scheme |= {"compensation.supply_correction": False, "compensation.curve_correction": curve}
    return eft.data_sheets.rig(sheets).replace(stiff | scheme | LOOPS[str(drawn["loop"])])


@cache
def record() -> eft.Record:
    """El Centro."""
    return eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO)


def tested(drawn: Drawn, rig: eft.Rig) -> eft.Command:
    """The command, as far as the rig reaches."""
    own, rate = drawn["frequency"], drawn["sample_rate"]
    if drawn["test"] == "quake":
        command = eft.effective_force(record(), drawn["mass"], rate)[: int(DURATION * rate)]
    else:
        amplitude = 8.9 / 156 * drawn["capacity"]
        command = eft.sine_sweep(amplitude, 0.5 * own, min(1.6 * own, 12.0), DURATION, rate)
    return within_the_rig(rig, command)


def plant(drawn: Drawn, rig: eft.Rig, ranges: dict[str, float]) -> dict[str, object]:
    """What is true of the rig, and the noise that the protection knows of."""
    openings, flows = coverage.bent(rig, drawn)
    changes: dict[str, object] = {
        "truth.servovalve.flow_table": {"openings": openings, "flows": flows},
        "truth.servovalve.null_bias": drawn["null_bias"],
    }
    for name, reach in ranges.items():
        sensor = {"noise": 5e-4 * reach, "range": reach, "bits": 16, "delay": drawn[f"{name}_delay"]}
        changes |= {f"truth.sensors.{name}.{key}": value for key, value in sensor.items()}
        changes[f"protection.{name}_noise"] = 5e-4 * reach
    return changes | {"limits.valve_command": 10.0}


def levels(rig: eft.Rig, command: eft.Command, ranges: dict[str, float], least: float) -> dict[str, float]:
    """The levels of the how-to within the ranges, that of the force at least a share of the capacity."""
    ideal = eft.ideal_response(rig, command)
    shares = {
        "force": (largest(np.asarray(command.values)), least, 0.5),
        "displacement": (largest(ideal.displacement), 0.16, 0.99),
        "velocity": (largest(ideal.velocity), 0.1, 1.43),
    }
    return {
        name: float(np.clip(MARGIN * peak, low * ranges[name], high * ranges[name]))
        for name, (peak, low, high) in shares.items()
    }


class Protected(NamedTuple):
    """A rig with noise and levels, its test, and the levels of force, displacement and velocity."""

    rig: eft.Rig
    command: eft.Command
    level: dict[str, float]
    low: dict[str, float]
    """The levels with a force of `LOW`."""
    row: dict[str, object]
    """What was drawn, and how the test without a fault ends."""

    @property
    def runs(self) -> bool:
        """Whether neither the check nor the test without a fault says no."""
        return "no" not in (self.row["check"], self.row["grade"]) and self.row["cause"] == "none"


def protected(drawn: Drawn, source: str, seed: int) -> Protected:
    """A drawn rig with a velocity sensor or an estimate, and noise of a seed."""
    rig = configured(drawn)
    command, rate = tested(drawn, rig), float(drawn["sample_rate"])
    ranges = {"force": drawn["capacity"], "displacement": float(rig["actuator.stroke"])}
    ranges |= {"velocity": drawn["speed"], "spool": 1.0}
    level, low = (levels(rig, command, ranges, least) for least in (LEAST_LEVEL, LOW))
    changes: dict[str, object] = {}
    if source != SENSOR:
        peak = largest(np.gradient(eft.ideal_response(rig, command).velocity)) * rate
        changes = estimate(rig, source, max(2 * G, MARGIN * peak))
        of_controller = {key: value for key, value in changes.items() if not key.startswith("truth.")}
        rig = leading(rig.replace(of_controller), rate)
    check = eft.check_feasibility(rig, command).verdict
    rig = rig.replace(plant(drawn, rig, ranges) | changes)
    grade = eft.simulate(rig, command).verdict.grade
    trips = {f"protection.{name}_trip": value for name, value in level.items()}
    rig = rig.replace({"protection.enabled": True, "protection.spool_trip": 0.95} | trips)
    cause = eft.simulate(rig.replace({"sensors.seed": seed}), command).cause.name.lower()
    share = level["force"] / drawn["capacity"]
    row = drawn | {"source": source, "level": share, "check": check, "grade": grade, "cause": cause}
    return Protected(rig, command, level, low, row)


def faults_of(
    number: int,
    source: str,
    seed: int = SEED,
    within: tuple[float, float] = LATER,
    off: float = 1.0,
    scheme: str | None = None,
) -> tuple[dict[str, object], list[dict[str, object]]]:
    """The row of a rig with a velocity sensor or an estimate, and a row for each of its faults.

    The null bias is that of the draw times a factor. Only faults in a running test, with the scheme of the
    draw, run with other settings.
    """
    drawn, random = draw(number, seed)
    drawn["null_bias"] *= off
    drawn["scheme"] = scheme or drawn["scheme"]
    if source != SENSOR:
        source = drawn["estimate"]
    guarded, command, level, low, row = found = protected(drawn, source, number)
    if not found.runs:
        return row, []
    rate = float(drawn["sample_rate"])
    settings: dict[str, dict[str, object]] = {"usual": {}}
    others = within == LATER and source == SENSOR and scheme is None
    if others and low["force"] < level["force"]:
        settings["low"] = {"protection.force_trip": low["force"]}
    if others and rate < LOWEST_RATE:
        settings["few"] = {"protection.lost_samples": round(LOST * rate)}
    faults = []
    for signal, kind in CASES:
        start = random.uniform(*within)
        fault = safety.fault(signal, kind, start)
        if kind == "transient":
            chosen = str(random.choice(KINDS))
            fault = safety.fault(signal, chosen, start, random.uniform(0.3, 0.5))
        if (signal, kind) not in RUN or (source != SENSOR and signal == "velocity"):
            continue
        begin = int(np.ceil(start * rate))
        for name, setting in settings.items():
            if name == "low" and signal != "force":
                continue
            failing = guarded.replace(fault | setting | {"sensors.seed": number + 7})
            run = eft.simulate(failing, command[: begin + int(2.0 * rate)])
            tripped = (run.status & eft.Status.TRIPPED) != 0
            faults.append(
                {
                    "rig": number,
                    "source": source,
                    "setting": name,
                    "signal": signal,
                    "kind": kind,
                    "time": (tripped.argmax() - begin) / rate if tripped.any() else np.inf,
                    "named": int(run.cause.name.lower().startswith(signal)),
                    "force": largest(run.force[begin:]) / failing["protection.force_trip"],
                    "displacement": largest(run.displacement[begin:]) / level["displacement"],
                }
            )
    return row, faults


def main(count: int, seed: int) -> None:
    """Run everything."""
    rows: list[dict[str, object]] = []
    faults: list[dict[str, object]] = []
    for number in range(count):
        for source in (SENSOR, "estimate"):
            row, found = faults_of(number, source, seed)
            rows.append({"rig": number} | row)
            faults += found
        print(f"{number + 1} of {count}", flush=True)
    safety.write(RIGS, iter(rows))
    safety.write(FAULTS, iter(faults))


if __name__ == "__main__":
    main(*[*map(int, sys.argv[1:]), *(COUNT, SEED)[len(sys.argv) - 1 :]])
