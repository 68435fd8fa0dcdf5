//! Which equations hold during a run (a switched system).

use crate::equations::{Equations, LongStepBounds};
use crate::excitation::{Forcing, Ramp, Values};
use crate::system::State;

/// The equations of a run, which may switch at contact changes. By default they never do.
pub(crate) trait SwitchedEquations {
    type Equations: Equations;

    /// The equations that hold now.
    fn equations(&self) -> &Self::Equations;

    /// The fraction of a step from `state` to `next` at which these equations first become invalid, if they do. `between`: the state at a
    /// fraction of this step.
    #[cfg_attr(feature = "std", inline(always))]
    fn first_change(
        &mut self,
        _: &Ramp,
        _: [&State; 2],
        _between: impl FnMut(&Self::Equations, f64) -> State,
    ) -> Option<f64> {
        None
    }

    /// Whether a step of a method without step error stays within these equations, by tests that are cheap and may fail where it does. If
    /// false, nothing in `self` has changed.
    fn stays(&mut self, ramp: &Ramp, state: &State, next: &State) -> bool;

    /// How many of these consecutive steps of `h` s, counted from the first, pass the cheapest of these tests. `values`: at the start of each
    /// step and at the end of the last; `states`: at the end of each. Remembers these steps as `stays` does.
    #[cfg_attr(feature = "std", inline(always))]
    fn steps_without_change(&mut self, _h: f64, _: &Forcing, _values: &[Values], _states: &[State]) -> usize {
        0
    }

    /// Whether a long step within these bounds stays within these equations, by tests that may fail where it does.
    #[inline(always)]
    fn stays_over(&self, _: &LongStepBounds) -> bool {
        false
    }

    /// Forgets what is known from the last step, after a long step.
    #[cfg_attr(feature = "std", inline(always))]
    fn invalidate_bounds(&mut self) {}

    /// The state at the change that was found, if it is known.
    #[cfg_attr(feature = "std", inline(always))]
    fn state_at_change(&self) -> Option<&State> {
        None
    }

    /// Time from `state` to the change that was found, s, if it matters: not where it is located on the exact solution, to rounding.
    #[cfg_attr(feature = "std", inline(always))]
    fn missed_by(&self, _state: &State) -> Option<f64> {
        None
    }

    /// Switches to the equations after the change that ended the step, in `state`.
    #[cfg_attr(feature = "std", inline(always))]
    fn cross(&mut self, _state: &State) {}

    /// Index of each nonlinear link in the system, and the segment of its law that it is on.
    fn segments(&self) -> &[(usize, u8)] {
        &[]
    }

    /// Number of changes so far.
    fn changes(&self) -> usize {
        0
    }

    /// Work of the searches for changes so far, in parts of a power series.
    #[cfg_attr(feature = "std", inline(always))]
    fn searched(&self) -> usize {
        0
    }
}

/// Equations that never switch.
pub(crate) struct Unswitched<'a, E>(pub &'a E);

impl<E: Equations> SwitchedEquations for Unswitched<'_, E> {
    type Equations = E;

    #[cfg_attr(feature = "std", inline(always))]
    fn equations(&self) -> &E {
        self.0
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn stays(&mut self, _: &Ramp, _: &State, _: &State) -> bool {
        true
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn steps_without_change(&mut self, _: f64, _: &Forcing, _: &[Values], states: &[State]) -> usize {
        states.len()
    }

    #[inline(always)]
    fn stays_over(&self, _: &LongStepBounds) -> bool {
        true
    }
}
