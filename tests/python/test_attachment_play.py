"""Play of the attachment, against an independent integration and in closed loop."""

import numpy as np
from scipy.integrate import solve_ivp

import eft

PLAY, RATE = 1e-4, 4096.0
# The independent model crosses the play as through a soft spring within this force (N).
WIDTH = 2.0


def free_motion(duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and force with a closed valve after a push of the valve."""
    rig = eft.Rig.zhao2005().replace(
        {
            "controller.sample_rate": RATE,
            "actuator.attachment_play": PLAY,
            "structure.kind": "linear",
        }
    )
    plant = eft.Plant(rig)
    states = [plant.step(0.5 if n < 200 else 0.0) for n in range(int(duration * RATE))]
    return np.array([s.displacement for s in states]), np.array([s.force for s in states])


def test_scipy_integrates_the_same_motion() -> None:
    rig = eft.Rig.zhao2005()
    area, oil, leakage = (rig[f"actuator.{key}"] for key in ("piston_area", "compressibility", "leakage"))
    tau, pilot, spool_area, spool_stroke, k_3 = (
        rig[f"servovalve.{key}"]
        for key in (
            "pilot_time_constant",
            "pilot_flow_gain",
            "spool_area",
            "spool_stroke",
            "spool_sensitivity",
        )
    )
    mass, damping, stiffness = (rig[f"structure.{key}"] for key in ("mass", "damping", "stiffness"))
    supply = rig["supply.pressure"]
    openings, flows = (np.array(rig[f"servovalve.flow_table.{key}"]) for key in ("openings", "flows"))

    def rates(_: float, y: np.ndarray, volts: float) -> list[float]:
        q, spool, force, x, v = y
        flow = np.interp(spool, openings, flows) * np.sqrt(1.0 - np.sign(spool) * force / area / supply)
        # The volume of the piston's lead over the structure adds to that of the oil.
        slope = 0.5 * PLAY * WIDTH**2 / np.hypot(force, WIDTH) ** 3
        force_rate = (flow - leakage * force / area - area * v) / (oil / area + area * slope)
        return [
            (pilot * (volts - k_3 * spool_stroke * spool) - q) / tau,
            q / (spool_area * spool_stroke),
            force_rate,
            v,
            (force - damping * v - stiffness * x) / mass,
        ]

    duration = 0.5
    displacement, force = free_motion(duration)
    y, samples = np.zeros(5), []
    for n in range(int(duration * RATE)):
        solution = solve_ivp(
            rates, (0.0, 1.0 / RATE), y, "LSODA", args=(0.5 if n < 200 else 0.0,), rtol=1e-9, atol=1e-12
        )
        y = solution.y[:, -1]
        samples.append(y)
    _, _, expected, x, _ = np.array(samples).T
    assert np.count_nonzero(np.diff(np.sign(force))) > 4, "the play must be crossed"
    assert np.abs(force - expected).max() < 1e-3 * np.abs(expected).max()
    assert np.abs(displacement - x).max() < 1e-3 * np.abs(x).max()


def test_the_piston_is_ahead_by_half_of_the_play_wherever_there_is_force() -> None:
    rig = eft.Rig.zhao2005().replace({"actuator.attachment_play": PLAY, "controller.sample_rate": RATE})
    command = eft.sine_sweep(8900.0, 0.0, 5.0, 4.0, RATE)
    of_piston = eft.simulate(rig, command)
    lead = of_piston.measured_displacement - of_piston.displacement
    carried = of_piston.load_pressure != 0.0
    assert 0.5 < carried.mean() < 1.0
    np.testing.assert_allclose(lead[carried], 0.5 * PLAY * np.sign(of_piston.force[carried]), atol=1e-15)
    assert np.abs(lead).max() <= 0.5 * PLAY + 1e-15
    of_structure = eft.simulate(rig.replace({"sensors.motion_at": "structure"}), command)
    np.testing.assert_array_equal(of_structure.measured_displacement, of_structure.displacement)


def test_a_play_of_a_tenth_of_a_millimetre_shows_in_the_force() -> None:
    robust = eft.Rig.zhao2005().replace(
        {
            "controller.force_loop": "robust",
            "compensation.adaptive": True,
            "compensation.feedforward": True,
            "compensation.look_ahead": True,
        }
    )
    command = eft.sine_sweep(8900.0, 0.0, 10.0, 16.0, RATE)
    errors = [
        eft.simulate(robust.replace({"truth.actuator.attachment_play": play}), command).metrics()["nrmse"]
        for play in (0.0, 2e-5, 1e-4)
    ]
    assert errors[0] < 0.01 < errors[1] < errors[2]
    # The controller never sees it, so an exported rig does not contain it.
    assert robust.replace({"truth.actuator.attachment_play": 1e-4})["actuator.attachment_play"] == 0.0


def test_the_recorded_motion_is_that_of_the_piston_if_only_the_true_rig_has_an_attachment() -> None:
    rig = eft.Rig.zhao2005().replace({"controller.realization": "digital"})
    command = eft.sine_sweep(2200.0, 0.5, 6.0, 1.0, RATE)
    for key, value in (("attachment_stiffness", 1e9), ("attachment_play", 1e-5)):
        true = rig.replace({f"truth.actuator.{key}": value})
        run = eft.simulate(true, command)
        controller = eft.Controller(true, sample_rate=RATE)
        readings = (run.measured_velocity, run.measured_force, run.measured_spool)
        given = zip(command.values, *readings, strict=True)
        commands = [controller.step(*one) for one in given]
        np.testing.assert_array_equal(commands, run.valve_command)
        assert (run.measured_displacement != run.displacement).any()
