//! The exact solution over one step under a force that changes linearly, as matrices.

use super::Equations;
use super::columns::{Columns, three_sums, whole};
use super::exponential::{integrals, matrix, norm_1};
use crate::excitation::Values;
use crate::numeric::float::{add_columns, add_scaled};
use crate::numeric::simd::dispatch;
use crate::system::{Force, State};

/// Exact step of length h: `x(h) = x(0) + E x(0) + B₀ f(0) + B₁ f(h)`, `E = exp(A h) - I`, for a force that is linear in between
/// (first-order hold).
#[derive(Debug, Clone, Copy)]
pub struct Propagator {
    /// E.
    pub(crate) exp_minus_identity: Columns<12>,
    /// Effect of the constant force of the equations.
    pub(crate) from_constant: [f64; 12],
    /// Effects of each component of the excitation: of its value at the start, and at the end.
    pub(crate) from_start: Columns<9>,
    pub(crate) from_end: Columns<9>,
    pub(super) components: usize,
}

impl Propagator {
    /// The exact step of `h` > 0 s. `influence`: modal force of a unit of each component of the excitation. Out of line: a run may need it in
    /// several places, each time it is long and rare.
    #[inline(never)]
    pub(crate) fn new<E: Equations>(equations: &E, influence: &[Force], h: f64) -> Self {
        dispatch!(propagator(equations, influence, h))
    }

    /// The step with this E. `effects`: of each, the first two integrals of the exponential, the influence of the excitation and the constant
    /// force that they are multiplied with; they are added up.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn with_effects(
        exp_minus_identity: &[Columns<6>; 2],
        effects: &[([&Columns<6>; 2], &[Force], &Force)],
        h: f64,
    ) -> Self {
        let (mut from_start, mut from_end, mut from_constant) = ([[0.0; 12]; 9], [[0.0; 12]; 9], [0.0; 12]);
        let mut components = 0;
        for &([once, twice], influence, constant) in effects {
            components = influence.len();
            for (component, force) in influence.iter().enumerate() {
                for j in 0..6 {
                    add_scaled(&mut from_start[component], &once[j], force[j]);
                    add_scaled(&mut from_end[component], &twice[j], force[j] / h);
                }
            }
            add_columns(&mut from_constant, once, constant);
        }
        // f(s) = f(0) + (f(h) - f(0)) s / h, summed over the components.
        for (start, end) in from_start.iter_mut().zip(&from_end).take(components) {
            for i in 0..12 {
                start[i] -= end[i];
            }
        }
        Self {
            exp_minus_identity: *whole(exp_minus_identity),
            from_constant,
            from_start,
            from_end,
            components,
        }
    }

    /// E by columns, and the effects of one component at the start and at the end.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn parts(&self, component: usize) -> (&Columns<12>, &[f64; 12], &[f64; 12]) {
        (&self.exp_minus_identity, &self.from_start[component], &self.from_end[component])
    }

    /// The state at the end of the interval.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn apply(&self, state: &State, start: &Values, end: &Values) -> State {
        // The excitation first, because it does not depend on the state.
        three_sums([self.effect(start, end), *state, [0.0; 12]], &self.exp_minus_identity, state)
    }

    /// The state at the end from zero at the start.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn effect(&self, start: &Values, end: &Values) -> State {
        let mut sum = self.from_constant;
        for j in 0..self.components {
            add_scaled(&mut sum, &self.from_start[j], start[j]);
            add_scaled(&mut sum, &self.from_end[j], end[j]);
        }
        sum
    }
}

/// [`Propagator::new`].
#[cfg_attr(feature = "std", inline(always))]
fn propagator<E: Equations>(equations: &E, influence: &[Force], h: f64) -> Propagator {
    let a = matrix(equations);
    let (exp_minus_identity, [once, twice]) = integrals(&a, norm_1(&a), h);
    Propagator::with_effects(&exp_minus_identity, &[([&once, &twice], influence, equations.constant())], h)
}
