//! The schema itself: one row per value, in the order in which files are written.
//!
//! The ranges are far wider than any rig; they refuse unit mistakes (psi for Pa) and values whose
//! products would overflow.

use super::schema::{Key, Kind, Need, Preset};
use Kind::{Bool, Choice, Float, Floats, Int, Text};
use Need::{Optional, Required, When};

const fn key(key: &'static str, unit: &'static str, kind: Kind, need: Need, doc: &'static str) -> Key {
    Key { key, unit, kind, need, doc }
}

const fn float(value: f64) -> Need {
    Need::Default(Preset::Float(value))
}

const fn int(value: i64) -> Need {
    Need::Default(Preset::Int(value))
}

const OFF: Need = Need::Default(Preset::Bool(false));
const ON: Need = Need::Default(Preset::Bool(true));
const BILINEAR: Need = When("structure.kind", "bilinear");
const BUILDING: Need = When("structure.kind", "shear_building");
const OBSERVER: Need = When("controller.velocity_source", "observer");
const BOUC_WEN: Need = When("structure.kind", "bouc_wen");

/// Every key of the configuration.
#[rustfmt::skip]
pub static KEYS: &[Key] = &[
    key("name", "", Text, Optional, "name of the rig, for reports and exported files"),

    key("actuator.piston_area", "m²", Float(1e-8, 1e2), Required, "effective piston area A"),
    key("actuator.compressibility", "m³/Pa", Float(1e-20, 1.0), Required, "oil compressibility of the chambers K_a, Eq. (7)"),
    key("actuator.leakage", "m³/(s·Pa)", Float(0.0, 1e-3), Required, "cross-piston leakage C_l, Eq. (7)"),
    key("actuator.stroke", "m", Float(1e-4, 1e2), Required, "stroke to either side of the middle"),
    key("actuator.dead_length", "m", Float(1e-4, 1e3), Optional, "what is left of a chamber at the end of the stroke, volume over area; constant volumes where absent"),
    key("actuator.friction", "N", Float(0.0, 1e9), float(0.0), "Coulomb friction of the seals"),
    key("actuator.friction_velocity", "m/s", Float(1e-6, 1.0), float(1e-3), "velocity below which the friction falls to zero"),
    key("actuator.stop_stiffness", "N/m", Float(1.0, 1e15), Optional, "stiffness of the stops at the ends of the stroke; no stops where absent"),
    key("actuator.stop_damping", "s/m", Float(0.0, 1e3), float(0.0), "damping of the stops relative to their elastic force"),

    key("supply.pressure", "Pa", Float(1e3, 1e9), Required, "supply pressure P_s at which the flow curve was measured"),
    key("supply.droop", "Pa·s/m³", Float(1e-3, 1e18), Optional, "fall of the pressure with the pump's flow; a pressure without droop where absent"),
    key("supply.accumulator", "m³/Pa", Float(1e-18, 1.0), Optional, "capacity of the accumulator, gas volume over exponent times pressure"),
    key("supply.pump_flow", "m³/s", Float(0.0, 1e3), Optional, "largest flow of the pump"),
    key("supply.schedule.times", "s", Floats(1, 64, -1e6, 1e6), Optional, "times at which the set pressure is given, straight between them"),
    key("supply.schedule.pressures", "Pa", Floats(1, 64, 0.0, 1e9), Optional, "set pressures at those times"),

    key("servovalve.pilot_time_constant", "s", Float(1e-6, 1.0), Required, "time constant of the pilot stage τ, Eq. (2)"),
    key("servovalve.pilot_flow_gain", "m³/(s·V)", Float(1e-12, 1.0), Required, "flow gain of the pilot stage K_vp, Eq. (2)"),
    key("servovalve.spool_area", "m²", Float(1e-9, 1.0), Required, "end area of the main spool A_v, Eq. (3)"),
    key("servovalve.spool_stroke", "m", Float(1e-6, 1.0), Required, "stroke of the main spool to either side x_vmax"),
    key("servovalve.spool_sensitivity", "V/m", Float(1e-3, 1e9), Required, "sensitivity of the spool position sensor K_3"),
    key("servovalve.flow_gain_scale", "", Float(1e-2, 1e2), float(1.0), "true flow over the flow that the valve's curve gives"),
    key("servovalve.flow_table.openings", "", Floats(2, 64, -1.0, 1.0), Required, "spool openings of the flow curve that the controller knows, Table 2"),
    key("servovalve.flow_table.flows", "m³/s", Floats(2, 64, -1e3, 1e3), Required, "no-load flows at those openings, Table 2"),
    key("servovalve.true_flow_table.openings", "", Floats(2, 64, -1.0, 1.0), Optional, "spool openings of the true valve's flow curve, where it is not the one that the controller knows"),
    key("servovalve.true_flow_table.flows", "m³/s", Floats(2, 64, -1e3, 1e3), Optional, "no-load flows at those openings"),
    key("servovalve.pilot_flow_limit", "m³/s", Float(1e-12, 1e3), Optional, "largest flow of the pilot stage"),
    key("servovalve.overlap", "", Float(0.0, 0.5), float(0.0), "overlap of the spool's lands, an opening that passes nothing"),
    key("servovalve.leakage.proportional", "m³/(s·Pa)", Float(0.0, 1e-3), float(0.0), "leakage of the main stage proportional to the load pressure, Eq. (5)"),
    key("servovalve.leakage.constant", "m³/s", Float(0.0, 1.0), float(0.0), "constant leakage of the main stage at `supply.pressure`, Eq. (5)"),
    key("servovalve.leakage.null_region", "", Float(1e-6, 1.0), float(0.003), "opening within which the constant leakage changes its sign"),

    key("controller.force_sensitivity", "V/N", Float(1e-12, 1e3), Required, "force sensitivity C_F, Eq. (1)"),
    key("controller.proportional_gain", "", Float(1e-6, 1e6), Required, "proportional gain G_p, Eq. (1)"),
    key("controller.derivative_gain", "s", Float(0.0, 10.0), Required, "derivative gain G_d, Eq. (1)"),
    key("controller.realization", "", Choice(&["analog", "digital"]), Need::Default(Preset::Text("analog")), "where the force loop runs: in continuous time or sampled"),
    key("controller.force_loop", "", Choice(&["pd", "robust"]), Need::Default(Preset::Text("pd")), "gains of the force loop: as given, or designed from the rig so that the oil column stays damped; the designed loop is digital"),
    key("controller.sample_rate", "Hz", Float(1.0, 1e6), Required, "sample rate where no command brings its own"),
    key("controller.velocity_source", "", Choice(&["sensor", "derivative", "observer", "accelerometer"]), Need::Default(Preset::Text("sensor")), "where the velocity comes from: its sensor, the displacement's derivative, displacement and force through an observer, displacement and accelerometer through the same"),
    key("controller.velocity_corner", "Hz", Float(1e-3, 1e6), float(80.0), "corner of the two low-passes of the derivative"),
    key("controller.observer_mass", "kg", Float(1e-3, 1e12), OBSERVER, "mass that the force moves, as the observer knows it"),
    key("controller.observer_displacement_noise", "m", Float(1e-12, 1.0), float(6.4e-5), "noise of the displacement per sample, as the observer knows it"),
    key("controller.observer_acceleration_noise", "m/s²", Float(1e-9, 1e6), float(0.02), "noise of the acceleration per sample, measured or the force over the mass, as the observer knows it"),
    key("controller.observer_drift", "m/s³", Float(1e-6, 1e9), float(200.0), "rate at which spring and damper change the acceleration, as the observer expects it"),
    key("controller.accelerometer_drift", "m/s³", Float(1e-6, 1e9), float(1.0), "rate at which the accelerometer's error changes, as the observer that reads it expects it"),

    key("compensation.mode", "", Choice(&["off", "linear", "nonlinear"]), Required, "velocity feedback scheme"),
    key("compensation.level", "", Float(0.0, 10.0), float(1.0), "compensation level, 1 = full"),
    key("compensation.flow_gain", "m³/s", Float(1e-12, 1e3), Required, "no-load flow gain at the origin K_v, of the linear scheme"),
    key("compensation.valve_gain", "1/V", Float(1e-6, 1e6), Required, "valve gain K_s, Eq. (8)"),
    key("compensation.response_delay", "s", Float(0.0, 1.0), Required, "response delay of the valve T_d, Eq. (8)"),
    key("compensation.lead_alpha", "", Float(1e-3, 0.99), Required, "ratio of the lead network's time constants α, Eq. (8)"),
    key("compensation.computation_delay", "samples", Int(0, 1000), int(0), "delay of the compensation by computation"),
    key("compensation.sign_from", "", Choice(&["spool", "demand"]), Need::Default(Preset::Text("spool")), "signal that gives the sign of the load-pressure term"),
    key("compensation.feedforward", "", Bool, OFF, "demand the command's own flow as well"),
    key("compensation.look_ahead", "", Bool, OFF, "feed forward the next sample's command, known in advance, where `compensation.feedforward` is on"),
    key("compensation.adaptive", "", Bool, OFF, "estimate flow gain and valve during the test, guarded against overcompensation"),
    key("compensation.curve_correction", "", Bool, OFF, "correct the flow curve by direction and band of opening during the test, where `compensation.adaptive` is on and the scheme is nonlinear"),
    key("compensation.supply_correction", "", Bool, OFF, "scale the flow by a measured supply pressure, also without estimates"),
    key("compensation.guard", "", Bool, OFF, "take the level back where overcompensation pumps the structure, also without estimates"),
    key("compensation.learning.excitation", "", Float(1e-6, 0.5), float(5.0e-4), "opening below which nothing is learned"),
    key("compensation.learning.lowest_flow_gain", "", Float(0.01, 1.0), float(0.7), "lowest flow gain that is learned, over the table's"),
    key("compensation.learning.highest_flow_gain", "", Float(1.0, 100.0), float(1.35), "highest flow gain that is learned, over the table's"),
    key("compensation.learning.lowest_valve_gain", "", Float(0.01, 1.0), float(0.8), "lowest valve gain that is learned, over `compensation.valve_gain`"),
    key("compensation.learning.highest_valve_gain", "", Float(1.0, 100.0), float(1.25), "highest valve gain that is learned, over `compensation.valve_gain`"),
    key("compensation.learning.shortest_delay", "", Float(0.01, 1.0), float(0.2), "shortest response delay that is learned, over `compensation.response_delay`"),
    key("compensation.learning.longest_delay", "", Float(1.0, 100.0), float(4.0), "longest response delay that is learned, over `compensation.response_delay`"),

    key("structure.kind", "", Choice(&["linear", "bilinear", "bouc_wen", "shear_building"]), Required, "kind of structure; parts it does not use are ignored"),
    key("structure.mass", "kg", Float(1e-3, 1e12), Required, "mass m"),
    key("structure.damping", "N·s/m", Float(0.0, 1e12), Required, "viscous damping c"),
    key("structure.stiffness", "N/m", Float(0.0, 1e15), Required, "stiffness k"),
    key("structure.softening.displacement", "m", Float(1e-6, 1e3), BILINEAR, "displacement beyond which the spring softens, Fig. 7"),
    key("structure.softening.stiffness", "N/m", Float(0.0, 1e15), BILINEAR, "stiffness beyond that displacement, Fig. 7"),
    key("structure.bouc_wen.yield_displacement", "m", Float(1e-6, 1e3), BOUC_WEN, "yield displacement of the hysteretic spring"),
    key("structure.bouc_wen.post_yield_ratio", "", Float(0.0, 1.0), BOUC_WEN, "stiffness after yielding over the stiffness before"),
    key("structure.bouc_wen.exponent", "", Float(1.0, 100.0), BOUC_WEN, "sharpness of the yield point n"),
    key("structure.bouc_wen.shape", "", Float(0.0, 1.0), BOUC_WEN, "shape of the loop β, with γ = 1 − β"),
    key("structure.power_damper.coefficient", "N", Float(0.0, 1e12), Optional, "power-law damper: force at 1 m/s"),
    key("structure.power_damper.exponent", "", Float(0.05, 3.0), Optional, "power-law damper: exponent of the velocity"),
    key("structure.stories.masses", "kg", Floats(1, 64, 1e-3, 1e12), BUILDING, "masses of the floors of a shear building, from the ground up"),
    key("structure.stories.dampings", "N·s/m", Floats(1, 64, 0.0, 1e12), BUILDING, "damping of the columns below each floor"),
    key("structure.stories.stiffnesses", "N/m", Floats(1, 64, 1e-3, 1e15), BUILDING, "stiffness of the columns below each floor"),

    key("sensors.seed", "", Int(0, i64::MAX), int(0), "seed of all noise"),
    key("sensors.cell_mass", "kg", Float(0.0, 1e9), Optional, "mass between load cell and piston, part of the structure's"),
    key("sensors.force.gain", "", Float(1e-2, 1e2), float(1.0), "load cell: gain, reading over true value"),
    key("sensors.force.noise", "N", Float(0.0, 1e9), float(0.0), "load cell: standard deviation of the noise per sample"),
    key("sensors.force.bandwidth", "Hz", Float(1e-3, 1e6), Optional, "load cell: first-order bandwidth"),
    key("sensors.force.bits", "bits", Int(1, 32), Optional, "load cell: resolution over the range"),
    key("sensors.force.range", "N", Float(1e-9, 1e12), Optional, "load cell: range to either side"),
    key("sensors.force.delay", "samples", Int(0, 1000), int(0), "load cell: delay"),
    key("sensors.force.bias", "N", Float(-1e9, 1e9), float(0.0), "load cell: constant offset"),
    key("sensors.force.dropout", "", Float(0.0, 1.0), float(0.0), "load cell: share of samples that get lost"),
    key("sensors.velocity.gain", "", Float(1e-2, 1e2), float(1.0), "velocity: gain, reading over true value"),
    key("sensors.velocity.noise", "m/s", Float(0.0, 1e3), float(0.0), "velocity: standard deviation of the noise per sample"),
    key("sensors.velocity.bandwidth", "Hz", Float(1e-3, 1e6), Optional, "velocity: first-order bandwidth"),
    key("sensors.velocity.bits", "bits", Int(1, 32), Optional, "velocity: resolution over the range"),
    key("sensors.velocity.range", "m/s", Float(1e-9, 1e3), Optional, "velocity: range to either side"),
    key("sensors.velocity.delay", "samples", Int(0, 1000), int(0), "velocity: delay"),
    key("sensors.velocity.bias", "m/s", Float(-1e3, 1e3), float(0.0), "velocity: constant offset"),
    key("sensors.velocity.dropout", "", Float(0.0, 1.0), float(0.0), "velocity: share of samples that get lost"),
    key("sensors.displacement.gain", "", Float(1e-2, 1e2), float(1.0), "displacement: gain, reading over true value"),
    key("sensors.displacement.noise", "m", Float(0.0, 1e3), float(0.0), "displacement: standard deviation of the noise per sample"),
    key("sensors.displacement.bandwidth", "Hz", Float(1e-3, 1e6), Optional, "displacement: first-order bandwidth"),
    key("sensors.displacement.bits", "bits", Int(1, 32), Optional, "displacement: resolution over the range"),
    key("sensors.displacement.range", "m", Float(1e-9, 1e3), Optional, "displacement: range to either side"),
    key("sensors.displacement.delay", "samples", Int(0, 1000), int(0), "displacement: delay"),
    key("sensors.displacement.bias", "m", Float(-1e3, 1e3), float(0.0), "displacement: constant offset"),
    key("sensors.displacement.dropout", "", Float(0.0, 1.0), float(0.0), "displacement: share of samples that get lost"),
    key("sensors.spool.gain", "", Float(1e-2, 1e2), float(1.0), "spool: gain, reading over true value"),
    key("sensors.spool.noise", "", Float(0.0, 10.0), float(0.0), "spool: standard deviation of the noise per sample, opening"),
    key("sensors.spool.bandwidth", "Hz", Float(1e-3, 1e6), Optional, "spool: first-order bandwidth"),
    key("sensors.spool.bits", "bits", Int(1, 32), Optional, "spool: resolution over the range"),
    key("sensors.spool.range", "", Float(1e-6, 10.0), Optional, "spool: range to either side, opening"),
    key("sensors.spool.delay", "samples", Int(0, 1000), int(0), "spool: delay"),
    key("sensors.spool.bias", "", Float(-1.0, 1.0), float(0.0), "spool: constant offset, opening"),
    key("sensors.spool.dropout", "", Float(0.0, 1.0), float(0.0), "spool: share of samples that get lost"),
    key("sensors.supply_pressure.gain", "", Float(1e-2, 1e2), float(1.0), "supply pressure: gain, reading over true value"),
    key("sensors.supply_pressure.noise", "Pa", Float(0.0, 1e9), float(0.0), "supply pressure: standard deviation of the noise per sample"),
    key("sensors.supply_pressure.bandwidth", "Hz", Float(1e-3, 1e6), Optional, "supply pressure: first-order bandwidth"),
    key("sensors.supply_pressure.bits", "bits", Int(1, 32), Optional, "supply pressure: resolution over the range"),
    key("sensors.supply_pressure.range", "Pa", Float(1e-3, 1e12), Optional, "supply pressure: range to either side"),
    key("sensors.supply_pressure.delay", "samples", Int(0, 1000), int(0), "supply pressure: delay"),
    key("sensors.supply_pressure.bias", "Pa", Float(-1e9, 1e9), float(0.0), "supply pressure: constant offset"),
    key("sensors.supply_pressure.dropout", "", Float(0.0, 1.0), float(0.0), "supply pressure: share of samples that get lost"),
    key("sensors.acceleration.gain", "", Float(1e-2, 1e2), float(1.0), "accelerometer: gain, reading over true value"),
    key("sensors.acceleration.noise", "m/s²", Float(0.0, 1e6), float(0.0), "accelerometer on the piston: standard deviation of the noise per sample"),
    key("sensors.acceleration.bandwidth", "Hz", Float(1e-3, 1e6), Optional, "accelerometer: first-order bandwidth"),
    key("sensors.acceleration.bits", "bits", Int(1, 32), Optional, "accelerometer: resolution over the range"),
    key("sensors.acceleration.range", "m/s²", Float(1e-9, 1e6), Optional, "accelerometer: range to either side"),
    key("sensors.acceleration.delay", "samples", Int(0, 1000), int(0), "accelerometer: delay"),
    key("sensors.acceleration.bias", "m/s²", Float(-1e6, 1e6), float(0.0), "accelerometer: constant offset"),
    key("sensors.acceleration.dropout", "", Float(0.0, 1.0), float(0.0), "accelerometer: share of samples that get lost"),
    key("sensors.fault.signal", "", Choice(&["force", "velocity", "displacement", "spool", "supply_pressure", "acceleration"]), Optional, "sensor that fails during the test"),
    key("sensors.fault.kind", "", Choice(&["lost", "zero", "stuck", "sign", "gain"]), Optional, "how it fails: no valid reading, reads zero, repeats the last reading, wrong sign, wrong gain"),
    key("sensors.fault.start", "s", Float(0.0, 1e6), Optional, "when it fails"),
    key("sensors.fault.duration", "s", Float(0.0, 1e6), Optional, "how long it fails; to the end of the test where absent"),
    key("sensors.fault.gain", "", Float(1e-2, 1e2), When("sensors.fault.kind", "gain"), "what it then reads over what it should, where `sensors.fault.kind` is \"gain\""),

    key("dac.range", "V", Float(1e-6, 1e6), Optional, "converter of the controller's output: range to either side"),
    key("dac.bits", "bits", Int(1, 32), Optional, "converter of the controller's output: resolution over the range"),
    key("dac.delay", "samples", Int(0, 1000), int(0), "converter of the controller's output: delay between it and the valve"),

    key("protection.enabled", "", Bool, OFF, "whether the protection is in the loop"),
    key("protection.force_warning", "N", Float(0.0, 1e12), Optional, "force that raises a warning"),
    key("protection.force_trip", "N", Float(0.0, 1e12), Optional, "force that trips the test"),
    key("protection.displacement_warning", "m", Float(0.0, 1e3), Optional, "displacement that raises a warning"),
    key("protection.displacement_trip", "m", Float(0.0, 1e3), Optional, "displacement that trips the test"),
    key("protection.velocity_warning", "m/s", Float(0.0, 1e3), Optional, "velocity that raises a warning"),
    key("protection.velocity_trip", "m/s", Float(0.0, 1e3), Optional, "velocity that trips the test"),
    key("protection.spool_warning", "", Float(0.0, 10.0), Optional, "spool opening that raises a warning of the protection"),
    key("protection.spool_trip", "", Float(0.0, 10.0), Optional, "spool opening that trips the test"),
    key("protection.start_time", "s", Float(0.0, 1e4), float(0.0), "time of the soft start"),
    key("protection.ramp_time", "s", Float(0.0, 1e4), float(0.5), "time of the ramp to zero force after a trip and at the soft end"),
    key("protection.soft_end", "", Bool, OFF, "whether the command fades along the ramp at its end"),
    key("protection.shutdown_time", "s", Float(0.0, 1e4), float(0.1), "time in which a shutdown takes the valve command to zero"),
    key("protection.lost_samples", "samples", Int(0, 100000), int(10), "lost or refused samples in a row that are waited for before the shutdown, lost commands before the trip"),
    key("protection.plausibility", "", Bool, ON, "whether the measurements must agree with each other (flow, motion, spool), and a trip goes by those that do"),
    key("protection.force_noise", "N", Float(0.0, 1e9), Optional, "noise of the force per sample that the plausibility expects; 0.05 % of the actuator's capacity where absent"),
    key("protection.displacement_noise", "m", Float(1e-12, 1.0), Optional, "the same of the displacement; 0.05 % of its trip level, or of 0.1 m, where absent"),
    key("protection.velocity_noise", "m/s", Float(0.0, 1e3), Optional, "the same of the velocity; 0.05 % of the piston's speed at full flow where absent"),
    key("protection.spool_noise", "", Float(0.0, 1.0), float(5e-4), "the same of the spool opening"),
    key("protection.false_alarms", "1/h", Float(1e-12, 1e6), float(1e-3), "false alarms that this noise may raise"),
    key("protection.settle_time", "s", Float(0.0, 1e4), float(1.5), "time in which a shutdown lets the piston follow the specimen, damped, before the valve is closed"),
    key("protection.stuck_samples", "samples", Int(0, 1000000), int(0), "times that a measurement may repeat itself to the last bit before it counts as stuck; 0 does not look"),
    key("protection.fault_time", "s", Float(0.0, 1e4), Optional, "how long nothing may be learned, because the models are contradicted (a sensor that lies) or samples are lost every tenth of a second, before the test is tripped, where `protection.enabled` and `compensation.adaptive` are on"),

    key("limits.valve_command", "V", Float(1e-6, 1e6), Optional, "largest valve command to either side"),
    key("limits.valve_command_rate", "V/s", Float(1e-6, 1e12), Optional, "largest rate of the valve command"),
    key("limits.spool_warning", "", Float(1e-3, 1.0), float(0.6), "spool opening beyond which a warning flag is raised"),
    key("limits.force_range", "N", Float(1e-9, 1e12), Optional, "largest plausible measured force to either side"),
    key("limits.velocity_range", "m/s", Float(1e-9, 1e3), Optional, "largest plausible measured velocity to either side"),
    key("limits.spool_range", "", Float(1e-6, 10.0), Optional, "largest plausible measured spool opening to either side"),

    key("verdict.caution.force_error", "", Float(1e-6, 1e6), float(0.1), "force error, rms over rms, above which a test deserves a look"),
    key("verdict.caution.displacement_error", "", Float(1e-6, 1e6), float(0.1), "displacement error against the ideal response, rms over rms, above which a test deserves a look"),
    key("verdict.caution.gain_margin", "", Float(1.0, 1e3), float(1.2), "gain margin of the force loop below which a test deserves a look"),
    key("verdict.caution.supply_pressure", "", Float(0.0, 1.0), float(0.9), "least supply pressure over the configured one below which a test deserves a look"),
    key("verdict.no.force_error", "", Float(1e-6, 1e6), float(0.3), "force error, rms over rms, above which a test does not count"),
    key("verdict.no.displacement_error", "", Float(1e-6, 1e6), float(0.3), "displacement error against the ideal response, rms over rms, above which a test does not count"),
    key("verdict.no.gain_margin", "", Float(1.0, 1e3), float(1.1), "gain margin of the force loop below which a test does not count"),
    key("verdict.no.supply_pressure", "", Float(0.0, 1.0), float(0.7), "least supply pressure over the configured one below which a test does not count"),
];
