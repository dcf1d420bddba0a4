"""Friction of the seals: identified from a sweep, and supplied by the feedforward."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import eft
from eft.cli import main

RATE = 2048.0
RIG = eft.Rig.zhao2005()
SWEEP = eft.sine_sweep(2200.0, 0.0, 10.0, duration=16.0, sample_rate=RATE)
FAST_SWEEP = eft.sine_sweep(2200.0, 0.0, 40.0, duration=16.0, sample_rate=RATE)
NOISE = {
    "sensors.force.noise": 50.0,
    "sensors.velocity.noise": 5e-4,
    "sensors.spool.noise": 5e-4,
    "sensors.velocity.delay": 1,
    "sensors.seed": 3,
}


def swept(friction: float, sweep: eft.Command = SWEEP, **truth: float) -> eft.TestRun:
    noisy = {f"truth.{key}": value for key, value in NOISE.items()}
    return eft.simulate(RIG.replace({"truth.actuator.friction": friction, **noisy, **truth}), sweep)


def found_in(run: eft.TestRun) -> eft.identification.FrictionEstimate:
    signals = run.measured_spool, run.measured_velocity, run.measured_force
    return eft.identification.identify_friction(RIG, *signals, RATE)


@pytest.mark.parametrize("friction", [0.0, 400.0, 1500.0])
def test_friction_oil_flow_and_latency_are_found_behind_noise(friction: float) -> None:
    truth = {"truth.actuator.compressibility": RIG["actuator.compressibility"] / 1.2}
    found = found_in(swept(friction, **truth, **{"truth.servovalve.flow_gain_scale": 1.03}))
    # The flow of the friction is that of the true oil.
    assert found.friction == pytest.approx(friction / 1.2, abs=50.0 + 0.15 * friction)
    assert found.compressibility == pytest.approx(RIG["actuator.compressibility"] / 1.2, rel=0.08)
    assert [float(one) for one in found.flow_factors] == pytest.approx([1.03, 1.03], abs=0.01)
    assert found.velocity_delay == pytest.approx(1.0 / RATE, abs=1e-4)


# Near the natural frequency a large sweep is a hundred times as fast as elsewhere.
@pytest.mark.parametrize(("force", "duration"), [(4000.0, 32.0), (8900.0, 32.0), (8900.0, 8.0)])
@pytest.mark.parametrize("bias", [0.0, 0.03])
def test_friction_is_found_in_large_sweeps_about_a_known_null(
    force: float, duration: float, bias: float
) -> None:
    rig = RIG.replace({"servovalve.null_bias": bias, "compensation.feedforward": True})
    sweep = eft.sine_sweep(force, 0.5, 10.0, duration=duration, sample_rate=4096.0)
    run = eft.simulate(rig.replace({"truth.actuator.friction": 400.0}), sweep)
    found = eft.identification.identify_friction(rig, run.spool, run.velocity, run.force, 4096.0)
    assert found.friction == pytest.approx(400.0, rel=0.02)


# Only the fast sweep shows the delay of the force.
@pytest.mark.parametrize(("sweep", "unknowns"), [(SWEEP, 7), (FAST_SWEEP, 8)])
def test_the_fit_is_numpys(sweep: eft.Command, unknowns: int) -> None:
    run = swept(800.0, sweep)
    spool, velocity, force = run.measured_spool, run.measured_velocity, run.measured_force
    area, oil = RIG["actuator.piston_area"], RIG["actuator.compressibility"]
    curve = RIG["servovalve.flow_table.openings"], RIG["servovalve.flow_table.flows"]
    place = np.arange(spool.size)
    frequency = np.fft.rfftfreq(spool.size, 1.0 / RATE)
    band = (frequency >= 0.5) & (frequency <= 40.0)
    weight = np.sin(np.pi * (place + 0.5) / spool.size)
    steady = velocity - np.polyval(np.polyfit(place, velocity, 1, w=weight), place)
    slow = np.fft.irfft(np.where(frequency <= 40.0, np.fft.rfft(steady), 0.0), spool.size)
    power = abs(np.fft.rfft(steady)) ** 2
    quiet = power[(frequency > 60.0) & (frequency <= 100.0)].mean()
    noise = 2.0 * quiet * np.sum((frequency > 0.0) & (frequency <= 40.0)) / spool.size**2
    near, sums = int(0.25 * RATE), np.r_[0.0, np.cumsum(slow**2)]
    first, end = np.maximum(place - near, 0), np.minimum(place + near, spool.size)
    square = (sums[end] - sums[first]) / (end - first)
    smooth = 0.005**2 * square + 2.0**2 * noise + RIG["actuator.friction_velocity"] ** 2
    sign = slow / np.sqrt(slow**2 + smooth)
    fade, rate = 0.5 * RATE, 2j * np.pi * frequency
    angle = np.pi / 2 * np.minimum(np.minimum(place + 1, spool.size - place) / fade, 1.0)
    share = np.sin(angle) ** 2
    slope = np.sin(2 * angle) * np.pi * np.sign(spool.size / 2 - place)

    def faded(signal: np.ndarray) -> np.ndarray:
        return np.fft.rfft(share * signal)

    def real(spectrum: np.ndarray) -> np.ndarray:
        return np.concatenate([spectrum[band].real, spectrum[band].imag])

    def changed(signal: np.ndarray) -> np.ndarray:
        return rate * np.fft.rfft(share * signal) - np.fft.rfft(slope * signal)

    def balance(delays: np.ndarray, late: float) -> np.ndarray:
        pressure = np.interp(place + late * RATE, place, force) / area
        flow = np.interp(spool, *curve) * np.sqrt(1.0 - np.sign(spool) * pressure / RIG["supply.pressure"])
        early, force_early = np.exp(rate * delays[0]), np.exp(rate * delays[1])
        leakage = RIG["actuator.leakage"] / area
        columns = [
            faded(np.where(spool < 0.0, flow, 0.0)),
            faded(np.where(spool > 0.0, flow, 0.0)),
            -area * rate * faded(velocity) * early,
            -oil / area * changed(force) * force_early,
            -oil / area * changed(sign) * early,
            area * faded(np.ones(spool.size)),
            area * faded(place / spool.size - 0.5),
            -oil / area * rate * changed(force) * force_early,
        ][:unknowns]
        taken = area * faded(velocity) * early + leakage * faded(force) * force_early
        matrix = np.stack([real(column) for column in columns], axis=1)
        size = np.linalg.norm(matrix, axis=0)
        return np.asarray(np.linalg.lstsq(matrix / size, real(taken), rcond=None)[0] / size)

    late = 0.0
    for _ in range(3):
        delays = np.zeros(2)
        for _ in range(8):
            best = balance(delays, late)
            delays += best[2], best[7] / best[3] if unknowns == 8 else 0.0
        late = delays[1]
    best[2] = delays[0]
    found = found_in(run)
    factors = [float(one) for one in found.flow_factors]
    assert [*factors, found.velocity_delay, found.compressibility / oil, found.friction] == pytest.approx(
        best[:5].tolist(), rel=1e-6, abs=1e-9
    )


@pytest.mark.parametrize("sweep", [SWEEP, FAST_SWEEP])
@pytest.mark.parametrize("samples", [0, 1, 3])
def test_a_late_load_cell_hardly_changes_the_friction(sweep: eft.Command, samples: int) -> None:
    found = found_in(swept(800.0, sweep, **{"truth.sensors.force.delay": samples}))
    assert found.friction == pytest.approx(800.0, rel=0.15)


def test_a_slow_recorder_is_enough() -> None:
    run = swept(800.0)
    signals = (signal[::20] for signal in (run.spool, run.velocity, run.force))
    assert eft.identification.identify_friction(RIG, *signals, RATE / 20).friction == pytest.approx(
        800.0, rel=0.3
    )


def test_the_found_friction_is_configured_and_lowers_the_error() -> None:
    scheme = {
        "controller.force_loop": "robust",
        "compensation.adaptive": True,
        "compensation.feedforward": True,
        "compensation.look_ahead": True,
    }
    rig = RIG.replace(scheme)
    worn = {"truth.actuator.friction": 1500.0}
    before = eft.simulate(rig.replace(worn), SWEEP)
    configured = found_in(before).apply(rig)
    after = eft.simulate(configured.replace(worn), SWEEP)

    def departure(run: eft.TestRun) -> float:
        return float(np.abs(run.fft_ratio(0.5, 9.5).ratio - 1.0).max())

    assert departure(after) < 0.6 * departure(before)
    without = eft.simulate(rig, SWEEP)
    assert found_in(without).apply(rig)["actuator.friction"] < 30.0


def test_the_command_line_agrees(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = swept(800.0)
    rig, file, output = tmp_path / "rig.toml", tmp_path / "sweep.eft", tmp_path / "friction.toml"
    rig.write_text(RIG.to_toml(), encoding="utf-8")
    run.save(file)
    assert main(["identify", "friction", str(file), "--rig", str(rig), "-o", str(output)]) == 0
    assert "compressibility" in capsys.readouterr().out
    saved = tomllib.loads(output.read_text(encoding="utf-8"))["actuator"]["friction"]
    # A saved run is read with its true signals.
    true = eft.identification.identify_friction(RIG, run.spool, run.velocity, run.force, RATE)
    assert saved == pytest.approx(float(true.friction), rel=1e-9)
    assert main(["identify", "friction", str(file), "--rig", str(rig), "--json"]) == 0
    assert '"velocity_delay_uncertainty"' in capsys.readouterr().out


def test_what_is_no_such_test_is_refused() -> None:
    run = swept(800.0)
    spool, velocity, force = run.measured_spool, run.measured_velocity, run.measured_force
    identify = eft.identification.identify_friction
    with pytest.raises(ValueError, match="check gains, units and signs"):
        identify(RIG, -spool, velocity, force, RATE)
    for other in (-force, force / 1e3):
        with pytest.raises(ValueError, match=r"force = .* check its unit and sign"):
            identify(RIG, spool, velocity, other, RATE)
    with pytest.raises(ValueError, match="hardly moves"):
        identify(RIG, 0.0 * spool, 0.0 * velocity, force, RATE)
    with pytest.raises(ValueError, match="velocity"):
        identify(RIG, spool, velocity[:-1], force, RATE)
