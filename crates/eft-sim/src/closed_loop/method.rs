//! The choice of the integration method.

/// The integration method of the plant between ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Integrates the linear part exactly and evaluates the load flow once per step. Compared with a
    /// Runge–Kutta step of the same length it has two to three times the error and a quarter of the flow
    /// evaluations.
    Exponential,
    /// The classical Runge–Kutta method of fourth order.
    RungeKutta,
}
