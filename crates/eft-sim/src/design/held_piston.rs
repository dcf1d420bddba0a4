//! The plant of a force loop whose compensation supplies the flow of the motion. It consists of valve, oil
//! and load cell with the piston at rest, sampled with the hold and the delays of the loop.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix};

use crate::Result;
use crate::state_space::matrices::exponential;
use crate::state_space::{Mode, StateSpace};

/// Valve, actuator and digital side of a force loop, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldPiston {
    /// Pilot time constant `τ` (s), Eq. (2).
    pub pilot_time_constant: f64,
    /// Natural frequency (Hz) and damping ratio (1) of the torque motor, if there is one.
    pub torque_motor: Option<(f64, f64)>,
    /// Pilot flow gain `K_vp` (m³/(s·V)).
    pub pilot_flow_gain: f64,
    /// Voltage of the spool's feedback at full opening, `K_3·x_vmax` (V).
    pub spool_voltage: f64,
    /// Oil volume that moves the spool from null to full opening, `A_v·x_vmax` (m³).
    pub spool_volume: f64,
    /// Slope of the flow curve about rest (m³/s per unit opening).
    pub flow_gain: f64,
    /// The slope beyond an underlap (m³/s per unit opening), if there is one.
    pub flow_gain_beyond: Option<f64>,
    /// Oil compressibility of the chambers `K_a` (m³/Pa).
    pub compressibility: f64,
    /// Leakage `C_l` (m³/(s·Pa)), including that of the valve.
    pub leakage: f64,
    /// Piston area `A` (m²).
    pub piston_area: f64,
    /// Force sensitivity `C_F` (V/N).
    pub force_sensitivity: f64,
    /// Bandwidth of the load cell (Hz), if it is limited.
    pub cell_bandwidth: Option<f64>,
    /// Delay between load cell and valve (samples), without that of the hold.
    pub delay: u32,
    /// Known latency of the load cell (s) besides its bandwidth and this delay.
    pub latency: f64,
    /// Whether pilot time constant and compressibility are identified on this rig.
    pub identified: bool,
    /// Sample rate (Hz).
    pub sample_rate: f64,
}

/// Gains of a sampled proportional-derivative controller, Eq. (1), with an integral part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Gains {
    pub(super) proportional: f64,
    pub(super) derivative: f64,
    /// 1/s.
    pub(super) integral: f64,
}

impl Gains {
    /// All gains by the same function.
    pub(super) fn map(self, of: impl Fn(f64) -> f64) -> Self {
        let Self { proportional, derivative, integral } = self;
        Self { proportional: of(proportional), derivative: of(derivative), integral: of(integral) }
    }

    /// All gains times a factor (1).
    pub(super) fn scaled(self, factor: f64) -> Self {
        self.map(|gain| factor * gain)
    }
}

/// The plant from one sample to the next: `x' = A·x + B·v`, measured force `C·x` (N).
#[derive(Debug, Clone)]
pub(super) struct Sampled {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    names: Vec<&'static str>,
    delay: usize,
    force_sensitivity: f64,
    pub(super) rate: f64,
}

/// The same between two samples: `ẋ = A·x + B·v`.
#[derive(Debug, Clone)]
pub(crate) struct Continuous {
    pub(crate) a: DMatrix<f64>,
    /// Index of the state that the valve command drives, and the state's rate per volt.
    pub(crate) driven: (usize, f64),
    /// Index of the state that the controller measures as the force, and the force (N) per unit of it.
    pub(crate) shown: (usize, f64),
    /// Names of the states; the first three always exist.
    pub(crate) names: Vec<&'static str>,
}

const PILOT_FLOW: usize = 0;
const SPOOL: usize = 1;
/// Index of the load pressure; pilot flow and spool are before it.
pub(crate) const PRESSURE: usize = 2;

impl HeldPiston {
    /// Eqs. (2), (3), (6) without its root and (7) without motion, with torque motor and load cell.
    pub(crate) fn continuous(&self) -> Continuous {
        let mut names = vec!["pilot_flow", "spool", "load_pressure"];
        let motor = self.torque_motor.map(|(frequency, damping)| {
            names.extend(["torque_motor", "torque_motor_rate"]);
            (names.len() - 2, TAU * frequency, damping)
        });
        let cell = self.cell_bandwidth.map(|bandwidth| {
            names.push("load_cell");
            (names.len() - 1, TAU * bandwidth)
        });
        let mut a = DMatrix::zeros(names.len(), names.len());
        let per_time = 1.0 / self.pilot_time_constant;
        a[(PILOT_FLOW, PILOT_FLOW)] = -per_time;
        let driven = match motor {
            None => (PILOT_FLOW, self.pilot_flow_gain / self.pilot_time_constant),
            Some((flow, omega, damping)) => {
                a[(PILOT_FLOW, flow)] = per_time;
                a[(flow, flow + 1)] = 1.0;
                a[(flow + 1, flow)] = -omega * omega;
                a[(flow + 1, flow + 1)] = -2.0 * damping * omega;
                (flow + 1, omega * omega * self.pilot_flow_gain)
            }
        };
        a[(driven.0, SPOOL)] = -driven.1 * self.spool_voltage;
        a[(SPOOL, PILOT_FLOW)] = 1.0 / self.spool_volume;
        a[(PRESSURE, SPOOL)] = self.flow_gain / self.compressibility;
        a[(PRESSURE, PRESSURE)] = -self.leakage / self.compressibility;
        let shown = match cell {
            None => (PRESSURE, self.piston_area),
            Some((cell, corner)) => {
                a[(cell, PRESSURE)] = corner * self.piston_area;
                a[(cell, cell)] = -corner;
                (cell, 1.0)
            }
        };
        Continuous { a, driven, shown, names }
    }

