"""The pictures of the page that compares the fixed scheme with self-calibration."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from fixed_against_adaptive_cases import command, falling_supply
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from random_rigs import BLUE, ORANGE, SCHEMES, northridge_errors, swings_up

import eft
from eft._files import atomic_write

TITLES = {"fixed": "fixed scheme", "adaptive": "calibrates itself"}
COLORS = {"fixed": ORANGE, "adaptive": BLUE}
# Legible at a width of 400 pixels.
STYLE = {"font.size": 11, "axes.titlesize": 12, "axes.spines.top": False, "axes.spines.right": False}
RATIOS = [0.5, 0.7, 1.0, 1.4, 2.0]
SWUNG = "0.15"
Rows = list[dict[str, str]]


def write(rows: Rows, folder: Path) -> str:
    """The pictures and their captions."""
    told = []
    with mpl.rc_context(STYLE):
        for name, make in (
            ("map", maps),
            ("history", history),
            ("curves", curves),
            ("structures", structures),
            ("supply", supply),
            ("errors", errors),
        ):
            figure = Figure(figsize=(5.8, 3.4), layout="constrained")
            alternative, below = make(rows, figure)
            with atomic_write(folder / f"fixed_against_adaptive_{name}.png") as temporary:
                figure.savefig(temporary, format="png", dpi=160)
            told.append(f"![{alternative}](_generated/fixed_against_adaptive_{name}.png)\n\n*{below}*\n")
    return "\n".join(told)


def worst(low: float, high: float) -> float:
    """The ratio that is further from 1, as a factor."""
    return high if high * low > 1.0 else low


def maps(rows: Rows, figure: Figure) -> tuple[str, str]:
    """The worst ratio over flow gain and response delay, and the unstable region."""
    tests = [row for row in rows if row["row"] == "map"]
    gains, delays = (sorted({float(row[key]) for row in tests}) for key in ("flow_gain", "response_delay"))
    axes = figure.subplots(1, 2, sharey=True)
    swung, span = {}, {}
    for ax, scheme in zip(axes, SCHEMES, strict=True):
        ratio = np.ones((len(delays), len(gains)))
        bad = np.zeros(ratio.shape, bool)
        for row in tests:
            at = delays.index(float(row["response_delay"])), gains.index(float(row["flow_gain"]))
            found = worst(float(row[f"{scheme}_lowest"]), float(row[f"{scheme}_highest"]))
            ratio[at] = max(ratio[at], found, key=lambda one: abs(np.log(one)))
            bad[at] |= float(row[f"{scheme}_unstable"]) > 0
        swung[scheme], span[scheme] = bad.mean(), (ratio[~bad].min(), ratio[~bad].max())
        ax.set_facecolor(SWUNG)
        image = ax.pcolormesh(
            100 * (np.array(gains) - 1),
            1e3 * np.array(delays),
            np.ma.array(ratio, mask=bad),
            norm=LogNorm(RATIOS[0], RATIOS[-1]),
            cmap="PuOr",
            rasterized=True,
        )
        ax.plot(0, 5, "o", mfc="none", mec="k", ms=9, mew=1.5)
        ax.set(title=TITLES[scheme], xlabel="flow gain off by (%)", xticks=[-10, -5, 0, 5, 10])
    axes[0].set(ylabel="response delay (ms)", yticks=range(3, 9))
    if swung["fixed"] > 0:
        axes[0].text(
            0.79, 0.5, "specimen\nunstable", color="w", ha="center", va="center", transform=axes[0].transAxes
        )
    scale = figure.colorbar(image, ax=axes, label="worst force over command", extend="both")
    scale.set_ticks(RATIOS, labels=[f"{value:g}" for value in RATIOS], minor=False)
    scale.minorticks_off()
    return (
        "Two maps of flow gain and response delay: the fixed scheme is coloured or black nearly everywhere, "
        "self-calibration white everywhere",
        f"Worst force over command, 0.5–9.5 Hz, in the sweeps of 2.2 and 8.9 kN with noise, over the true "
        f"values of the valve. The circle is the configuration of the controller. White is 1. In the black "
        f"region the specimen becomes unstable: {100 * swung['fixed']:.0f} % of the fixed scheme's map, "
        f"{100 * swung['adaptive']:.0f} % of the other one. The colours of the latter range from "
        f"{span['adaptive'][0]:.3f} to {span['adaptive'][1]:.3f}.",
    )


def swept(scheme: str, gain: float) -> eft.TestRun:
    """The sweep of 8.9 kN on a valve with a factor on the table's flow."""
    rig = eft.Rig.zhao2005().replace({"truth.servovalve.flow_gain_scale": gain, **SCHEMES[scheme]})
    return eft.simulate(rig, command("8.9 kN"))


