//! The exact solution over one step under a force that changes linearly, as matrices.

use super::Equations;
use crate::excitation::Values;
use crate::numeric::float::{add_columns, add_scaled, scale};
use crate::numeric::simd::dispatch;
use crate::system::{Force, NO_FORCE, State};

/// Term of a series for a norm of at most one that is below rounding.
const LEAST_TERM: f64 = 1e-17;

/// Columns of 12 entries.
pub(crate) type Columns<const N: usize> = [[f64; 12]; N];

/// Exact step of length h: `x(h) = x(0) + E x(0) + B₀ f(0) + B₁ f(h)`, `E = exp(A h) - I`, for a force that is linear in between
/// (first-order hold).
#[derive(Debug, Clone, Copy)]
pub struct Propagator {
    /// E.
    pub(super) exp_minus_identity: Columns<12>,
    /// Effect of the constant force of the equations.
    pub(super) from_constant: [f64; 12],
    /// Effects of each component of the excitation: of its value at the start, and at the end.
    pub(super) from_start: Columns<9>,
    pub(super) from_end: Columns<9>,
    pub(super) components: usize,
}

impl Propagator {
    /// The exact step of `h` > 0 s. `influence`: modal force of a unit of each component of the excitation. Out of line: a run may need it in
    /// several places, each time it is long and rare.
    #[inline(never)]
    pub(crate) fn new<E: Equations>(equations: &E, influence: &[Force], h: f64) -> Self {
        dispatch!(propagator(equations, influence, h))
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
        let mut sum = self.from_constant;
        for j in 0..self.components {
            add_scaled(&mut sum, &self.from_start[j], start[j]);
            add_scaled(&mut sum, &self.from_end[j], end[j]);
        }
        three_sums([sum, *state, [0.0; 12]], &self.exp_minus_identity, state)
    }
}

/// [`Propagator::new`].
#[cfg_attr(feature = "std", inline(always))]
fn propagator<E: Equations>(equations: &E, influence: &[Force], h: f64) -> Propagator {
    let (exp_minus_identity, [once, twice]) = integrals(equations, h);
    // f(s) = f(0) + (f(h) - f(0)) s / h, summed over the components.
    let mut from_start = [[0.0; 12]; 9];
    let mut from_end = [[0.0; 12]; 9];
    for (component, force) in influence.iter().enumerate() {
        for j in 0..6 {
            add_scaled(&mut from_start[component], &once[j], force[j]);
            add_scaled(&mut from_end[component], &twice[j], force[j] / h);
        }
        for i in 0..12 {
            from_start[component][i] -= from_end[component][i];
        }
    }
    let mut from_constant = [0.0; 12];
    add_columns(&mut from_constant, &once, equations.constant());
    Propagator { exp_minus_identity, from_constant, from_start, from_end, components: influence.len() }
}

/// `parts` and a matrix times `vector`, in three sums side by side: each addition to a single sum would wait for the one before.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn three_sums(parts: [State; 3], matrix: &Columns<12>, vector: &State) -> State {
    let [mut sum, mut second, mut third] = parts;
    for j in (0..12).step_by(3) {
        add_scaled(&mut sum, &matrix[j], vector[j]);
        add_scaled(&mut second, &matrix[j + 1], vector[j + 1]);
        add_scaled(&mut third, &matrix[j + 2], vector[j + 2]);
    }
    for i in 0..12 {
        sum[i] += second[i] + third[i];
    }
    sum
}

/// `E = exp(A h) - I`, and the first to the Nth integral over h of `exp(A s)`, of which only the columns of the force are needed.
///
/// Scaling and doubling are applied to all of them together, which works for defective, overdamped and undamped matrices. E is used instead
/// of `exp(A h)`, because `1 + E` would lose digits of a slow mode of a strongly damped machine, twice as many with every doubling. In
/// energy coordinates `|exp(A τ)| <= 1`, so nothing grows (cf. Higham 2005; Moler & Van Loan 2003, method 3).
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn integrals<E: Equations, const N: usize>(
    equations: &E,
    h: f64,
) -> (Columns<12>, [Columns<6>; N]) {
    let a = matrix(equations);
    let norm = h * norm_1(&a);
    let mut halvings = 0;
    let mut scale = 1.0;
    while norm * scale > 1.0 {
        scale *= 0.5;
        halvings += 1;
    }
    // Beyond the range of numbers nothing is left of a step; NaN tells the run.
    let mut tau = if norm < f64::INFINITY { h * scale } else { f64::NAN };

    let mut integrals = [identity::<6>(6); N];
    let mut phi = integrals[0];
    for n in (1..phi_terms(norm * scale)).rev() {
        phi = next_phi(&a, tau / (n + 1) as f64, &phi);
        if n <= N {
            integrals[n - 1] = phi;
        }
    }
    let mut factor = 1.0;
    for n in 1..=N {
        factor *= tau / n as f64;
        scale_by(&mut integrals[n - 1], factor);
    }
    let mut exp_minus_identity = exp_minus_identity_of(&a, &integrals[0]);

    // Two steps of τ make one of 2 τ. In the second one, an integral starts as the Taylor polynomial that the lower ones make of it.
    for _ in 0..halvings {
        for n in (0..N).rev() {
            double(&mut integrals[n], &exp_minus_identity);
            let mut factor = 1.0;
            for lower in (0..n).rev() {
                factor *= tau / (n - lower) as f64;
                let below = integrals[lower];
                for (column, below) in integrals[n].iter_mut().zip(&below) {
                    add_scaled(column, below, factor);
                }
            }
        }
        let before = exp_minus_identity;
        double(&mut exp_minus_identity, &before);
        tau *= 2.0;
    }
    (exp_minus_identity, integrals)
}

