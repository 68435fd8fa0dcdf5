//! The equations of motion that an integrator solves: linear, linear on the present segments, or smooth.
//!
//! In the energy coordinates of `system`, with the elastic loads above those at rest:
//!
//! ```text
//! d/dt (ω η) =  ω η'
//! d/dt  η'   = -S (ω η) - Ĉ η' + c + f(t) - (nonlinear loads)
//! ```
//!
//! `linear`, `piecewise`, `smooth`: the three kinds; `ball_links`, `riding`: what preloaded balls and moving riders add to the third.
//! `columns`, `exponential`: matrices, and the exponential of that of the linear part; `propagator`, `series`, `cubic`: the exact solution of this part over one step;
//! `propagator_derivative`: its derivatives; `sampled`: at a fixed period; `two_steps`, `long_step`: over two and many steps; `linearized`: steps and long steps of preloaded scenes near an equilibrium;
//! `side_by_side`: steps of some preloaded scenes at once.

mod ball_links;
mod columns;
mod cubic;
mod exponential;
mod linear;
mod linearized;
mod long_step;
mod piecewise;
mod propagator;
#[cfg(feature = "studies")]
mod propagator_derivative;
mod riding;
mod sampled;
mod series;
#[cfg(feature = "studies")]
mod side_by_side;
mod smooth;
mod two_steps;

#[cfg(feature = "studies")]
pub(crate) use columns::three_sums;
pub use cubic::CubicPropagator;
pub(crate) use cubic::{CubicStep, advance_cubic};
#[cfg(feature = "studies")]
pub(crate) use exponential::series_terms;
pub use linearized::Linearized;
pub use long_step::LongStep;
pub(crate) use long_step::{LONG_STEP, LongStepBounds, LongStepSamples};
pub(crate) use piecewise::SegmentEquations;
pub use propagator::Propagator;
#[cfg(feature = "studies")]
pub(crate) use propagator_derivative::EquationsDerivative;
pub(crate) use riding::Riders;
pub use riding::StageData;
pub use sampled::SampledSystem;
pub(crate) use series::{CubicForce, PowerSeries, advance, power_series, work};
#[cfg(feature = "studies")]
pub(crate) use side_by_side::{BallScenes, Forces, Propagators, Remainders, States, number, plus};
pub(crate) use smooth::SmoothEquations;
pub use two_steps::TwoSteps;

use crate::excitation::{Instant, Ramp};
use crate::numeric::float::{fma, sqrt};
use crate::system::{Force, NO_FORCE, Square, State, StateBox};

/// Nonlinear loads beyond the linear part of the equations.
#[derive(Debug, Clone, Copy)]
pub struct Remainder {
    /// Their modal force, and its rate of change along the motion.
    pub(crate) force: Force,
    pub(crate) rate: Force,
    /// Which rows of rolling elements are open: a number that changes whenever one opens or closes.
    pub(crate) contact_signature: f64,
}

impl Remainder {
    pub(crate) const NONE: Self = Self { force: NO_FORCE, rate: NO_FORCE, contact_signature: 0.0 };
}

/// Equations of motion over one or more steps.
pub trait Equations {
    /// Whether other equations hold after a contact change.
    const PIECEWISE: bool;
    /// Whether the rate is linear in the state, so that one factorisation serves every state.
    const LINEAR: bool;

    /// Key: within one run equations with the same key have the same matrices.
    fn key(&self) -> u32;

    /// Angular frequencies ω of the coordinates.
    fn frequency(&self) -> &[f64; 6];

    /// The linear part of the rate of change under the modal force `force`: `A s + (0, f)`.
    fn linear(&self, state: &State, force: &Force) -> State;

    /// The constant part of the modal force.
    fn constant(&self) -> &Force;

    /// Computes what depends on the instant alone, at these fractions of a step, at most eight: only with moving riders.
    #[cfg_attr(feature = "std", inline(always))]
    fn prepare(&self, _: &Ramp, _: &[f64], _: &mut StageData) {}

    /// The whole rate of change of a state under the modal force `force`, at one of the stage_data.
    fn rate(&self, state: &State, force: &Force, at: (&StageData, usize)) -> State;

    /// The nonlinear loads of a state beyond the linear part of the equations.
    #[cfg_attr(feature = "std", inline(always))]
    fn remainder(&self, _: &State) -> Remainder {
        Remainder::NONE
    }

    /// Bounds on the modal force, entry by entry, by which the loads of any state in the box differ from those of the tangent at the state
    /// `at`; infinite if a row opens or closes in the box.
    fn tangent_error(&self, _at: &State, _states: &StateBox) -> Force {
        [f64::INFINITY; NO_FORCE.len()]
    }

    /// Number of links that have other rows open in one state than in another.
    fn changed_rows(&self, _: &State, _: &State) -> usize {
        0
    }

    /// Stiffness S (columns, per unit of `ω η`) and damping Ĉ (columns) of the tangent at a state and an instant.
    fn tangent(&self, state: &State, at: Instant) -> (Square, Square);
}

/// Bound on the growth rate of `|exp(A t)|`: `|S - ω| / 2`. All else in A turns a state or, as the dampers, shortens it.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn growth_rate<E: Equations>(equations: &E) -> f64 {
    let (stiffness, _) = equations.tangent(&[0.0; 12], Instant::FIRST);
    let (mut rows, mut column): ([f64; 6], f64) = ([0.0; 6], 0.0);
    for j in 0..6 {
        let mut sum = 0.0;
        for i in 0..6 {
            let off = (stiffness[j][i] - if i == j { equations.frequency()[j] } else { 0.0 }).abs();
            rows[i] += off;
            sum += off;
        }
        column = f64::max(column, sum);
    }
    let mut row = 0.0;
    for sum in rows {
        row = f64::max(row, sum);
    }
    0.5 * sqrt(row * column)
}

/// Bound on the growth of a state without force in a time h, for this growth rate: `exp(x) <= 1 + x + x²` up to x = 1.25; infinite beyond.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn growth(rate: f64, h: f64) -> f64 {
    let x = rate * h;
    if x <= 1.25 { fma(x, x, x) + 1.0 } else { f64::INFINITY }
}
