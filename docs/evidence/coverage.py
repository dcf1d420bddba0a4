"""How well the stated standard deviations of the estimates cover the truth, over random rigs.

``python docs/evidence/coverage.py [COUNT]`` runs two tests per rig and writes ``data/coverage.csv``, one row
for each rig and estimate. `report` makes the table of the page. The same seed makes the same rigs everywhere.
"""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from random_rigs import ADAPTIVE, RANGES, RATE, true, valve_delay

import eft
from eft._files import write_text

RESULTS = Path(__file__).parent / "data" / "coverage.csv"
SEED, COUNT = 20162, 200
# Angular frequency (rad/s) in the middle of the sweep's last four seconds.
SPEED = 2 * np.pi * 5.5
CURVE = ADAPTIVE | {"compensation.curve_correction": True}
# Openings at which the flow curve is judged; the motion reaches them.
OPENINGS = (-0.15, -0.1, -0.05, 0.05, 0.1, 0.15)
Row = tuple[str, int, float, float, float, float]


def draw(index: int) -> tuple[dict[str, object], dict[str, float]]:
    """One rig's changes, and its true values."""
    random = np.random.default_rng([SEED, index])
    truth = {
        "flow_gain": random.uniform(0.92, 1.08),
        "valve_delay": 5e-3 * random.uniform(0.7, 1.3),
        "velocity_delay": int(random.integers(0, 7)) / RATE,
        "noise": random.uniform(0.5, 2.0),
        "amplitude": float(random.choice([2200.0, 8900.0])),
        "asymmetry": random.uniform(-0.04, 0.04),
        "bend": random.uniform(-0.04, 0.04),
    }
    changes: dict[str, object] = {"sensors.seed": index}
    changes |= {"sensors.velocity.delay": round(truth["velocity_delay"] * RATE)}
    for sensor, size in RANGES.items():
        changes |= {f"sensors.{sensor}.noise": 5e-4 * truth["noise"] * size}
        changes |= {f"sensors.{sensor}.range": size, f"sensors.{sensor}.bits": 16}
    return true(changes) | valve_delay(truth["valve_delay"]), truth


def test(changes: dict[str, object], amplitude: float) -> eft.TestRun:
    """A sweep through the structure's frequency, on the paper's rig with these changes."""
    rig = eft.Rig.zhao2005().replace(changes)
    return eft.simulate(rig, eft.sine_sweep(amplitude, 0.0, 6.0, 24.0, RATE))


def delay_of(valve: float, run: eft.TestRun) -> float:
    """Delay (s) of the spool after a held command: the phase of the three-stage valve at `SPEED`."""
    pilot = run.rig.plant["servovalve.pilot_time_constant"]
    phase = np.arctan2(SPEED * valve, 1 - pilot * valve * SPEED**2)
    return float(phase / SPEED + 0.5 / RATE)


def model_errors(run: eft.TestRun) -> dict[str, float]:
    """Error of the learner's models in flow gain (1) and delays (s).

    They contain the first power of ``ωδ`` of a delay. The next ones are ``(ωδ)²`` in a gain and
    ``δ·(ωδ)²/3`` in the delay. The velocity's delay counts for the whole flow, but the part that compresses
    the oil is not late.
    """
    rig = run.rig.plant
    late, valve = run.velocity_delay_estimate[-1], run.response_delay_estimate[-1]
    last = slice(-4 * int(RATE), None)
    rate = np.diff(run.force[last]) * RATE
    oil = rig["actuator.compressibility"] / rig["actuator.piston_area"] * np.sqrt(np.mean(np.square(rate)))
    motion = rig["actuator.piston_area"] * np.sqrt(np.mean(np.square(run.velocity[last])))
    return {
        "flow_gain": run.flow_gain_estimate[-1] * (SPEED * late) ** 2,
        "velocity_delay": abs(late) * oil / motion,
        "response_delay": valve * (SPEED * valve) ** 2 / 3,
    }


