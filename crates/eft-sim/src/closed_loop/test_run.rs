//! What a test leaves behind: one value per command sample and channel.

use std::hint::black_box;
use std::sync::Once;

use eft_core::Flags;

use crate::closed_loop::chunk::Recorder;
use crate::closed_loop::controller::adapts;
use crate::closed_loop::fast::Tick;
use crate::config::{Mode, RigConfig, StructureKind};
use crate::error::{Error, Result};
use crate::instruments::{are_ideal, has_accelerometer};
use crate::lanes::Num;
use crate::plant::{EnergyBalance, needs_detail};

/// The traces of one test. Value `i` is the plant's true value at time `i / sample_rate`, before that tick's
/// output acts.
#[derive(Debug, Clone, PartialEq)]
pub struct TestRun {
    /// The rig that was tested.
    pub rig: RigConfig,
    /// Ticks per second (Hz).
    pub sample_rate: f64,
    /// Force command (N).
    pub command: Vec<f64>,
    /// Force on the structure (N).
    pub force: Vec<f64>,
    /// Displacement (m).
    pub displacement: Vec<f64>,
    /// Velocity (m/s).
    pub velocity: Vec<f64>,
    /// Spool opening (1).
    pub spool: Vec<f64>,
    /// Load pressure (Pa).
    pub load_pressure: Vec<f64>,
    /// Supply pressure (Pa); empty where it [stays](Self::is_steady) as configured.
    pub supply_pressure: Vec<f64>,
    /// Valve command `v` (V).
    pub valve_command: Vec<f64>,
    /// Compensation signal `v_c` (V).
    pub compensation: Vec<f64>,
    /// The flow gain the controller believes in, against its table (1); empty where it stays 1.
    pub flow_gain_estimate: Vec<f64>,
    /// The delay (s) that the controller makes up for; empty where it stays the configured one.
    pub response_delay_estimate: Vec<f64>,
    /// The spool's gain over the configured one (1), as the controller believes it; empty where it stays 1.
    pub valve_gain_estimate: Vec<f64>,
    /// The overcompensation guard's factor on the compensation level (1); empty where it stays 1.
    pub level: Vec<f64>,
    /// Bits of [`eft_core::status`].
    pub status: Vec<u32>,
    /// No-load flows (m³/s) that the valve was found to pass by the end, at the openings of the rig's flow table; the
    /// table's own where nothing is learned, a straight line's where the linear scheme learns; empty where they stayed
    /// with a controller from outside.
    pub found_flows: Vec<f64>,
    /// Where the energy went, with a rig that has effects beyond the paper's model.
    pub energy: Option<EnergyBalance>,
    steady: bool,
    /// What the sensors reported, the velocity perhaps estimated; none where each is the truth.
    measured: Option<Measured>,
}

/// What the sensors reported, beside the truth; a sample that got lost is NaN.
#[derive(Debug, Clone, PartialEq)]
struct Measured {
    force: Vec<f64>,
    displacement: Vec<f64>,
    velocity: Vec<f64>,
    spool: Vec<f64>,
    supply_pressure: Vec<f64>,
    /// Of a rig with an accelerometer, true and reported.
    acceleration: Option<[Vec<f64>; 2]>,
}

/// Has the allocator keep some tens of megabytes that were freed: the traces of the next test then stand in memory that
/// the system need not clear again, which takes as long as a third of the test.
// The GNU allocator keeps twice the largest block that it ever mapped and unmapped, up to this size; no page of it is
// touched. Others ignore it.
fn keep_memory() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| drop(black_box(Vec::<u8>::with_capacity(31 << 20))));
}

