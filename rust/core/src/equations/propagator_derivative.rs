//! Derivatives of the exact step by numbers of the equations (Fréchet derivative of the exponential).

use super::Equations;
use super::columns::{Columns, add_product, identity};
use super::exponential::{Block, integrals, matrix, norm_1};
use super::propagator::Propagator;
use crate::excitation::Forcing;
use crate::numeric::simd::dispatch;
use crate::system::Force;

/// Derivatives of linear equations by one number, at a fixed state and input.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EquationsDerivative {
    /// Of A, by columns.
    pub matrix: Columns<12>,
    /// Of the modal force of a unit of each component of an input.
    pub influence: [Force; 9],
    /// Of the constant force.
    pub constant: Force,
}

impl Propagator {
    /// The exact step of `h` > 0 s, and its derivatives by some numbers, by the product rule for every operation: exact for defective,
    /// overdamped and undamped equations, and for repeated eigenvalues. A derivative of the step is a step whose parts are derivatives:
    /// `x'(h) = (I + E) x'(0) + E' x(0) + (effects of the excitation)'`.
    #[inline(always)]
    pub(crate) fn with_derivatives<E: Equations>(
        equations: &E,
        by: &[EquationsDerivative],
        forcing: &Forcing,
        h: f64,
    ) -> (Self, Vec<Self>) {
        let half = |of: usize, value| {
            let slopes = by.iter().map(|by| by.matrix.as_chunks::<6>().0[of]).collect();
            Dual { value, slopes }
        };
        let a = matrix(equations);
        let (e, [once, twice]) = integrals(&[half(0, a[0]), half(1, a[1])], norm_1(&a), h);
        let (influence, constant) = (forcing.influence(), equations.constant());
        let integrals = [&once.value, &twice.value];
        let step = Self::with_effects(&[e[0].value, e[1].value], &[(integrals, influence, constant)], h);
        let mut derivatives = Vec::with_capacity(by.len());
        for (column, by) in by.iter().enumerate() {
            let slopes = [&once.slopes[column], &twice.slopes[column]];
            let mut turned = [[0.0; 8]; 9];
            for (to, &component) in turned.iter_mut().zip(forcing.components()) {
                *to = by.influence[component];
            }
            let effects =
                [(slopes, influence, constant), (integrals, &turned[..influence.len()], &by.constant)];
            let e = [e[0].slopes[column], e[1].slopes[column]];
            derivatives.push(Self::with_effects(&e, &effects, h));
        }
        (step, derivatives)
    }
}

/// Numbers with their derivatives (dual numbers).
#[derive(Clone)]
struct Dual {
    value: Columns<6>,
    /// By each number of the equations.
    slopes: Vec<Columns<6>>,
}

impl Block for Dual {
    /// Derivatives of terms are of lower order in A.
    const MORE_TERMS: usize = 2;

    fn identity(&self) -> Self {
        self.constant(identity(6))
    }

    fn product(matrix: &[Self; 2], right: &Self) -> Self {
        let mut out = right.constant([[0.0; 12]; 6]);
        matrix[0].add_times::<0>(right, &mut out);
        matrix[1].add_times::<6>(right, &mut out);
        out
    }

    fn times_last_rows(&self, right: &Self) -> Self {
        let mut out = right.constant([[0.0; 12]; 6]);
        self.add_times::<6>(right, &mut out);
        out
    }

    #[inline(always)]
    fn add_scaled(&mut self, other: &Self, factor: f64) {
        self.value.add_scaled(&other.value, factor);
        for (slope, other) in self.slopes.iter_mut().zip(&other.slopes) {
            slope.add_scaled(other, factor);
        }
    }

    #[inline(always)]
    fn scale(&mut self, factor: f64) {
        self.value.scale(factor);
        for slope in &mut self.slopes {
            slope.scale(factor);
        }
    }
}

impl Dual {
    /// These numbers as constants, with as many derivatives.
    fn constant(&self, value: Columns<6>) -> Self {
        Self { value, slopes: vec![[[0.0; 12]; 6]; self.slopes.len()] }
    }

    /// Adds these columns times the rows of `right` from ROW on.
    #[inline(never)]
    fn add_times<const ROW: usize>(&self, right: &Self, sum: &mut Self) {
        dispatch!(add_times::<ROW>(self, right, sum));
    }
}

/// [`Dual::add_times`].
#[inline(always)]
fn add_times<const ROW: usize>(left: &Dual, right: &Dual, sum: &mut Dual) {
    add_product::<ROW, 6, 6>(&mut sum.value, &left.value, &right.value);
    for (sum, (of_left, of_right)) in sum.slopes.iter_mut().zip(left.slopes.iter().zip(&right.slopes)) {
        add_product::<ROW, 6, 6>(sum, of_left, &right.value);
        add_product::<ROW, 6, 6>(sum, &left.value, of_right);
    }
}
