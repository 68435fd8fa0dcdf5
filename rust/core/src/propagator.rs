//! The exact solution over one interval of linearly changing force, as a matrix and as a series.

use crate::equations::Equations;
use crate::float::{add_scaled, ceil, sqrt};
use crate::integrate::{Ramp, Values};
use crate::system::{Force, NO_FORCE, State, size};

/// Terms of the exponential series: the first one left out is below rounding where the norm is at most one (1/19! = 8e-18).
pub(crate) const TERMS: usize = 18;

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
    /// Effect of the constant force.
    from_constant: [f64; 12],
    /// Effect of each component of the excitation at the start and at the end, as many as there are.
    from_start: Columns<9>,
    from_end: Columns<9>,
    components: usize,
}

impl Propagator {
    /// The exact step of length `h` > 0 s under components of an excitation with the modal forces `influence`.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn new<E: Equations>(equations: &E, influence: &[Force], h: f64) -> Self {
        let a = matrix(equations);
        let norm = h * norm_1(&a);
        let mut halvings = 0;
        let mut scale = 1.0;
        while norm * scale > 1.0 {
            scale *= 0.5;
            halvings += 1;
        }
        let mut tau = h * scale;

        // S₁ = Σ (Aτ)^k / (k+1)!, with E = Aτ S₁, and S₂ = Σ (Aτ)^k / (k+2)!; of the integrals only the columns of the force are wanted.
        // Four terms at a time (Paterson & Stockmeyer 1973), which takes a third of the products.
        let mut powers = [a; 4];
        scale_by(&mut powers[0], tau);
        for power in 1..4 {
            powers[power] = product(&powers[power - 1], &powers[0]);
        }
        let inner = series::<12>(&powers, 0, 1);
        let mut twice = series::<6>(&powers, 6, 2);
        let mut change = product(&powers[0], &inner);
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
        let mut from_constant = [0.0; 12];
        for (column, &force) in once.iter().zip(equations.constant()) {
            add_scaled(&mut from_constant, column, force);
        }
        Self { change, from_constant, from_start, from_end, components: influence.len() }
    }

    /// By columns: E, and the effects of one component at the start and at the end.
    #[cfg(feature = "std")]
    #[inline(always)]
    pub(crate) fn parts(&self, component: usize) -> (&Columns<12>, &[f64; 12], &[f64; 12]) {
        (&self.change, &self.from_start[component], &self.from_end[component])
    }

    /// The state at the end of the interval.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn apply(&self, state: &State, start: &Values, end: &Values) -> State {
        // The excitation by itself, as it is known before the state; then three sums side by side: fewer would wait for their own
        // additions.
        let (mut sum, mut second, mut third) = (self.from_constant, *state, [0.0; 12]);
        for j in 0..self.components {
            add_scaled(&mut sum, &self.from_start[j], start[j]);
            add_scaled(&mut sum, &self.from_end[j], end[j]);
        }
        for j in (0..12).step_by(3) {
            add_scaled(&mut sum, &self.change[j], state[j]);
            add_scaled(&mut second, &self.change[j + 1], state[j + 1]);
            add_scaled(&mut third, &self.change[j + 2], state[j + 2]);
        }
        for i in 0..12 {
            sum[i] += second[i] + third[i];
        }
        sum
    }
}

/// The power series of the solution over an interval, in parts short enough for it to end after some terms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Series {
    norm: f64,
}

impl Series {
    /// The norm is the largest column of A after each `ω η` has been scaled so that it weighs as much in S as in ω: where links are soft at
    /// rest and stiff elsewhere that is by orders less, and no digit of η' depends on the scale.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn new<E: Equations>(equations: &E) -> Self {
        let (stiffness, damping) = equations.tangent(&[0.0; 12]);
        let mut norm = 0.0;
        for j in 0..6 {
            let (mut pulls, mut damps) = (0.0, 0.0);
            for i in 0..6 {
                pulls += stiffness[j][i].abs();
                damps += damping[j][i].abs();
            }
            norm = f64::max(norm, sqrt(equations.frequency()[j] * pulls) + damps);
        }
        Self { norm }
    }

    /// Number of parts of an interval of length `h` that end after [`TERMS`] terms.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn parts(&self, h: f64) -> f64 {
        f64::max(1.0, ceil(h * self.norm))
    }

    /// The state at the end of a ramp.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn advance<E: Equations>(&self, equations: &E, ramp: &Ramp, state: &State) -> State {
        let parts = f64::max(1.0, ceil(ramp.h * self.norm / LONGEST));
        let mut state = *state;
        let mut part = 0.0;
        while part < parts {
            let mut sum = Sum { state, scale: size(&state), small: 0 };
            power_series(equations, ramp, [part / parts, 1.0 / parts], &state, MOST_TERMS, &mut sum);
            state = sum.state;
            part += 1.0;
        }
        state
    }

    /// The state over a ramp of one part as a power series in the fraction of it.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn terms<E: Equations>(
        &self,
        equations: &E,
        ramp: &Ramp,
        state: &State,
    ) -> [State; TERMS + 1] {
        let mut terms = [[0.0; 12]; TERMS + 1];
        terms[0] = *state;
        power_series(equations, ramp, [0.0, 1.0], state, TERMS, &mut terms);
        terms
    }
}

/// Where the terms of a power series go. (Not a closure, which may be compiled for the oldest processor.)
trait Sink {
    /// Takes term `k`; whether the next one is wanted.
    fn take(&mut self, k: usize, term: &State) -> bool;
}

