//! The exact solution over one step under a force that changes linearly, as a power series in time.

use super::Equations;
use super::propagator::Propagator;
use crate::excitation::{Instant, Ramp};
use crate::numeric::float::{add_scaled, ceil, scale, sqrt};
use crate::numeric::simd::dispatch;
use crate::system::{Force, NO_FORCE, State, energy_norm};

/// Terms of the exponential series. For a norm of at most one, the first omitted term is below rounding (1/19! = 8e-18).
pub(crate) const TERMS: usize = 18;

/// Power series of the solution over a step, or over equal parts of it that are short enough to converge in few terms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PowerSeries {
    norm: f64,
}

impl PowerSeries {
    /// The series of linear equations.
    ///
    /// Its norm is the largest column sum of A after scaling each `ω η` so that its columns in S and in ω have the same size. Where links
    /// are soft at rest and stiff elsewhere, the scaled norm is smaller by orders of magnitude; the scale does not change any digit of η'.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn new<E: Equations>(equations: &E) -> Self {
        let (stiffness, damping) = equations.tangent(&[0.0; 12], Instant::FIRST);
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

    /// Norm of a step of length `h`.
    #[inline(always)]
    pub(crate) fn norm(&self, h: f64) -> f64 {
        h.abs() * self.norm
    }

    /// Number of parts of a step of length `h` whose series converge in [`TERMS`] terms.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn parts(&self, h: f64) -> f64 {
        f64::max(1.0, ceil(h * self.norm))
    }

    /// The state at the end of a ramp. Out of line: a run needs it in several places.
    #[inline(never)]
    fn advance<E: Equations>(&self, equations: &E, ramp: &Ramp, state: &State) -> State {
        dispatch!(self.advance_under(
            equations,
            ramp.h,
            #[cfg_attr(feature = "std", inline(always))]
            |from, length| force_of(equations, ramp, [from, length]),
            state,
        ))
    }

    /// The state `h` s later under a force that is a cubic. Out of line, as [`PowerSeries::advance`].
    #[inline(never)]
    pub(super) fn advance_cubic<E: Equations>(
        &self,
        equations: &E,
        h: f64,
        force: &CubicForce,
        state: &State,
    ) -> State {
        dispatch!(self.advance_under(
            equations,
            h,
            #[cfg_attr(feature = "std", inline(always))]
            |from, length| force.part(from, length).0,
            state,
        ))
    }

    /// The state `h` s later under the force with these coefficients in the part that starts at a fraction of `h` and has a length.
    #[cfg_attr(feature = "std", inline(always))]
    fn advance_under<E: Equations, const N: usize>(
        &self,
        equations: &E,
        h: f64,
        force: impl Fn(f64, f64) -> [Force; N],
        state: &State,
    ) -> State {
        let parts = f64::max(1.0, ceil(h * self.norm / LONGEST));
        let length = 1.0 / parts;
        let mut state = *state;
        let mut part = 0.0;
        while part < parts {
            let mut sum = Sum { state, scale: energy_norm(&state), small: 0 };
            power_series(equations, h * length, &force(part / parts, length), &state, MAX_TERMS, &mut sum);
            state = sum.state;
            part += 1.0;
        }
        state
    }

    /// Terms of the power series of the state in the fraction of a ramp that is one part.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn terms<E: Equations>(
        &self,
        equations: &E,
        ramp: &Ramp,
        state: &State,
    ) -> [State; TERMS + 1] {
        let mut terms = [[0.0; 12]; TERMS + 1];
        terms[0] = *state;
        power_series(equations, ramp.h, &force_of(equations, ramp, [0.0, 1.0]), state, TERMS, &mut terms);
        terms
    }
}

/// Receives the terms of a power series. (A trait, because a closure may be compiled for the oldest processor.)
pub(crate) trait TermSink {
    /// Receives term `k`; returns whether the next one is needed.
    fn take(&mut self, k: usize, term: &State) -> bool;
}

