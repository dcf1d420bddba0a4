//! What a test leaves behind: one value per command sample and trace.

use std::hint::black_box;
use std::ops::{Deref, DerefMut};
use std::sync::Once;

use crate::closed_loop::controller::adapts;
use crate::closed_loop::traces::Traces;
use crate::config::{Mode, RigConfig};
use crate::error::{Error, Result};
use crate::plant::EnergyBalance;

/// One test. Value `i` of a [trace](Traces) is the plant's true value at time `i / sample_rate`, before that tick's
/// output acts; what the sensors reported stands beside it as `measured_…`.
#[derive(Debug, Clone, PartialEq)]
pub struct TestRun {
    /// The rig that was tested.
    pub rig: RigConfig,
    /// Ticks per second (Hz).
    pub sample_rate: f64,
    /// The traces, whose fields are the run's.
    pub traces: Traces,
    /// No-load flows (m³/s) that the valve was found to pass by the end, at the openings of the rig's flow table; the
    /// table's own where nothing is learned, a straight line's where the linear scheme learns; empty where they stayed
    /// with a controller from outside.
    pub found_flows: Vec<f64>,
    /// Where the energy went, with a rig that has effects beyond the paper's model; of a building, all floors together.
    pub energy: Option<EnergyBalance>,
    /// Why a structure outside ended the test, in one sentence; the test ends with the sample before.
    pub stopped: Option<String>,
}

impl Deref for TestRun {
    type Target = Traces;

    fn deref(&self) -> &Traces {
        &self.traces
    }
}

impl DerefMut for TestRun {
    fn deref_mut(&mut self) -> &mut Traces {
        &mut self.traces
    }
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
        Self {
            rig: rig.clone(),
            sample_rate,
            traces: Traces::with_capacity(rig, ticks),
            found_flows: rig.servovalve.flow_table.flows.clone(),
            energy: None,
            stopped: None,
        }
    }

    /// Takes over the flows (m³/s) that were found at openings, where any were.
    pub(crate) fn learn(&mut self, found: impl FnOnce(&[f64]) -> Option<Vec<f64>>) {
        if let Some(flows) = found(&self.rig.servovalve.flow_table.openings) {
            self.found_flows = flows;
        }
    }

    /// Smallest supply pressure (Pa).
    pub fn min_supply_pressure(&self) -> f64 {
        match self.supply_pressure() {
            [] => self.rig.plant().supply.pressure,
            trace => trace.iter().fold(f64::INFINITY, |least, pressure| least.min(*pressure)),
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
}
