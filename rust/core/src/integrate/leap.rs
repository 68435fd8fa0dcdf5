//! Leaps over many samples at once, where the record needs none of those in between and no contact can change. Only with `std`.

use super::method::Method;
#[cfg(feature = "std")]
use super::method::Output;
use super::recorder::Recorder;
use super::step_loop::Runner;
use super::switched::SwitchedEquations;
#[cfg(feature = "std")]
use crate::equations::LEAP;
use crate::excitation::{Forcing, Values};
#[cfg(feature = "std")]
use crate::numeric::simd::{Kernel, dispatch};
use crate::system::State;

/// When a run tries to leap.
pub(super) struct Leaps {
    /// Sample of the next attempt.
    pub from: usize,
    /// Intervals between a failed attempt and the next, and the most of them.
    #[cfg(feature = "std")]
    pause: usize,
    #[cfg(feature = "std")]
    longest_pause: usize,
}

#[cfg(feature = "std")]
impl Leaps {
    pub(super) fn new(recorder: &Recorder) -> Self {
        let possible = matches!(recorder.output, Output::Samples) && !recorder.record.needs_all();
        // Under a noisy motion, where hardly any attempt succeeds, they must take no time.
        Self { from: if possible { 0 } else { usize::MAX }, pause: LEAP, longest_pause: 8 * LEAP }
    }

    /// Notes an attempt at sample `k`.
    fn note(&mut self, k: usize, succeeded: bool) {
        if succeeded {
            *self = Self { from: k + LEAP, pause: LEAP, longest_pause: 2 * LEAP };
        } else {
            self.from = k + self.pause;
            self.pause = usize::min(2 * self.pause, self.longest_pause);
        }
    }
}

#[cfg(feature = "std")]
impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Leaps from sample `k`, at which `state` is, to sample `leaps.from`, if possible; whether it was. Then `state` and the values `from`
    /// belong to that sample.
    #[inline(never)]
    pub(super) fn leap(
        &mut self,
        leaps: &mut Leaps,
        forcing: &Forcing,
        k: usize,
        [state, next]: [&mut &mut State; 2],
        from: &mut Values,
    ) -> bool {
        let (excitation, last) = (self.recorder.excitation, k + LEAP);
        let h = excitation.interval(k);
        // The loop of all steps looks up the budget.
        let work = M::WORK * (self.summary.steps + self.summary.rejected) + self.equations.searched();
        let leapt = last < excitation.count()
            && !self.budget.is_due(work)
            && (k + 1..last).all(|k| excitation.interval(k) == h)
            && dispatch(LeapKernel { runner: self, forcing, k, h, state, next });
        leaps.note(k, leapt);
        if leapt {
            core::mem::swap(state, next);
            forcing.sample(excitation, last, from);
            self.summary.steps += 1;
        }
        leapt
    }
}

/// The leap from sample `k` into `next`; false if it is not possible.
#[cfg(feature = "std")]
struct LeapKernel<'s, 'a, 'f, M: Method, C> {
    runner: &'s mut Runner<'a, M, C>,
    forcing: &'f Forcing,
    k: usize,
    h: f64,
    state: &'s State,
    next: &'s mut State,
}

#[cfg(feature = "std")]
impl<M: Method, C: SwitchedEquations> Kernel for LeapKernel<'_, '_, '_, M, C> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let Self { runner, forcing, k, h, state, next } = self;
        let Runner { method, memory, equations, recorder, .. } = runner;
        let Some(leap) = method.leap(memory, equations.equations(), forcing, h) else { return false };
        let mut samples = [[0.0; LEAP + 1]; 9];
        forcing.samples(recorder.excitation, k, &mut samples);
        let bounds = leap.bounds(equations.equations(), state, &samples);
        // The record last: it then counts on the leap.
        let possible = equations.stays_over(&bounds) && recorder.leave_out(LEAP, &bounds.samples);
        if possible {
            *next = leap.apply(state, &samples);
            equations.leapt();
        }
        possible
    }
}

#[cfg(not(feature = "std"))]
impl Leaps {
    pub(super) fn new(_: &Recorder) -> Self {
        Self { from: usize::MAX }
    }
}

#[cfg(not(feature = "std"))]
impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    pub(super) fn leap(
        &mut self,
        _: &mut Leaps,
        _: &Forcing,
        _: usize,
        _: [&mut &mut State; 2],
        _: &mut Values,
    ) -> bool {
        false
    }
}
