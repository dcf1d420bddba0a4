"""Rigs as laboratories have them: late and slow sensors, friction, overlap, and other specimens.

``python docs/evidence/laboratory_rigs.py [COUNT] [SEED]`` runs the tests and adds a row for each rig to
``data/laboratory_rigs.csv``, after the existing rows. A rig takes seven seconds of one core. The same seed
makes the same rigs on every machine. Each other seed has a separate file. The integral part of the designed
loop, the width of the friction, the step over the overlap and the load pressure by the command were chosen
with 60 rigs of seed 16, the gains of an identified rig with seed 70225. Seed 261126 was run last, after all
choices.
"""

import sys
from pathlib import Path

import numpy as np
from random_rigs import ADAPTIVE, BAND, RANGES, Row, Schemes, read, write

import eft
from eft._files import write_text
from eft.benchmark import Case, drawn_cases
from eft.benchmark._criteria import slow_error
from eft.benchmark._excitations import within_the_rig
from eft.benchmark._rigs import RATE
from eft.demo.experiments import EL_CENTRO

DATA = Path(__file__).parent / "data"
SEED, COUNT, LAST = 16, 60, 261126
AMPLITUDES = (2200.0, 8900.0)
CURVE = {"compensation.curve_correction": True}
ROBUST = {"controller.force_loop": "robust", "compensation.look_ahead": True}
SCHEMES: Schemes = {
    "fixed": {},
    "adaptive": ADAPTIVE,
    "curve": ADAPTIVE | CURVE,
    "robust_fixed": ROBUST | {"compensation.feedforward": True},
    "robust": ADAPTIVE | ROBUST,
    "robust_curve": ADAPTIVE | ROBUST | CURVE,
    "overlap": ADAPTIVE | ROBUST | CURVE,
    "identified": ADAPTIVE | ROBUST | CURVE,
    "on_time": ADAPTIVE | ROBUST | CURVE,
    "loop": ADAPTIVE | ROBUST | CURVE,
    "gain": ADAPTIVE | ROBUST | CURVE,
    "calibrated": ADAPTIVE | ROBUST | CURVE,
}
OVERLAP_KNOWN = ("overlap", "identified", "on_time", "loop", "gain", "calibrated")
FRICTION_IDENTIFIED = OVERLAP_KNOWN[1:]
LATENCY_IDENTIFIED = OVERLAP_KNOWN[2:]
LOOP_IDENTIFIED = OVERLAP_KNOWN[3:]
DURATION = 16.0
"""Duration (s) of the sweep and of the used part of the record."""
TITLES = {
    "fixed": "fixed",
    "adaptive": "adaptive",
    "curve": "adaptive with curve",
    "robust_fixed": "designed loop, fixed",
    "robust": "designed loop, adaptive",
    "robust_curve": "designed loop, adaptive with curve",
    "overlap": "the same, overlap known",
    "identified": "overlap known, friction identified",
    "on_time": "the same, latency of the load cell identified",
    "loop": "the same, valve and oil identified",
    "gain": "the same, gain of the load cell identified",
    "calibrated": "gain of the load cell exact",
}
CELL = "reading of the load cell equal to the command"
GOALS = {
    "unstable": ("unstable although the check passes", "none"),
    "ratio": ("sweep: force over command within 0.93–1.07", "95 %"),
    "error": ("earthquake: error below 20 Hz at most 3 %", "90 %"),
    "displacement": ("earthquake: displacement error at most 5 %", "90 %"),
}
JUDGED = "gain"
DRAWN = {
    "friction": "friction over the amplitude of the sweep",
    "damping_ratio": "damping of the specimen",
    "overlap": "overlap of the spool",
    "velocity_delay": "latency of the velocity sensor",
    "force_delay": "latency of the load cell",
    "force_gain": "error of the load cell's gain",
    "frequency": "natural frequency",
    "noise": "noise",
}
"""Drawn parameters by which the rigs are sorted."""
FOUND_OVER_TRUE = {
    "actuator.compressibility": "found_compressibility",
    "servovalve.pilot_time_constant": "found_pilot_time_constant",
}
CHECKED = ("controller.force_loop", "compensation.adaptive")
"""Keys on which the feasibility check depends."""
FOUND = ("allowed", "unstable", "lowest", "highest")
UNSTABLE = 1.0
"""Force error (rms over rms) above which a test counts as unstable."""


def results(seed: int) -> Path:
    """The file of a seed's rigs."""
    return DATA / ("laboratory_rigs.csv" if seed == SEED else f"laboratory_rigs_{seed}.csv")


