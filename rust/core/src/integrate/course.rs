//! Which equations hold, step by step.

use super::Ramp;
use crate::contacts::Contacts;
use crate::equations::Equations;
use crate::piece::Piece;
use crate::system::State;

/// The equations of a run from its first step to its last.
pub(super) trait Course {
    type Equations: Equations;

    /// Those that hold now.
    fn equations(&self) -> &Self::Equations;

    /// The fraction of a step from `state` to `next` at which they first cease to hold, if they do.
    fn first_change(&mut self, ramp: &Ramp, state: &State, next: &State) -> Option<f64>;

    /// The step ended, in `state`, with the change.
    fn cross(&mut self, state: &State);

    /// Changes so far.
    fn changes(&self) -> usize;

    /// Parts of steps that were looked into for them.
    fn searched(&self) -> usize;
}

/// One set of equations throughout.
pub(super) struct Steady<'a, E>(pub &'a E);

impl<E: Equations> Course for Steady<'_, E> {
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

impl Course for Contacts<'_> {
    type Equations = Piece;

    #[cfg_attr(feature = "std", inline(always))]
    fn equations(&self) -> &Piece {
        self.piece()
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
