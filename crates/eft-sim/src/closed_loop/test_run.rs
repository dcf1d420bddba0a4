//! The result of a test: one value per command sample and trace.

use std::hint::black_box;
use std::ops::{Deref, DerefMut};
use std::sync::Once;

use eft_core::SavedCalibration;

use crate::closed_loop::{Traces, adapts};
use crate::config::{Mode, RigConfig};
use crate::plant::EnergyBalance;
use crate::{Result, checks};

/// One test. Value `i` of a [trace](Traces) is the plant's true value at time `i / sample_rate`, before that
/// tick's output acts; the sensors' readings are the traces `measured_…`.
#[derive(Debug, Clone, PartialEq)]
pub struct TestRun {
    /// The rig that was tested.
    pub rig: RigConfig,
    /// Ticks per second (Hz).
    pub sample_rate: f64,
    /// The traces; their fields are also fields of the run.
    pub traces: Traces,
    /// Learned no-load flows (m³/s) of the valve at the end, at the openings of the rig's flow table, behind
    /// the overlap that the controller knows. Without learning they are the table's own. If the linear scheme
    /// learns they lie on a straight line. They are empty if an external controller has learned.
    pub found_flows: Vec<f64>,
    /// The calibration that the controller learned, for the section `calibration` of a later rig.
    pub calibration: Option<SavedCalibration>,
    /// The energy balance, of a rig with effects beyond the paper's model; for a building of all floors
    /// together. For any other rig [`energy_of_traces`](super::energy_of_traces) computes it from the traces.
    pub energy: Option<EnergyBalance>,
    /// Reason in one sentence why an external structure ended the test; the test ends with the sample before.
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

/// Makes the allocator keep some tens of megabytes of freed memory for the traces of the next test. Otherwise
/// the system clears it again, which takes as long as a third of the test.
// The GNU allocator keeps twice the largest block that it ever mapped and unmapped, up to this size; no page
// of it is touched. Other allocators ignore it.
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
            calibration: None,
            energy: None,
            stopped: None,
        }
    }

    /// Sets the learned flows (m³/s) at openings of the spool, if there are any.
    pub(crate) fn set_found_flows(&mut self, found: impl FnOnce(&[f64]) -> Option<Vec<f64>>) {
        if let Some(flows) = self.rig.found_flows(found) {
            self.found_flows = flows;
        }
    }

    /// Sets a flag at the last tick.
    pub(crate) fn flag_end(&mut self, flag: u32) {
        if let Some(last) = self.traces.status.last_mut() {
            *last |= flag;
        }
    }

    /// Smallest supply pressure (Pa).
    pub fn min_supply_pressure(&self) -> f64 {
        match self.supply_pressure() {
            [] => self.rig.plant().supply.pressure,
            trace => trace.iter().fold(f64::INFINITY, |least, pressure| least.min(*pressure)),
        }
    }

    /// The rig with the learned flow curve in its controller; the true valve is unchanged.
    /// Its calibration is removed, because that refers to the earlier table.
    ///
    /// # Errors
    /// The test had self-calibration or the guard with the linear scheme, which learns a slope and no table.
    /// Or an external controller has learned. Or the flows do not increase, which single precision can cause
    /// where the table is almost flat.
    pub fn corrected_rig(&self) -> Result<RigConfig> {
        corrected_rig(&self.rig, &self.found_flows)
    }
}

/// [`TestRun::corrected_rig`] of a tested rig and the flows (m³/s) that the test found.
///
/// # Errors
/// As that.
pub fn corrected_rig(rig: &RigConfig, found_flows: &[f64]) -> Result<RigConfig> {
    let has_table = !(adapts(rig) && rig.compensation.mode == Mode::Linear);
    let allowed = "must be \"nonlinear\" for a flow table to be found: the linear scheme uses none";
    checks::require(has_table, "compensation.mode", "\"linear\"", allowed)?;
    let allowed = "must have been found here: an external controller keeps its flows";
    checks::require(!found_flows.is_empty(), "found_flows", "none", allowed)?;
    let true_curve = rig.plant().servovalve.true_curve().clone();
    rig.without(&["truth.servovalve.flow_table", "calibration"])?.with(|rig| {
        rig.servovalve.true_flow_table = Some(true_curve);
        rig.servovalve.flow_table.flows = found_flows.to_vec();
    })
}
