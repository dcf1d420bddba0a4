"""Rigs of 10 to 1,000 kN from data sheets, with the designed loop and self-calibration.

``python docs/evidence/sized_rigs.py [COUNT]`` runs the tests and adds a row a rig to ``data/sized_rigs.csv``,
continuing after the last row (half a second of one core per rig). The same seed makes the same rigs on every
machine. No part of the controller was chosen with these rigs, and they ran once.
"""

import sys
from functools import partial
from pathlib import Path

import numpy as np
from drawn_sheets import data_sheets, log_uniform
from random_rigs import BAND, Row, read, swings_up, true, write

import eft
from eft._files import write_text
from eft.benchmark._criteria import slow_error
from eft.benchmark._excitations import within_the_rig
from eft.demo.experiments import EL_CENTRO

RESULTS = Path(__file__).parent / "data" / "sized_rigs.csv"
SEED, COUNT = 310, 1000
RATES = (1024.0, 2048.0, 4096.0, 8192.0)
DURATION = 16.0
"""Duration (s) of the sweep and of the used part of the record."""
PRESSURE = 3000 * 6894.757
"""Supply pressure, Pa."""
CONTROLLER: dict[str, object] = {
    "controller.force_loop": "robust",
    "compensation.adaptive": True,
    "compensation.feedforward": True,
    "compensation.look_ahead": True,
}
SENSORS = {"force": "capacity", "displacement": "stroke", "velocity": "speed", "spool": None}
"""The range of each sensor: a drawn value, or 1."""
LATE = ("force", "velocity", "spool")


def draw(count: int) -> list[Row]:
    """The sheets of the rigs, and their true values relative to the sheets."""
    random = np.random.default_rng(SEED)

    log = partial(log_uniform, random)
    return [
        {
            "sample_rate": float(random.choice(RATES)),
            "capacity": (capacity := log(10e3, 1000e3)),
            "speed": random.uniform(0.3, 1.5),
            "stroke": random.uniform(0.15, 0.5),
            "corner": log(30.0, 150.0),
            "mass": capacity / 9.81 / log(0.5, 4.0),
            "frequency": log(0.5, 6.0),
            "damping_ratio": log(0.005, 0.08),
            "oil_stiffness": random.uniform(0.75, 1.5),
            "pilot_time_constant": random.uniform(0.6, 1.7),
            "flow_gain": random.uniform(0.92, 1.08),
            "true_mass": random.uniform(0.9, 1.1),
            "piston_area": random.uniform(0.98, 1.02),
            "noise": 5e-4 * random.uniform(0.5, 2.0),
        }
        | {f"{sensor}_delay": random.uniform(0.0, 1e-3) for sensor in LATE}
        | {f"{sensor}_gain": random.uniform(0.98, 1.02) for sensor in ("force", "velocity")}
        for _ in range(count)
    ]


def configured(drawn: Row) -> eft.Rig:
    """The rig of the sheets."""
    flow = drawn["capacity"] / PRESSURE * drawn["speed"]
    return eft.data_sheets.rig(data_sheets(drawn, PRESSURE, flow, 8.0 * flow)).replace(CONTROLLER)


def plant(drawn: Row, rig: eft.Rig, seed: int) -> dict[str, object]:
    """What is true of the rig; the controller has the sheets."""
    changes: dict[str, object] = {
        "actuator.compressibility": rig["actuator.compressibility"] / drawn["oil_stiffness"],
        "actuator.piston_area": rig["actuator.piston_area"] * drawn["piston_area"],
        "servovalve.pilot_time_constant": rig["servovalve.pilot_time_constant"]
        * drawn["pilot_time_constant"],
        "servovalve.flow_gain_scale": drawn["flow_gain"],
        "structure.mass": drawn["mass"] * drawn["true_mass"],
        "sensors.seed": seed,
    }
    for sensor, size in SENSORS.items():
        changes[f"sensors.{sensor}.noise"] = drawn["noise"] * (drawn[size] if size else 1.0)
    for sensor in LATE:
        changes[f"sensors.{sensor}.delay"] = round(drawn[f"{sensor}_delay"] * drawn["sample_rate"])
    for sensor in ("force", "velocity"):
        changes[f"sensors.{sensor}.gain"] = drawn[f"{sensor}_gain"]
    return true(changes)


def tested(drawn: Row, seed: int) -> Row:
    """A sweep of a tenth of the capacity and El Centro, each within the rig."""
    rig, rate = configured(drawn), drawn["sample_rate"]
    record = eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO)
    sweep = eft.sine_sweep(0.1 * drawn["capacity"], 0.0, 10.0, DURATION, rate)
    quake = eft.effective_force(record, drawn["mass"], rate)[: int(DURATION * rate)]
    row, unstable = dict(drawn), False
    for name, command in (("sweep", within_the_rig(rig, sweep)), ("quake", within_the_rig(rig, quake))):
        row[f"{name}_go"] = float(eft.check_feasibility(rig, command).verdict == "go")
        run = eft.simulate(rig.replace(plant(drawn, rig, seed)), command)
        ideal = eft.ideal_response(run.rig, command).displacement[: len(run)]
        unstable |= swings_up(run, command) or not run.metrics(fft=False).nrmse <= 1.0
        row[f"{name}_error"] = slow_error(run.command, run.force, rate)
        moved = np.linalg.norm(run.displacement - ideal) / np.linalg.norm(ideal)
        row[f"{name}_displacement"] = float(moved)
        if name == "sweep":
            ratio = run.fft_ratio(*BAND).ratio
            row |= {"lowest": float(ratio.min()), "highest": float(ratio.max())}
    return row | {"unstable": float(unstable)}


def run_missing(count: int) -> None:
    """The rigs that have no row yet."""
    done = len(read(RESULTS)["mass"]) if RESULTS.exists() else 0
    for number, drawn in list(enumerate(draw(count)))[done:]:
        write(RESULTS, [tested(drawn, number + 1)], further=number > 0)
        print(f"{number + 1} of {count}", flush=True)


def shares(data: dict[str, np.ndarray], groups: dict[str, np.ndarray], title: str) -> str:
    """Counts and goals of groups of rigs."""
    ratio = (data["lowest"] >= 0.93) & (data["highest"] <= 1.07)
    head = (title, "rigs", "unstable", 'verdict "go"', "ratio within 0.93–1.07", "error below 20 Hz, median")
    lines = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for name, rigs in groups.items():
        cells = [
            f"{rigs.sum()}",
            f"{data['unstable'][rigs].sum():.0f}",
            f"{100 * data['sweep_go'][rigs].mean():.0f} %",
            f"{100 * ratio[rigs].mean():.0f} %",
            f"{100 * np.median(data['quake_error'][rigs]):.1f} %",
        ]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def report(folder: Path) -> None:
    """The tables that the page includes."""
    data = read(RESULTS)
    rates = {f"{rate:,.0f} Hz": data["sample_rate"] == rate for rate in RATES}
    rates["all"] = data["mass"] > 0
    fast, corner = data["sample_rate"] > 4000.0, data["corner"]
    low, high = np.quantile(corner, [1 / 3, 2 / 3])
    valves = {
        f"below {low:.0f} Hz": fast & (corner < low),
        f"{low:.0f} to {high:.0f} Hz": fast & (corner >= low) & (corner < high),
        f"above {high:.0f} Hz": fast & (corner >= high),
    }
    text = shares(data, rates, "sample rate") + "\n" + shares(data, valves, "valve's frequency at 90°")
    write_text(folder / "sized_rigs.md", text)


if __name__ == "__main__":
    run_missing(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
