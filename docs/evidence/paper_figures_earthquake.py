"""Figs. 9 and 10 of the paper, the earthquake test.

They need the paper's record, which cannot ship. If the folder ``EFT_RECORDS`` has it, they are made with it,
and `northridge.toml` in this folder keeps the numbers. Without the record they are made with El Centro, which
ships with the package, and the page quotes the kept numbers.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from paper_figures_page import Shown, table

import eft
from eft import plots
from eft._files import write_text
from eft.demo.experiments import SCHEMES, EarthquakeTest, observe

if TYPE_CHECKING:
    from eft import TestRun

KEPT = Path(__file__).parent / "northridge.toml"
RECORD = "northridge1994_sylmar_county_360.csv"
SMALLER = 0.6
"""Scale at which the paper's record leaves the virtual valve within its stroke."""


def figures_9_and_10() -> Iterator[Shown]:
    """The earthquake test, with the paper's record if it is available, otherwise with El Centro."""
    path = Path(os.environ.get("EFT_RECORDS", "")) / RECORD
    available = bool(os.environ.get("EFT_RECORDS")) and path.is_file()
    test = EarthquakeTest(path if available else None, None)
    runs = {scheme: test.run(scheme) for scheme in SCHEMES}
    ideal = test.result(runs).ideal
    numbers = {scheme: numbers_of(run, ideal) for scheme, run in runs.items()}
    if available:
        smaller = EarthquakeTest(path, SMALLER)
        for scheme in ("linear", "nonlinear"):
            run = smaller.run(scheme)
            numbers[f"{scheme}, at {SMALLER:.0%}"] = numbers_of(
                run, eft.ideal_response(run.rig, smaller.command)
            )
        stopped = (runs["nonlinear"].status & eft.Status.SPOOL_STOP) != 0
        scale = {
            "ideal displacement, m": float(abs(ideal.displacement).max()),
            "stroke, m": test.rig["actuator.stroke"],
            "first at the stop, s": float(ideal.time[stopped.argmax()]),
        }
        keep({**numbers, "full scale": scale})
        about, kept = "the paper's record, 0.84 g.", None
    else:
        about = f"El Centro, 1940, scaled by {test.scale:g}, because the paper's record cannot ship."
        with KEPT.open("rb") as file:
            kept = tomllib.load(file)
        scale = kept.pop("full scale")
    window = strong_part(ideal)
    yield Shown(
        "9",
        "forces in an earthquake test",
        "under the full Northridge record (0.84 g) the time history of the force seems to follow the "
        "command with every scheme, even without compensation. Without compensation the spectrum of the "
        "force near the natural frequency is far below that of the command. With nonlinear compensation "
        "both agree.",
        tables(
            about, ("largest spool opening", "force error (rms)", "force/command, 1.2–1.9 Hz"), numbers, kept
        )
        + beyond(scale),
        {"fig09": plots.figure_9(runs, window=window)},
    )
    yield Shown(
        "10",
        "displacement and velocity in an earthquake test",
        "without compensation the responses are much smaller than desired. Linear compensation is better "
        "than none, and worse than nonlinear compensation. With nonlinear compensation displacement and "
        "velocity generally follow the desired ones in phase, but do not fully reach several peaks.",
        tables(
            f"{about} The desired response is that of the same structure under the command applied exactly.",
            ("peak displacement over the ideal one", "displacement error (rms)"),
            numbers,
            kept,
        ),
        {"fig10": plots.figure_10(runs, ideal, window=window)},
    )


def beyond(scale: dict[str, float]) -> str:
    """Why this rig cannot apply the paper's record at full scale."""
    return (
        "\n"
        "\n"
        "This model cannot apply the paper's record at full scale. The ideal response needs "
        f"{1e3 * scale['ideal displacement, m']:.0f} mm of a stroke of {1e3 * scale['stroke, m']:.0f} mm. "
        f"At {scale['first at the stop, s']:.1f} s the valve reaches its stop. One peak of the force is "
        "then cut, and the motion after it differs. The paper does not name the station and the component "
        f"of its record. At {SMALLER:.0%} the valve is large enough, and the force follows the command."
    )


def numbers_of(run: TestRun, ideal: eft.IdealResponse) -> dict[str, float]:
    """The numbers of the tables, by the names of their columns."""
    found = observe(run, ideal)
    frequency = np.fft.rfftfreq(len(run), 1.0 / run.sample_rate)
    band = (frequency >= 1.2) & (frequency <= 1.9)
    power = [float((abs(np.fft.rfft(signal))[band] ** 2).sum()) for signal in (run.force, run.command)]
    return {
        "largest spool opening": found.max_spool,
        "force error (rms)": found.force_nrmse,
        "force/command, 1.2–1.9 Hz": float(np.sqrt(power[0] / power[1])),
        "peak displacement over the ideal one": found.peak_reached,
        "displacement error (rms)": found.displacement_nrmse,
    }


def tables(
    about: str,
    columns: tuple[str, ...],
    numbers: dict[str, dict[str, float]],
    kept: dict[str, dict[str, float]] | None,
) -> str:
    """The numbers of this run, and the kept numbers of the paper's record if this run has another one."""

    def one(values: dict[str, dict[str, float]]) -> str:
        rows = [(name, *(f"{row[column]:.0%}" for column in columns)) for name, row in values.items()]
        return table(("", *columns), rows)

    text = about + one(numbers)
    if kept is None:
        return text
    return f"{text}\n\nWith the paper's record (0.84 g) the same tests gave:{one(kept)}"


def strong_part(ideal: eft.IdealResponse) -> tuple[float, float]:
    """From the start to 95 % of the displacement's energy, s."""
    energy = (ideal.displacement**2).cumsum()
    return 0.0, float(ideal.time[(energy < 0.95 * energy[-1]).sum()])


def keep(numbers: dict[str, dict[str, float]]) -> None:
    """Keep the numbers of the paper's record for pages that are made without it."""
    lines = [
        "# Written by paper_figures_earthquake.py where the paper's record is available, and quoted "
        "elsewhere."
    ]
    for scheme, values in numbers.items():
        lines += ["", f'["{scheme}"]', *(f'"{key}" = {value:.4g}' for key, value in values.items())]
    write_text(KEPT, "\n".join(lines) + "\n")
