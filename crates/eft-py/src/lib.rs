//! Python bindings of `eft`: conversion only.
//!
//! Every class is a thin wrapper of the Rust type of the same name, which does all computations.

use numpy::PyArray1;
use pyo3::prelude::*;

mod arrays;
mod batch;
mod controlled;
mod controller;
mod design;
mod energy;
mod errors;
mod excitation;
mod firmware;
mod flow_table;
mod identification;
mod integration;
mod interruption;
mod linear;
mod metrics;
mod one_caller;
mod planning;
mod plant;
mod replay;
mod rig;
mod run;
mod specimen;
mod tables;
mod values;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Keeps released memory for ten seconds instead of one, unless `MIMALLOC_PURGE_DELAY` says otherwise. New memory
/// costs a virtual machine more time than the test whose traces it takes.
fn keep_released_memory() {
    /// `mi_option_purge_delay`, ms. The Rust bindings do not name it.
    const PURGE_DELAY: libmimalloc_sys::mi_option_t = 15;
    // SAFETY: the option exists, and setting it is an assignment.
    unsafe { libmimalloc_sys::mi_option_set_default(PURGE_DELAY, 10_000) };
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    keep_released_memory();
    // The first array looks up NumPy's functions. An interrupt during that causes a panic, so it happens here
    // while the package loads.
    PyArray1::<f64>::zeros(module.py(), 1, false);
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<rig::Rig>()?;
    module.add_function(wrap_pyfunction!(rig::check_rig, module)?)?;
    module.add_class::<excitation::Command>()?;
    module.add_class::<excitation::Record>()?;
    module.add_class::<flow_table::FlowTable>()?;
    module.add_class::<controller::Compensator>()?;
    module.add_class::<controller::Controller>()?;
    module.add_class::<linear::LinearModel>()?;
    module.add_class::<batch::BatchResult>()?;
    module.add_class::<plant::Plant>()?;
    module.add_class::<plant::PlantState>()?;
    module.add_function(wrap_pyfunction!(rig::rig_keys, module)?)?;
    module.add_function(wrap_pyfunction!(rig::quantity, module)?)?;
    module.add_function(wrap_pyfunction!(rig::unit_factor, module)?)?;
    module.add_function(wrap_pyfunction!(rig::units_of, module)?)?;
    module.add_function(wrap_pyfunction!(excitation::sine_sweep, module)?)?;
    module.add_function(wrap_pyfunction!(excitation::effective_force, module)?)?;
    module.add_function(wrap_pyfunction!(excitation::read_record, module)?)?;
    module.add_function(wrap_pyfunction!(run::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(run::corrected_rig, module)?)?;
    module.add_function(wrap_pyfunction!(controlled::simulate_controlled, module)?)?;
    module.add_function(wrap_pyfunction!(batch::simulate_batch, module)?)?;
    module.add_function(wrap_pyfunction!(replay::replay, module)?)?;
    module.add_function(wrap_pyfunction!(firmware::export_source, module)?)?;
    module.add_function(wrap_pyfunction!(firmware::fmu_files, module)?)?;
    module.add_function(wrap_pyfunction!(firmware::processor_in_the_loop, module)?)?;
    module.add_function(wrap_pyfunction!(tables::trace_table, module)?)?;
    module.add_function(wrap_pyfunction!(tables::recorded_traces, module)?)?;
    module.add_function(wrap_pyfunction!(tables::metric_table, module)?)?;
    module.add_function(wrap_pyfunction!(metrics::judge_test, module)?)?;
    module.add_function(wrap_pyfunction!(metrics::metrics, module)?)?;
    module.add_function(wrap_pyfunction!(metrics::worst, module)?)?;
    module.add_function(wrap_pyfunction!(metrics::fft_ratio, module)?)?;
    module.add_function(wrap_pyfunction!(metrics::coherence, module)?)?;
    module.add_function(wrap_pyfunction!(run::ideal_response, module)?)?;
    module.add_function(wrap_pyfunction!(energy::energy_balance, module)?)?;
    module.add_function(wrap_pyfunction!(energy::energy_of_traces, module)?)?;
    module.add_function(wrap_pyfunction!(tables::status_flags, module)?)?;
    module.add_function(wrap_pyfunction!(design::design_force_loop, module)?)?;
    module.add_function(wrap_pyfunction!(tables::trip_causes, module)?)?;
    module.add_function(wrap_pyfunction!(linear::linearize, module)?)?;
    module.add_function(wrap_pyfunction!(linear::stability_margin, module)?)?;
    module.add_function(wrap_pyfunction!(linear::margins_within, module)?)?;
    module.add_function(wrap_pyfunction!(linear::stability_margins, module)?)?;
    module.add_function(wrap_pyfunction!(linear::stability_map, module)?)?;
    module.add_function(wrap_pyfunction!(linear::delay_budget, module)?)?;
    module.add_function(wrap_pyfunction!(linear::inverse_dynamics, module)?)?;
    module.add_function(wrap_pyfunction!(linear::observer_gains, module)?)?;
    module.add_function(wrap_pyfunction!(identification::identify_delay, module)?)?;
    module.add_function(wrap_pyfunction!(identification::identify_flow_curve, module)?)?;
    module.add_function(wrap_pyfunction!(identification::identify_flow_gain, module)?)?;
    module.add_function(wrap_pyfunction!(identification::identify_overlap, module)?)?;
    module.add_function(wrap_pyfunction!(identification::identify_friction, module)?)?;
    module.add_function(wrap_pyfunction!(identification::identify_force_loop, module)?)?;
    module.add_function(wrap_pyfunction!(identification::force_loop_keys, module)?)?;
    module.add_function(wrap_pyfunction!(identification::identify_load_cell, module)?)?;
    module.add_function(wrap_pyfunction!(identification::identify_damping, module)?)?;
    module.add_function(wrap_pyfunction!(identification::fine_tune, module)?)?;
    module.add_function(wrap_pyfunction!(identification::valve_test, module)?)?;
    module.add_function(wrap_pyfunction!(identification::flow_test, module)?)?;
    module.add_function(wrap_pyfunction!(identification::free_vibration, module)?)?;
    module.add_function(wrap_pyfunction!(planning::band_passed, module)?)?;
    module.add_function(wrap_pyfunction!(planning::baseline_corrected, module)?)?;
    module.add_function(wrap_pyfunction!(planning::check_feasibility, module)?)?;
    module.add_function(wrap_pyfunction!(planning::demands, module)?)?;
    module.add_function(wrap_pyfunction!(planning::displacement_spectrum, module)?)?;
    module.add_function(wrap_pyfunction!(planning::learned, module)?)?;
    module.add_function(wrap_pyfunction!(planning::smallest_force, module)?)?;
    module.add_function(wrap_pyfunction!(planning::growth_until_learned, module)?)?;
    module.add_function(wrap_pyfunction!(planning::guarded, module)?)?;
    module.add_function(wrap_pyfunction!(planning::predicted_errors, module)?)?;
    module.add_function(wrap_pyfunction!(planning::resampled, module)?)?;
    module.add_function(wrap_pyfunction!(planning::scaled, module)?)?;
    module.add_function(wrap_pyfunction!(planning::tapered, module)?)?;
    Ok(())
}
