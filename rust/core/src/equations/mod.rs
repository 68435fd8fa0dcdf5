//! The equations of motion as a method sees them: linear, linear between two contact changes, or smooth.
//!
//! In the energy coordinates of [`crate::system`], with the links' elastic forces beyond those of the static position:
//!
//! ```text
//! d/dt (ω η) =  ω η'
//! d/dt  η'   = -S (ω η) - Ĉ η' + c + f(t) - (what is not linear)
//! ```

mod linear;
mod piecewise;
mod propagator;
mod series;
mod smooth;

pub(crate) use piecewise::SegmentEquations;
pub(crate) use propagator::{Propagator, TERMS};
pub(crate) use series::{PowerSeries, advance};
pub(crate) use smooth::SmoothEquations;

use crate::system::{Force, Square, State};

/// Equations of motion that a method steps over.
pub trait Equations {
    /// Whether the equations change at contacts.
    const PIECEWISE: bool;
    /// Whether the rate is linear in the state: one factorisation serves every state.
    const LINEAR: bool;

    /// Tells equations of one run apart: those of one key have the same matrices.
    fn key(&self) -> u32;

    /// Angular frequencies ω of the coordinates.
    fn frequency(&self) -> &[f64; 6];

    /// The linear part of the rate of change under the modal force `force`: `A s + (0, f)`.
    fn linear(&self, state: &State, force: &Force) -> State;

    /// The constant part of the modal force.
    fn constant(&self) -> &Force;

    /// Rate of change of a state under the modal force `force`: all of it.
    fn rate(&self, state: &State, force: &Force) -> State;

    /// Stiffness S (columns, per unit of `ω η`) and damping Ĉ (columns) of the tangent at a state.
    fn tangent(&self, state: &State) -> (Square, Square);
}
