//! Learning channels side by side: the tick runs in lanes, and one learner per lane runs once per window.

use eft_core::{
    Calibration, ChannelLanes, ChannelLanesState, ControllerInput, ControllerOutput, Parameters,
    SavedCalibration, Scalar,
};

use crate::Result;
use crate::closed_loop::channel::RigLearner;
use crate::closed_loop::{Estimates, EstimatesInUse, Precision, RigController};
use crate::config::TABLE_CAPACITY;
use crate::lanes::{Num, Work};

/// Channels of rigs that learn, without protection and with a measured velocity, one per lane.
pub(crate) struct LearningLanes<S: Num, C: Scalar<Element: Precision>> {
    channels: Box<ChannelLanes<C, TABLE_CAPACITY>>,
    state: Box<ChannelLanesState<C>>,
    learners: Vec<RigLearner<C::Element>>,
    /// For each lane the calibration in use and the one of the next window.
    calibrations: Vec<[Calibration<C::Element>; 2]>,
    /// The estimates of the calibrations in use.
    pub(crate) estimates: EstimatesInUse<S>,
    /// Whether the last tick closed a window.
    window_closed: bool,
}

impl<S: Num, C: Scalar<Element: Precision>> LearningLanes<S, C> {
    /// At rest; each learner starts from what was saved of its rig.
    ///
    /// # Errors
    /// Parameters that `eft-core` refuses.
    pub(crate) fn new<'a>(
        parameters: &[Parameters],
        controllers: &[RigController<C::Element>],
        saved: impl Fn(usize) -> Option<&'a SavedCalibration>,
    ) -> Result<Self> {
        let window_ticks = C::Element::channel(&parameters[0])?.window_ticks();
        let channels = Box::new(ChannelLanes::new(RigController::pack(&|i| &controllers[i]), window_ticks));
        let learner = |(i, p)| RigLearner::new(p, saved(i));
        let learners = parameters.iter().enumerate().map(learner).collect::<Result<_>>()?;
        let calibrations: Vec<_> = controllers
            .iter()
            .zip(&learners)
            .map(|(one, learning): (_, &RigLearner<_>)| [learning.first.unwrap_or_else(|| one.nominal()); 2])
            .collect();
        let estimates = EstimatesInUse::new(Estimates::unknown().or(|i| Some(&calibrations[i][0])));
        Ok(Self {
            state: Box::new(channels.at_rest_with(&Calibration::pack(|i| &calibrations[i][0]))),
            channels,
            learners,
            calibrations,
            estimates,
            window_closed: false,
        })
    }

    /// The calibration in use of a lane.
    pub(crate) fn calibration(&self, lane: usize) -> Option<&Calibration<C::Element>> {
        self.calibrations.get(lane).map(|[in_use, _]| in_use)
    }

    /// One tick; the compensation signal passes through `path` before the force loop.
    #[inline(always)]
    pub(crate) fn step(
        &mut self,
        input: &ControllerInput<C>,
        valve_command: C,
        path: impl FnOnce(C) -> C,
    ) -> ControllerOutput<C> {
        if self.window_closed {
            self.learn();
        }
        let out;
        (out, self.window_closed) = self.channels.step(&mut self.state, input, valve_command, path);
        out
    }

    /// Updates the learners from the closed window; the calibration is used one window later.
    #[inline(never)]
    fn learn(&mut self) {
        for (lane, (learning, [in_use, next])) in
            self.learners.iter_mut().zip(&mut self.calibrations).enumerate()
        {
            *in_use = *next;
            *next = learning.learner.update(&mut learning.state, &self.state.window(lane));
        }
        S::dispatch(Publish(self));
    }

    /// As [`RigChannel::saved`](crate::closed_loop::channel::RigChannel::saved), of a lane.
    pub(crate) fn saved(&self, lane: usize) -> Option<SavedCalibration> {
        let mut learning = self.learners.get(lane)?.clone();
        // A window that closed with the last tick would be learned before the next.
        if self.window_closed {
            learning.learner.update(&mut learning.state, &self.state.window(lane));
        }
        learning.saved()
    }

    /// As [`RigChannel::found_flows`](crate::closed_loop::channel::RigChannel::found_flows), for one lane.
    pub(crate) fn found_flows(&self, openings: &[f64], lane: usize) -> Option<Vec<f64>> {
        Some(self.learners.get(lane)?.found_flows(self.calibration(lane)?, openings))
    }
}

struct Publish<'a, S: Num, C: Scalar<Element: Precision>>(&'a mut LearningLanes<S, C>);

impl<S: Num, C: Scalar<Element: Precision>> Work for Publish<'_, S, C> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let LearningLanes { channels, state, calibrations, estimates, .. } = self.0;
        channels.publish(state, |lane| &calibrations[lane][1]);
        estimates.replace(Estimates::unknown().or(|lane| Some(&calibrations[lane][0])));
    }
}
