//! The derivative of one figure of a linear run by all columns, backwards in time.
//!
//! A figure J enters by its derivatives `g_k` by the state at each sample. The adjoint state `λ_k = (I + E)ᵀ λ_{k+1} + g_k` is that of every
//! column, and `dJ = Σ λ_{k+1} · D (s_k, u_k, u_{k+1}, 1)` needs each column only once for each length of interval, for the sum of the
//! outer products.

use super::tangents::{Interval, LinearRun, Prepared};
use crate::equations::Propagator;
use crate::numeric::float::{add_scaled, dot};
use crate::numeric::simd::dispatch;
use crate::system::State;

/// Sum of `λ (s_k, u_k, u_{k+1}, 1)ᵀ` over the intervals of a length, by columns.
#[derive(Clone)]
struct Products {
    state: [[f64; 12]; 12],
    start: [[f64; 12]; 9],
    end: [[f64; 12]; 9],
    constant: [f64; 12],
}

impl Products {
    const NONE: Self =
        Self { state: [[0.0; 12]; 12], start: [[0.0; 12]; 9], end: [[0.0; 12]; 9], constant: [0.0; 12] };

    /// The sum with the derivative of the step by a column.
    fn with(&self, by: &Propagator) -> f64 {
        dot(self.state.as_flattened(), by.exp_minus_identity.as_flattened())
            + dot(self.start.as_flattened(), by.from_start.as_flattened())
            + dot(self.end.as_flattened(), by.from_end.as_flattened())
            + dot(&self.constant, &by.from_constant)
    }
}

/// Derivatives of a figure by each column through the states. `by_state`: its derivatives by the state at each sample.
pub(super) fn through_states(run: LinearRun, prepared: &Prepared, by_state: &[State]) -> Vec<f64> {
    let Prepared { columns, recurring, .. } = prepared;
    let (products, first) = dispatch!(backwards(run, prepared, by_state));
    let mut out: Vec<f64> = (0..columns.len())
        .map(|column| {
            products.iter().zip(recurring).map(|(products, of)| products.with(&of.derivatives[column])).sum()
        })
        .collect();
    if run.quasi_static {
        for (out, column) in out.iter_mut().zip(columns) {
            let tangent = column.quasi_static(run.varied, &run.states[0], &run.excitation.input(0));
            *out += dot(&tangent, &first);
        }
    }
    out
}

#[cfg_attr(feature = "std", inline(always))]
fn backwards(run: LinearRun, prepared: &Prepared, by_state: &[State]) -> (Vec<Products>, State) {
    let Prepared { intervals, recurring, forcing, .. } = prepared;
    let mut products = vec![Products::NONE; recurring.len()];
    let mut transposed = Vec::with_capacity(recurring.len());
    for of in recurring {
        transposed.push(core::array::from_fn::<[f64; 12], 12, _>(|j| {
            of.propagator.exp_minus_identity.map(|column| column[j])
        }));
    }
    let mut adjoint = by_state[by_state.len() - 1];
    for (k, interval) in intervals.iter().enumerate().rev() {
        if let Interval::Propagator(index) = interval
            && adjoint != [0.0; 12]
        {
            let to = &mut products[*index];
            for (column, &factor) in to.state.iter_mut().zip(&run.states[k]) {
                add_scaled(column, &adjoint, factor);
            }
            for (place, &component) in forcing.components().iter().enumerate() {
                add_scaled(&mut to.start[place], &adjoint, run.excitation.component(k, component));
                add_scaled(&mut to.end[place], &adjoint, run.excitation.component(k + 1, component));
            }
            add_scaled(&mut to.constant, &adjoint, 1.0);
            let (mut back, mut second) = (adjoint, [0.0; 12]);
            for j in (0..12).step_by(2) {
                add_scaled(&mut back, &transposed[*index][j], adjoint[j]);
                add_scaled(&mut second, &transposed[*index][j + 1], adjoint[j + 1]);
            }
            add_scaled(&mut back, &second, 1.0);
            adjoint = back;
        }
        add_scaled(&mut adjoint, &by_state[k], 1.0);
    }
    (products, adjoint)
}
