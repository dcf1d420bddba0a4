//! Identification from measured arrays, as in the paper: response delay (Fig. 4a), flow curve and flow gain
//! (Fig. 4b, Table 2), and damping. Friction of the seals and latencies of the sensors follow from the same
//! signals. The paper's experiments on the virtual rig give such arrays.
//!
//! Samples that are not finite are gaps. Offsets and linear drifts are removed. Data that does not determine
//! a result is refused with the reason.

mod clipping;
mod damping;
mod delay;
mod experiments;
mod fine_tuning;
mod flow_balance;
mod flow_curve;
mod flow_differences;
mod force_loop;
mod friction;
mod gaps;
mod integrated_noise;
mod least_squares;
mod load_cell;
mod overlap;

pub use damping::{DampingEstimate, identify_damping};
pub use delay::{DelayEstimate, identify_delay};
pub use experiments::{FlowTest, ValveTest, flow_test, free_vibration, valve_test};
pub use fine_tuning::{FineTuning, TestSignals, fine_tune};
pub use flow_balance::MotionSignals;
pub use flow_curve::{FlowCurveEstimate, Recording, identify_flow_curve, identify_flow_gain};
pub use flow_differences::flow_curve_by_differences;
pub use force_loop::{ForceLoopEstimate, identify_force_loop};
pub use friction::{FrictionEstimate, identify_friction};
pub use load_cell::{LoadCellEstimate, SpecimenSignals, identify_load_cell};
pub use overlap::{OverlapEstimate, identify_overlap};

/// A number and its standard uncertainty, in the same unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// One standard deviation.
    pub uncertainty: f64,
}

impl Estimate {
    fn new(value: f64, uncertainty: f64) -> Self {
        Self { value, uncertainty }
    }

    /// The same in another unit, by a positive factor.
    fn times(self, factor: f64) -> Self {
        Self::new(factor * self.value, factor * self.uncertainty)
    }
}
