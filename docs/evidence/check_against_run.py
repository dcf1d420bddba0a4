"""The verdict of the check before a test compared with that of the simulated test, on drawn rigs.

``python docs/evidence/check_against_run.py [COUNT]`` checks and runs a test of each rig and adds a row to
``data/check_against_run.csv``, continuing after the last row (half a second of one core per rig), and then
of rigs that learn to ``data/check_while_learning.csv``. The check knows the true values, as the simulated
plant does. The same seed makes the same rigs on every machine.
"""

import csv
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from drawn_sheets import data_sheets, log_uniform
from random_rigs import true

import eft
from eft._files import write_text
from eft.benchmark._excitations import within_the_rig
from eft.demo.experiments import EL_CENTRO

RESULTS = Path(__file__).parent / "data" / "check_against_run.csv"
LEARNING = RESULTS.with_name("check_while_learning.csv")
SEED, COUNT = 912, 400
"""The seed of the kept rigs. The check was improved with the rigs of other seeds only."""
LEARNING_SEED, LEARNING_COUNT = 914, 200
"""The same for the rigs that learn."""
FLOW = (0.6, 1.7)
"""Range of the true flow gain of a rig that learns, over the sheet's."""
RATES = (1024.0, 2048.0, 4096.0, 8192.0)
DURATION = 16.0
"""Duration of every test, s."""
PRESSURE = 3000 * 6894.757
"""Supply pressure, Pa."""
SCHEMES: dict[str, dict[str, object]] = {
    "fixed": {},
    "linear": {"compensation.mode": "linear"},
    "guard": {"compensation.guard": True},
    "adaptive": {"compensation.adaptive": True},
    "linear, guard": {"compensation.mode": "linear", "compensation.guard": True},
    "linear, adaptive": {"compensation.mode": "linear", "compensation.adaptive": True},
}
BARE: dict[str, object] = {"compensation.adaptive": False, "compensation.guard": False}
COMMANDS = ("sweep", "record", "noise")
GRADES = ("go", "caution", "no")
ERRORS = ("force", "displacement")
NOISE = {"force": "capacity", "displacement": "stroke", "velocity": "speed"}
"""The range of each noisy sensor: a drawn value."""
LATE = ("force", "velocity", "dac")
ACCURATE = 0.02
"""Errors below this one (1) are not compared."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
Row = dict[str, Any]


def draw(count: int, seed: int = SEED) -> list[Row]:
    """The sheets of the rigs, their controllers and commands, and their true values."""
    random = np.random.default_rng(seed)
    log = partial(log_uniform, random)

    def one() -> Row:
        capacity, unknown = log(5e3, 1000e3), random.uniform(0.0, 1.0)

        def around(least: float, most: float) -> float:
            """A true value relative to the sheet's, or that itself for a third of the rigs."""
            value = 1.0 + unknown * (random.uniform(least, most) - 1.0)
            return value if random.random() < 2 / 3 else 1.0

        return {
            "sample_rate": float(random.choice(RATES)),
            "capacity": capacity,
            "speed": random.uniform(0.3, 1.5),
            "stroke": random.uniform(0.15, 0.5),
            "corner": log(30.0, 150.0),
            "mass": capacity / 9.81 / log(0.5, 4.0),
            "frequency": log(0.5, 6.0),
            "damping_ratio": log(0.005, 0.08),
            "floors": float(random.choice([1, 1, 1, 2, 3])),
            "scheme": str(random.choice(list(SCHEMES), p=[0.2, 0.1, 0.2, 0.3, 0.1, 0.1])),
            "force_loop": str(random.choice(["pd", "robust", "robust"])),
            "feedforward": float(random.random() < 2 / 3),
            "command": str(random.choice(COMMANDS)),
            "amplitude": capacity * log(0.005, 0.2),
            "noise": random.choice([0.0, 1.0]) * 5e-4 * log(0.1, 2.0),
            "oil": around(0.75, 1.5),
            "pilot": around(0.6, 1.7),
            "flow": around(0.92, 1.08),
            "true_mass": around(0.9, 1.1),
            "force_gain": around(0.98, 1.02),
            "velocity_gain": around(0.98, 1.02),
            "lap": around(0.995, 1.01) - 1.0,
        } | {f"{part}_late": unknown * random.uniform(0.0, 1e-3) for part in LATE}

    return [one() for _ in range(count)]


def draw_learning(count: int, seed: int = LEARNING_SEED) -> list[Row]:
    """As `draw`, with self-calibration and a flow gain that is far from the sheet's."""
    random = np.random.default_rng((seed, 1))

    def learns(drawn: Row) -> Row:
        scheme = str(random.choice([scheme for scheme in SCHEMES if "adaptive" in scheme], p=[0.75, 0.25]))
        return drawn | {"scheme": scheme, "flow": random.uniform(*FLOW)}

    return [learns(drawn) for drawn in draw(count, seed)]