impl TestRun {
    pub(crate) fn with_capacity(rig: &RigConfig, sample_rate: f64, ticks: usize) -> Self {
        keep_memory();
        let channel = || Vec::with_capacity(ticks);
        let steady = !needs_detail(rig) && !adapts(rig) && rig.structure.kind != StructureKind::ShearBuilding;
        // Five traces fewer to fill take a thirtieth of a test's time off.
        let moving = || if steady { Vec::new() } else { channel() };
        Self {
            rig: rig.clone(),
            sample_rate,
            command: channel(),
            force: channel(),
            displacement: channel(),
            velocity: channel(),
            spool: channel(),
            load_pressure: channel(),
            supply_pressure: moving(),
            valve_command: channel(),
            compensation: channel(),
            flow_gain_estimate: moving(),
            response_delay_estimate: moving(),
            valve_gain_estimate: moving(),
            level: moving(),
            status: Vec::with_capacity(ticks),
            found_flows: rig.servovalve.flow_table.flows.clone(),
            energy: None,
            steady,
            measured: measures(rig).then(|| Measured {
                force: channel(),
                displacement: channel(),
                velocity: channel(),
                spool: channel(),
                supply_pressure: channel(),
                acceleration: has_accelerometer(rig).then(|| [channel(), channel()]),
            }),
        }
    }

    /// Takes over the flows (m³/s) that were found at openings, where any were.
    pub(crate) fn learn(&mut self, found: impl FnOnce(&[f64]) -> Option<Vec<f64>>) {
        if let Some(flows) = found(&self.rig.servovalve.flow_table.openings) {
            self.found_flows = flows;
        }
    }

    /// The rig with the flow curve that was found as its controller's; the valve itself stays what it was.
    ///
    /// # Errors
    /// A test in which an adaptive controller or a guard compensated by the linear scheme: what was found is the slope
    /// of its straight line, and says nothing of the table. A controller from outside, with which they stayed. Flows that do not increase, which a controller in single
    /// precision can leave behind where the table all but stands still.
    pub fn corrected_rig(&self) -> Result<RigConfig> {
        if adapts(&self.rig) && self.rig.compensation.mode == Mode::Linear {
            let allowed =
                "must be \"nonlinear\" for a flow table to be found: the linear scheme looks at none";
            return Err(Error::value("compensation.mode", "\"linear\"", allowed));
        }
        if self.found_flows.is_empty() {
            let allowed = "must have been found here: those of a controller from outside stay with it";
            return Err(Error::value("found_flows", "none", allowed));
        }
        let true_curve = self.rig.plant().servovalve.true_curve().clone();
        self.rig.without(&["truth.servovalve.flow_table"])?.with(|rig| {
            rig.servovalve.true_flow_table = Some(true_curve);
            rig.servovalve.flow_table.flows.clone_from(&self.found_flows);
        })
    }

    /// Where two runs differ by a bit for the first time, as trace and sample; none where they are equal.
    /// Samples that only one of them has are a difference.
    pub fn first_difference(&self, other: &Self) -> Option<(&'static str, usize)> {
        fn first<T>(a: &[T], b: &[T], bits: impl Fn(&T) -> u64) -> Option<usize> {
            let differ = a.iter().zip(b).position(|(a, b)| bits(a) != bits(b));
            differ.or((a.len() != b.len()).then(|| a.len().min(b.len())))
        }
        type Trace = fn(&TestRun) -> &[f64];
        let traces: [(&str, Trace); 20] = [
            ("command", |run| &run.command),
            ("force", |run| &run.force),
            ("displacement", |run| &run.displacement),
            ("velocity", |run| &run.velocity),
            ("spool", |run| &run.spool),
            ("load_pressure", |run| &run.load_pressure),
            ("supply_pressure", |run| &run.supply_pressure),
            ("valve_command", |run| &run.valve_command),
            ("compensation", |run| &run.compensation),
            ("flow_gain_estimate", |run| &run.flow_gain_estimate),
            ("response_delay_estimate", |run| &run.response_delay_estimate),
            ("valve_gain_estimate", |run| &run.valve_gain_estimate),
            ("level", |run| &run.level),
            ("measured_force", Self::measured_force),
            ("measured_displacement", Self::measured_displacement),
            ("measured_velocity", Self::measured_velocity),
            ("measured_spool", Self::measured_spool),
            ("measured_supply_pressure", Self::measured_supply_pressure),
            ("acceleration", |run| run.acceleration().unwrap_or_default()),
            ("measured_acceleration", |run| run.measured_acceleration().unwrap_or_default()),
        ];
        let flags = first(&self.status, &other.status, |&flags| flags.into()).map(|at| ("status", at));
        let differences = traces.into_iter().filter_map(|(name, trace)| {
            first(trace(self), trace(other), |value| value.to_bits()).map(|at| (name, at))
        });
        differences.chain(flags).min_by_key(|difference| difference.1)
    }

