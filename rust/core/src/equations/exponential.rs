//! `exp(A h) - I` and the integrals of `exp(A s)`, of plain numbers or of numbers with their derivatives.

use super::Equations;
use super::columns::{Columns, identity, product, scale_by, whole};
use crate::numeric::float::add_scaled;
use crate::system::NO_FORCE;

/// Term of a series for a norm of at most one that is below rounding.
const LEAST_TERM: f64 = 1e-17;

/// Six columns of twelve numbers, with which all operations of the exponential are done. A square matrix is two of them.
pub(super) trait Block: Clone {
    /// Terms of a series beyond those that plain numbers need.
    const MORE_TERMS: usize;

    /// The columns of the identity that a force acts on; they are constant.
    fn identity(&self) -> Self;

    /// A matrix times `right`.
    fn product(matrix: &[Self; 2], right: &Self) -> Self;

    /// These columns times the last six rows of `right`.
    fn times_last_rows(&self, right: &Self) -> Self;

    fn add_scaled(&mut self, other: &Self, factor: f64);

    fn scale(&mut self, factor: f64);
}

impl Block for Columns<6> {
    const MORE_TERMS: usize = 0;

    #[cfg_attr(feature = "std", inline(always))]
    fn identity(&self) -> Self {
        identity(6)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn product(matrix: &[Self; 2], right: &Self) -> Self {
        product::<0, 12, 6>(whole(matrix), right)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn times_last_rows(&self, right: &Self) -> Self {
        product::<6, 6, 6>(self, right)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn add_scaled(&mut self, other: &Self, factor: f64) {
        for (column, other) in self.iter_mut().zip(other) {
            add_scaled(column, other, factor);
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn scale(&mut self, factor: f64) {
        scale_by(self, factor);
    }
}

/// `E = exp(A h) - I`, and the first to the Nth integral over h of `exp(A s)`, of which only the columns of the force are needed.
///
/// Scaling and doubling are applied to all of them together, which works for defective, overdamped and undamped matrices. E is used instead
/// of `exp(A h)`, because `1 + E` would lose digits of a slow mode of a strongly damped machine, twice as many with every doubling. In
/// energy coordinates `|exp(A τ)| <= 1`, so nothing grows (cf. Higham 2005; Moler & Van Loan 2003, method 3). `norm`: of A.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn integrals<B: Block, const N: usize>(a: &[B; 2], norm: f64, h: f64) -> ([B; 2], [B; N]) {
    let norm = h * norm;
    let mut halvings = 0;
    let mut scale = 1.0;
    while norm * scale > 1.0 {
        scale *= 0.5;
        halvings += 1;
    }
    // Beyond the range of numbers nothing is left of a step; NaN tells the run.
    let mut tau = if norm < f64::INFINITY { h * scale } else { f64::NAN };

    let identity = a[0].identity();
    let mut phi = identity.clone();
    let mut integrals: [B; N] = core::array::from_fn(|_| phi.clone());
    for n in (1..series_terms(norm * scale, LEAST_TERM) + B::MORE_TERMS).rev() {
        // The columns of the force of `φ_n = n! Σ (A τ)^k / (k + n)!` from those of `φ_(n+1)`: `I + A τ φ_(n+1) / (n + 1)`.
        let mut next = B::product(a, &phi);
        next.scale(tau / (n + 1) as f64);
        next.add_scaled(&identity, 1.0);
        phi = next;
        if n <= N {
            integrals[n - 1] = phi.clone();
        }
    }
    let mut factor = 1.0;
    for n in 1..=N {
        factor *= tau / n as f64;
        integrals[n - 1].scale(factor);
    }
    // In the columns of the velocities, E is A times the first integral; A turns `ω η` into forces alone, so in the columns of `ω η` E is
    // the integral times these forces.
    let once = &integrals[0];
    let mut exp_minus_identity = [once.times_last_rows(&a[0]), B::product(a, once)];

    // Two steps of τ make one of 2 τ. In the second one, an integral starts as the Taylor polynomial that the lower ones make of it.
    for _ in 0..halvings {
        for n in (0..N).rev() {
            let (lower, integral) = integrals.split_at_mut(n);
            double_block(&mut integral[0], &exp_minus_identity);
            let mut factor = 1.0;
            for below in (0..n).rev() {
                factor *= tau / (n - below) as f64;
                integral[0].add_scaled(&lower[below], factor);
            }
        }
        let before = exp_minus_identity.clone();
        for half in &mut exp_minus_identity {
            double_block(half, &before);
        }
        tau *= 2.0;
    }
    (exp_minus_identity, integrals)
}

/// E, or an integral of which no lower ones are added, over twice the time.
#[cfg_attr(feature = "std", inline(always))]
fn double_block<B: Block>(block: &mut B, exp_minus_identity: &[B; 2]) {
    let mut both = B::product(exp_minus_identity, block);
    both.add_scaled(block, 2.0);
    *block = both;
}

/// Number of terms `norm^k / k!` down to the first one below `least`, for a norm of at most one.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn series_terms(norm: f64, least: f64) -> usize {
    let (mut count, mut term) = (1, norm);
    while term > least {
        count += 1;
        term *= norm / count as f64;
    }
    count
}

/// The system matrix A: its columns of `ω η` and of `η'`.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn matrix<E: Equations>(equations: &E) -> [Columns<6>; 2] {
    let mut a = [identity(0), identity(6)];
    for column in a.as_flattened_mut() {
        *column = equations.linear(column, &NO_FORCE);
    }
    a
}

/// Largest sum of the sizes in a column of a matrix.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn norm_1(matrix: &[Columns<6>; 2]) -> f64 {
    let mut largest = 0.0;
    for column in matrix.as_flattened() {
        let mut sum = 0.0;
        for entry in column {
            sum += entry.abs();
        }
        largest = f64::max(largest, sum);
    }
    largest
}
