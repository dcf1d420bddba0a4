//! The choice of the integration method.

/// How the plant is carried from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The linear part exactly, the load flow once a step: two to three times the error of a Runge–Kutta step of
    /// the same length, from a quarter of its flow evaluations.
    Exponential,
    /// Classical Runge–Kutta of fourth order.
    RungeKutta,
}