    /// Delay and latency together (samples).
    pub(super) fn samples(&self) -> u32 {
        self.delay + libm::round(self.latency * self.sample_rate) as u32
    }

    pub(super) fn sampled(&self) -> Sampled {
        let Continuous { a, driven, shown, names } = self.continuous();
        let states = names.len();
        // The held valve command is the last state, so that one exponential gives A and B.
        let mut m = a.resize(states + 1, states + 1, 0.0);
        m[(driven.0, states)] = driven.1;
        let mut c = DMatrix::zeros(1, states);
        c[(0, shown.0)] = shown.1;
        let step = exponential(&(m / self.sample_rate));
        Sampled {
            a: step.view((0, 0), (states, states)).into_owned(),
            b: step.view((0, states), (states, 1)).into_owned(),
            c,
            names,
            delay: self.samples() as usize,
            force_sensitivity: self.force_sensitivity,
            rate: self.sample_rate,
        }
    }
}

impl Sampled {
    /// The open loop's gain from force error to measured force (1) at a frequency (Hz) that is not a pole.
    pub(super) fn open_loop_at(&self, gains: Gains, frequency: f64) -> Option<Complex<f64>> {
        let z = Complex::from_polar(1.0, TAU * frequency / self.rate);
        let complex = |m: &DMatrix<f64>| m.map(|entry| Complex::new(entry, 0.0));
        let n = self.a.nrows();
        let state =
            (DMatrix::from_diagonal_element(n, n, z) - complex(&self.a)).lu().solve(&complex(&self.b))?;
        let plant = (complex(&self.c) * state)[(0, 0)];
        // The integral contains the earlier samples only.
        let integral = (z - 1.0).inv() * (gains.integral / self.rate);
        let controller =
            (Complex::from(1.0) - z.inv()) * (gains.derivative * self.rate) + gains.proportional + integral;
        Some(plant * controller * self.force_sensitivity * z.powi(-(self.delay as i32)))
    }

    /// The loop, open or closed, from force command (N) to measured force (N).
    pub(super) fn model(&self, gains: Gains, closed: bool) -> StateSpace {
        let (n, delay) = (self.a.nrows(), self.delay);
        let size = n + delay + 2;
        let (last_error, integral) = (size - 2, size - 1);
        // The valve command as a row over the states, and per volt of force error.
        let per_error = gains.proportional + gains.derivative * self.rate;
        let mut command = DMatrix::zeros(1, size);
        command[(0, last_error)] = -gains.derivative * self.rate;
        command[(0, integral)] = 1.0;
        let mut error = DMatrix::zeros(1, size);
        if closed {
            error.view_mut((0, 0), (1, n)).copy_from(&(&self.c * -self.force_sensitivity));
        }
        command += &error * per_error;
        let mut a = DMatrix::zeros(size, size);
        let mut b = DMatrix::zeros(size, 1);
        a.view_mut((0, 0), (n, n)).copy_from(&self.a);
        a.row_mut(last_error).copy_from(&error);
        b[(last_error, 0)] = self.force_sensitivity;
        // Without an integral gain the unused state decays at once, so that it adds no pole at 1.
        let per_sample = gains.integral / self.rate;
        a.row_mut(integral).copy_from(&(&error * per_sample));
        a[(integral, integral)] = if per_sample > 0.0 { 1.0 } else { 0.0 };
        b[(integral, 0)] = per_sample * self.force_sensitivity;
        let direct = per_error * self.force_sensitivity;
        if delay == 0 {
            let driven = a.view((0, 0), (n, size)) + &self.b * &command;
            a.view_mut((0, 0), (n, size)).copy_from(&driven);
            b.view_mut((0, 0), (n, 1)).copy_from(&(&self.b * direct));
        } else {
            a.view_mut((0, n + delay - 1), (n, 1)).copy_from(&self.b);
            a.row_mut(n).copy_from(&command);
            b[(n, 0)] = direct;
            for age in 1..delay {
                a[(n + age, n + age - 1)] = 1.0;
            }
        }
        let mut c = DMatrix::zeros(1, size);
        c.view_mut((0, 0), (1, n)).copy_from(&self.c);
        let delayed_commands = (1..=delay).map(|age| format!("valve_command_{age}"));
        let states = self.names.iter().map(|name| (*name).to_owned()).chain(delayed_commands);
        StateSpace {
            a,
            b,
            c,
            d: DMatrix::zeros(1, 1),
            states: states.chain(["force_error", "integral"].map(str::to_owned)).collect(),
            inputs: vec!["command".into()],
            outputs: vec!["force".into()],
            left_out: Vec::new(),
            sample_time: Some(1.0 / self.rate),
        }
    }