def changes_of(scheme: str, rig: eft.Rig) -> dict[str, object]:
    """The keys of a scheme for a rig, without those that are identified."""
    true = {key: rig.plant[key] for key in ("servovalve.overlap", "actuator.friction")}
    changes = SCHEMES[scheme] | {f"truth.{key}": value for key, value in true.items()}
    if scheme in OVERLAP_KNOWN:
        changes["servovalve.overlap"] = true["servovalve.overlap"]
    else:
        changes["servovalve.overlap"] = 0.0
    if scheme == "calibrated":
        changes["truth.sensors.force.gain"] = 1.0
    return changes | {"actuator.friction": 0.0}


def friction_of(rig: eft.Rig, sweep: eft.Command) -> float:
    """The friction (N) that is identified from a sweep with this rig."""
    run = eft.simulate(rig, sweep)
    signals = run.measured_spool, run.measured_velocity, run.measured_force
    found = eft.identification.identify_friction(rig.replace({"truth": None}), *signals, RATE)
    return max(float(found.friction), 0.0)


def loop_of(rig: eft.Rig) -> dict[str, float | bool]:
    """Keys of valve, oil and load cell that are identified from a sweep of 8.9 kN to 40 Hz with this rig."""
    known = rig.replace({"truth": None})
    run = eft.simulate(rig, within_the_rig(known, eft.sine_sweep(max(AMPLITUDES), 0.0, 40.0, DURATION, RATE)))
    signals = run.valve_command, run.measured_spool, run.measured_velocity, run.measured_force
    try:
        return eft.identification.identify_force_loop(known, *signals, RATE).keys(known)
    except ValueError:
        # A force that is too small for the load cell's noise: the data sheet remains.
        return {"controller.force_delay": 0.0}


def gain_of(rig: eft.Rig) -> float:
    """The gain of the load cell that is identified from a sweep of 8.9 kN to 40 Hz with this rig."""
    known = rig.replace({"truth": None})
    run = eft.simulate(rig, within_the_rig(known, eft.sine_sweep(max(AMPLITUDES), 0.0, 40.0, DURATION, RATE)))
    signals = run.measured_displacement, run.measured_velocity, run.measured_force
    # Each gain is drawn from ±2 %.
    uncertainty = 0.02 / np.sqrt(3.0)
    try:
        found = eft.identification.identify_load_cell(known, *signals, RATE, gain_uncertainty=uncertainty)
    except ValueError:
        return 1.0
    return float(found.gain)


def shifted_error(command: np.ndarray, force: np.ndarray) -> float:
    """As `slow_error`, after the constant delay of the force within ±3 ms that makes it smallest."""
    last = 1 + int(20.0 * command.size / RATE)
    wanted, found = np.fft.rfft(command)[:last], np.fft.rfft(force)[:last]
    advance = 2j * np.pi * np.fft.rfftfreq(command.size, 1.0 / RATE)[:last]
    errors = [
        np.linalg.norm(found * np.exp(advance * delay) - wanted) for delay in np.linspace(-3e-3, 3e-3, 121)
    ]
    return float(min(errors) / np.linalg.norm(wanted))


def deviation(moved: np.ndarray, wanted: np.ndarray) -> float:
    """Deviation of a displacement, rms over rms."""
    return float(np.linalg.norm(moved - wanted) / np.linalg.norm(wanted))


def under_the_cell(command: np.ndarray, drawn: dict[str, float]) -> np.ndarray:
    """The force (N) whose reading, by a load cell of this gain, latency and bandwidth, is the command."""
    spectrum, frequency = np.fft.rfft(command), np.fft.rfftfreq(command.size, 1.0 / RATE)
    late = np.exp(-2j * np.pi * frequency * round(drawn["force_delay"] * RATE) / RATE)
    cell = drawn["force_gain"] * late / (1.0 + 1j * frequency / drawn["force_bandwidth"])
    return np.fft.irfft(np.where(frequency < 100.0, spectrum / cell, spectrum), command.size)


