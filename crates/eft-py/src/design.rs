//! `design_force_loop`.

use pyo3::prelude::*;

use crate::interruption::interruptible;
use crate::linear::LinearModel;
use crate::rig::GivenRig;

/// Gains G_p (1), G_d (s) and G_i (1/s); margins gain (1), delay (s), damping (1), e_max (1); the open and
/// the closed loop.
type Designed = ([f64; 3], [f64; 4], LinearModel, LinearModel);

/// Design the force loop of a rig; see `eft.design_force_loop`.
#[pyfunction]
pub(crate) fn design_force_loop(py: Python<'_>, rig: GivenRig, sample_rate: f64) -> PyResult<Designed> {
    let design = || {
        let designed = rig.config.designed_force_loop(sample_rate)?;
        let margins = designed.margins()?;
        Ok((designed, margins))
    };
    let (designed, margins) = interruptible(py, design)?;
    Ok((
        [designed.proportional_gain, designed.derivative_gain, designed.integral_gain],
        [margins.gain, margins.delay, margins.damping, margins.e_max],
        LinearModel { inner: designed.open_loop() },
        LinearModel { inner: designed.closed_loop() },
    ))
}
