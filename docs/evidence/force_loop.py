"""The designed force loop and the paper's gains: margins, and tests on rigs that deviate."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from random_rigs import noise

import eft
from eft._files import write_text
from eft.demo.experiments import EL_CENTRO

RIG = eft.Rig.zhao2005()
ADAPTIVE = {
    "compensation.adaptive": True,
    "compensation.curve_correction": False,
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
    "as configured": {},
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

# Deviations of a real rig that its controller does not know; most of them excite the oil column with the
# paper's gains.
OIL_COLUMN = {
    "as configured": {},
    "oil 0.7 times as stiff": {"actuator.compressibility": OIL / 0.7},
    "oil 1.3 times as stiff": {"actuator.compressibility": OIL / 1.3},
    "load cell of 300 Hz": {"sensors.force.bandwidth": 300.0},
    "torque motor of 250 Hz": {"servovalve.torque_motor_frequency": 250.0},
    "torque motor of 150 Hz": {"servovalve.torque_motor_frequency": 150.0},
    "pilot of 2.2 ms": {"servovalve.pilot_time_constant": 2.2e-3},
    "attachment of 5e8 N/m, motion of the piston": {"actuator.attachment_stiffness": 5e8},
    "attachment of 5e8 N/m, motion of the structure": {
        "actuator.attachment_stiffness": 5e8,
        "sensors.motion_at": "structure",
    },
    "play of 0.02 mm, motion of the piston": {"actuator.attachment_play": 2e-5},
    "play of 0.02 mm, motion of the structure": {
        "actuator.attachment_play": 2e-5,
        "sensors.motion_at": "structure",
    },
    "flow gain 1.35": {"servovalve.flow_gain_scale": 1.35},
    "underlap of 0.2 %": {"servovalve.overlap": -0.002},
    "null bias of 2 %": {"servovalve.null_bias": 0.02},
    "areas 1.3": {"actuator.area_ratio": 1.3},
}
# The paper's gains as on its rig, where an analog controller closes the loop.
SCHEMES = {
    "paper's gains, analog": {"compensation.feedforward": True},
    "paper's gains, analog, self-calibrating": ADAPTIVE,
    "designed loop": {"controller.force_loop": "robust", "compensation.feedforward": True},
    "designed loop, self-calibrating": ADAPTIVE | {"controller.force_loop": "robust"},
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
    lines = ["| true rig | paper's gains | designed gains |", "| --- | --- | --- |"]
    lines += [f"| {name} | {' | '.join(job.result() for job in jobs)} |" for name, jobs in rows.items()]
    return "\n".join(lines) + "\n"


def shaken(truth: dict[str, object], scheme: dict[str, object], rate: float) -> str:
    """The force error of a 2.2 kN sweep, and the growth rate of the linear model."""
    digital = {"controller.realization": "digital"} if rate < 4096.0 else {}
    truth = {f"truth.{key}": value for key, value in truth.items()}
    rig = RIG.replace(digital | scheme | truth | {"controller.sample_rate": rate})
    run = eft.simulate(rig, eft.sine_sweep(2200.0, 0.0, 10.0, 16.0, rate))
    growth = eft.linearize(rig, sampled=True, sample_rate=rate, flow_gain="mean").growth_rate
    error = run.metrics()["nrmse"]
    unstable = growth > 0.0 and not error < 1.0
    return f"{'unstable' if unstable else f'{100 * error:.1f} %'} ({growth:+.1f})"


def oil_column() -> str:
    """Force errors of plants with deviations that the controller does not know."""
    with ThreadPoolExecutor() as pool:
        cases = [(name, truth, 4096.0) for name, truth in OIL_COLUMN.items()]
        cases.append(("all digital at 1024 Hz", {}, 1024.0))
        rows = {
            name: [pool.submit(shaken, truth, scheme, rate) for scheme in SCHEMES.values()]
            for name, truth, rate in cases
        }
    lines = [f"| true rig | {' | '.join(SCHEMES)} |", "| --- |" + " --- |" * len(SCHEMES)]
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
        ("`G_i` (1/s)", "–", f"{loop.coefficients['controller.integral_gain']:.4g}"),
        ("gain margin of the force loop, whole rig", f"{around['paper']:.2f}", f"{around['designed']:.2f}"),
        ("largest stable compensation level", f"{level['paper']:.3f}", f"{level['designed']:.3f}"),
        ("gain margin, piston at rest", "–", f"{loop.margins.gain:.1f}"),
        ("delay margin, piston at rest (ms)", "–", f"{1e3 * loop.margins.delay:.1f}"),
        ("damping of the oil column, piston at rest", "–", f"{loop.margins.damping:.2f}"),
        ("normalised coprime margin, piston at rest", "–", f"{loop.margins.e_max:.2f}"),
    ]
    lines = ["| paper's rig, digital at 4096 Hz | paper's gains | designed gains |", "| --- | --- | --- |"]
    return "\n".join(lines + [f"| {' | '.join(row)} |" for row in rows]) + "\n"


RECORD = Path(eft.__file__).parent / "data" / EL_CENTRO
SWEEP = "sweep of {} kN, 0 to 10 Hz in 32 s"


def reached() -> str:
    """Force errors of the designed loop on a rig that is as configured, the largest of three seeds."""
    earthquake = eft.effective_force(eft.read_record(RECORD), mass=7040.0, sample_rate=4096.0)
    large, small = (eft.sine_sweep(amplitude, 0.0, 10.0, 32.0, 4096.0) for amplitude in (8900.0, 2200.0))
    noisy = [noise(seed) for seed in (1, 2, 3)]
    tests: list[tuple[str, eft.Command, list[dict[str, object]]]] = [
        (SWEEP.format(8.9) + ", without noise", large, [{}]),
        (SWEEP.format(8.9), large, noisy),
        (SWEEP.format(2.2), small, noisy),
        ("El Centro", earthquake, noisy),
    ]
    robust = RIG.replace(ADAPTIVE | LOOPS["designed"])
    rigs = [robust, robust.replace({"compensation.curve_correction": True})]
    lines = ["| test | self-calibration | with the curve correction |", "| --- | --- | --- |"]
    for name, command, noises in tests:
        runs = [[eft.simulate(rig.replace(changes), command) for changes in noises] for rig in rigs]
        errors = [max(run.metrics(fft=False)["nrmse"] for run in seeds) for seeds in runs]
        lines.append(f"| {name} | " + " | ".join(f"{error:.2%}" for error in errors) + " |")
    return "\n".join(lines) + "\n"


def report(folder: Path) -> None:
    """The tables that the page includes."""
    write_text(folder / "force_loop_reached.md", reached())
    write_text(folder / "force_loop_margins.md", margins())
    write_text(folder / "force_loop_cases.md", cases())
    write_text(folder / "oil_column.md", oil_column())
