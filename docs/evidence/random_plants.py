"""Rigs whose calibration, plant, sensors and delays all differ from their controllers' configuration.

``python docs/evidence/random_plants.py [COUNT]`` runs the tests and adds a row a rig to
``data/random_plants.csv``, continuing after the last row (about half a second of one core per rig). `report`
makes table and picture for the page. The same seed makes the same rigs on every machine.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from random_rigs import (
    ADAPTIVE,
    BLUE,
    ORANGE,
    RANGES,
    SCHEMES,
    SEED,
    TITLES,
    draw,
    read,
    run_missing,
    table,
    true,
    truths,
)

import eft
from eft._files import write_text

RESULTS = Path(__file__).parent / "data" / "random_plants.csv"
COUNT = 1000
DESIGNED = {"controller.force_loop": "robust", "compensation.look_ahead": True}
ALL = SCHEMES | {"robust": ADAPTIVE | DESIGNED}


def draw_plants(count: int, seed: int = SEED) -> list[dict[str, float]]:
    """Rigs that differ in calibration, plant and sensors; half the force loops are digital."""
    random = np.random.default_rng(seed + 1)
    return [
        truth
        | {
            "oil_stiffness": random.uniform(0.6, 1.5),
            "pilot_time_constant": float(np.exp(random.uniform(np.log(0.5), np.log(2.0)))),
            "mass": random.uniform(0.7, 1.3),
            "piston_area": random.uniform(0.97, 1.03),
            "unknown_delay": float(random.integers(0, 3)),
            "digital": float(random.integers(0, 2)),
        }
        | {f"{sensor}_gain": random.uniform(0.98, 1.02) for sensor in RANGES}
        for truth in draw(count, seed)
    ]


def plant(truth: dict[str, float], seed: int) -> dict[str, object]:
    """The changes of the rig; its controller has the paper's numbers."""
    base = eft.Rig.zhao2005()
    changes: dict[str, object] = {
        # The oil column's stiffness is A²/K_a.
        "actuator.compressibility": base["actuator.compressibility"] / truth["oil_stiffness"],
        "dac.delay": int(truth["unknown_delay"]),
    }
    factors = {
        "servovalve.pilot_time_constant": "pilot_time_constant",
        "structure.mass": "mass",
        "actuator.piston_area": "piston_area",
    }
    changes |= {key: base[key] * truth[name] for key, name in factors.items()}
    changes |= {f"sensors.{sensor}.gain": truth[f"{sensor}_gain"] for sensor in RANGES}
    realization = "digital" if truth["digital"] else "analog"
    return truths(truth, seed) | true(changes) | {"controller.realization": realization}


def unstable(data: dict[str, np.ndarray], scheme: str) -> np.ndarray:
    """Whether the specimen is unstable, or the force error of the earthquake exceeds 100 %."""
    return (data[f"{scheme}_unstable"] > 0) | ~(data[f"{scheme}_nrmse"] <= 1.0)


def figure(data: dict[str, np.ndarray], folder: Path) -> None:
    """Stable and unstable rigs over oil stiffness and pilot time constant."""
    shown = Figure(figsize=(6.7, 3.4), layout="constrained")
    axes = shown.subplots(1, 3, sharey=True)
    digital = data["digital"] > 0
    panels = (
        ("analog", ~digital, "adaptive"),
        ("digital", digital, "adaptive"),
        ("designed, digital", digital | ~digital, "robust"),
    )
    for ax, (title, rigs, scheme) in zip(axes, panels, strict=True):
        bad = unstable(data, scheme)
        for chosen, color, marker, label in (
            (rigs & ~bad, BLUE, ".", "stable"),
            (rigs & bad, ORANGE, "x", "unstable"),
        ):
            place = data["oil_stiffness"][chosen], data["pilot_time_constant"][chosen]
            ax.plot(*place, marker, color=color, ms=3, label=label)
        ax.set(title=title, yscale="log", xlabel="oil stiffness (ratio)")
        ax.set_yticks([0.5, 0.7, 1, 1.4, 2], ["0.5", "0.7", "1", "1.4", "2"], minor=False)
        ax.yaxis.set_minor_formatter(NullFormatter())
    axes[0].set_ylabel("pilot time constant (ratio)")
    shown.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    shown.savefig(folder / "random_plants.png", dpi=150)


def groups(data: dict[str, np.ndarray]) -> str:
    """Share of unstable rigs by the largest deviation."""
    slow, stiff = data["pilot_time_constant"] > 1.5, data["oil_stiffness"] > 1.2
    chosen = {
        "all": np.ones(slow.size, bool),
        "pilot more than 1.5 times slower": slow,
        "oil more than 1.2 times stiffer, pilot at most 1.5 times slower": stiff & ~slow,
        "neither": ~stiff & ~slow,
    }
    lines = [f"| unstable | loop | rigs | {' | '.join(TITLES[scheme] for scheme in ALL)} |"]
    lines += ["| --- " * (3 + len(ALL)) + "|"]
    for name, of in chosen.items():
        for realization, digital in (("analog", 0.0), ("digital", 1.0)):
            these = of & (data["digital"] == digital)
            shares = (f"{100 * unstable(data, scheme)[these].mean():.0f} %" for scheme in ALL)
            lines.append(f"| {name} | {realization} | {these.sum()} | {' | '.join(shares)} |")
    return "\n".join(lines)


def report(folder: Path) -> None:
    """The generated part of the page, and its picture."""
    data = read(RESULTS)
    figure(data, folder)
    text = [
        f"{data['digital'].size} rigs.",
        "",
        "![Stable and unstable rigs over oil stiffness and pilot time constant]"
        "(_generated/random_plants.png)",
        "",
        "*Each point is a self-calibrating rig: with the paper's gains in an analog and in a digital loop, "
        "and with the designed loop. Ratios are true values over configured ones.*",
        "",
        groups(data),
        "",
        table(data, ALL),
    ]
    write_text(folder / "random_plants.md", "\n".join(text))


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    run_missing(RESULTS, draw_plants(count), plant, ALL)
