"""A thousand rigs with errors in their controllers: the paper's fixed scheme, and self-calibration.

``python docs/evidence/random_rigs.py [COUNT]`` runs the tests and adds a row a rig to
``data/random_rigs.csv``, continuing after the last row (a third of a second of one core per rig). If
EFT_RECORDS names a folder with the Northridge record, it writes ``data/northridge_seeds.csv`` first. `report`
makes table and pictures of both for the page. The same seed makes the same rigs on every machine.
"""

import csv
import os
import sys
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import eft
from eft._files import write_text
from eft.demo.experiments import EL_CENTRO

HERE = Path(__file__).parent
RESULTS = HERE / "data" / "random_rigs.csv"
SEEDS = HERE / "data" / "northridge_seeds.csv"
SEED, COUNT = 20051, 1000
RATE = 4096.0
BAND = (0.5, 9.5)
ADAPTIVE = {
    "compensation.feedforward": True,
    "compensation.adaptive": True,
    "compensation.curve_correction": False,
}
"""Self-calibration with one flow gain."""
Schemes = dict[str, dict[str, object]]
Row = dict[str, float]
TOGETHER = 32
"""Number of rigs whose traces are in memory together."""
SCHEMES: Schemes = {"fixed": {}, "adaptive": ADAPTIVE}
RANGES = {"force": 156e3, "displacement": 0.127, "spool": 1.0, "velocity": 1.05}
BLUE, ORANGE = "#0072B2", "#D55E00"


def true(changes: dict[str, object]) -> dict[str, object]:
    """Changes of the plant that its controller does not know."""
    return {f"truth.{key}": value for key, value in changes.items()}


def noise(seed: int) -> dict[str, object]:
    """0.05 % of the range per sample and 16 bits, on every sensor."""
    changes: dict[str, object] = {"sensors.seed": seed}
    for sensor, size in RANGES.items():
        changes |= {f"sensors.{sensor}.noise": 5e-4 * size}
        changes |= {f"sensors.{sensor}.range": size, f"sensors.{sensor}.bits": 16}
    return true(changes)


def valve_delay(delay: float) -> dict[str, object]:
    """A true valve of this response delay (s), through its pilot's flow gain: 2ζ/ω_n is A_v/(K_3·K_vp)."""
    base = eft.Rig.zhao2005()
    area, sensitivity = base["servovalve.spool_area"], base["servovalve.spool_sensitivity"]
    return true({"servovalve.pilot_flow_gain": area / (sensitivity * delay)})


def damping_ratio(ratio: float) -> dict[str, object]:
    """A structure of this damping."""
    base = eft.Rig.zhao2005()
    critical = 2 * np.sqrt(base["structure.stiffness"] * base["structure.mass"])
    return true({"structure.damping": ratio * critical})


def draw(count: int, seed: int = SEED) -> list[dict[str, float]]:
    """The true values of each rig relative to its controller's."""
    random = np.random.default_rng(seed)
    return [
        {
            "flow_gain": random.uniform(0.92, 1.08),
            "response_delay": 5e-3 * random.uniform(0.7, 1.3),
            "damping_ratio": random.uniform(0.01, 0.10),
            "supply": random.uniform(0.9, 1.1),
            "amplitude": float(random.choice([2200.0, 8900.0])),
        }
        for _ in range(count)
    ]


def truths(truth: dict[str, float], seed: int) -> dict[str, object]:
    """The changes of the rig; its controller has the paper's values."""
    pressure = eft.Rig.zhao2005()["supply.pressure"]
    changes = {
        "servovalve.flow_gain_scale": truth["flow_gain"],
        "supply.schedule.times": [0.0],
        "supply.schedule.pressures": [truth["supply"] * pressure],
    }
    return (
        true(changes)
        | valve_delay(truth["response_delay"])
        | damping_ratio(truth["damping_ratio"])
        | noise(seed)
    )


def swings_up(run: eft.TestRun, command: eft.Command) -> bool:
    """Whether the specimen was unstable: not finite, far beyond the ideal, or beyond the stroke alone."""
    ideal = np.abs(eft.ideal_response(run.rig, command).displacement).max()
    fits = ideal < run.rig["actuator.stroke"]
    flags = eft.Status.DIVERGED | (eft.Status.STROKE_EXCEEDED if fits else eft.Status(0))
    return bool(run.flags & flags) or bool(np.abs(run.displacement).max() > 1.5 * ideal)


