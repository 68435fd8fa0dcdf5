//! The exact solution of the linear part over one step under a force that is a cubic polynomial in time.

use super::Equations;
use super::propagator::{Columns, integrals};
use super::series::{CubicForce, LONG_SERIES, PowerSeries};
use crate::numeric::float::add_scaled;
use crate::system::{Force, NO_FORCE, State};

/// Exact step of length h: `x(h) = x(0) + E x(0) + Σ R_k c_k` under the force `Σ c_k (t / h)^k`.
#[derive(Debug, Clone, Copy)]
pub struct CubicPropagator {
    pub(super) change: Columns<12>,
    /// R₀, R₁, R₂, and R₃ - R₂.
    pub(super) response: [Columns<6>; 4],
}

impl CubicPropagator {
    /// The exact step of `h` > 0 s of the linear part.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn new<E: Equations>(equations: &E, h: f64) -> Self {
        // R_k is k! / h^k times integral k + 1.
        let (change, mut response) = integrals::<E, 4>(equations, h);
        let mut factor = 1.0;
        for k in 1..4 {
            factor *= k as f64 / h;
            for column in &mut response[k] {
                for entry in column {
                    *entry *= factor;
                }
            }
        }
        let [_, _, quadratic, cubic] = &mut response;
        for (cubic, quadratic) in cubic.iter_mut().zip(quadratic) {
            add_scaled(cubic, quadratic, -1.0);
        }
        Self { change, response }
    }

    /// The state at the end of the step under a force that is linear in time, of these two coefficients.
    #[cfg_attr(feature = "std", inline(always))]
    fn apply(&self, state: &State, force: [&Force; 2]) -> State {
        // Three sums side by side: each addition of a single sum would wait for the one before.
        let (mut sum, mut second, mut third) = ([0.0; 12], *state, [0.0; 12]);
        for j in 0..6 {
            add_scaled(&mut second, &self.response[0][j], force[0][j]);
            add_scaled(&mut third, &self.response[1][j], force[1][j]);
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

    /// What a quadratic and a cubic term of the force add to the state, and how much less it would be if the cubic term were quadratic.
    #[cfg_attr(feature = "std", inline(always))]
    fn curved(&self, [quadratic, cubic]: [&Force; 2]) -> [State; 2] {
        let (mut both, mut difference) = ([0.0; 12], [0.0; 12]);
        for j in 0..6 {
            add_scaled(&mut both, &self.response[2][j], quadratic[j] + cubic[j]);
            add_scaled(&mut difference, &self.response[3][j], cubic[j]);
        }
        for i in 0..12 {
            both[i] += difference[i];
        }
        [both, difference]
    }
}

/// A step of the linear part: by a propagator where the length recurs, else by the series.
pub(crate) enum CubicStep<'a> {
    Propagator(&'a CubicPropagator),
    /// With the length, s.
    Series(&'a PowerSeries, f64),
}

impl CubicStep<'_> {
    /// The state at the end of the step under a force that is linear in time, of these two coefficients.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn apply<E: Equations>(
        &self,
        equations: &E,
        state: &State,
        [first, second]: [&Force; 2],
    ) -> State {
        match *self {
            Self::Propagator(propagator) => propagator.apply(state, [first, second]),
            Self::Series(series, h) => {
                advance_cubic(equations, series, h, &CubicForce([*first, *second, NO_FORCE, NO_FORCE]), state)
            }
        }
    }

    /// What a quadratic and a cubic term of the force add to the state, and how much less it would be if the cubic term were quadratic.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn curved<E: Equations>(&self, equations: &E, [quadratic, cubic]: [&Force; 2]) -> [State; 2] {
        match *self {
            Self::Propagator(propagator) => propagator.curved([quadratic, cubic]),
            Self::Series(series, h) => {
                let mut opposite = NO_FORCE;
                add_scaled(&mut opposite, cubic, -1.0);
                let still = &[0.0; 12];
                let both = CubicForce([NO_FORCE, NO_FORCE, *quadratic, *cubic]);
                let difference = CubicForce([NO_FORCE, NO_FORCE, opposite, *cubic]);
                [
                    advance_cubic(equations, series, h, &both, still),
                    advance_cubic(equations, series, h, &difference, still),
                ]
            }
        }
    }
}

/// The state `h` s later, by the series or by a propagator used once, whichever is cheaper.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn advance_cubic<E: Equations>(
    equations: &E,
    series: &PowerSeries,
    h: f64,
    force: &CubicForce,
    state: &State,
) -> State {
    if series.parts(h) <= LONG_SERIES {
        return series.advance_cubic(equations, h, force, state);
    }
    let propagator = CubicPropagator::new(equations, h);
    let mut end = propagator.apply(state, [&force.0[0], &force.0[1]]);
    let [curved, _] = propagator.curved([&force.0[2], &force.0[3]]);
    add_scaled(&mut end, &curved, 1.0);
    end
}
