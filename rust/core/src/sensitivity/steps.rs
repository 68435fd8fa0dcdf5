//! Steps of the derivatives of a state: over a length of interval that recurs, and by power series.

use super::system::VariedSystem;
use crate::equations::{Equations, EquationsDerivative, PowerSeries, PropagatorDerivative, PropagatorStages};
use crate::numeric::float::{add_columns, add_scaled, scale, times};
use crate::system::{Force, Input, NO_FORCE, State};

/// A length of interval that recurs: E, and the derivatives of the propagator by each column.
pub(super) struct Recurring {
    /// s.
    pub length: f64,
    pub exp_minus_identity: [[f64; 12]; 12],
    pub derivatives: Vec<PropagatorDerivative>,
}

impl Recurring {
    /// The tangent of a column at the end of the interval.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn step(
        &self,
        column: usize,
        tangent: &State,
        state: &State,
        ends: [&Input; 2],
        components: &[usize],
    ) -> State {
        let (mut sum, mut second) = (*tangent, [0.0; 12]);
        self.derivatives[column].add_to(&mut sum, state, ends, components);
        for j in (0..12).step_by(2) {
            add_scaled(&mut sum, &self.exp_minus_identity[j], tangent[j]);
            add_scaled(&mut second, &self.exp_minus_identity[j + 1], tangent[j + 1]);
        }
        for i in 0..12 {
            sum[i] += second[i];
        }
        sum
    }
}

/// The propagator of a length of interval, and its derivatives by all columns.
#[inline(always)]
pub(super) fn derivatives<E: Equations>(
    equations: &E,
    varied: &VariedSystem,
    columns: &[EquationsDerivative],
    length: f64,
) -> Recurring {
    let stages = PropagatorStages::new(equations, length);
    let (influence, constant) = (varied.system.influence(), equations.constant());
    let mut derivatives = Vec::with_capacity(columns.len());
    for column in columns {
        derivatives.push(stages.derivative(column, influence, constant));
    }
    Recurring { length, exp_minus_identity: *stages.exp_minus_identity(), derivatives }
}

/// Largest number of terms of the series over a part of an interval whose norm is at most one, and the smallest term: 1/24!, for derivatives
/// of high order relative to the state.
const TERMS: usize = 24;
const SMALLEST: f64 = 1.6e-24;

/// Number of terms of the series over a part of this norm.
fn terms_for(norm: f64) -> usize {
    let (mut terms, mut size) = (1, norm);
    while size > SMALLEST && terms < TERMS {
        terms += 1;
        size *= norm / terms as f64;
    }
    usize::max(terms, 2)
}

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
    let count = terms_for(series.norm(tau));
    let mut start = *state;
    let mut part = 0.0;
    while part < parts {
        let theta = part / parts;
        let input: Input = core::array::from_fn(|i| ends[0][i] + theta * (ends[1][i] - ends[0][i]));
        let rise: Input = core::array::from_fn(|i| (ends[1][i] - ends[0][i]) / parts);
        let mut forces = [times(influence, &input), times(influence, &rise)];
        add_scaled(&mut forces[0], equations.constant(), 1.0);
        let mut terms = [start; TERMS + 1];
        for k in 0..count {
            let force = if k < 2 { &forces[k] } else { &NO_FORCE };
            terms[k + 1] = equations.linear(&terms[k], force);
            scale(&mut terms[k + 1], tau / (k + 1) as f64);
        }
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
