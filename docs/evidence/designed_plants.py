"""The designed loop on random plants: errors below 20 Hz and of the displacement, and where the ratio misses.

``python docs/evidence/designed_plants.py [COUNT]`` runs the tests and adds a row a rig to
``data/designed_plants.csv``, continuing after the last row (two seconds of one core per rig). No setting
was chosen with this seed.
"""

import sys
from pathlib import Path

import numpy as np
from random_plants import ADAPTIVE, DESIGNED, draw_plants, plant
from random_rigs import BAND, RATE, TOGETHER, Row, Schemes, read, swings_up, write

import eft
from eft._files import write_text
from eft.benchmark._criteria import slow_error
from eft.demo.experiments import EL_CENTRO

RESULTS = Path(__file__).parent / "data" / "designed_plants.csv"
SEED, COUNT = 81125, 128
CURVE = {"compensation.curve_correction": True}
SCHEMES: Schemes = {
    "plain": ADAPTIVE | DESIGNED,
    "curve": ADAPTIVE | DESIGNED | CURVE,
    "oil": ADAPTIVE | DESIGNED | CURVE,
    "cell": ADAPTIVE | DESIGNED | CURVE | {"truth.sensors.force.gain": 1.0},
}
TITLES = {
    "plain": "designed loop",
    "curve": "with curve correction",
    "oil": "with curve correction, oil identified",
    "cell": "with curve correction, load cell exact",
}
GOALS = {
    "unstable": ("specimen becomes unstable", "none"),
    "ratio": ("sweep: force over command within 0.93–1.07", "95 %"),
    "error": ("earthquake: error below 20 Hz at most 3 %", "90 %"),
    "displacement": ("earthquake: displacement error at most 5 %", "90 %"),
}
DRAWN = {
    "oil_stiffness": "stiffness of the oil",
    "pilot_time_constant": "pilot time constant",
    "flow_gain": "flow gain",
    "response_delay": "response delay",
    "damping_ratio": "damping",
    "mass": "mass",
    "unknown_delay": "delay of the converter",
    "force_gain": "error of the load cell's gain",
}
"""Drawn parameters by which the rigs are sorted."""


def compressibility_of(rig: eft.Rig) -> float:
    """The oil's compressibility (m³/Pa) that is identified from a sweep of 8.9 kN to 40 Hz with this rig."""
    run = eft.simulate(rig, eft.sine_sweep(8900.0, 0.0, 40.0, 16.0, RATE))
    signals = run.valve_command, run.measured_spool, run.measured_velocity, run.measured_force
    found = eft.identification.identify_force_loop(rig.replace({"truth": None}), *signals, RATE)
    return float(found.compressibility)


def tested(drawn: list[Row], numbers: list[int]) -> list[Row]:
    """A sweep and El Centro with each scheme, for some rigs side by side."""
    base = eft.Rig.zhao2005()
    sweep = eft.sine_sweep(1.0, 0.0, 10.0, 32.0, RATE)
    record = eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO)
    quake = eft.effective_force(record, base["structure.mass"], RATE)
    rows = [dict(one) for one in drawn]
    plants = [plant(one, number) for one, number in zip(drawn, numbers, strict=True)]
    for row, true in zip(rows, plants, strict=True):
        rig = base.replace(true | SCHEMES["plain"])
        # The check knows the true rig; its verdict is on what the test demands.
        row["allowed"] = float(eft.check_feasibility(rig, row["amplitude"] * sweep).verdict != "no")
        row["identified"] = compressibility_of(rig)
    for scheme, changes in SCHEMES.items():
        tests = [true | changes for true in plants]
        if scheme == "oil":
            tests = [
                test | {"actuator.compressibility": row["identified"]}
                for test, row in zip(tests, rows, strict=True)
            ]
        scaled = [test | {"command.scale": row["amplitude"]} for test, row in zip(tests, rows, strict=True)]
        sweeps = eft.study(base, sweep, scaled, traces=True, fft=False, progress=False)
        quakes = eft.study(base, quake, tests, traces=True, fft=False, progress=False)
        for i, row in enumerate(rows):
            swept, shaken = sweeps.run(i), quakes.run(i)
            ratio = swept.fft_ratio(*BAND).ratio
            ideal = eft.ideal_response(shaken.rig, quake).displacement
            moved = np.linalg.norm(shaken.displacement - ideal) / np.linalg.norm(ideal)
            unstable = swings_up(swept, row["amplitude"] * sweep) or swings_up(shaken, quake)
            row |= {f"{scheme}_lowest": float(ratio.min()), f"{scheme}_highest": float(ratio.max())}
            row[f"{scheme}_error"] = slow_error(shaken.command, shaken.force, RATE)
            row |= {f"{scheme}_displacement": float(moved), f"{scheme}_unstable": float(unstable)}
    return rows


