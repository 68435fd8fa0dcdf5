//! The equations of a linear scene: a [`System`] by itself.

use super::{Equations, StageData};
use crate::excitation::Instant;
use crate::system::{Force, NO_FORCE, Square, State, System};

impl Equations for System {
    const PIECEWISE: bool = false;
    const LINEAR: bool = true;

    #[cfg_attr(feature = "std", inline(always))]
    fn key(&self) -> u32 {
        0
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn frequency(&self) -> &[f64; 6] {
        &self.frequency
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn linear(&self, state: &State, force: &Force) -> State {
        self.linear_rate(state, force)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn constant(&self) -> &Force {
        &NO_FORCE
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn rate(&self, state: &State, force: &Force, _: (&StageData, usize)) -> State {
        self.linear_rate(state, force)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn tangent(&self, _: &State, _: Instant) -> (Square, Square) {
        let mut stiffness = [[0.0; 6]; 6];
        for (i, column) in stiffness.iter_mut().enumerate() {
            column[i] = self.frequency[i];
        }
        (stiffness, self.damping)
    }
}
