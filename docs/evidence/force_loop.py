"""The designed force loop and the paper's gains: margins, and tests on rigs that deviate."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import eft
from eft._files import write_text

RIG = eft.Rig.zhao2005()
ADAPTIVE = {
    "compensation.adaptive": True,
    "compensation.feedforward": True,
    "compensation.look_ahead": True,
}
LOOPS = {
    "paper": {"controller.realization": "digital"},
    "designed": {"controller.force_loop": "robust"},
}
OIL = RIG["actuator.compressibility"]
PILOT = RIG["servovalve.pilot_time_constant"]
CASES = {
    "as believed": {},
    "oil 0.6 times as stiff": {"actuator.compressibility": OIL / 0.6},
    "oil 1.5 times as stiff": {"actuator.compressibility": OIL / 1.5},
    "pilot 1.5 times slower": {"servovalve.pilot_time_constant": 1.5 * PILOT},
    "pilot 2 times slower": {"servovalve.pilot_time_constant": 2.0 * PILOT},
    "load cell of 300 Hz": {"sensors.force.bandwidth": 300.0},
    "two samples of delay": {"dac.delay": 2},
    "flow gain 1.1": {"servovalve.flow_gain_scale": 1.1},
    "oil 1.5, pilot 2, two samples": {
        "actuator.compressibility": OIL / 1.5,
        "servovalve.pilot_time_constant": 2.0 * PILOT,
        "dac.delay": 2,
    },
}


def tested(truth: dict[str, object], loop: dict[str, object]) -> str:
    """Least and largest force over command, and the force error."""
    rig = RIG.replace(ADAPTIVE | loop | {f"truth.{key}": value for key, value in truth.items()})
    run = eft.simulate(rig, eft.sine_sweep(8900.0, 0.0, 10.0, 16.0, 4096.0))
    error = run.metrics()["nrmse"]
    if not error < 1.0:
        return "unstable"
    ratio = run.fft_ratio(0.5, 9.5).ratio
    return f"{ratio.min():.3f}–{ratio.max():.3f}, {100 * error:.1f} %"


def cases() -> str:
    """A row for each deviation."""
    with ThreadPoolExecutor() as pool:
        rows = {
            name: [pool.submit(tested, truth, loop) for loop in LOOPS.values()]
            for name, truth in CASES.items()
        }
    lines = ["| true of the rig | paper's gains | designed gains |", "| --- | --- | --- |"]
    lines += [f"| {name} | {' | '.join(job.result() for job in jobs)} |" for name, jobs in rows.items()]
    return "\n".join(lines) + "\n"


def margins() -> str:
    """Gains and margins of both loops."""
    loop = eft.design_force_loop(RIG)
    rigs = {name: RIG.replace(changes) for name, changes in LOOPS.items()}
    level = {name: eft.stability_margin(rig, sampled=True) for name, rig in rigs.items()}
    around = {name: eft.linear.stability_margins(rig, sampled=True).loop_gain for name, rig in rigs.items()}
    paper = ["controller.proportional_gain", "controller.derivative_gain"]
    rows = [
        ("`G_p`", f"{RIG[paper[0]]:.4g}", f"{loop.coefficients[paper[0]]:.4g}"),
        ("`G_d` (ms)", f"{1e3 * RIG[paper[1]]:.3g}", f"{1e3 * loop.coefficients[paper[1]]:.3g}"),
        ("gain margin of the force loop, whole rig", f"{around['paper']:.2f}", f"{around['designed']:.2f}"),
        ("largest stable compensation level", f"{level['paper']:.3f}", f"{level['designed']:.3f}"),
        ("gain margin, piston at rest", "–", f"{loop.margins.gain:.1f}"),
        ("delay margin, piston at rest (ms)", "–", f"{1e3 * loop.margins.delay:.1f}"),
        ("damping of the oil column, piston at rest", "–", f"{loop.margins.damping:.2f}"),
        ("e_max, piston at rest", "–", f"{loop.margins.e_max:.2f}"),
    ]
    lines = ["| paper's rig, digital at 4096 Hz | paper's gains | designed gains |", "| --- | --- | --- |"]
    return "\n".join(lines + [f"| {' | '.join(row)} |" for row in rows]) + "\n"


def report(folder: Path) -> None:
    """The tables that the page includes."""
    write_text(folder / "force_loop_margins.md", margins())
    write_text(folder / "force_loop_cases.md", cases())