def rig_of(drawn: Row, seed: int) -> eft.Rig:
    """The rig of the sheets, and what is true of it."""
    flow = drawn["capacity"] / PRESSURE * drawn["speed"]
    settings = {"controller.force_loop": drawn["force_loop"], "controller.sample_rate": drawn["sample_rate"]}
    settings |= dict.fromkeys(
        ("compensation.feedforward", "compensation.look_ahead"), drawn["feedforward"] > 0
    )
    rig = eft.data_sheets.rig(data_sheets(drawn, PRESSURE, flow, 8.0 * flow))
    rig = rig.replace(BARE | SCHEMES[drawn["scheme"]] | settings)
    changes: dict[str, object] = {
        "actuator.compressibility": rig["actuator.compressibility"] / drawn["oil"],
        "servovalve.pilot_time_constant": rig["servovalve.pilot_time_constant"] * drawn["pilot"],
        "servovalve.flow_gain_scale": drawn["flow"],
        "servovalve.overlap": drawn["lap"],
        "sensors.force.gain": drawn["force_gain"],
        "sensors.velocity.gain": drawn["velocity_gain"],
        "sensors.seed": seed,
    }
    of_stories = rig["structure.kind"] == "shear_building"
    key = "structure.stories.masses" if of_stories else "structure.mass"
    changes[key] = (drawn["true_mass"] * np.asarray(rig[key])).tolist()
    for sensor, size in NOISE.items():
        changes[f"sensors.{sensor}.noise"] = drawn["noise"] * drawn[size]
    for part in LATE:
        key = "dac.delay" if part == "dac" else f"sensors.{part}.delay"
        changes[key] = round(drawn[f"{part}_late"] * drawn["sample_rate"])
    return rig.replace(true(changes))


def command_of(drawn: Row, rig: eft.Rig, seed: int) -> eft.Command:
    """A sweep, a record or a random force, with a part for each floor, within the configured rig."""
    rate, floors, amplitude = drawn["sample_rate"], int(drawn["floors"]), drawn["amplitude"]
    parts = np.arange(1, floors + 1)[:, None] / floors if floors > 1 else 1.0
    if drawn["command"] == "sweep":
        values = eft.sine_sweep(amplitude, 0.3, 10.0, DURATION, rate).values
    elif drawn["command"] == "record":
        record = eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO)
        values = eft.effective_force(record, 1.0, rate).values[: int(DURATION * rate)]
    else:
        random = np.random.default_rng(seed)
        width = round(rate / 20.0)
        values = np.convolve(random.standard_normal(int(DURATION * rate)), np.ones(width), "same")
        values *= np.sin(np.pi * np.arange(len(values)) / len(values))
    values = amplitude * values / np.abs(values).max()
    return within_the_rig(rig.replace({"truth": {}}), eft.Command(parts * values, rate))


def tested(drawn: Row, seed: int) -> Row:
    """Verdicts and errors of check and run."""
    rig = rig_of(drawn, seed)
    command = command_of(drawn, rig, seed)
    check, run = eft.check_feasibility(rig, command), eft.simulate(rig, command)
    verdict, metrics = run.verdict, run.metrics()
    nothing = float("nan")
    found = (check.force_error, check.displacement_error)
    return drawn | {
        "check": check.verdict,
        "run": verdict.grade,
        "check_force": nothing if found[0] is None else found[0],
        "run_force": float(np.nanmax(metrics.nrmse)),
        "check_displacement": nothing if found[1] is None else found[1],
        "run_displacement": float(np.nanmax(metrics.displacement_error)),
        "check_reason": first_sentence(check.reasons),
        "run_reason": first_sentence(verdict.reasons),
    }


def first_sentence(reasons: tuple[str, ...]) -> str:
    """Of the worst reason, if there is one."""
    return next(iter(reasons), "").split(". ")[0].rstrip(".")


def write(row: Row, results: Path) -> None:
    """Add a row, four digits of each number."""
    first = not results.exists()
    with results.open("a", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        if first:
            table.writerow(row)
        table.writerow(f"{one:.4g}" if isinstance(one, float) else one for one in row.values())


def read(results: Path = RESULTS) -> dict[str, np.ndarray]:
    """Columns by name, numbers where they are numbers."""
    with results.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))

    def column(name: str) -> np.ndarray:
        values = [row[name] for row in rows]
        try:
            return np.array(values, dtype=float)
        except ValueError:
            return np.array(values)

    return {name: column(name) for name in rows[0]}


