"""What a force loop depends on, identified from a sweep, and the use of the load cell's latency."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.signal import csd, detrend, welch

import eft
from eft.benchmark._criteria import slow_error
from eft.cli import main
from eft.demo.experiments import EL_CENTRO

RATE = 4096.0
RIG = eft.Rig.zhao2005().replace({"controller.force_loop": "robust", "compensation.feedforward": True})
SWEEP = eft.sine_sweep(4000.0, 0.0, 40.0, duration=16.0, sample_rate=RATE)
NOISE = {"force.noise": 78.0, "velocity.noise": 5e-4, "spool.noise": 5e-4, "seed": 3}


def swept(truth: dict[str, object] | None = None) -> eft.TestRun:
    noisy: dict[str, object] = {f"truth.sensors.{key}": value for key, value in NOISE.items()}
    return eft.simulate(RIG.replace(noisy | (truth or {})), SWEEP)


def found_in(run: eft.TestRun) -> eft.identification.ForceLoopEstimate:
    signals = run.valve_command, run.measured_spool, run.measured_velocity, run.measured_force
    return eft.identification.identify_force_loop(RIG, *signals, RATE)


@pytest.mark.parametrize(
    ("truth", "force", "spool"),
    [
        ({}, 0.0, 0.0),
        (
            {
                "truth.sensors.force.delay": 5,
                "truth.sensors.spool.delay": 2,
                "truth.sensors.velocity.delay": 4,
                "truth.actuator.compressibility": RIG["actuator.compressibility"] / 1.3,
                "truth.actuator.friction": 500.0,
            },
            5.0 / RATE,
            2.0 / RATE,
        ),
        (
            {
                "truth.sensors.force.bandwidth": 400.0,
                "truth.sensors.spool.delay": 6,
                "truth.servovalve.pilot_time_constant": 1.5 * RIG["servovalve.pilot_time_constant"],
                "truth.servovalve.flow_gain_scale": 1.04,
            },
            0.5 / np.pi / 400.0,
            6.0 / RATE,
        ),
    ],
)
def test_latencies_valve_and_oil_are_found_behind_noise(
    truth: dict[str, object], force: float, spool: float
) -> None:
    found = found_in(swept(truth))
    assert found.force_delay == pytest.approx(force, abs=1.5e-4)
    assert found.spool_delay == pytest.approx(spool, abs=1e-4)
    valve = RIG["servovalve.spool_area"] / RIG["servovalve.pilot_flow_gain"]
    assert found.response_delay == pytest.approx(valve / RIG["servovalve.spool_sensitivity"], rel=0.02)
    true = RIG.replace(truth).plant
    assert found.pilot_time_constant == pytest.approx(true["servovalve.pilot_time_constant"], rel=0.05)
    assert found.compressibility == pytest.approx(true["actuator.compressibility"], rel=0.08)
    assert 0.0 < found.spool_delay.uncertainty < found.force_delay.uncertainty < 1e-4


@pytest.mark.parametrize(("force", "spool"), [(5, 0), (0, 3), (6, 2)])
def test_late_sensors_do_not_change_the_oil(force: int, spool: int) -> None:
    late = {"truth.sensors.force.delay": force, "truth.sensors.spool.delay": spool}
    found = found_in(eft.simulate(RIG.replace(late), SWEEP))
    assert found.compressibility == pytest.approx(RIG["actuator.compressibility"], rel=5e-4)
    assert found.force_delay == pytest.approx(force / RATE, abs=1e-5)


@pytest.mark.parametrize("offset", [-0.5, 0.1])
def test_an_offset_of_the_valve_command_changes_nothing(offset: float) -> None:
    run = swept()
    signals = run.measured_spool, run.measured_velocity, run.measured_force
    plain, moved = (
        eft.identification.identify_force_loop(RIG, run.valve_command + volts, *signals, RATE)
        for volts in (0.0, offset)
    )
    for name in ("spool_delay", "response_delay", "pilot_time_constant", "force_delay"):
        assert getattr(moved, name) == pytest.approx(getattr(plain, name), rel=1e-6)


def test_a_known_torque_motor_is_no_latency() -> None:
    motor = {"servovalve.torque_motor_frequency": 250.0}
    run = eft.simulate(RIG.replace({f"truth.{key}": value for key, value in motor.items()}), SWEEP)
    signals = run.valve_command, run.measured_spool, run.measured_velocity, run.measured_force
    known = eft.identification.identify_force_loop(RIG.replace(motor), *signals, RATE)
    unknown = eft.identification.identify_force_loop(RIG, *signals, RATE)
    assert abs(known.spool_delay) < 5e-5
    # 2ζ/ω of the motor.
    assert unknown.spool_delay == pytest.approx(1.4 / (2.0 * np.pi * 250.0), rel=0.25)


def test_the_fit_of_the_valve_is_scipys() -> None:
    run = swept({"truth.sensors.spool.delay": 3})
    found = found_in(run)
    how = {"fs": RATE, "nperseg": int(RATE), "noverlap": int(RATE) // 2, "detrend": False}
    steady = [detrend(signal) for signal in (run.valve_command, run.measured_spool)]
    frequency, cross = csd(*steady, **how)
    powers = [welch(signal, **how)[1] for signal in steady]
    band = (frequency >= 1.0) & (frequency <= 200.0)
    s = 2j * np.pi * frequency[band]
    response = (cross / powers[0])[band]
    coherence = (np.abs(cross) ** 2 / powers[0] / powers[1])[band]
    weight = np.sqrt(coherence / (1.0 - coherence))

    def model(p: np.ndarray) -> np.ndarray:
        gain, time, square, delay = p
        # The digital command is held for a sample.
        return np.exp(-s * (1e-3 * delay + 0.5 / RATE)) / (gain + 1e-3 * s * time + 1e-6 * s**2 * square)

    p = np.array([10.0, 50.0, 70.0, 0.0])
    for _ in range(4):
        size = np.abs(model(p))

        def departure(p: np.ndarray, size: np.ndarray = size) -> np.ndarray:
            rest = (model(p) - response) * weight / size
            return np.concatenate([rest.real, rest.imag])

        p = least_squares(departure, p, x_scale=[10.0, 50.0, 70.0, 1.0], xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    assert found.spool_delay == pytest.approx(1e-3 * p[3], abs=1e-8)
    assert found.response_delay == pytest.approx(1e-3 * p[1] / p[0], abs=1e-8)
    assert found.pilot_time_constant == pytest.approx(1e-3 * p[2] / p[1], abs=1e-8)


def test_an_uncertain_estimate_identifies_no_plant() -> None:
    found = found_in(swept())
    assert found.keys(RIG)["controller.identified_plant"] is True
    oil = eft.identification.Estimate(float(found.compressibility), 0.11 * found.compressibility)
    assert replace(found, compressibility=oil).keys(RIG)["controller.identified_plant"] is False


def test_a_configured_latency_puts_the_force_on_time() -> None:
    late = {"truth.sensors.force.delay": 6}
    # Its reading is on time, so the force leads by the latency.
    leading = eft.simulate(RIG.replace(late), SWEEP)
    found = found_in(swept(late))
    on_time = eft.simulate(found.apply(RIG).replace(late), SWEEP)

    def delay(run: eft.TestRun) -> float:
        return float(eft.identify_delay(run.command, run.force, RATE, (1.0, 15.0)))

    assert delay(leading) < -6.0 / RATE
    assert delay(on_time) - delay(leading) == pytest.approx(6.0 / RATE, abs=1e-4)
    np.testing.assert_array_equal(on_time.command, leading.command)


def test_an_identified_valve_and_oil_lower_the_force_error() -> None:
    truth = {
        "truth.sensors.force.delay": 5,
        "truth.actuator.compressibility": 1.3 * RIG["actuator.compressibility"],
        "truth.servovalve.pilot_time_constant": 0.8 * RIG["servovalve.pilot_time_constant"],
        "truth.servovalve.pilot_flow_gain": RIG["servovalve.pilot_flow_gain"],
    }
    found = found_in(swept(truth))
    known = found.apply(RIG)
    on_time = RIG.replace({"controller.force_delay": known["controller.force_delay"]})
    sweep = eft.sine_sweep(4000.0, 0.0, 10.0, duration=8.0, sample_rate=RATE)

    def error(rig: eft.Rig) -> float:
        run = eft.simulate(rig.replace(truth), sweep)
        return slow_error(run.command, run.force, RATE)

    assert error(known) < 0.6 * error(on_time)
    margins = eft.design_force_loop(known).margins
    assert margins.gain > 1.6 and margins.damping > 0.2 and margins.e_max > 0.2


def with_given_gains(rig: eft.Rig) -> eft.Rig:
    """The rig with the gains that are designed for a punctual load cell."""
    gains = eft.design_force_loop(rig).coefficients
    return rig.replace({"controller.force_loop": "pd", "controller.realization": "digital", **gains})


@pytest.mark.parametrize("dtype", ["f32", "f64"])
def test_a_delay_of_whole_samples_is_a_later_command(dtype: Literal["f32", "f64"]) -> None:
    samples = 7
    short = SWEEP[:2048]
    # The same gains for both, because a designed loop is slower with a known latency.
    rig = with_given_gains(RIG)
    later = eft.Command(np.concatenate([np.zeros(samples), short.values]), RATE)
    delayed = eft.simulate(rig.replace({"controller.force_delay": samples / RATE}), short, dtype=dtype)
    played = eft.simulate(rig, later, dtype=dtype)
    np.testing.assert_array_equal(delayed.force[samples:], played.force[samples : short.values.size])


@pytest.mark.parametrize(
    ("realization", "look_ahead", "start", "next_command"),
    [
        # A step of 500 N at the start, before which the command is 0 N.
        ("digital", False, 500.0, ""),
        ("digital", True, 0.0, "The next tick's command is given without this delay."),
        ("analog", True, 0.0, "The next tick's command has the same delay."),
    ],
)
def test_an_export_says_how_the_command_is_delayed(
    realization: str, look_ahead: bool, start: float, next_command: str
) -> None:
    changes = {"controller.realization": realization, "compensation.look_ahead": look_ahead}
    rig = with_given_gains(RIG).replace(changes)
    late = rig.replace({"controller.force_delay": 7.4 / RATE})
    command = eft.Command(SWEEP.values[:2048] + start, RATE)
    ticks = np.arange(-1, len(command))
    later = eft.Command(np.interp(ticks[1:] - 7.4, ticks, [0.0, *command.values]), RATE)
    simulated, played = (eft.simulate(*test).force[:-1] for test in ((late, command), (rig, later)))
    # The command after the last one differs. Without the delay a controller looks further ahead.
    same = bool(np.abs(simulated - played).max() < 1e-3)
    assert same == ("is given without" not in next_command)
    text = " ".join(eft.firmware.export(late, target="c").replace("\n *", " ").split())
    assert "(7.4 samples) later" in text and "linearly between its samples, and 0 N before the first" in text
    assert next_command in text


def test_the_command_line_agrees(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = swept({"truth.sensors.force.delay": 5})
    rig, file, output = tmp_path / "rig.toml", tmp_path / "sweep.eft", tmp_path / "loop.toml"
    rig.write_text(RIG.to_toml(), encoding="utf-8")
    run.save(file)
    assert main(["identify", "force-loop", str(file), "--rig", str(rig), "-o", str(output)]) == 0
    assert "latency of the load cell" in capsys.readouterr().out
    saved = tomllib.loads(output.read_text(encoding="utf-8"))
    # A saved run is read with its true signals.
    signals = run.valve_command, run.spool, run.velocity, run.force
    true = eft.identification.identify_force_loop(RIG, *signals, RATE)
    keys = {f"{section}.{key}": value for section, of in saved.items() for key, value in of.items()}
    assert keys == true.keys(RIG)
    assert true.apply(RIG) == RIG.replace(keys)
    assert main(["identify", "force-loop", str(file), "--rig", str(rig), "--json"]) == 0
    assert '"response_delay_uncertainty"' in capsys.readouterr().out


def test_what_is_no_such_test_is_refused() -> None:
    run = swept()
    voltage, spool = run.valve_command, run.measured_spool
    velocity, force = run.measured_velocity, run.measured_force
    identify = eft.identification.identify_force_loop
    with pytest.raises(ValueError, match="check gains, units and signs"):
        identify(RIG, -voltage, -spool, velocity, force, RATE)
    with pytest.raises(ValueError, match="no response of this form"):
        identify(RIG, np.zeros_like(voltage), spool, velocity, force, RATE)
    with pytest.raises(ValueError, match="valve_command"):
        identify(RIG, voltage[:-1], spool, velocity, force, RATE)
    with pytest.raises(ValueError, match="valve_command"):
        identify(RIG, np.full_like(voltage, np.nan), spool, velocity, force, RATE)
    slow = eft.simulate(
        RIG.replace({"truth.sensors.force.noise": 400.0}), eft.sine_sweep(4e3, 0.0, 5.0, 16.0, RATE)
    )
    with pytest.raises(ValueError, match="run a sweep to 40 Hz"):
        identify(
            RIG, slow.valve_command, slow.measured_spool, slow.measured_velocity, slow.measured_force, RATE
        )


def test_a_late_load_cell_feeds_no_oscillation_at_large_openings() -> None:
    mass, frequency = 1e4, 2 * np.pi * 1.3
    rig = with_given_gains(RIG).replace(
        {
            "compensation.adaptive": True,
            "compensation.curve_correction": False,
            "structure.mass": mass,
            "structure.stiffness": mass * frequency**2,
            "structure.softening.stiffness": 0.5 * mass * frequency**2,
            "structure.damping": 0.026 * mass * frequency,
            "controller.force_delay": 8 / RATE,
            "truth.sensors.force.delay": 8,
            "truth.servovalve.pilot_time_constant": 1.38 * RIG["servovalve.pilot_time_constant"],
            "truth.actuator.compressibility": RIG["actuator.compressibility"] / 1.5,
        }
    )
    record = eft.read_record(Path(eft.__file__).parent / "data" / EL_CENTRO)
    quake = eft.effective_force(record, mass, RATE)[: int(9 * RATE)]
    quake = quake * (22e3 / float(np.abs(quake.values).max()))

    def slow(ahead: bool) -> float:
        run = eft.simulate(rig.replace({"compensation.look_ahead": ahead}), quake)
        assert run.metrics()["max_spool"] > 0.6
        return slow_error(run.command, run.force, RATE)

    # A correction by the measured force removes the valve's damping with a delay.
    assert slow(False) > 0.025
    assert slow(True) < 0.015
