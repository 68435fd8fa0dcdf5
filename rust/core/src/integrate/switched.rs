//! Which equations hold during a run (a switched system).

use super::method::Method;
use crate::contacts::{Contacts, DENSE_POINTS, SmoothContacts};
#[cfg(feature = "std")]
use crate::equations::LeapBounds;
use crate::equations::{Equations, SegmentEquations, SmoothEquations};
use crate::excitation::Ramp;
#[cfg(feature = "std")]
use crate::excitation::{Forcing, Values};
use crate::system::State;

/// The equations of a run, which may switch at contact changes.
pub(super) trait SwitchedEquations {
    type Equations: Equations;

    /// The equations that hold now.
    fn equations(&self) -> &Self::Equations;

    /// The fraction of a step from `state` to `next`, the last step of the `method`, at which these equations first become invalid, if they
    /// do.
    fn first_change<M: Method>(
        &mut self,
        method: &M,
        memory: &mut M::Memory,
        ramp: &Ramp,
        state: &State,
        next: &State,
    ) -> Option<f64>;

    /// Whether a step of a method without step error stays within these equations, by tests that are cheap and may fail where it does.
    fn stays(&mut self, ramp: &Ramp, state: &State, next: &State) -> bool;

    /// How many of these consecutive steps of `h` s, counted from the first, pass the cheapest of these tests. `values`: at the start of each
    /// step and at the end of the last; `states`: at the end of each.
    #[cfg(feature = "std")]
    #[inline(always)]
    fn stays_near(&mut self, _h: f64, _: &Forcing, _values: &[Values], _states: &[State]) -> usize {
        0
    }

    /// Whether a leap within these bounds stays within these equations, by tests that may fail where it does.
    #[cfg(feature = "std")]
    #[inline(always)]
    fn stays_over(&self, _: &LeapBounds) -> bool {
        false
    }

    /// Called after a leap.
    #[cfg(feature = "std")]
    #[inline(always)]
    fn leapt(&mut self) {}

    /// The state at the change that was found, if it is known.
    #[cfg_attr(feature = "std", inline(always))]
    fn state_at_change(&self) -> Option<&State> {
        None
    }

    /// Time from `state` to the change that was found, s, if it matters.
    fn missed_by(&self, state: &State) -> Option<f64>;

    /// Switches to the equations after the change that ended the step, in `state`.
    fn cross(&mut self, state: &State);

    /// Index of each nonlinear link in the system, and the segment of its law that it is on.
    fn segments(&self) -> &[(usize, u8)];

    /// Number of changes so far.
    fn changes(&self) -> usize;

    /// Work of the searches for changes so far, in parts of a power series.
    fn searched(&self) -> usize;
}

/// Equations that never switch.
pub(super) struct Unswitched<'a, E>(pub &'a E);

impl<E: Equations> SwitchedEquations for Unswitched<'_, E> {
    type Equations = E;

    #[cfg_attr(feature = "std", inline(always))]
    fn equations(&self) -> &E {
        self.0
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn first_change<M: Method>(
        &mut self,
        _: &M,
        _: &mut M::Memory,
        _: &Ramp,
        _: &State,
        _: &State,
    ) -> Option<f64> {
        None
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn stays(&mut self, _: &Ramp, _: &State, _: &State) -> bool {
        true
    }

    #[cfg(feature = "std")]
    #[inline(always)]
    fn stays_near(&mut self, _: f64, _: &Forcing, _: &[Values], states: &[State]) -> usize {
        states.len()
    }

    #[cfg(feature = "std")]
    #[inline(always)]
    fn stays_over(&self, _: &LeapBounds) -> bool {
        true
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn missed_by(&self, _: &State) -> Option<f64> {
        None
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn cross(&mut self, _: &State) {}

    fn segments(&self) -> &[(usize, u8)] {
        &[]
    }

    fn changes(&self) -> usize {
        0
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn searched(&self) -> usize {
        0
    }
}

impl SwitchedEquations for Contacts<'_> {
    type Equations = SegmentEquations;

    #[cfg_attr(feature = "std", inline(always))]
    fn equations(&self) -> &SegmentEquations {
        Contacts::equations(self)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn first_change<M: Method>(
        &mut self,
        _: &M,
        _: &mut M::Memory,
        ramp: &Ramp,
        state: &State,
        next: &State,
    ) -> Option<f64> {
        Contacts::first_change(self, ramp, state, next)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn stays(&mut self, ramp: &Ramp, state: &State, next: &State) -> bool {
        Contacts::stays(self, ramp, state, next)
    }

    #[cfg(feature = "std")]
    #[inline(always)]
    fn stays_near(&mut self, h: f64, forcing: &Forcing, values: &[Values], states: &[State]) -> usize {
        Contacts::stays_near(self, h, forcing, values, states)
    }

    #[cfg(feature = "std")]
    #[inline(always)]
    fn stays_over(&self, bounds: &LeapBounds) -> bool {
        Contacts::stays_over(self, bounds)
    }

    #[cfg(feature = "std")]
    #[inline(always)]
    fn leapt(&mut self) {
        Contacts::leapt(self);
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn state_at_change(&self) -> Option<&State> {
        Contacts::state_at_change(self)
    }

    /// Located on the exact solution, to rounding.
    #[cfg_attr(feature = "std", inline(always))]
    fn missed_by(&self, _: &State) -> Option<f64> {
        None
    }

    fn cross(&mut self, state: &State) {
        Contacts::cross(self, state);
    }

    fn segments(&self) -> &[(usize, u8)] {
        self.present()
    }

    fn changes(&self) -> usize {
        self.changes
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn searched(&self) -> usize {
        self.searched
    }
}

impl<'a> SwitchedEquations for SmoothContacts<'a> {
    type Equations = SmoothEquations<'a>;

    #[cfg_attr(feature = "std", inline(always))]
    fn equations(&self) -> &SmoothEquations<'a> {
        SmoothContacts::equations(self)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn first_change<M: Method>(
        &mut self,
        method: &M,
        memory: &mut M::Memory,
        ramp: &Ramp,
        state: &State,
        next: &State,
    ) -> Option<f64> {
        if self.far_from_edges(ramp.h, state, next) {
            return None;
        }
        let mut path = [*state; DENSE_POINTS];
        path[DENSE_POINTS - 1] = *next;
        for point in 1..DENSE_POINTS - 1 {
            let theta = point as f64 / (DENSE_POINTS - 1) as f64;
            path[point] = method.between(self.equations(), memory, ramp, state, theta);
        }
        SmoothContacts::first_change(self, ramp.h, &path)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn stays(&mut self, _: &Ramp, _: &State, _: &State) -> bool {
        false
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn missed_by(&self, state: &State) -> Option<f64> {
        SmoothContacts::missed_by(self, state)
    }

    fn cross(&mut self, state: &State) {
        SmoothContacts::cross(self, state);
    }

    fn segments(&self) -> &[(usize, u8)] {
        self.present()
    }

    fn changes(&self) -> usize {
        self.changes
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn searched(&self) -> usize {
        SmoothContacts::searched(self)
    }
}
