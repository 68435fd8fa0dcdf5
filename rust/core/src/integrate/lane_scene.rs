//! A scene that runs beside others: its state between steps, and the steps that it makes by itself.

use super::exponential::Exponential;
use super::free_vibration::is_tried_at;
use super::step_loop::Runner;
use crate::contacts::Unswitched;
use crate::equations::SmoothEquations;
use crate::error::RunError;
use crate::excitation::{Forcing, Values};
use crate::numeric::float::times;
use crate::numeric::simd::{MAX_LANES, dispatch};
use crate::system::{Force, State};

/// An error of a scene at the same index.
pub(super) type Failures = [Option<RunError>; MAX_LANES];

pub(super) const NO_FAILURES: Failures = [const { None }; MAX_LANES];

/// A run in progress.
pub(super) struct Scene<'a, 'e> {
    pub runner: Runner<'a, Exponential, Unswitched<'e, SmoothEquations<'e>>>,
    pub forcing: Forcing,
    pub state: State,
    /// Of the excitation at the last sample.
    pub values: Values,
    /// The sample of the state, if it is not recorded yet.
    pub unrecorded: Option<usize>,
    /// The sample up to which it has vibrated freely, and to which its state belongs, while the others are still before it.
    pub free_until: usize,
    /// Index of the run.
    pub place: usize,
}

impl Scene<'_, '_> {
    /// Records the state, if it is not recorded yet. (Vectors of numbers that were stored one by one just before would wait for them.)
    #[inline(always)]
    pub(super) fn record(&mut self) {
        if let Some(k) = self.unrecorded.take() {
            self.runner.recorder.sample(k, &self.state);
        }
    }

    /// Moves it on from sample `k`, where it has arrived by a step over a whole interval, as far as it vibrates freely.
    #[inline(always)]
    pub(super) fn vibrate_freely(&mut self, k: usize) {
        if is_tried_at(k) {
            self.record();
            self.free_until = self.runner.vibrate_freely(&self.forcing, k, &mut self.state);
        }
    }

    /// Modal force of the excitation at sample `k`, whose values it takes.
    #[inline(always)]
    pub(super) fn force(&mut self, k: usize) -> Force {
        self.forcing.sample(self.runner.recorder.excitation, k, &mut self.values);
        times(self.forcing.influence(), &self.values)
    }
}

/// Steps a scene by itself from sample `k` to the next. `tries`: whether it first tries a single step.
#[inline(never)]
pub(super) fn step_by_itself(scene: &mut Scene, k: usize, tries: bool) -> Result<(), RunError> {
    dispatch!(step(scene, k, tries))
}

#[inline(always)]
fn step(scene: &mut Scene, k: usize, tries: bool) -> Result<(), RunError> {
    let Scene { runner, forcing, state, values, free_until, .. } = scene;
    if k < *free_until {
        return Ok(());
    }
    let (mut next, mut to) = ([0.0; 12], [0.0; 9]);
    forcing.sample(runner.recorder.excitation, k, values);
    let (mut at, mut other, mut from, mut until) = (&mut *state, &mut next, &mut *values, &mut to);
    let (states, ends) = ([&mut at, &mut other], [&mut from, &mut until]);
    if tries && runner.whole_interval(forcing, k, states, ends)? {
        *free_until = runner.vibrate_freely(forcing, k + 1, at);
    } else {
        runner.interval(forcing, k, [&mut at, &mut other], [&mut from, &mut until])?;
    }
    *state = *at;
    Ok(())
}
