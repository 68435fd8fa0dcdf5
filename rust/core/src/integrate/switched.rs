//! Which equations hold during a run (a switched system).

use crate::contacts::Contacts;
use crate::equations::Equations;
use crate::equations::SegmentEquations;
use crate::excitation::Ramp;
use crate::system::State;

/// The equations of a run, which may switch at contact changes.
pub(super) trait SwitchedEquations {
    type Equations: Equations;

    /// The equations that hold now.
    fn equations(&self) -> &Self::Equations;

    /// The fraction of a step from `state` to `next` at which these equations first become invalid, if they do.
    fn first_change(&mut self, ramp: &Ramp, state: &State, next: &State) -> Option<f64>;

    /// Switches to the equations after the change that ended the step, in `state`.
    fn cross(&mut self, state: &State);

    /// Number of changes so far.
    fn changes(&self) -> usize;

    /// Number of parts of steps searched for changes so far.
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
    fn first_change(&mut self, _: &Ramp, _: &State, _: &State) -> Option<f64> {
        None
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn cross(&mut self, _: &State) {}

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
    fn first_change(&mut self, ramp: &Ramp, state: &State, next: &State) -> Option<f64> {
        Contacts::first_change(self, ramp, state, next)
    }

    fn cross(&mut self, state: &State) {
        Contacts::cross(self, state);
    }

    fn changes(&self) -> usize {
        self.changes
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn searched(&self) -> usize {
        self.searched
    }
}