def judged(rigs: list[dict[str, object]], amplitudes: list[float], schemes: Schemes) -> list[Row]:
    """A sweep of an amplitude (N) and El Centro for each rig and scheme, side by side."""
    base = eft.Rig.zhao2005()
    sweep = eft.sine_sweep(1.0, 0.0, 10.0, 32.0, RATE)
    record = eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO)
    quake = eft.effective_force(record, base["structure.mass"], RATE)
    scales = [{"command.scale": amplitude} for amplitude in amplitudes]
    rows: list[Row] = [{} for _ in rigs]
    for scheme, changes in schemes.items():
        tests = [rig | changes for rig in rigs]
        scaled = [test | scale for test, scale in zip(tests, scales, strict=True)]
        sweeps = eft.study(base, sweep, scaled, traces=True, fft=False, progress=False)
        quakes = eft.study(base, quake, tests, traces=True, progress=False)
        for i, (row, amplitude) in enumerate(zip(rows, amplitudes, strict=True)):
            run = sweeps.run(i)
            ratio = run.fft_ratio(*BAND).ratio
            unstable = swings_up(run, amplitude * sweep) or swings_up(quakes.run(i), quake)
            row |= {f"{scheme}_lowest": ratio.min(), f"{scheme}_highest": ratio.max()}
            row |= {f"{scheme}_nrmse": quakes["nrmse"][i], f"{scheme}_fei": quakes["fei_amplitude"][i]}
            row[f"{scheme}_unstable"] = float(unstable)
    return rows


def run_missing(
    path: Path, drawn: list[Row], changes: Callable[[Row, int], dict[str, object]], schemes: Schemes
) -> None:
    """Runs the rigs without a row in groups, because their traces need memory."""
    done = len(read(path)["flow_gain"]) if path.exists() else 0
    for start in range(done, len(drawn), TOGETHER):
        some = drawn[start : start + TOGETHER]
        rigs = [changes(truth, start + n + 1) for n, truth in enumerate(some)]
        found = judged(rigs, [truth["amplitude"] for truth in some], schemes)
        write(path, [truth | row for truth, row in zip(some, found, strict=True)], further=start > 0)
        print(f"{start + len(some)} of {len(drawn)}", flush=True)


def write(path: Path, rows: Iterable[dict[str, float]], *, further: bool = False) -> None:
    """As CSV, four digits; row by row, so that the rows remain after an interruption."""
    for row in rows:
        text = ",".join(f"{value:.4g}" for value in row.values()) + "\n"
        if not further:
            path.write_text(",".join(row) + "\n" + text, encoding="utf-8")
        else:
            with path.open("a", encoding="utf-8") as file:
                file.write(text)
        further = True


def read(path: Path) -> dict[str, np.ndarray]:
    """Columns by name."""
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def northridge(folder: Path) -> list[dict[str, float]]:
    """Displacement error of the Northridge test at 60 %, over 50 seeds of the noise."""
    record = eft.read_record(folder / "northridge1994_sylmar_county_360.csv")
    base = eft.Rig.zhao2005()
    command = eft.effective_force(record, base["structure.mass"], RATE, 0.6)
    ideal = eft.ideal_response(base, command).displacement

    def error(seed: int | None, changes: dict[str, object]) -> float:
        rig = base.replace(changes if seed is None else changes | noise(seed))
        missed = eft.simulate(rig, command).displacement - ideal
        return float(np.sqrt(np.mean(missed**2) / np.mean(ideal**2)))

    def row(seed: int) -> dict[str, float]:
        # Seed 0 means no noise.
        return {"seed": seed} | {name: error(seed or None, changes) for name, changes in SCHEMES.items()}

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(row, range(51)))


def northridge_errors(noisy: bool) -> dict[str, float]:
    """Displacement error of the Northridge test with either scheme; with noise the median of the seeds."""
    seeds = read(SEEDS)
    return {scheme: float(np.median(seeds[scheme][(seeds["seed"] > 0) == noisy])) for scheme in SCHEMES}


@dataclass(frozen=True)
class Asked:
    """A requirement, and the share of the rigs that meet it with each scheme."""

    what: str
    wanted: str
    reached: dict[str, float]
    met: bool


def asked(data: dict[str, np.ndarray], schemes: Schemes = SCHEMES) -> list[Asked]:
    """The requirements, and the share of the rigs that meet each."""

    def of(judge: Callable[[dict[str, np.ndarray]], np.ndarray]) -> dict[str, float]:
        names = ("lowest", "highest", "nrmse", "fei", "unstable")
        return {
            scheme: float(judge({name: data[f"{scheme}_{name}"] for name in names}).mean())
            for scheme in schemes
        }

    lines = [
        Asked(
            "specimen becomes unstable",
            "none",
            swings := of(lambda one: one["unstable"] > 0),
            swings["adaptive"] == 0,
        )
    ]
    for what, least, reached in (
        (
            "sweep: force over command within 0.93–1.07 over 0.5–9.5 Hz",
            0.98,
            of(lambda one: (one["lowest"] >= 0.93) & (one["highest"] <= 1.07)),
        ),
        ("earthquake: force NRMSE at most 4 %", 0.95, of(lambda one: one["nrmse"] <= 0.04)),
        ("earthquake: FEI amplitude within 2 % of 1", 0.95, of(lambda one: np.abs(one["fei"] - 1) <= 0.02)),
    ):
        lines.append(Asked(what, f"{100 * least:.0f} %", reached, reached["adaptive"] >= least))
    return lines


