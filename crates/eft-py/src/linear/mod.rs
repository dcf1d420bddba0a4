//! `eft.linearize` and the analysis of linear models.

mod delays;
mod margins;
mod model;

pub(crate) use delays::{delay_budget, inverse_dynamics, observer_gains};
pub(crate) use margins::{linearize, margins_within, stability_map, stability_margin, stability_margins};
pub(crate) use model::LinearModel;