impl<const N: usize> TermSink for [State; N] {
    #[cfg_attr(feature = "std", inline(always))]
    fn take(&mut self, k: usize, term: &State) -> bool {
        self[k] = *term;
        true
    }
}

/// Sum of the terms until they are negligible.
struct Sum {
    state: State,
    /// Size of the state, or of the first term if that is larger.
    scale: f64,
    /// Negligible terms in a row.
    small: u32,
}

impl TermSink for Sum {
    #[cfg_attr(feature = "std", inline(always))]
    fn take(&mut self, k: usize, term: &State) -> bool {
        add_scaled(&mut self.state, term, 1.0);
        // Two in a row, because one alone may be small only where it belongs to the other half of the state.
        let size = energy_norm(term);
        self.scale = if (k == 1 || self.scale == 0.0) && size > self.scale { size } else { self.scale };
        self.small = if size <= LEAST_TERM * self.scale { self.small + 1 } else { 0 };
        self.small < 2
    }
}

/// Largest number of terms, enough for a norm of at most [`LONGEST`] (2²⁵/25! = 2e-18).
const MAX_TERMS: usize = 24;
const LONGEST: f64 = 2.0;

/// Fraction of a state below which a term does not change its last bit.
const LEAST_TERM: f64 = 1e-18;

/// Passes terms 1, 2, … of the solution to `sink` until it returns false or `most` is reached. The solution starts in `state` and covers
/// `tau` s, in which the force is a polynomial of the fraction of it, with these coefficients in ascending order.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn power_series<E: Equations, const N: usize>(
    equations: &E,
    tau: f64,
    force: &[Force; N],
    state: &State,
    most: usize,
    sink: &mut impl TermSink,
) {
    // Term k + 1 is τ / (k + 1) times A times term k, plus coefficient k of the force.
    let mut term = equations.linear(state, &force[0]);
    scale(&mut term, tau);
    sink.take(1, &term);
    for k in 2..=N {
        term = equations.linear(&term, &force[k - 1]);
        scale(&mut term, tau / k as f64);
        sink.take(k, &term);
    }
    for k in N + 1..=most {
        term = equations.linear(&term, &NO_FORCE);
        scale(&mut term, tau / k as f64);
        if !sink.take(k, &term) {
            return;
        }
    }
}

/// A modal force over one step: coefficients of a cubic in the fraction of the step, in ascending order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CubicForce(pub [Force; 4]);

impl CubicForce {
    /// The same force in the fraction of the part that starts at `from` and is `length` long.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn part(&self, from: f64, length: f64) -> Self {
        let mut part = *self;
        // Horner's scheme, again for each derivative.
        for lowest in 0..3 {
            for power in (lowest..3).rev() {
                let above = part.0[power + 1];
                add_scaled(&mut part.0[power], &above, from);
            }
        }
        let mut factor = 1.0;
        for coefficient in &mut part.0 {
            scale(coefficient, factor);
            factor *= length;
        }
        part
    }
}

/// The force in the fraction of a ramp from `from` to `from + length`, with the constant one of the equations.
#[cfg_attr(feature = "std", inline(always))]
fn force_of<E: Equations>(equations: &E, ramp: &Ramp, [from, length]: [f64; 2]) -> [Force; 2] {
    let (mut force, mut rise) = (ramp.force(from), ramp.rise());
    add_scaled(&mut force, equations.constant(), 1.0);
    scale(&mut rise, length);
    [force, rise]
}

/// The state at the end of a ramp whose length does not recur, by the series or by a propagator used once, whichever is cheaper.
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

/// Parts of a series beyond which a propagator is cheaper.
pub(super) const LONG_SERIES: f64 = 16.0;

/// Work of [`advance`] over a step of so many parts, in parts of a series. Of a propagator, each doubling counts as two.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn work(parts: f64) -> usize {
    // The exponent of a double is the number of doublings, also of infinity.
    if parts <= LONG_SERIES {
        parts as usize
    } else {
        LONG_SERIES as usize + 2 * (parts.to_bits() >> 52) as usize - 2046
    }
}