def history(rows: Rows, figure: Figure) -> tuple[str, str]:
    """Force and command while the sweep passes the natural frequency."""
    axes = figure.subplots(2, 1, sharex=True, sharey=True)
    for ax, gain, title in zip(axes, (0.95, 1.05), ("5 % less", "5 % more"), strict=True):
        for scheme, color in COLORS.items():
            run = swept(scheme, gain)
            ax.plot(run.time, 1e-3 * run.force, color=color, lw=1.6, label=TITLES[scheme])
        ax.plot(run.time, 1e-3 * run.command, "k--", lw=1.0, label="command")
        ax.set(
            title=f"the valve passes {title} than the table says",
            xlim=(3.6, 6.6),
            ylim=(-25, 25),
            ylabel="force (kN)",
        )
    axes[1].set_xlabel("time (s)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return (
        "Force over time at resonance: the fixed scheme loses half of its force on one valve and swings "
        "up on the other, self-calibration lies on the command",
        "Force while the 8.9 kN sweep passes the structure's natural frequency, 1.58 Hz at 5.1 s, without "
        "noise.",
    )


def curves(rows: Rows, figure: Figure) -> tuple[str, str]:
    """Force over command at every frequency, for some flow gains."""
    axes = figure.subplots(1, 2, sharey=True)
    shades = dict(
        zip((0.90, 0.95, 1.00, 1.01, 1.10), mpl.colormaps["cividis"](np.linspace(0.0, 0.9, 5)), strict=True)
    )
    for ax, scheme in zip(axes, SCHEMES, strict=True):
        for gain, color in reversed(shades.items()):
            run = swept(scheme, gain)
            ratio = run.fft_ratio(0.5, 9.5)
            swung = swings_up(run, command("8.9 kN"))
            label = f"{100 * (gain - 1):+.0f} %" if gain != 1 else "none"
            ax.plot(
                ratio.frequency,
                ratio.ratio,
                color=color,
                lw=0.6 if swung else 2.0,
                ls=":" if swung else "-",
                label=label,
            )
        ax.set(
            xscale="log",
            yscale="log",
            xlim=(0.5, 9.5),
            ylim=(0.2, 5.0),
            title=TITLES[scheme],
            xlabel="frequency (Hz)",
        )
        ax.set_xticks([0.5, 1, 2, 5], ["0.5", "1", "2", "5"])
        ax.set_xticks([], minor=True)
        ax.set_yticks([0.2, 0.5, 1, 2, 5], ["0.2", "0.5", "1", "2", "5"])
        ax.set_yticks([], minor=True)
    axes[0].set_ylabel("force over command")
    axes[1].legend(title="flow gain off by", frameon=False, loc="upper right", ncols=2)
    return (
        "Force over command against frequency: a notch at resonance or instability with the fixed scheme, "
        "one flat line with self-calibration",
        "Force over command in the 8.9 kN sweep, without noise. Dotted lines: the specimen becomes unstable.",
    )


def structures(rows: Rows, figure: Figure) -> tuple[str, str]:
    """From the least to the largest ratio, for structures that the controller does not know."""
    figure.set_size_inches(5.8, 4.6)
    ax = figure.subplots()
    chosen = [row for row in rows if row["row"] in ("structure", "building") and row["seed"] != "0"][::-1]
    ax.axvspan(0.95, 1.05, color="0.85", lw=0)
    for i, row in enumerate(chosen):
        for scheme, shift in (("fixed", 0.17), ("adaptive", -0.17)):
            bar(ax, row, scheme, i + shift)
    for scheme, color in COLORS.items():
        ax.plot([], [], color=color, lw=4, label=TITLES[scheme])
    ax.plot([], [], "x", color=ORANGE, mew=2, label="unstable")
    labels = [("three stories, " if row["row"] == "building" else "") + row["label"] for row in chosen]
    ax.set_yticks(range(len(chosen)), labels, fontsize=9)
    ax.set(xscale="log", xlim=(0.7, 1.4), xlabel="force over command, 0.5–9.5 Hz")
    ax.set_xticks([0.7, 0.8, 0.9, 1, 1.1, 1.2, 1.4], ["0.7", "0.8", "0.9", "1", "1.1", "1.2", "1.4"])
    ax.set_xticks([], minor=True)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return (
        "From the least to the largest force over command for ten structures and three buildings: with "
        "self-calibration all within the grey band",
        "From the least to the largest force over command, with noise. The grey band is 0.95–1.05. A bar "
        "that touches the edge ends beyond it.",
    )


