"""How well the stated standard deviations of the estimates cover the truth, over random rigs of three sizes.

``python docs/evidence/coverage.py [COUNT]`` runs the tests of each rig and writes ``data/coverage.csv``, one
row for each rig and estimate. `report` makes the table of the page. The same seed makes the same rigs
everywhere. The errors of the models were derived with another seed, 20162, and this one was kept back.
"""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

import learned_motion
import numpy as np
from random_rigs import ADAPTIVE, RANGES, RATE, true

import eft
from eft._files import write_text
from eft.benchmark._excitations import within_the_rig

RESULTS = Path(__file__).parent / "data" / "coverage.csv"
SEED, COUNT = 20168, 200
CURVE = ADAPTIVE | {"compensation.curve_correction": True}
# Openings at which the flow curve is judged; the motion reaches them.
OPENINGS = (-0.15, -0.1, -0.05, 0.05, 0.1, 0.15)
MOST_BIAS = 0.02
"""Largest null bias, of opening."""
Row = tuple[str, str, int, float, float, float]


SUPPLY = {
    "pressure": "3000 psi",
    "pump_flow": "60 gpm",
    "accumulator_volume": "20 gal",
    "precharge": "1500 psi",
}


def sheet(mass: str, frequency: str, force: str, flow: str, corner: str) -> eft.Rig:
    """A rig of another size, whose supply holds its pressure."""
    rig = eft.data_sheets.rig(
        {
            "structure": {"mass": mass, "frequency": frequency, "damping_ratio": "2 %"},
            "actuator": {"force": force, "stroke": "250 mm"},
            "servovalve": {"rated_flow": flow, "rated_drop": "1000 psi", "phase_90_frequency": corner},
            "supply": SUPPLY,
        }
    )
    return rig.replace({f"supply.{key}": None for key in ("droop", "accumulator", "pump_flow")})


RIGS = {
    "paper's rig": eft.Rig.zhao2005(),
    "250 kN": sheet("12 t", "2.3 Hz", "250 kN", "90 gpm", "60 Hz"),
    "25 kN": sheet("500 kg", "5 Hz", "25 kN", "10 gpm", "100 Hz"),
}
"""Rigs by their size."""
NEAR = ("actuator.compressibility", "servovalve.pilot_time_constant", "structure.mass")
"""What differs by up to 10 % from rig to rig."""


def draw(index: int, size: str) -> tuple[eft.Rig, dict[str, float]]:
    """A rig near that of a size, and what is true of its calibration. Its controller knows the rest."""
    random = np.random.default_rng([SEED, index])
    near = {key: RIGS[size][key] * random.uniform(0.9, 1.1) for key in NEAR}
    rig = RIGS[size].replace(near)
    valve = delay_of_valve(rig)
    truth = {
        "flow_gain": random.uniform(0.92, 1.08),
        "valve_delay": valve * random.uniform(0.7, 1.3),
        "velocity_delay": int(random.integers(0, 7)) / RATE,
        "noise": random.uniform(0.5, 2.0),
        "amplitude": float(random.choice([0.014, 0.057])) * capacity(rig),
        "asymmetry": random.uniform(-0.04, 0.04),
        "bend": random.uniform(-0.04, 0.04),
        "valve_gain": random.uniform(0.98, 1.02),
    }
    sensitivity = rig["servovalve.spool_sensitivity"] / truth["valve_gain"]
    pilot = rig["servovalve.pilot_flow_gain"] * truth["valve_gain"] * valve / truth["valve_delay"]
    changes: dict[str, object] = {
        "servovalve.spool_sensitivity": sensitivity,
        "servovalve.pilot_flow_gain": pilot,
        "sensors.seed": index,
        "sensors.velocity.delay": round(truth["velocity_delay"] * RATE),
    }
    for sensor, reach in (RANGES | {"force": capacity(rig)}).items():
        changes |= {f"sensors.{sensor}.noise": 5e-4 * truth["noise"] * reach}
        changes |= {f"sensors.{sensor}.range": reach, f"sensors.{sensor}.bits": 16}
    return rig.replace(true(changes)), truth


def capacity(rig: eft.Rig) -> float:
    """Largest force (N)."""
    return float(rig["actuator.piston_area"] * rig["supply.pressure"])


def delay_of_valve(rig: eft.Rig) -> float:
    """Response delay (s) of a three-stage valve at low frequencies: A_v/(K_3·K_vp)."""
    valve = rig.to_dict()["servovalve"]
    return float(valve["spool_area"] / (valve["spool_sensitivity"] * valve["pilot_flow_gain"]))


def test(rig: eft.Rig, amplitude: float) -> eft.TestRun:
    """A sweep through the structure's frequency, of this amplitude (N) or as far as the rig reaches."""
    sweep = eft.sine_sweep(amplitude, 0.0, 6.0, 24.0, RATE)
    return eft.simulate(rig, within_the_rig(rig.replace({"truth": None}), sweep))


def stated(run: eft.TestRun, name: str) -> float:
    """Standard deviation of an estimate at the end of a test."""
    return float(getattr(run, f"{name}_deviation")[-1])


def gain_and_delays(size: str, index: int) -> Iterator[Row]:
    """Gains and delays of a valve whose table is right; its own are those of the motion that was learned."""
    rig, truth = draw(index, size)
    changes = ADAPTIVE | true({"servovalve.flow_gain_scale": truth["flow_gain"]})
    run = test(rig.replace(changes), truth["amplitude"])
    valve_gain, response_delay = learned_motion.gain_and_delay(run)
    expected = {
        "flow_gain": truth["flow_gain"],
        "valve_gain": valve_gain,
        "velocity_delay": truth["velocity_delay"],
        "response_delay": response_delay,
    }
    kept = run.calibration
    assert kept is not None
    for name, value in expected.items():
        yield size, name, index, value, kept[name], stated(run, name)