    /// Room for a sample under each of these commands (N), to be filled in.
    pub(crate) fn extend(&mut self, commands: &[f64]) -> Rows<'_> {
        fn more<T: Copy>(channel: &mut Vec<T>, ticks: usize, value: T) -> &mut [T] {
            let from = channel.len();
            channel.resize(from + ticks, value);
            &mut channel[from..]
        }
        let ticks = commands.len();
        self.command.extend_from_slice(commands);
        Rows {
            force: more(&mut self.force, ticks, 0.0),
            displacement: more(&mut self.displacement, ticks, 0.0),
            velocity: more(&mut self.velocity, ticks, 0.0),
            spool: more(&mut self.spool, ticks, 0.0),
            load_pressure: more(&mut self.load_pressure, ticks, 0.0),
            valve_command: more(&mut self.valve_command, ticks, 0.0),
            compensation: more(&mut self.compensation, ticks, 0.0),
            status: more(&mut self.status, ticks, 0),
            moving: (!self.steady).then(|| MovingRows {
                supply_pressure: more(&mut self.supply_pressure, ticks, 0.0),
                flow_gain_estimate: more(&mut self.flow_gain_estimate, ticks, 0.0),
                response_delay_estimate: more(&mut self.response_delay_estimate, ticks, 0.0),
                valve_gain_estimate: more(&mut self.valve_gain_estimate, ticks, 0.0),
                level: more(&mut self.level, ticks, 0.0),
            }),
            measured: self.measured.as_mut().map(|measured| MeasuredRows {
                force: more(&mut measured.force, ticks, 0.0),
                displacement: more(&mut measured.displacement, ticks, 0.0),
                velocity: more(&mut measured.velocity, ticks, 0.0),
                spool: more(&mut measured.spool, ticks, 0.0),
                supply_pressure: more(&mut measured.supply_pressure, ticks, 0.0),
                acceleration: measured
                    .acceleration
                    .as_mut()
                    .map(|both| both.each_mut().map(|channel| more(channel, ticks, 0.0))),
            }),
        }
    }

    /// Keeps the first `ticks` samples.
    pub(crate) fn truncate(&mut self, ticks: usize) {
        let channels = [
            &mut self.command,
            &mut self.force,
            &mut self.displacement,
            &mut self.velocity,
            &mut self.spool,
            &mut self.load_pressure,
            &mut self.supply_pressure,
            &mut self.valve_command,
            &mut self.compensation,
            &mut self.flow_gain_estimate,
            &mut self.response_delay_estimate,
            &mut self.valve_gain_estimate,
            &mut self.level,
        ];
        let measured = self.measured.as_mut().map(|measured| {
            [
                &mut measured.force,
                &mut measured.displacement,
                &mut measured.velocity,
                &mut measured.spool,
                &mut measured.supply_pressure,
            ]
            .into_iter()
            .chain(measured.acceleration.iter_mut().flatten())
        });
        for channel in channels.into_iter().chain(measured.into_iter().flatten()) {
            channel.truncate(ticks);
        }
        self.status.truncate(ticks);
    }

    /// Whether supply pressure and what the controller believes stay as configured, and have no traces.
    pub fn is_steady(&self) -> bool {
        self.steady
    }

    /// Whether each sensor is ideal, and what was measured is what was true.
    pub fn has_ideal_sensors(&self) -> bool {
        self.measured.is_none()
    }

    /// Force (N) as the load cell reported it.
    pub fn measured_force(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.force, |measured| &measured.force)
    }

    /// Displacement (m) as its sensor reported it.
    pub fn measured_displacement(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.displacement, |measured| &measured.displacement)
    }

    /// Velocity (m/s) as its sensor reported it.
    pub fn measured_velocity(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.velocity, |measured| &measured.velocity)
    }

    /// Spool opening (1) as its sensor reported it.
    pub fn measured_spool(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.spool, |measured| &measured.spool)
    }

    /// Supply pressure (Pa) as its sensor reported it; empty where there is neither sensor nor trace.
    pub fn measured_supply_pressure(&self) -> &[f64] {
        self.measured.as_ref().map_or(&self.supply_pressure, |measured| &measured.supply_pressure)
    }

    /// Acceleration (m/s²) of a rig with an accelerometer.
    pub fn acceleration(&self) -> Option<&[f64]> {
        self.accelerations().map(|[truth, _]| truth.as_slice())
    }

    /// Acceleration (m/s²) as the accelerometer reported it.
    pub fn measured_acceleration(&self) -> Option<&[f64]> {
        self.accelerations().map(|[_, reported]| reported.as_slice())
    }

    fn accelerations(&self) -> Option<&[Vec<f64>; 2]> {
        self.measured.as_ref().and_then(|measured| measured.acceleration.as_ref())
    }

    /// Every flag that was raised at any time.
    pub fn status_union(&self) -> u32 {
        self.status.iter().fold(0, |all, s| all | s)
    }
}

