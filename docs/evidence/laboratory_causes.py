"""The causes of the errors of the worst laboratory rigs: each rig again without one group of deviations.

``python docs/evidence/laboratory_causes.py [COUNT]`` writes ``data/laboratory_causes.csv`` with a row for
each rig. A row has the largest deviation of force over command from 1 in the sweep, as drawn and without each
group.
"""

import sys
from pathlib import Path

import numpy as np
from laboratory_rigs import DURATION, SEED, changes_of, drawn, results
from random_rigs import BAND, Row, read, write

import eft
from eft._files import write_text
from eft.benchmark import Case
from eft.benchmark._excitations import within_the_rig
from eft.benchmark._rigs import RATE, laboratory

CAUSES = Path(__file__).parent / "data" / "laboratory_causes.csv"
COUNT = 10
SCHEME = "identified"
SENSORS = ("force", "displacement", "spool", "velocity")
GONE = {
    "overlap": {"overlap": 0.0},
    "friction": {"friction": 0.0},
    "latencies": {f"{sensor}_delay": 0.0 for sensor in SENSORS},
    "bandwidths": {f"{sensor}_bandwidth": 3000.0 for sensor in SENSORS},
    "sensor gains and area": {f"{sensor}_gain": 1.0 for sensor in SENSORS} | {"piston_area": 1.0},
    "flow curve": {"direction": 0.0, "bend": 0.0},
    "oil": {"oil_stiffness": 1.0},
    "pilot": {"pilot_time_constant": 1.0},
    "supply": {"supply": 1.0},
    "noise": {"noise": 0.0},
}


def departure(data: dict[str, np.ndarray], scheme: str = SCHEME) -> np.ndarray:
    """Largest deviation of force over command from 1; infinite if the rig is unstable."""
    far = np.maximum(data[f"{scheme}_highest"] - 1.0, 1.0 - data[f"{scheme}_lowest"])
    return np.where(data[f"{scheme}_unstable"] > 0.0, np.inf, far)


def swept(case: Case, sweep: eft.Command) -> float:
    """The deviation of one rig in a sweep, with its overlap and friction known."""
    known = {"actuator.friction": case.rig.plant["actuator.friction"]}
    run = eft.simulate(case.rig.replace(changes_of(SCHEME, case.rig) | known), sweep)
    if not run.success:
        return np.inf
    ratio = run.fft_ratio(*BAND).ratio
    return float(max(ratio.max() - 1.0, 1.0 - ratio.min()))


def row(number: int, case: Case, amplitude: float) -> Row:
    """A rig as drawn, and without each group."""
    known = case.rig.replace({"truth": None})
    sweep = within_the_rig(known, eft.sine_sweep(amplitude, 0.0, 10.0, DURATION, RATE))
    seed = case.rig.plant["sensors.seed"]
    found: Row = {"rig": float(number), "frequency": case.drawn["frequency"]}
    found |= {"damping_ratio": case.drawn["damping_ratio"], "amplitude": float(np.abs(sweep.values).max())}
    found["as drawn"] = swept(case, sweep)
    for name, gone in GONE.items():
        found[name] = swept(Case(case.name, laboratory({**case.drawn, **gone}, seed)), sweep)
    return found


def report(folder: Path) -> None:
    """The table that the page includes: the deviation without each group."""
    data = read(CAUSES)
    head = ["rig", "natural frequency", "damping", "sweep", "as drawn", *(f"no {name}" for name in GONE)]
    lines = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for i, number in enumerate(data["rig"]):
        cells = [f"{number:.0f}", f"{data['frequency'][i]:.2f} Hz", f"{100 * data['damping_ratio'][i]:.1f} %"]
        cells.append(f"{1e-3 * data['amplitude'][i]:.1f} kN")
        left = [data[name][i] for name in GONE]
        cells.append(f"{100 * data['as drawn'][i]:.0f} %")
        cells += [f"**{100 * one:.0f} %**" if one == min(left) else f"{100 * one:.0f} %" for one in left]
        lines.append(f"| {' | '.join(cells)} |")
    write_text(folder / "laboratory_causes.md", "\n".join(lines) + "\n")


def main(count: int) -> None:
    """The worst rigs of the study."""
    far = departure(read(results(SEED)))
    rigs, rows = drawn(far.size), list[Row]()
    for number in np.argsort(-far)[:count]:
        rows.append(row(int(number), *rigs[number]))
        print(rows[-1], flush=True)
    write(CAUSES, rows)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