    /// Damping ratio (1) of the closed loop's least damped mode, the oil column's; not positive where the loop is
    /// unstable.
    pub(super) fn damping(&self, gains: Gains) -> Result<f64> {
        let modes = self.model(gains, true).modes()?;
        // Stable poles near the negative real axis of the z-plane belong to the sampling, not to the oil.
        let of = |mode: &Mode| match mode.pole.re >= 0.0 {
            true => Some(mode.damping.min(0.0)),
            false => (mode.frequency < 0.25 * self.rate).then_some(mode.damping),
        };
        Ok(modes.iter().filter_map(of).fold(1.0, f64::min))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::force_loop::tests::zhao2005;

    const GAINS: Gains = Gains { proportional: 0.45, derivative: 6e-4, integral: 0.0 };

    fn late() -> Sampled {
        HeldPiston { cell_bandwidth: Some(300.0), delay: 2, ..zhao2005() }.sampled()
    }

    // From NumPy: scipy.linalg.expm of the scaled matrices, numpy.linalg.eigvals.
    #[test]
    fn poles_are_those_of_an_independent_model() {
        let modes = late().model(GAINS, true).modes().unwrap();
        let oil = modes[1].pole;
        assert!((oil.re + 39.111701).abs() < 1e-4 && (oil.im - 329.613633).abs() < 1e-4, "{oil}");
        assert!((modes[2].pole.re + 553.805600).abs() < 1e-3 && (modes[3].pole.re + 2068.0498).abs() < 1e-2);
        assert!((late().damping(GAINS).unwrap() - 39.111701 / oil.norm()).abs() < 1e-8);
    }

    #[test]
    fn both_realizations_have_the_open_loop_of_an_independent_model() {
        let plant = late();
        let expected = [(1.0, 23.26742331, -9.33745899), (60.0, -0.69504105, -0.04092098)];
        for (frequency, re, im) in expected {
            let gain = plant.open_loop_at(GAINS, frequency).unwrap();
            assert!((gain - Complex::new(re, im)).norm() < 1e-7 * gain.norm(), "{gain}");
            let model = plant.model(GAINS, false).response("force", frequency).unwrap();
            assert!((gain - model).norm() < 1e-9 * gain.norm(), "{gain} {model}");
            let closed = plant.model(GAINS, true).response("force", frequency).unwrap();
            assert!((closed - gain / (gain + 1.0)).norm() < 1e-9);
        }
    }

    #[test]
    fn torque_motor_and_load_cell_are_blocks_in_the_loop() {
        let plant =
            HeldPiston { torque_motor: Some((250.0, 0.5)), cell_bandwidth: Some(300.0), ..zhao2005() };
        let Continuous { a, driven, shown, names } = plant.continuous();
        for frequency in [1.0, 30.0, 65.0, 200.0] {
            let s = Complex::new(0.0, TAU * frequency);
            let mut forced = nalgebra::DVector::zeros(names.len());
            forced[driven.0] = Complex::from(driven.1);
            let system = DMatrix::from_diagonal_element(names.len(), names.len(), s) - a.map(Complex::from);
            let got = system.lu().solve(&forced).unwrap()[shown.0] * shown.1;
            let relative = s / (TAU * 250.0);
            let motor = (relative * relative + relative + 1.0).inv();
            let pilot = motor * plant.pilot_flow_gain / (s * plant.pilot_time_constant + 1.0);
            let spool = pilot / (s * plant.spool_volume + pilot * plant.spool_voltage);
            let oil = plant.flow_gain / (s * plant.compressibility + plant.leakage) * plant.piston_area;
            let expected = spool * oil / (s / (TAU * 300.0) + 1.0);
            assert!((got - expected).norm() < 1e-10 * expected.norm(), "{frequency}: {got} {expected}");
        }
        let gains = Gains { proportional: 0.36, derivative: 1e-3, integral: 0.0 };
        let with = plant.sampled().damping(gains).unwrap();
        let without = zhao2005().sampled().damping(gains).unwrap();
        assert!(with < 0.8 * without, "{with} {without}");
    }
}
