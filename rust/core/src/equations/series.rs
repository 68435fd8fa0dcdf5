//! The exact solution over one step of linearly changing force, as a power series in time.

use super::Equations;
use super::propagator::{Propagator, TERMS};
use crate::excitation::Ramp;
use crate::numeric::float::{add_scaled, ceil, sqrt};
use crate::system::{NO_FORCE, State, size};

/// The power series of the solution over an interval, in parts short enough for it to end after some terms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PowerSeries {
    norm: f64,
}

impl PowerSeries {
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
            let mut sum = state;
            let (mut scale, mut small) = (size(&state), 0);
            power_series(equations, ramp, [part / parts, 1.0 / parts], &state, MAX_TERMS, |k, term| {
                add_scaled(&mut sum, term, 1.0);
                // Two in a row, one of which may hide what is in the other half of the state.
                let size = size(term);
                scale = if k == 1 && size > scale { size } else { scale };
                small = if size <= NEGLIGIBLE * scale { small + 1 } else { 0 };
                small < 2
            });
            state = sum;
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
        power_series(equations, ramp, [0.0, 1.0], state, TERMS, |k, term| {
            terms[k] = *term;
            true
        });
        terms
    }
}

/// The same for a norm of at most [`LONGEST`] (2²⁵/25! = 2e-18); what is below this part of a state does not reach its last bit.
const MAX_TERMS: usize = 24;
const LONGEST: f64 = 2.0;
const NEGLIGIBLE: f64 = 1e-18;

/// Terms 1, 2, … of the solution, as long as `take` wants them, from `state` over the part of a ramp that begins at `from` and is `length` long, in fractions of the ramp.
#[cfg_attr(feature = "std", inline(always))]
fn power_series<E: Equations>(
    equations: &E,
    ramp: &Ramp,
    [from, length]: [f64; 2],
    state: &State,
    most: usize,
    mut take: impl FnMut(usize, &State) -> bool,
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
    take(1, &term);
    term = equations.linear(&term, &rise);
    scale(&mut term, tau / 2.0);
    take(2, &term);
    for k in 3..=most {
        term = equations.linear(&term, &NO_FORCE);
        scale(&mut term, tau / k as f64);
        if !take(k, &term) {
            return;
        }
    }
}

/// The state at the end of a ramp of which the length comes once.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn advance<E: Equations>(
    equations: &E,
    series: &PowerSeries,
    ramp: &Ramp,
    state: &State,
) -> State {
    if series.parts(ramp.h) <= LONG_SERIES {
        return series.advance(equations, ramp, state);
    }
    Propagator::new(equations, ramp.forcing.influence(), ramp.h).apply(state, ramp.start, ramp.end)
}

/// Parts of a series beyond which a propagator costs less.
const LONG_SERIES: f64 = 16.0;

#[cfg_attr(feature = "std", inline(always))]
fn scale(column: &mut [f64; 12], factor: f64) {
    for entry in column {
        *entry *= factor;
    }
}