def tested(case: Case, amplitude: float) -> Row:
    """A sweep and El Centro with each scheme."""
    known = case.rig.replace({"truth": None})
    record = eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO)
    quake = eft.effective_force(record, known["structure.mass"], RATE)[: int(DURATION * RATE)]
    sweep = eft.sine_sweep(amplitude, 0.0, 10.0, DURATION, RATE)
    commands = {"sweep": within_the_rig(known, sweep), "quake": within_the_rig(known, quake)}
    ideal = {name: eft.ideal_response(case.rig, command).displacement for name, command in commands.items()}
    row: Row = dict(case.drawn)
    row["amplitude"] = float(np.abs(commands["sweep"].values).max())
    held = np.asarray(under_the_cell(commands["quake"].values, case.drawn))
    moved = eft.ideal_response(case.rig, eft.Command(held, RATE)).displacement
    row["cell_quake_error"] = slow_error(commands["quake"].values, held, RATE)
    row["cell_quake_displacement"] = deviation(moved, ideal["quake"])
    row["scale"] = float(np.abs(commands["quake"].values).max() / np.abs(quake.values).max())
    allowed: dict[object, float] = {}
    for scheme in SCHEMES:
        changes = changes_of(scheme, case.rig)
        if scheme == "identified":
            row["identified"] = friction_of(case.rig.replace(changes), commands["sweep"])
        if scheme in FRICTION_IDENTIFIED:
            changes["actuator.friction"] = row["identified"]
        if scheme == "gain":
            row["found_gain"] = gain_of(case.rig.replace(changes))
            changes["truth.sensors.force.gain"] = case.drawn["force_gain"] / row["found_gain"]
        if scheme in LATENCY_IDENTIFIED:
            keys = loop_of(case.rig.replace(changes))
            changes["controller.force_delay"] = keys["controller.force_delay"]
        if scheme in LOOP_IDENTIFIED:
            # The plant's other values are under ``truth``.
            flow_gain = "servovalve.pilot_flow_gain"
            changes |= keys | {f"truth.{flow_gain}": case.rig.plant[flow_gain]}
        if scheme == "loop":
            row["latency"] = float(keys["controller.force_delay"])
            for key, name in FOUND_OVER_TRUE.items():
                row[name] = keys.get(key, np.nan) / case.rig.plant[key]
        # The check takes long for a designed loop.
        kind = tuple(changes.get(key) for key in CHECKED)
        if kind not in allowed:
            check = eft.check_feasibility(known.replace(SCHEMES[scheme]), commands["sweep"])
            allowed[kind] = float(check.verdict != "no")
        found = {"allowed": allowed[kind], "unstable": 0.0}
        for name, command in commands.items():
            run = eft.simulate(case.rig.replace(changes), command)
            force_error = run.metrics(fft=False).nrmse
            moved, wanted = run.displacement, ideal[name][: len(run)]
            found[f"{name}_nrmse"] = force_error
            found[f"{name}_error"] = slow_error(run.command, run.force, RATE)
            found[f"{name}_shifted"] = shifted_error(run.command, run.force)
            found[f"{name}_displacement"] = deviation(moved, wanted)
            swings = np.abs(moved).max() > 1.5 * np.abs(wanted).max()
            beyond = bool(run.flags & (eft.Status.DIVERGED | eft.Status.STROKE_EXCEEDED))
            if swings or beyond or not force_error <= UNSTABLE:
                found["unstable"] = 1.0
            if name == "sweep":
                ratio = run.fft_ratio(*BAND).ratio
                found |= {"lowest": float(ratio.min()), "highest": float(ratio.max())}
        row |= {f"{scheme}_{name}": value for name, value in found.items()}
    return row


def drawn(count: int, seed: int = SEED) -> list[tuple[Case, float]]:
    """The rigs, and the amplitude (N) of each rig's sweep."""
    amplitudes = np.random.default_rng(seed + 1).choice(AMPLITUDES, count)
    return list(zip(drawn_cases(count, seed), map(float, amplitudes), strict=True))


def run_missing(count: int, seed: int) -> None:
    """The rigs that have no row yet."""
    path, rigs = results(seed), drawn(count, seed)
    done = len(read(path)["mass"]) if path.exists() else 0
    for number in range(done, count):
        write(path, [tested(*rigs[number])], further=number > 0)
        print(f"{number + 1} of {count}", flush=True)


def judgements(data: dict[str, np.ndarray], scheme: str) -> dict[str, np.ndarray]:
    """Where each goal is reached, in the order of `GOALS`."""
    of = {key: data[f"{scheme}_{key}"] for key in (*FOUND, "quake_error", "quake_displacement")}
    return {
        "unstable": of["unstable"][of["allowed"] > 0] > 0,
        "ratio": (of["lowest"] >= 0.93) & (of["highest"] <= 1.07),
        "error": of["quake_error"] <= 0.03,
        "displacement": of["quake_displacement"] <= 0.05,
    }