def bar(ax: Axes, row: dict[str, str], scheme: str, height: float) -> None:
    """One test; a cross at the edge if it is unstable."""
    if float(row[f"{scheme}_unstable"]) > 0:
        ax.plot(1.36, height, "x", color=COLORS[scheme], mew=2)
    else:
        ends = float(row[f"{scheme}_lowest"]), float(row[f"{scheme}_highest"])
        ax.hlines(height, *ends, color=COLORS[scheme], lw=4)


def supply(rows: Rows, figure: Figure) -> tuple[str, str]:
    """The estimated flow gain while the supply pressure falls, and the force errors."""
    ax = figure.subplots()
    rig = eft.Rig.zhao2005().replace(SCHEMES["adaptive"] | falling_supply())
    run = eft.simulate(rig, command("El Centro"))
    pressure = rig["supply.pressure"]
    ax.plot(run.time, 100 * np.sqrt(run.supply_pressure / pressure), "k--", lw=1.5, label="true")
    ax.plot(run.time, 100 * run.flow_gain_estimate, color=BLUE, lw=2, label="found without a transducer")
    ax.axhline(100, color=ORANGE, lw=2, label="fixed scheme")
    ax.set(xlabel="time (s)", ylabel="flow gain (% of the table's)", ylim=(85, 102), xlim=(0, run.time[-1]))
    ax.legend(frameon=False, loc="lower left")
    constant = next(row for row in rows if row["label"] == "constant" and row["seed"] == "0")
    faster = {
        row["label"]: float(row["adaptive_nrmse"]) / float(constant["adaptive_nrmse"])
        for row in rows
        if row["row"] == "faster"
    }
    return (
        "The estimated flow gain follows the true one while the supply pressure falls by 20 %",
        "El Centro while the supply falls by 20 % in 20 s, not measured and without noise. The flow gain is "
        "proportional to the root of the pressure. The estimate lags a faster fall. With a fall in 10 s the "
        f"force error is {faster['10 s']:.1f} times that with constant supply, in 5 s "
        f"{faster['5 s']:.1f} times. With a transducer it is {faster['measured']:.2f} times, for 5 s.",
    )


def errors(rows: Rows, figure: Figure) -> tuple[str, str]:
    """The errors of whole tests, without noise and with it."""
    ax = figure.subplots()
    shown: list[tuple[str, dict[str, float]]] = []
    for row, label, title in (
        ("sweep", "sound calibration", "8.9 kN sweep"),
        ("supply", "constant", "El Centro"),
        ("supply", "without a transducer", "El Centro, supply falls"),
    ):
        for one in (one for one in rows if one["row"] == row and one["label"] == label):
            part = ", noise" if one["seed"] != "0" else ""
            shown.append((title + part, {scheme: float(one[f"{scheme}_nrmse"]) for scheme in SCHEMES}))
    for noisy, part in ((False, ""), (True, ", noise")):
        shown.append((f"Northridge × 0.6, motion{part}", northridge_errors(noisy)))
    for i, (_, reached) in enumerate(shown):
        ax.plot(
            [100 * value for value in reached.values()], [-i] * len(reached), color="0.75", lw=2, zorder=1
        )
        for scheme, value in reached.items():
            ax.plot(100 * value, -i, "o", color=COLORS[scheme], ms=9, label=None if i else TITLES[scheme])
    ax.set_yticks([-i for i in range(len(shown))], [title for title, _ in shown])
    ax.set(xscale="log", xlim=(0.4, 25), xlabel="error, rms over rms (%)")
    ax.set_xticks([0.5, 1, 2, 5, 10, 20], ["0.5", "1", "2", "5", "10", "20"])
    ax.set_xticks([], minor=True)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return (
        "Errors of sweep and earthquake tests on a logarithmic scale: self-calibration lies well below the "
        "fixed scheme",
        "Error of the force, for Northridge of the displacement (with noise the median of its seeds).",
    )