def run_missing(count: int) -> None:
    """The rigs that have no row yet."""
    drawn = draw_plants(count, SEED)
    done = len(read(RESULTS)["mass"]) if RESULTS.exists() else 0
    for start in range(done, count, TOGETHER):
        some = drawn[start : start + TOGETHER]
        write(RESULTS, tested(some, list(range(start + 1, start + 1 + len(some)))), further=start > 0)
        print(f"{start + len(some)} of {count}", flush=True)


def judgements(data: dict[str, np.ndarray], scheme: str) -> dict[str, np.ndarray]:
    """Where each goal is reached, in the order of `GOALS`; an unstable rig is where the first one is true."""
    return {
        "unstable": data[f"{scheme}_unstable"] > 0,
        "ratio": (data[f"{scheme}_lowest"] >= 0.93) & (data[f"{scheme}_highest"] <= 1.07),
        "error": data[f"{scheme}_error"] <= 0.03,
        "displacement": data[f"{scheme}_displacement"] <= 0.05,
    }


def shares(data: dict[str, np.ndarray]) -> str:
    """The goals, and the share of the rigs that reached them."""
    lines = [f"| share of the rigs | {' | '.join(TITLES.values())} | goal |", "| --- " * 6 + "|"]
    reached = {scheme: judgements(data, scheme) for scheme in SCHEMES}
    passed = data["allowed"] > 0
    for name, (what, goal) in GOALS.items():
        cells = [f"{100 * one[name].mean():.1f} %" for one in reached.values()]
        lines.append(f"| {what} | {' | '.join(cells)} | {goal} |")
        if name == "ratio":
            cells = [f"{100 * one[name][passed].mean():.1f} %" for one in reached.values()]
            what = f"the same, on the {passed.sum()} rigs whose check with the true values passes"
            lines.append(f"| {what} | {' | '.join(cells)} | {goal} |")
    cells = [f"{100 * np.median(data[f'{scheme}_error']):.1f} %" for scheme in SCHEMES]
    lines.append(f"| earthquake: error below 20 Hz, median | {' | '.join(cells)} | – |")
    return "\n".join(lines) + "\n"


def by_draws(data: dict[str, np.ndarray]) -> str:
    """Share of the rigs that miss a goal, in the lowest and the highest third of each drawn parameter."""
    reached = judgements(data, "curve")
    goals = ("ratio", "error", "displacement")
    lines = [f"| thirds of the rigs by | {' | '.join(goals)} |", "| --- " * 4 + "|"]
    for name, title in DRAWN.items():
        by = np.abs(data[name] - 1.0) if name == "force_gain" else data[name]
        order = np.argsort(by, kind="stable")
        low, high = order[: order.size // 3], order[-(order.size // 3) :]
        cells = [
            f"{100 * (~reached[g][low]).mean():.0f} → {100 * (~reached[g][high]).mean():.0f} %" for g in goals
        ]
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def report(folder: Path) -> None:
    """The tables that the page includes."""
    data = read(RESULTS)
    text = f"{data['mass'].size} rigs, seed {SEED}.\n\n{shares(data)}"
    write_text(folder / "designed_plants.md", text)
    write_text(folder / "designed_plants_draws.md", by_draws(data))


if __name__ == "__main__":
    run_missing(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
