"""A null bias of 2 % in each scheme, told or not: remaining force, and error of the estimated flow gain.

``python docs/evidence/null_bias.py`` runs every test and stores its results in ``data/null_bias.csv``.
`report` makes the table of the page.
"""

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from random_rigs import ADAPTIVE, BAND, RATE, noise, true

import eft
from eft._files import write_text

RESULTS = Path(__file__).parent / "data" / "null_bias.csv"
BIASES, AMPLITUDES = (0.0, 0.02), (2200.0, 8900.0)
DIGITAL = {"controller.realization": "digital", "compensation.feedforward": True}
INTEGRAL = {"controller.integral_gain": 10.0}
KNOWN = {"servovalve.null_bias": 0.02}
ROBUST = {"controller.force_loop": "robust", "compensation.feedforward": True}
SCHEMES: dict[str, dict[str, object]] = {
    "paper's gains": DIGITAL,
    "paper's gains, integral": DIGITAL | INTEGRAL,
    "designed loop": ROBUST,
    "paper's gains, self-calibrating": DIGITAL | ADAPTIVE,
    "paper's gains, curve": DIGITAL | ADAPTIVE | {"compensation.curve_correction": True},
    "paper's gains, self-calibrating, integral": DIGITAL | ADAPTIVE | INTEGRAL,
    "the same, curve": DIGITAL | ADAPTIVE | INTEGRAL | {"compensation.curve_correction": True},
    "designed loop, self-calibrating": ROBUST | ADAPTIVE,
    "designed loop, curve": ROBUST | ADAPTIVE | {"compensation.curve_correction": True},
    "paper's gains, known bias": DIGITAL | KNOWN,
    "paper's gains, curve, known bias": DIGITAL | ADAPTIVE | {"compensation.curve_correction": True} | KNOWN,
    "designed loop, known bias": ROBUST | KNOWN,
}
SETTLED = slice(-8 * round(RATE), None)
"""The last 8 s, in which the mean of the command is nearly zero."""


def row(scheme: str, amplitude: float, bias: float) -> dict[str, str]:
    """A sweep from 0 to 10 Hz. A scheme that knows the bias is told the true one."""
    told = dict.fromkeys(KNOWN.keys() & SCHEMES[scheme].keys(), bias)
    truth = true({"servovalve.null_bias": bias})
    rig = eft.Rig.zhao2005().replace(SCHEMES[scheme] | told | noise(1) | truth)
    run = eft.simulate(rig, eft.sine_sweep(amplitude, 0.0, 10.0, 32.0, RATE))
    ratio = run.fft_ratio(*BAND).ratio
    first = np.abs(run.force - run.command)[: round(RATE)].max()
    return {
        "scheme": scheme,
        "amplitude": f"{amplitude:.0f}",
        "bias": f"{bias:g}",
        "residual": f"{(run.force - run.command)[SETTLED].mean():.0f}",
        "first": f"{first:.0f}",
        "lowest": f"{ratio.min():.3f}",
        "highest": f"{ratio.max():.3f}",
        "nrmse": f"{run.metrics(fft=False)['nrmse']:.4f}",
        "flow_gain": f"{run.flow_gain_estimate[-1] - 1.0:+.4f}",
    }


def rows() -> Iterator[dict[str, str]]:
    """Every scheme, without and with the bias."""
    for scheme in SCHEMES:
        for amplitude in AMPLITUDES:
            for bias in BIASES:
                yield row(scheme, amplitude, bias)


def main() -> None:
    """Runs every test and stores its results."""
    found = list(rows())
    lines = [
        ",".join(f'"{cell}"' if "," in cell else cell for cell in line)
        for line in (found[0], *(r.values() for r in found))
    ]
    write_text(RESULTS, "\n".join(lines) + "\n")


def report(folder: Path) -> None:
    """The table that the page includes; 2.2 and 8.9 kN in each cell."""
    with RESULTS.open(encoding="utf-8") as file:
        stored = {(r["scheme"], float(r["amplitude"]), float(r["bias"])): r for r in csv.DictReader(file)}
    titles = ["scheme", "remaining force", "largest error in the first second"]
    titles += ["force over command", "without bias", "force error", "without bias", "error of the flow gain"]
    lines = ["| " + " | ".join(titles) + " |", "| --- " * len(titles) + "|"]
    sound, biased = BIASES

    def cell(scheme: str, bias: float, text: str) -> str:
        of = [stored[scheme, amplitude, bias] for amplitude in AMPLITUDES]
        return " / ".join(text.format(**{name: number(value) for name, value in one.items()}) for one in of)

    for scheme in SCHEMES:
        learns = bool(SCHEMES[scheme].get("compensation.adaptive"))
        cells = [scheme, cell(scheme, biased, "{residual:.0f} N"), cell(scheme, biased, "{first:.0f} N")]
        for text in ("{lowest:.2f}–{highest:.2f}", "{nrmse:.1%}"):
            cells += [cell(scheme, biased, text), cell(scheme, sound, text)]
        cells.append(cell(scheme, biased, "{flow_gain:+.1%}") if learns else "–")
        lines.append("| " + " | ".join(cells) + " |")
    write_text(folder / "null_bias.md", "\n".join(lines) + "\n")


def number(text: str) -> float | str:
    """A stored value."""
    try:
        return float(text)
    except ValueError:
        return text


if __name__ == "__main__":
    main()
