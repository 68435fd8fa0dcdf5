//! What an integrator provides.

use crate::equations::Equations;
use crate::excitation::Ramp;
use crate::system::State;

/// An integrator: advances the state over one step of given length.
pub trait Method {
    /// Memory of one run: stages, factorisations.
    type Memory;
    /// Order of the error estimate of [`Method::step`]; none for a method without step error.
    const ERROR_ORDER: Option<u32>;

    /// Memory for one run.
    fn memory(&self) -> Self::Memory;

    /// The state after the step that starts in `state`, and its estimated error.
    fn step<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
    ) -> (State, State);

    /// Dense output: the state at the fraction `theta` of the step that [`Method::step`] made last, from `state`.
    fn between<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
        theta: f64,
    ) -> State;
}
