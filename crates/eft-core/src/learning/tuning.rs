//! Constants of the learner that no user sets, found on the paper's rig with sensor noise of about 0.05 % of range. The public
//! ones are for predictions of what it does.

/// Zero of the estimators' filter (Hz) between the mains' 50 and 60 Hz, nearer to the one that the oil column amplifies more.
pub(crate) const MAINS: f64 = 58.0;
/// Corner of the estimators' two equal low-passes (Hz). With the zero they pass as much noise as 12 Hz without it.
pub const LOW_PASS: f64 = 13.0;
/// Corner of the estimators' high-pass (Hz).
pub const HIGH_PASS: f64 = 0.1;
/// Shortest memory (s), at strong motion.
pub(crate) const MEMORY: f64 = 0.25;
/// Evidence (squared opening × s) at which half of the forgetting of the shortest memory is reached.
pub(crate) const HALF_EVIDENCE: f64 = 1.5e-3;
/// Evidence (squared opening × s) that is never forgotten.
pub(crate) const KEPT_EVIDENCE: f64 = 5.0e-5;
/// Least time (s) between two checkpoints, within which a failed sensor is noticed.
pub(crate) const CHECKPOINT: f64 = 0.2;
/// Time (s) without learning after a rejection.
pub(crate) const HOLD_OFF: f64 = 0.5;
/// Time (s) without learning after lost samples.
pub(crate) const SETTLING: f64 = 0.1;
/// Time (s) over which the gate averages.
pub(crate) const GATE_AVERAGE: f64 = 0.03;
/// Allowed squared error of the models, as a share of the signals' squares (1).
pub const GATE_THRESHOLD: f64 = 0.03;
/// Share of the threshold (1) that the gate allows between a rejection and the next evidence.
pub const GATE_CAUTION: f64 = 0.5;
/// Squares of the signals that the gate needs for a rejection, over the square of the opening from which on something is learned
/// (1). The unexplained part of smaller signals may be noise.
pub const GATE_SIGNAL: f64 = 9.0;
/// Largest possible sum of the magnitudes of a window's flows, forces or openings (1): over the flow of the open valve and
/// the leakage, the force of the supply pressure, or the stroke.
pub(crate) const LARGEST_SUM: f64 = 8.0;
/// Opening (1) beyond which the valve counts as saturated.
pub(crate) const LINEAR_RANGE: f64 = 0.9;
/// Time (s) that weights a rate of opening in comparison with an opening.
pub(crate) const EXCITATION_TIME: f64 = 0.1;

/// Square of the lowest frequency (1/s²) at which leakage and the oil's compression are distinguished.
pub(crate) const SLOWEST: f64 = 1.0e-6;

/// Square of the highest frequency (1/s²) that the lead network's gain is corrected for; no motion is as fast.
pub(crate) const FASTEST: f64 = 1.0e12;

/// Largest share of the velocity's delay that is added for the phase of the lead network. Up to it the phase's expansion holds.
pub(crate) const LARGEST_DEFICIT: f64 = 0.5;

/// Shortest response delay (samples) that is learned.
pub const SHORTEST_DELAY: f64 = 2.0;
/// Largest rate (1/s) of the flow gain.
pub const FLOW_GAIN_RATE: f64 = 0.5;
/// Largest rate (1/s) of the valve gain.
pub const VALVE_GAIN_RATE: f64 = 0.2;
/// Largest rate (1/s) of either delay over the configured response delay.
pub const DELAY_RATE: f64 = 2.0;
/// Largest distance of the velocity's delay from the configured one, over the configured response delay (1).
pub const VELOCITY_DELAY_REACH: [f64; 2] = [-1.0, 2.0];
/// Weight of the configured flow gain (squared opening × s).
pub(crate) const FLOW_GAIN_PRIOR: f64 = 1.0e-7;
/// Weight of the configured valve gain (squared opening × s).
pub(crate) const VALVE_GAIN_PRIOR: f64 = 1.0e-6;
/// Weight of the configured response delay (1/s, of squared opening rate).
pub(crate) const RESPONSE_DELAY_PRIOR: f64 = 6.0e-5;
/// The same for the velocity's delay.
pub(crate) const VELOCITY_DELAY_PRIOR: f64 = 6.0e-4;
/// Largest rate of the null offset (1/s).
pub(crate) const NULL_RATE: f64 = 0.05;
/// Memory (s) of the two directions' gains, at strong motion.
pub(crate) const DIRECTION_MEMORY: f64 = 5.0;
/// Time (s) over which the errors of the flow curve are averaged.
pub(crate) const CURVE_AVERAGE: f64 = 4.0;
/// Assumed duration (s) of an error of the flow curve: half a period of a tone of some hertz.
pub(crate) const CURVE_CORRELATION: f64 = 0.12;
/// Time (s) for which a disturbance of the spool's sensor may be in phase with the motion.
pub(crate) const DISTURBANCE: f64 = 2.0;
/// Largest departure of a node from its direction, over the node's flow (1).
pub const CURVE_DEPARTURE: f64 = 0.2;
/// Drift of a node over its own flow (1/√s of motion in the adjacent pieces).
pub(crate) const CURVE_DRIFT: f64 = 0.016;