def shares(data: dict[str, np.ndarray]) -> str:
    """The goals, and the share of the rigs that reached them."""
    cell = {
        "ratio": np.abs(1.0 / data["force_gain"] - 1.0) <= 0.07,
        "error": data["cell_quake_error"] <= 0.03,
        "displacement": data["cell_quake_displacement"] <= 0.05,
    }
    lines = [
        f"| share of the rigs | {' | '.join(TITLES.values())} | {CELL} | goal |",
        "| --- " * (3 + len(TITLES)) + "|",
    ]
    reached = [judgements(data, scheme) for scheme in TITLES]
    for name, (what, goal) in GOALS.items():
        cells = [percent(one[name]) for one in reached] + [percent(cell[name]) if name in cell else "–"]
        lines.append(f"| {what} | {' | '.join(cells)} | {goal} |")
    aligned = [percent(data[f"{scheme}_quake_shifted"] <= 0.03) for scheme in TITLES]
    what = "earthquake: error below 20 Hz besides a constant delay at most 3 %"
    lines.append(f"| {what} | {' | '.join(aligned)} | – | – |")
    for name, what in (("quake_error", "earthquake: error below 20 Hz"), ("sweep_error", "sweep: the same")):
        kept = [data.get(f"{scheme}_{name}") for scheme in (*TITLES, "cell")]
        cells = ["–" if one is None else f"{100 * np.median(one):.1f} %" for one in kept]
        lines.append(f"| {what}, median | {' | '.join(cells)} | – |")
    return "\n".join(lines) + "\n"


def percent(reached: np.ndarray) -> str:
    """A share as a text."""
    share = 100 * float(reached.mean())
    return f"{share:.1f} %" if 0 < share < 1 else f"{share:.0f} %"


def by_draws(data: dict[str, np.ndarray]) -> str:
    """Share of the rigs that miss a goal, in the lowest and the highest third of each drawn parameter."""
    reached = judgements(data, JUDGED)
    missed = {
        "sweep: ratio": ~reached["ratio"],
        "earthquake: error below 20 Hz": ~reached["error"],
        "earthquake: displacement": ~reached["displacement"],
    }
    lines = [f"| thirds of the rigs by | {' | '.join(missed)} |", "| --- " * 4 + "|"]
    for name, title in DRAWN.items():
        by = np.abs(data[name] - 1.0) if name == "force_gain" else data[name]
        order = np.argsort(by / data["amplitude"] if name == "friction" else by)
        low, high = order[: order.size // 3], order[-(order.size // 3) :]
        cells = [f"{100 * bad[low].mean():.0f} → {100 * bad[high].mean():.0f} %" for bad in missed.values()]
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def latencies(data: dict[str, np.ndarray]) -> str:
    """The errors of the latency of the load cell, where it was identified."""
    true = np.round(data["force_delay"] * RATE) / RATE + 0.5 / np.pi / data["force_bandwidth"]
    found = np.isfinite(data["found_compressibility"])
    error = 1e3 * np.abs(data["latency"] - true)[found]
    middle, high, largest = np.quantile(error, [0.5, 0.95, 1.0])
    return (
        f"The identified latency of the load cell differs from the true one by at most {high:.2f} ms on "
        f"95 % of the rigs of seed {LAST}. The median is {middle:.2f} ms, the largest {largest:.2f} ms.\n"
    )


def valve_and_oil(data: dict[str, np.ndarray]) -> str:
    """The identified compressibility and pilot time constant over the true ones."""
    quantiles = [np.nanquantile(data[name], [0.0, 0.05, 0.95, 1.0]) for name in FOUND_OVER_TRUE.values()]
    oil, pilot = (f"{low:.2f} to {high:.2f} times the true one" for _, low, high, _ in quantiles)
    all_oil, all_pilot = (f"{least:.2f} to {most:.2f}" for least, *_, most in quantiles)
    return (
        f"The identified compressibility is {oil} on nine of ten rigs of seed {LAST} ({all_oil} on all), and "
        f"the pilot time constant {pilot} ({all_pilot} on all).\n"
    )


def identified(data: dict[str, np.ndarray]) -> str:
    """The identified friction's flow over the true one."""
    true = data["friction"] * RANGES["force"] / data["oil_stiffness"]
    rubs = data["friction"] > 0.001
    low, middle, high = np.quantile(data["identified"][rubs] / true[rubs], [0.05, 0.5, 0.95])
    return (
        f"The flow of the identified friction is {low:.2f} to {high:.2f} times the true one on nine of ten "
        f"rigs of seed {LAST} whose friction exceeds 0.1 % of the capacity. Its median is {middle:.2f}.\n"
    )


def report(folder: Path) -> None:
    """The tables that the page includes."""
    files = {"": SEED, "_last": LAST}
    for name, seed in files.items():
        data = read(results(seed))
        text = f"{data['mass'].size} rigs, seed {seed}.\n\n{shares(data)}"
        write_text(folder / f"laboratory_rigs{name}.md", text)
    write_text(folder / "laboratory_friction.md", identified(read(results(LAST))))
    write_text(folder / "laboratory_latency.md", latencies(read(results(LAST))))
    write_text(folder / "laboratory_loop.md", valve_and_oil(read(results(LAST))))
    write_text(folder / "laboratory_draws.md", by_draws(read(results(LAST))))


if __name__ == "__main__":
    run_missing(
        int(sys.argv[1]) if len(sys.argv) > 1 else COUNT, int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    )