impl Sink for [State; TERMS + 1] {
    #[cfg_attr(feature = "std", inline(always))]
    fn take(&mut self, k: usize, term: &State) -> bool {
        self[k] = *term;
        true
    }
}

/// The sum of the terms until they no longer matter.
struct Sum {
    state: State,
    /// Size of what the terms are added to.
    scale: f64,
    /// Negligible terms in a row.
    small: u32,
}

impl Sink for Sum {
    #[cfg_attr(feature = "std", inline(always))]
    fn take(&mut self, k: usize, term: &State) -> bool {
        add_scaled(&mut self.state, term, 1.0);
        // Two in a row, one of which may hide what is in the other half of the state.
        let size = size(term);
        self.scale = if k == 1 && size > self.scale { size } else { self.scale };
        self.small = if size <= NEGLIGIBLE * self.scale { self.small + 1 } else { 0 };
        self.small < 2
    }
}

/// The same for a norm of at most [`LONGEST`] (2²⁵/25! = 2e-18); what is below this part of a state does not reach its last bit.
const MOST_TERMS: usize = 24;
const LONGEST: f64 = 2.0;
const NEGLIGIBLE: f64 = 1e-18;

/// Terms 1, 2, … of the solution, as long as `sink` wants them, from `state` over the part of a ramp that begins at `from` and is `length` long, in fractions of the ramp.
#[cfg_attr(feature = "std", inline(always))]
fn power_series<E: Equations>(
    equations: &E,
    ramp: &Ramp,
    [from, length]: [f64; 2],
    state: &State,
    most: usize,
    sink: &mut impl Sink,
) {
    let tau = ramp.h * length;
    let mut rise = ramp.rise();
    for entry in &mut rise {
        *entry *= length;
    }
    let mut force = ramp.force(from);
    add_scaled(&mut force, equations.constant(), 1.0);
    // Derivatives of the solution: x' = A x + f, x'' = A x' + f', and from there on A alone.
    let mut term = equations.linear(state, &force);
    scale(&mut term, tau);
    sink.take(1, &term);
    term = equations.linear(&term, &rise);
    scale(&mut term, tau / 2.0);
    sink.take(2, &term);
    for k in 3..=most {
        term = equations.linear(&term, &NO_FORCE);
        scale(&mut term, tau / k as f64);
        if !sink.take(k, &term) {
            return;
        }
    }
}

/// The state at the end of a ramp of which the length comes once.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn advance<E: Equations>(equations: &E, series: &Series, ramp: &Ramp, state: &State) -> State {
    if series.parts(ramp.h) <= LONG_SERIES {
        return series.advance(equations, ramp, state);
    }
    Propagator::new(equations, ramp.drive.influence(), ramp.h).apply(state, ramp.start, ramp.end)
}

/// Parts of a series beyond which a propagator costs less.
const LONG_SERIES: f64 = 16.0;

/// The system matrix A by columns.
#[cfg_attr(feature = "std", inline(always))]
fn matrix<E: Equations>(equations: &E) -> Columns<12> {
    let mut a = identity::<12>(0);
    for column in &mut a {
        *column = equations.linear(column, &NO_FORCE);
    }
    a
}

/// Columns `from..from + N` of the identity.
#[cfg_attr(feature = "std", inline(always))]
fn identity<const N: usize>(from: usize) -> Columns<N> {
    let mut unit = [[0.0; 12]; N];
    for (j, column) in unit.iter_mut().enumerate() {
        column[from + j] = 1.0;
    }
    unit
}

/// Bound on the rate at which `|exp(A t)|` grows: `|S - ω| / 2`, as all else in A turns a state or, the dampers, shortens it.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn growth_rate<E: Equations>(equations: &E) -> f64 {
    let (stiffness, _) = equations.tangent(&[0.0; 12]);
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

#[cfg_attr(feature = "std", inline(always))]
fn norm_1(a: &Columns<12>) -> f64 {
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
#[cfg_attr(feature = "std", inline(always))]
fn double<const N: usize>(columns: &mut Columns<N>, change: &Columns<12>) {
    let moved = product(change, columns);
    for (column, moved) in columns.iter_mut().zip(&moved) {
        for i in 0..12 {
            column[i] = 2.0 * column[i] + moved[i];
        }
    }
}

/// Columns from `from` on of `n! Σ B^k / (k + n)!`, of the `powers` B, B², B³, B⁴.
#[cfg_attr(feature = "std", inline(always))]
fn series<const N: usize>(powers: &[Columns<12>; 4], from: usize, n: usize) -> Columns<N> {
    let mut factor = [1.0; TERMS + 2];
    for k in 1..TERMS + 2 {
        factor[k] = factor[k - 1] / (k + n) as f64;
    }
    let mut sum = [[0.0; 12]; N];
    // Groups of four terms, the last first: sum <- B⁴ sum + c₀ + c₁ B + c₂ B² + c₃ B³.
    for group in (0..=TERMS / 4).rev() {
        if group < TERMS / 4 {
            sum = product(&powers[3], &sum);
        }
        for j in 0..N {
            sum[j][from + j] += factor[4 * group];
            for power in 0..3 {
                add_scaled(&mut sum[j], &powers[power][from + j], factor[4 * group + power + 1]);
            }
        }
    }
    sum
}

#[cfg_attr(feature = "std", inline(always))]
fn scale_by<const N: usize>(columns: &mut Columns<N>, factor: f64) {
    for column in columns {
        scale(column, factor);
    }
}

#[cfg_attr(feature = "std", inline(always))]
fn scale(column: &mut [f64; 12], factor: f64) {
    for entry in column {
        *entry *= factor;
    }
}
