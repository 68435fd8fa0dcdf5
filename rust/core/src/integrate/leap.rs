//! Leaps over many samples at once, where the record needs none of those in between and no contact can change. Only with `std`.

use super::leap_plan::LeapPlan;
use super::method::Method;
use super::step_loop::Runner;
use super::switched::SwitchedEquations;
#[cfg(feature = "std")]
use crate::equations::{LEAP, LeapSamples};
use crate::excitation::{Forcing, Values};
#[cfg(feature = "std")]
use crate::numeric::simd::{Kernel, dispatch};
use crate::system::State;

#[cfg(feature = "std")]
impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Leaps from sample `k`, at which `state` is, if possible; returns the sample reached, to which `state` and `values` then belong.
    #[inline(never)]
    pub(super) fn leap(
        &mut self,
        plan: &mut LeapPlan,
        forcing: &Forcing,
        k: usize,
        [state, next]: [&mut &mut State; 2],
        values: &mut Values,
    ) -> Option<usize> {
        let (excitation, last) = (self.recorder.excitation, k + LEAP);
        let h = excitation.interval(k);
        let leapt = last < excitation.count()
            && !self.budget.is_due(self.work())
            && (k + 1..last).all(|k| excitation.interval(k) == h)
            && dispatch(LeapKernel { runner: self, samples: &mut plan.samples, forcing, k, h, state, next });
        plan.note(k, leapt);
        if !leapt {
            return None;
        }
        core::mem::swap(state, next);
        forcing.sample(excitation, last, values);
        self.summary.steps += 1;
        Some(last)
    }
}

/// The leap from sample `k` into `next`; false if it is not possible.
#[cfg(feature = "std")]
struct LeapKernel<'s, 'a, 'f, M: Method, C> {
    runner: &'s mut Runner<'a, M, C>,
    samples: &'s mut LeapSamples,
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
        let Self { runner, samples, forcing, k, h, state, next } = self;
        let Runner { method, memory, equations, recorder, .. } = runner;
        let Some(leap) = method.leap(memory, equations.equations(), forcing, h) else { return false };
        forcing.samples(recorder.excitation, k, samples);
        let bounds = leap.bounds(equations.equations(), forcing, samples, state);
        // The record is asked last: one that agrees counts these samples as passed.
        let possible = equations.stays_over(&bounds) && recorder.leave_out(LEAP, &bounds.samples);
        if possible {
            *next = leap.apply(samples, state);
            equations.leapt();
        }
        possible
    }
}

#[cfg(not(feature = "std"))]
impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    pub(super) fn leap(
        &mut self,
        _: &mut LeapPlan,
        _: &Forcing,
        _: usize,
        _: [&mut &mut State; 2],
        _: &mut Values,
    ) -> Option<usize> {
        None
    }
}