def run_missing(rigs: list[Row], results: Path) -> None:
    """The rigs that have no row yet."""
    done = len(read(results)["mass"]) if results.exists() else 0
    for number, drawn in list(enumerate(rigs))[done:]:
        write(tested(drawn, number + 1), results)
        print(f"{number + 1} of {len(rigs)}", flush=True)


def table(head: tuple[str, ...], rows: list[list[str]]) -> str:
    """In Markdown."""
    lines = [head, ("---",) * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def grades(data: dict[str, np.ndarray]) -> str:
    """How many rigs have each pair of verdicts."""
    rows = []
    for grade in GRADES:
        runs = [np.sum((data["check"] == grade) & (data["run"] == one)) for one in GRADES]
        rows.append([f'"{grade}"', *map(str, runs)])
    return table(("check", *(f'run "{grade}"' for grade in GRADES)), rows)


def agreement(data: dict[str, np.ndarray], groups: dict[str, np.ndarray]) -> str:
    """Shares of wrong verdicts."""
    check, run = (np.array([GRADES.index(one) for one in data[name]]) for name in ("check", "run"))
    rows = []
    for name, rigs in groups.items():
        cautions = rigs & (check == 1)
        wrong = (
            rigs & (check < run),
            rigs & (check == 0) & (run == 2),
            rigs & (check > run),
        )
        shares = [f"{100 * found.sum() / rigs.sum():.1f} %" for found in wrong]
        good = f"{100 * (cautions & (run == 0)).sum() / max(cautions.sum(), 1):.1f} %"
        rows.append([name, str(rigs.sum()), *shares, good])
    head = ("group", "rigs", "false yes", 'of them "go" and "no"', "false no", "cautions whose test is good")
    return table(head, rows)


def counts(data: dict[str, np.ndarray]) -> str:
    """Numbers of right and wrong verdicts, as a sentence."""
    check, run = (np.array([GRADES.index(one) for one in data[name]]) for name in ("check", "run"))

    def counted(found: np.ndarray, one: str, more: str, none: str = "none") -> str:
        count = found.sum()
        return f"{count or none} {one if count < 2 else more}"

    same = counted(check == run, "rig has", "rigs have", "no")
    worst = counted((check == 0) & (run == 2), 'rig with a "go" has', 'rigs with a "go" have', "no")
    return (
        f"{same.capitalize()} the same verdict in check and test, "
        f"{counted(check < run, 'is', 'are')} a false yes "
        f'and {counted(check > run, "is", "are")} a false no. {worst.capitalize()} a test that is a "no".\n'
    )


def ratios(data: dict[str, np.ndarray], groups: dict[str, np.ndarray]) -> str:
    """Quantiles of predicted over simulated errors."""
    rows = []
    for what in ERRORS:
        predicted, simulated = data[f"check_{what}"], data[f"run_{what}"]
        known = np.isfinite(predicted) & np.isfinite(simulated)
        known &= np.fmax(predicted, simulated) > ACCURATE
        for name, rigs in groups.items():
            ratio = predicted[known & rigs] / simulated[known & rigs]
            quantiles = (f"{one:.2f}" for one in np.quantile(ratio, QUANTILES))
            rows.append([what, name, str(ratio.size), *quantiles])
    return table(("error", "group", "rigs", *(f"{100 * one:g} %" for one in QUANTILES)), rows)


def groups_of(data: dict[str, np.ndarray], more: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """All rigs, some of them, and those by lap."""
    laps = {
        "without unknown lap": data["lap"] == 0,
        "unknown overlap": data["lap"] > 0,
        "unknown underlap": data["lap"] < 0,
    }
    return {"all": data["mass"] > 0} | more | laps


def report(folder: Path) -> None:
    """The tables that the page includes."""
    data, learning = read(), read(LEARNING)
    floors = {"one mass": data["floors"] == 1, "buildings": data["floors"] > 1}
    groups = groups_of(data, floors)
    schemes = {scheme: data["scheme"] == scheme for scheme in SCHEMES}
    parts = (grades(data), agreement(data, groups | schemes), ratios(data, groups), counts(data))
    write_text(folder / "check_against_run.md", "\n".join(parts))
    flow = learning["flow"]
    gains = {"0.6 to 1": flow < 1, "1 to 1.38": (flow >= 1) & (flow < 1.38), "1.38 to 1.7": flow >= 1.38}
    groups = groups_of(learning, {f"flow gain {name}": rigs for name, rigs in gains.items()})
    parts = (grades(learning), agreement(learning, groups), ratios(learning, groups), counts(learning))
    write_text(folder / "check_while_learning.md", "\n".join(parts))


if __name__ == "__main__":
    run_missing(draw(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT), RESULTS)
    run_missing(draw_learning(LEARNING_COUNT), LEARNING)