def gain_and_delays(index: int) -> Iterator[Row]:
    """Flow gain and delays of a valve with the correct table."""
    changes, truth = draw(index)
    changes |= ADAPTIVE | true({"servovalve.flow_gain_scale": truth["flow_gain"]})
    run = test(changes, truth["amplitude"])
    expected = {
        "flow_gain": truth["flow_gain"],
        "velocity_delay": truth["velocity_delay"],
        "response_delay": delay_of(truth["valve_delay"], run),
    }
    left_out = model_errors(run)
    for name, value in expected.items():
        found = getattr(run, f"{name}_estimate")[-1]
        yield name, index, value, found, getattr(run, f"{name}_deviation")[-1], left_out[name]


def nodes(index: int) -> Iterator[Row]:
    """Flow at some openings of a valve whose curve differs from the table by direction and bend."""
    changes, truth = draw(index)
    table = eft.Rig.zhao2005()["servovalve.flow_table"]
    openings = np.array(table["openings"])
    factor = truth["flow_gain"] * (1 + truth["asymmetry"] * np.sign(openings))
    factor *= 1 + truth["bend"] * (1 - 4 * np.abs(openings))
    flows = factor * table["flows"]
    curve = {"openings": openings.tolist(), "flows": flows.tolist()}
    changes |= CURVE | true({"servovalve.flow_table": curve})
    run = test(changes, 8900.0)
    kept = run.calibration
    assert kept is not None and run.found_flows is not None
    gain, curve = kept["flow_gain"], kept["curve"]
    at = np.linspace(-8, 8, 17) * kept["greatest_flow"] / 7
    own = np.array(curve["departure_deviations"])
    share = np.divide(own, np.abs(at), out=np.zeros_like(own), where=at != 0)
    for opening in OPENINGS:
        true_flow = np.interp(opening, openings, flows)
        found = np.interp(opening, openings, run.found_flows)
        deviation = np.sqrt(
            (kept["deviations"]["flow_gain"] / gain) ** 2
            + curve["asymmetry_deviation"] ** 2
            + np.interp(found / gain, at[at != 0], share[at != 0]) ** 2
        )
        yield f"flow at {opening:g}", index, 1.0, found / true_flow, deviation, 0.0


def main(count: int) -> None:
    """Runs every test and stores estimates, truth and stated deviations."""

    def rows(index: int) -> list[Row]:
        return [*gain_and_delays(index), *nodes(index)]

    lines = ["estimate,rig,truth,found,deviation,left_out"]
    for row in (row for index in range(count) for row in rows(index)):
        name, rig, truth, found, *deviations = row
        sizes = ",".join(f"{size:.3g}" for size in deviations)
        lines.append(f"{name},{rig},{truth:.6g},{found:.6g},{sizes}")
    write_text(RESULTS, "\n".join(lines) + "\n")


def table() -> str:
    """Coverage of each estimate, by the stated deviation alone and together with the error of the models."""
    with RESULTS.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    titles = ["estimate", "tests", "rms error", "rms deviation", "within two"]
    titles += ["rms with the models' errors", "within two"]
    lines = ["| " + " | ".join(titles) + " |", "| --- " * len(titles) + "|"]
    for name in dict.fromkeys(row["estimate"] for row in rows):
        keys = ("truth", "found", "deviation", "left_out")
        of = np.array([[float(row[key]) for key in keys] for row in rows if row["estimate"] == name])
        truth, found, deviation, left_out = of.T
        whole, error = np.hypot(deviation, left_out), np.abs(found - truth)
        late = name.endswith("delay")

        def rms(values: np.ndarray, late: bool = late) -> str:
            size = float(np.sqrt(np.mean(np.square(values))))
            return f"{1e6 * size:.0f} µs" if late else f"{size:.2%}"

        cells = [name.replace("_", " "), str(len(of)), rms(error)]
        for size in (deviation, whole):
            cells += [rms(size), f"{np.mean(error < 2 * size):.1%}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def report(folder: Path) -> None:
    """The table that the page includes."""
    write_text(folder / "coverage.md", table())


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
    print(table())