/// Number of terms of the series of the φ-functions for a norm of `A τ` of at most one: the first omitted term is below rounding.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn phi_terms(norm: f64) -> usize {
    let (mut count, mut term) = (1, norm);
    while term > LEAST_TERM {
        count += 1;
        term *= norm / count as f64;
    }
    count
}

/// The columns of the force of `φ_n = n! Σ (A τ)^k / (k + n)!` from those of `φ_(n+1)`: `I + A τ φ_(n+1) / (n + 1)`. `fraction`: `τ / (n + 1)`.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn next_phi(a: &Columns<12>, fraction: f64, phi: &Columns<6>) -> Columns<6> {
    let mut next = product(a, phi);
    scale_by(&mut next, fraction);
    for j in 0..6 {
        next[j][6 + j] += 1.0;
    }
    next
}

/// E from the first integral of `exp(A s)`. In the columns of the velocities it is A times this integral; A turns `ω η` into forces alone,
/// so in the columns of `ω η` it is the integral times these forces.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn exp_minus_identity_of(a: &Columns<12>, once: &Columns<6>) -> Columns<12> {
    let mut exp_minus_identity = [[0.0; 12]; 12];
    for j in 0..6 {
        for i in 0..6 {
            add_scaled(&mut exp_minus_identity[j], &once[i], a[j][6 + i]);
        }
    }
    exp_minus_identity[6..].copy_from_slice(&product(a, once));
    exp_minus_identity
}

/// The system matrix A by columns.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn matrix<E: Equations>(equations: &E) -> Columns<12> {
    let mut a = identity::<12>(0);
    for column in &mut a {
        *column = equations.linear(column, &NO_FORCE);
    }
    a
}

/// Columns `from..from + N` of the identity.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn identity<const N: usize>(from: usize) -> Columns<N> {
    let mut unit = [[0.0; 12]; N];
    for (j, column) in unit.iter_mut().enumerate() {
        column[from + j] = 1.0;
    }
    unit
}

#[cfg_attr(feature = "std", inline(always))]
pub(super) fn norm_1(a: &Columns<12>) -> f64 {
    let mut largest = 0.0;
    for column in a {
        let mut sum = 0.0;
        for entry in column {
            sum += entry.abs();
        }
        largest = f64::max(largest, sum);
    }
    largest
}

#[cfg_attr(feature = "std", inline(always))]
pub(super) fn product<const N: usize>(left: &Columns<12>, right: &Columns<N>) -> Columns<N> {
    let mut out = [[0.0; 12]; N];
    add_product(&mut out, left, right);
    out
}

/// Adds `left * right` to `sum`.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn add_product<const N: usize>(sum: &mut Columns<N>, left: &Columns<12>, right: &Columns<N>) {
    // Three columns at a time: the additions of a single one would wait for each other.
    for (sum, right) in sum.chunks_mut(3).zip(right.chunks(3)) {
        if let ([first, second, third], [a, b, c]) = (&mut *sum, right) {
            for j in 0..12 {
                add_scaled(first, &left[j], a[j]);
                add_scaled(second, &left[j], b[j]);
                add_scaled(third, &left[j], c[j]);
            }
        } else {
            for (sum, right) in sum.iter_mut().zip(right) {
                add_columns(sum, left, right);
            }
        }
    }
}

/// `sum + matrix * column`.
#[inline(always)]
pub(super) fn plus_product(sum: &State, matrix: &Columns<12>, column: &State) -> State {
    let mut sum = *sum;
    add_columns(&mut sum, matrix, column);
    sum
}

/// `columns + columns + E columns`: E, or an integral of which no lower ones are added, over twice the time.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn double<const N: usize>(columns: &mut Columns<N>, exp_minus_identity: &Columns<12>) {
    let moved = product(exp_minus_identity, columns);
    for (column, moved) in columns.iter_mut().zip(&moved) {
        for i in 0..12 {
            column[i] = 2.0 * column[i] + moved[i];
        }
    }
}

#[cfg_attr(feature = "std", inline(always))]
pub(super) fn scale_by<const N: usize>(columns: &mut Columns<N>, factor: f64) {
    for column in columns {
        scale(column, factor);
    }
}