TITLES = {
    "fixed": "fixed scheme",
    "adaptive": "self-calibrating",
    "robust": "self-calibrating, designed loop",
}


def table(data: dict[str, np.ndarray], schemes: Schemes = SCHEMES) -> str:
    """The requirements, and the share of the rigs that meet each, as a table."""
    titles = " | ".join(TITLES[scheme] for scheme in schemes)
    lines = [f"| share of the rigs | {titles} | goal |", "| --- " * (2 + len(schemes)) + "|"]
    for one in asked(data, schemes):
        shares = " | ".join(f"{100 * value:.1f} %" for value in one.reached.values())
        lines.append(f"| {one.what} | {shares} | {one.wanted} |")
    return "\n".join(lines) + "\n"


def figures(data: dict[str, np.ndarray], folder: Path) -> None:
    """The two pictures."""
    shown = Figure(figsize=(6.7, 3.2), layout="constrained")
    axes = shown.subplots(1, 2, sharey=True)
    title = {"fixed": "fixed scheme", "adaptive": "calibrates itself"}
    for ax, scheme, color in zip(axes, SCHEMES, (ORANGE, BLUE), strict=True):
        low, high = (data[f"{scheme}_{name}"].clip(0.1, 10) for name in ("lowest", "highest"))
        ax.axhspan(0.93, 1.07, color="0.85", lw=0)
        ax.vlines(100 * (data["flow_gain"] * np.sqrt(data["supply"]) - 1), low, high, color=color, lw=0.4)
        ax.set(title=title[scheme], yscale="log", ylim=(0.1, 10), xlabel="true flow gain off by (%)")
        ax.set_yticks([0.1, 0.5, 1, 2, 10], ["≤ 0.1", "0.5", "1", "2", "≥ 10"], minor=False)
    axes[0].set_ylabel("force over command, 0.5–9.5 Hz")
    shown.savefig(folder / "random_rigs_ratio.png", dpi=150)
    shown = Figure(figsize=(6.7, 2.8), layout="constrained")
    ax = shown.subplots()
    for scheme, color in zip(SCHEMES, (ORANGE, BLUE), strict=True):
        errors = np.sort(100 * data[f"{scheme}_nrmse"])
        ax.plot(errors, 100 * np.arange(1, len(errors) + 1) / len(errors), color=color, label=title[scheme])
    ax.axvline(4.0, color="0.35", ls="--", lw=0.9)
    ax.set(xscale="log", xlim=(2, 300), ylim=(0, 101), xlabel="force error of the earthquake test (%)")
    ax.set_xticks([2, 4, 10, 30, 100, 300], ["2", "4", "10", "30", "100", "300"], minor=False)
    ax.set_ylabel("share of the rigs (%)")
    ax.legend(frameon=False, loc="lower right")
    shown.savefig(folder / "random_rigs_error.png", dpi=150)


def report(folder: Path) -> None:
    """The generated part of the page, and its pictures."""
    data = read(RESULTS)
    figures(data, folder)
    unstable = f"{100 * (data['fixed_unstable'] > 0).mean():.1f} %"
    text = [
        f"{len(data['flow_gain'])} rigs. With the fixed scheme the specimen becomes unstable on {unstable} "
        "of them.",
        "",
        "![Force over command from 0.5 to 9.5 Hz, one line per rig: from nothing to ten times "
        "with the fixed scheme, with self-calibration within the grey band]"
        "(_generated/random_rigs_ratio.png)",
        "",
        "*Force over command in the sweep, one line from the least to the largest ratio per rig. The grey "
        "band is 0.93–1.07.*",
        "",
        "![Share of the rigs below a force error in the earthquake test](_generated/random_rigs_error.png)",
        "",
        "*Force error of the earthquake test: share of the rigs below it; the dashed line is the goal, 4 %.*",
        "",
        table(data),
    ]
    if SEEDS.exists():
        seeds = read(SEEDS)
        noisy = seeds["seed"] > 0
        head = (
            "| Northridge × 0.6: displacement error against the ideal response | fixed | self-calibrating |"
        )
        text += ["", head]
        text += ["| --- | --- | --- |"]
        quiet, median = (
            " | ".join(f"{100 * value:.1f} %" for value in northridge_errors(one).values())
            for one in (False, True)
        )
        worst = " | ".join(f"{100 * seeds[scheme][noisy].max():.1f} %" for scheme in SCHEMES)
        text += [f"| without noise | {quiet} |", f"| with noise, median of {noisy.sum()} seeds | {median} |"]
        text += [f"| with noise, the worst of them | {worst} |", ""]
    write_text(folder / "random_rigs.md", "\n".join(text))


def main(count: int) -> None:
    """Run what is missing."""
    if (folder := os.environ.get("EFT_RECORDS")) and not SEEDS.exists():
        write(SEEDS, northridge(Path(folder)))
    run_missing(RESULTS, draw(count), truths, SCHEMES)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
