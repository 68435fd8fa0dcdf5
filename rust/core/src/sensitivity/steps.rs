//! Steps of the derivatives of a state: over a length of interval that recurs, and by power series.

use crate::equations::{
    Equations, EquationsDerivative, PowerSeries, Propagator, power_series, series_terms, three_sums,
};
use crate::excitation::{Forcing, Values, between};
use crate::numeric::float::{add_columns, add_scaled, scale, times};
use crate::numeric::simd::dispatch;
use crate::system::{Force, Input, NO_FORCE, State};

/// A length of interval that recurs: its propagator, and the derivatives of that by each column.
pub(super) struct Recurring {
    /// s.
    pub length: f64,
    pub propagator: Propagator,
    pub derivatives: Vec<Propagator>,
}

impl Recurring {
    /// For a length of interval.
    pub(super) fn new<E: Equations>(
        equations: &E,
        columns: &[EquationsDerivative],
        forcing: &Forcing,
        length: f64,
    ) -> Self {
        let (propagator, derivatives) =
            dispatch!(Propagator::with_derivatives(equations, columns, forcing, length));
        Self { length, propagator, derivatives }
    }

    /// The tangent of a column at the end of the interval.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn step(&self, column: usize, tangent: &State, state: &State, ends: &[Values; 2]) -> State {
        let (none, by) = ([0.0; 12], &self.derivatives[column]);
        let fixed = three_sums([by.effect(&ends[0], &ends[1]), none, none], &by.exp_minus_identity, state);
        three_sums([fixed, *tangent, none], &self.propagator.exp_minus_identity, tangent)
    }
}

/// Largest number of terms of the series over a part of an interval whose norm is at most one, and the smallest term: 1/24!, for derivatives
/// of high order relative to the state.
const TERMS: usize = 24;
const SMALLEST: f64 = 1.6e-24;

/// Passes an interval, which may be negative, by power series of the state and its derivatives. Returns the state at its end.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn by_series<E: Equations>(
    equations: &E,
    influence: &[Force; 9],
    (columns, series): (&[EquationsDerivative], &PowerSeries),
    (length, state, ends): (f64, &State, &[Input; 2]),
    tangents: &mut [State],
) -> State {
    let parts = series.parts(length.abs());
    let tau = length / parts;
    let count = series_terms(series.norm(tau), SMALLEST).clamp(2, TERMS);
    let mut start = *state;
    let mut part = 0.0;
    while part < parts {
        let theta = part / parts;
        let input = between(ends, theta);
        let rise: Input = core::array::from_fn(|i| (ends[1][i] - ends[0][i]) / parts);
        let mut forces = [times(influence, &input), times(influence, &rise)];
        add_scaled(&mut forces[0], equations.constant(), 1.0);
        let mut terms = [start; TERMS + 1];
        power_series(equations, tau, &forces, &start, count, &mut terms);
        for (tangent, by) in tangents.iter_mut().zip(columns) {
            let mut forces = [times(&by.influence, &input), times(&by.influence, &rise)];
            add_scaled(&mut forces[0], &by.constant, 1.0);
            let mut term = *tangent;
            for k in 0..count {
                let force = if k < 2 { &forces[k] } else { &NO_FORCE };
                term = equations.linear(&term, force);
                add_columns(&mut term, &by.matrix, &terms[k]);
                scale(&mut term, tau / (k + 1) as f64);
                add_scaled(tangent, &term, 1.0);
            }
        }
        for term in &terms[1..=count] {
            add_scaled(&mut start, term, 1.0);
        }
        part += 1.0;
    }
    start
}