def gain_beside_curve(size: str, index: int) -> Iterator[Row]:
    """Flow gain of the same valve with the curve correction, whose bands share its changes."""
    rig, truth = draw(index, size)
    run = test(
        rig.replace(CURVE | true({"servovalve.flow_gain_scale": truth["flow_gain"]})), truth["amplitude"]
    )
    kept = run.calibration
    assert kept is not None
    name = "flow gain beside the curve"
    yield size, name, index, truth["flow_gain"], kept["flow_gain"], stated(run, "flow_gain")


def bent(rig: eft.Rig, truth: dict[str, float]) -> tuple[list[float], list[float]]:
    """Openings and flows of a valve whose curve differs from the table by direction and bend."""
    table = rig["servovalve.flow_table"]
    openings = np.array(table["openings"])
    factor = truth["flow_gain"] * (1 + truth["asymmetry"] * np.sign(openings))
    factor *= 1 + truth["bend"] * (1 - 4 * np.abs(openings))
    return openings.tolist(), (factor * table["flows"]).tolist()


def null(size: str, index: int) -> Iterator[Row]:
    """Null offset of a valve whose curve differs from the table as well."""
    rig, truth = draw(index, size)
    openings, flows = bent(rig, truth)
    bias = np.random.default_rng([SEED, index, 1]).uniform(-MOST_BIAS, MOST_BIAS)
    changes = {"servovalve.flow_table": {"openings": openings, "flows": flows}, "servovalve.null_bias": bias}
    run = test(rig.replace(CURVE | true(changes)), 0.057 * capacity(rig))
    assert run.calibration is not None
    # The estimate is the commanded opening.
    offset = bias / truth["valve_gain"]
    yield size, "null_offset", index, offset, run.calibration["null_offset"], stated(run, "null_offset")


def nodes(size: str, index: int) -> Iterator[Row]:
    """Flow at some openings of a valve whose curve differs from the table by direction and bend."""
    rig, truth = draw(index, size)
    openings, flows = bent(rig, truth)
    curve = {"openings": openings, "flows": flows}
    run = test(rig.replace(CURVE | true({"servovalve.flow_table": curve})), 8900.0)
    kept = run.calibration
    assert kept is not None and run.found_flows is not None
    gain, curve = kept["flow_gain"], kept["curve"]
    at = np.linspace(-8, 8, 17) * kept["greatest_flow"] / 7
    own = np.array(curve["departure_deviations"])
    share = np.divide(own, np.abs(at), out=np.zeros_like(own), where=at != 0)
    # The departures' part of the flow gain cancels in the flow, the product of gain and curve.
    of_gain = max((stated(run, "flow_gain") / gain) ** 2 - curve["flow_gain_share"] ** 2, 0.0)
    for opening in OPENINGS:
        true_flow = np.interp(opening, openings, flows)
        found = np.interp(opening, openings, run.found_flows)
        deviation = np.sqrt(
            of_gain
            + curve["asymmetry_deviation"] ** 2
            + np.interp(found / gain, at[at != 0], share[at != 0]) ** 2
        )
        yield size, f"flow at {opening:g}", index, 1.0, found / true_flow, deviation


def main(count: int) -> None:
    """Runs every test and stores estimates, truth and stated deviations."""
    lines = ["size,estimate,rig,truth,found,deviation"]
    for size in RIGS:
        curve = nodes if size == "paper's rig" else lambda *_: ()
        kinds = (gain_and_delays, gain_beside_curve, curve, null)
        rows = (row for index in range(count) for kind in kinds for row in kind(size, index))
        for row in rows:
            of, name, rig, truth, found, deviation = row
            lines.append(f"{of},{name},{rig},{truth:.6g},{found:.6g},{deviation:.3g}")
    write_text(RESULTS, "\n".join(lines) + "\n")


def table() -> str:
    """Coverage of each estimate by its stated deviation."""
    with RESULTS.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    titles = ["rig", "estimate", "tests", "rms error", "rms deviation", "ratio", "within two"]
    lines = ["| " + " | ".join(titles) + " |", "| --- " * len(titles) + "|"]
    for size, name in dict.fromkeys((row["size"], row["estimate"]) for row in rows):
        keys = ("truth", "found", "deviation")
        chosen = [row for row in rows if (row["size"], row["estimate"]) == (size, name)]
        truth, found, deviation = np.array([[float(row[key]) for key in keys] for row in chosen]).T
        error = np.abs(found - truth)
        late, digits = name.endswith("delay"), 4 if name == "null_offset" else 2

        def rms(values: np.ndarray) -> float:
            return float(np.sqrt(np.mean(np.square(values))))

        def shown(value: float, late: bool = late, digits: int = digits) -> str:
            return f"{1e6 * value:.0f} µs" if late else f"{value:.{digits}%}"

        cells = [size, name.replace("_", " "), str(error.size), shown(rms(error)), shown(rms(deviation))]
        cells += [f"{rms(deviation) / rms(error):.1f}", f"{np.mean(error < 2 * deviation):.1%}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def report(folder: Path) -> None:
    """The table that the page includes."""
    write_text(folder / "coverage.md", table())


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
    print(table())
