//! Python bindings of `eft`: conversion only.
//!
//! Every class is a thin wrapper of the Rust type of the same name, which does all computations.

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

#[pyo3::pymodule]
mod _native {
    use numpy::PyArray1;
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::batch::{BatchResult, simulate_batch};
    #[pymodule_export]
    use crate::controlled::simulate_controlled;
    #[pymodule_export]
    use crate::controller::{Compensator, Controller};
    #[pymodule_export]
    use crate::design::design_force_loop;
    #[pymodule_export]
    use crate::energy::{energy_balance, energy_of_traces};
    #[pymodule_export]
    use crate::excitation::{Command, Record, effective_force, read_record, sine_sweep};
    #[pymodule_export]
    use crate::firmware::{export_source, fmu_files, processor_in_the_loop};
    #[pymodule_export]
    use crate::flow_table::FlowTable;
    #[pymodule_export]
    use crate::identification::{
        fine_tune, flow_test, force_loop_keys, free_vibration, identify_damping, identify_delay,
        identify_flow_curve, identify_flow_gain, identify_force_loop, identify_friction, identify_load_cell,
        identify_overlap, valve_test,
    };
    #[pymodule_export]
    use crate::linear::{
        LinearModel, delay_budget, inverse_dynamics, linearize, margins_within, observer_gains,
        stability_map, stability_margin, stability_margins,
    };
    #[pymodule_export]
    use crate::metrics::{coherence, fft_ratio, judge_test, metrics, worst};
    #[pymodule_export]
    use crate::planning::{
        check_feasibility, demands, displacement_spectrum, growth_until_learned, guarded, learned,
        predicted_errors, smallest_force,
    };
    #[pymodule_export]
    use crate::plant::{Plant, PlantState};
    #[pymodule_export]
    use crate::replay::replay;
    #[pymodule_export]
    use crate::rig::{Rig, check_rig, quantity, rig_keys, unit_factor, units_of};
    #[pymodule_export]
    use crate::run::{corrected_rig, ideal_response, simulate};
    #[pymodule_export]
    use crate::tables::{metric_table, recorded_traces, status_flags, trace_table, trip_causes};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::keep_released_memory();
        // The first array looks up NumPy's functions. An interrupt during that causes a panic, so it happens here
        // while the package loads.
        PyArray1::<f64>::zeros(module.py(), 1, false);
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
