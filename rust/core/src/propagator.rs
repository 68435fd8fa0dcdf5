//! The exact solution over one interval of linearly changing force, as a matrix and as a series.

use crate::float::{add_scaled, ceil};
use crate::integrate::{Ramp, Values};
use crate::system::{Force, NO_FORCE, State, System};

/// Terms of the exponential series: the first one left out is below rounding where the norm is at most one (1/19! = 8e-18).
const TERMS: usize = 18;

/// A block of columns that act on a state.
type Columns<const N: usize> = [[f64; 12]; N];

/// State after a time h: `x(h) = x(0) + E x(0) + B₀ f(0) + B₁ f(h)`, `E = exp(A h) - I`, for a force that is linear in between
/// (first-order hold).
///
/// Scaling and doubling of `E`, `∫ exp(A s) ds g` and `∫∫ exp(A s) ds² g` together, so that defective, overdamped and undamped matrices are
/// all alike. E and not the exponential: beside 1 a slow mode of a strongly damped machine would lose the digits that every doubling
/// doubles the loss of. In energy coordinates `|exp(A τ)| <= 1`, so nothing grows (cf. Higham 2005; Moler & Van Loan 2003, method 3).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Propagator {
    /// E.
    change: Columns<12>,
    /// Effect of each component of the excitation at the start and at the end, as many as there are.
    from_start: Columns<9>,
    from_end: Columns<9>,
    components: usize,
}

impl Propagator {
    /// The exact step of length `h` > 0 s under components of an excitation with the modal forces `influence`.
    #[inline(always)]
    pub(crate) fn new(system: &System, influence: &[Force], h: f64) -> Self {
        let a = matrix(system);
        let norm = h * norm_1(&a);
        let mut halvings = 0;
        let mut scale = 1.0;
        while norm * scale > 1.0 {
            scale *= 0.5;
            halvings += 1;
        }
        let mut tau = h * scale;

        // Horner from the last term: S₁ = Σ (Aτ)^k / (k+1)!, with E = Aτ S₁, and S₂ = Σ (Aτ)^k / (k+2)!; of the integrals only the
        // columns of the force are wanted.
        let mut inner = identity::<12>(0);
        let mut twice = identity::<6>(6);
        for k in (1..=TERMS).rev() {
            inner = series_term(&a, &inner, tau / (k + 1) as f64, 0);
            twice = series_term(&a, &twice, tau / (k + 2) as f64, 6);
        }
        let mut change = product(&a, &inner);
        scale_by(&mut change, tau);
        let mut once = identity::<6>(6);
        once.copy_from_slice(&inner[6..]);
        scale_by(&mut once, tau);
        scale_by(&mut twice, tau * tau / 2.0);

        // Two steps of τ: the force starts the second one at f + τ f'.
        for _ in 0..halvings {
            double(&mut twice, &change);
            for (twice, once) in twice.iter_mut().zip(&once) {
                add_scaled(twice, once, tau);
            }
            double(&mut once, &change);
            let before = change;
            double(&mut change, &before);
            tau *= 2.0;
        }

        // f(s) = f(0) + (f(h) - f(0)) s / h, and f is a sum over the components.
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
        Self { change, from_start, from_end, components: influence.len() }
    }

    /// The state at the end of the interval.
    #[inline(always)]
    pub(crate) fn apply(&self, state: &State, start: &Values, end: &Values) -> State {
        // The excitation by itself, as it is known before the state; then two sums side by side: one alone would wait for its own
        // additions.
        let mut even = [0.0; 12];
        for j in 0..self.components {
            add_scaled(&mut even, &self.from_start[j], start[j]);
            add_scaled(&mut even, &self.from_end[j], end[j]);
        }
        for i in 0..12 {
            even[i] += state[i];
        }
        let mut odd = [0.0; 12];
        for j in (0..12).step_by(2) {
            add_scaled(&mut even, &self.change[j], state[j]);
            add_scaled(&mut odd, &self.change[j + 1], state[j + 1]);
        }
        for i in 0..12 {
            even[i] += odd[i];
        }
        even
    }
}

/// The power series of the solution over an interval, in parts short enough for it to end after [`TERMS`] terms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Series {
    norm: f64,
}

impl Series {
    pub(crate) fn new(system: &System) -> Self {
        Self { norm: norm_1(&matrix(system)) }
    }

    /// Number of parts of an interval of length `h`.
    #[inline(always)]
    pub(crate) fn parts(&self, h: f64) -> f64 {
        f64::max(1.0, ceil(h * self.norm))
    }

    /// The state at the end of a ramp.
    #[inline(always)]
    pub(crate) fn advance(&self, system: &System, ramp: &Ramp, state: &State) -> State {
        let parts = self.parts(ramp.h);
        let tau = ramp.h / parts;
        let (first, last) = (ramp.force(0.0), ramp.force(1.0));
        let mut rise = NO_FORCE;
        for i in 0..6 {
            rise[i] = (last[i] - first[i]) / parts;
        }
        let mut state = *state;
        let mut part = 0.0;
        while part < parts {
            // Derivatives of the solution: x' = A x + f, x'' = A x' + f', and from there on A alone.
            let mut term = system.rate(&state, &ramp.force(part / parts));
            scale(&mut term, tau);
            add_scaled(&mut state, &term, 1.0);
            term = system.rate(&term, &rise);
            scale(&mut term, tau / 2.0);
            add_scaled(&mut state, &term, 1.0);
            for k in 3..=TERMS {
                term = system.rate(&term, &NO_FORCE);
                scale(&mut term, tau / k as f64);
                add_scaled(&mut state, &term, 1.0);
            }
            part += 1.0;
        }
        state
    }
}

/// The system matrix A by columns.
fn matrix(system: &System) -> Columns<12> {
    let mut a = identity::<12>(0);
    for column in &mut a {
        *column = system.rate(column, &NO_FORCE);
    }
    a
}

/// Columns `from..from + N` of the identity.
fn identity<const N: usize>(from: usize) -> Columns<N> {
    let mut unit = [[0.0; 12]; N];
    for (j, column) in unit.iter_mut().enumerate() {
        column[from + j] = 1.0;
    }
    unit
}

fn norm_1(a: &Columns<12>) -> f64 {
    a.iter().map(|column| column.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}

#[inline(always)]
fn product<const N: usize>(left: &Columns<12>, right: &Columns<N>) -> Columns<N> {
    let mut out = [[0.0; 12]; N];
    for (out, right) in out.iter_mut().zip(right) {
        for (column, &factor) in left.iter().zip(right) {
            add_scaled(out, column, factor);
        }
    }
    out
}

/// `columns + columns + E columns`: what they are after twice the time.
#[inline(always)]
fn double<const N: usize>(columns: &mut Columns<N>, change: &Columns<12>) {
    let moved = product(change, columns);
    for (column, moved) in columns.iter_mut().zip(&moved) {
        for i in 0..12 {
            column[i] = 2.0 * column[i] + moved[i];
        }
    }
}

/// `I + factor A sum`.
#[inline(always)]
fn series_term<const N: usize>(a: &Columns<12>, sum: &Columns<N>, factor: f64, from: usize) -> Columns<N> {
    let mut out = product(a, sum);
    scale_by(&mut out, factor);
    for (j, column) in out.iter_mut().enumerate() {
        column[from + j] += 1.0;
    }
    out
}

#[inline(always)]
fn scale_by<const N: usize>(columns: &mut Columns<N>, factor: f64) {
    for column in columns {
        scale(column, factor);
    }
}

#[inline(always)]
fn scale(column: &mut [f64; 12], factor: f64) {
    for entry in column {
        *entry *= factor;
    }
}