/// Some samples of every trace, to be written.
pub(crate) struct Rows<'a> {
    force: &'a mut [f64],
    displacement: &'a mut [f64],
    velocity: &'a mut [f64],
    spool: &'a mut [f64],
    load_pressure: &'a mut [f64],
    valve_command: &'a mut [f64],
    compensation: &'a mut [f64],
    status: &'a mut [u32],
    /// None where they stay as the configuration has them.
    moving: Option<MovingRows<'a>>,
    measured: Option<MeasuredRows<'a>>,
}

struct MovingRows<'a> {
    supply_pressure: &'a mut [f64],
    flow_gain_estimate: &'a mut [f64],
    response_delay_estimate: &'a mut [f64],
    valve_gain_estimate: &'a mut [f64],
    level: &'a mut [f64],
}

struct MeasuredRows<'a> {
    force: &'a mut [f64],
    displacement: &'a mut [f64],
    velocity: &'a mut [f64],
    spool: &'a mut [f64],
    supply_pressure: &'a mut [f64],
    acceleration: Option<[&'a mut [f64]; 2]>,
}

impl Rows<'_> {
    /// Writes one lane of a tick as sample `i`.
    #[inline(always)]
    pub(crate) fn set<S: Num>(&mut self, i: usize, tick: &Tick<S>, lane: usize) {
        self.force[i] = tick.force.lane(lane);
        self.displacement[i] = tick.plant.displacement.lane(lane);
        self.velocity[i] = tick.plant.velocity.lane(lane);
        self.spool[i] = tick.plant.spool.lane(lane);
        self.load_pressure[i] = tick.plant.load_pressure.lane(lane);
        self.valve_command[i] = tick.decision.valve_command.lane(lane);
        self.compensation[i] = tick.decision.compensation.lane(lane);
        self.status[i] = tick.status.lane(lane);
        if let Some(moving) = &mut self.moving {
            let calibration = &tick.decision.estimates;
            moving.supply_pressure[i] = tick.supply_pressure.lane(lane);
            moving.flow_gain_estimate[i] = calibration.flow_gain.lane(lane);
            moving.response_delay_estimate[i] = calibration.response_delay.lane(lane);
            moving.valve_gain_estimate[i] = calibration.valve_gain.lane(lane);
            moving.level[i] = calibration.level.lane(lane);
        }
        if let Some(measured) = &mut self.measured {
            let reported = &tick.decision.measured;
            measured.force[i] = reported.force.lane(lane);
            measured.displacement[i] = reported.displacement.lane(lane);
            measured.velocity[i] = reported.velocity.lane(lane);
            measured.spool[i] = reported.spool.lane(lane);
            measured.supply_pressure[i] = reported.supply_pressure.lane(lane);
            if let Some([truth, reading]) = &mut measured.acceleration {
                truth[i] = tick.acceleration.lane(lane);
                reading[i] = reported.acceleration.lane(lane);
            }
        }
    }
}

impl<S: Num> Recorder<S> for Rows<'_> {
    #[inline(always)]
    fn record(&mut self, i: usize, tick: &Tick<S>) {
        self.set(i, tick, 0);
    }
}

/// Whether the controller sees anything but the truth.
fn measures(rig: &RigConfig) -> bool {
    !are_ideal(rig) || rig.controller.velocity_source != crate::config::VelocitySource::Sensor
}
