//! The exact solution of the linear part over one step under a force that is a cubic polynomial in time.

use super::Equations;
use super::columns::{Columns, scale_by, three_sums, whole};
use super::exponential::{integrals, matrix, norm_1};

use super::series::{CubicForce, LONG_SERIES, PowerSeries};
use crate::numeric::float::add_scaled;
use crate::numeric::simd::dispatch;
use crate::system::{Force, NO_FORCE, State};

/// Exact step of length h: `x(h) = x(0) + E x(0) + Σ R_k c_k` under the force `Σ c_k (t / h)^k`.
#[derive(Debug, Clone, Copy)]
pub struct CubicPropagator {
    pub(super) exp_minus_identity: Columns<12>,
    /// R₀, R₁, R₂, and R₃ - R₂.
    pub(super) response: [Columns<6>; 4],
}

impl CubicPropagator {
    /// The exact step of `h` > 0 s of the linear part. Out of line: a step may need it in several places, each time it is long and rare.
    #[inline(never)]
    pub(crate) fn new<E: Equations>(equations: &E, h: f64) -> Self {
        dispatch!(propagator(equations, h))
    }

    /// The state at the end of the step under a force that is linear in time, of these two coefficients.
    #[cfg_attr(feature = "std", inline(always))]
    fn apply(&self, state: &State, force: [&Force; 2]) -> State {
        let (mut second, mut third) = (*state, [0.0; 12]);
        for j in 0..6 {
            add_scaled(&mut second, &self.response[0][j], force[0][j]);
            add_scaled(&mut third, &self.response[1][j], force[1][j]);
        }
        three_sums([[0.0; 12], second, third], &self.exp_minus_identity, state)
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

/// [`CubicPropagator::new`].
#[cfg_attr(feature = "std", inline(always))]
fn propagator<E: Equations>(equations: &E, h: f64) -> CubicPropagator {
    // R_k is k! / h^k times integral k + 1.
    let a = matrix(equations);
    let (exp_minus_identity, mut response) = integrals(&a, norm_1(&a), h);
    let mut factor = 1.0;
    for k in 1..4 {
        factor *= k as f64 / h;
        scale_by(&mut response[k], factor);
    }
    let [_, _, quadratic, cubic] = &mut response;
    for (cubic, quadratic) in cubic.iter_mut().zip(quadratic) {
        add_scaled(cubic, quadratic, -1.0);
    }
    CubicPropagator { exp_minus_identity: *whole(&exp_minus_identity), response }
}

/// A step of the linear part: by a propagator where the length recurs, else by the series.
pub(crate) enum CubicStep<'a> {
    Propagator(&'a CubicPropagator),
    /// With the length, s.
    Series(PowerSeries, f64),
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
            Self::Series(ref series, h) => {
                advance_cubic(equations, series, h, &CubicForce([*first, *second, NO_FORCE, NO_FORCE]), state)
            }
        }
    }

    /// What a quadratic and a cubic term of the force add to the state, and how much less it would be if the cubic term were quadratic.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn curved<E: Equations>(&self, equations: &E, [quadratic, cubic]: [&Force; 2]) -> [State; 2] {
        match *self {
            Self::Propagator(propagator) => propagator.curved([quadratic, cubic]),
            Self::Series(ref series, h) => {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::excitation::Instant;
    use crate::system::{System, energy_norm};
    use crate::yardstick::{cart_links, cart_on, number};

    /// The cart undamped, damped, or overdamped by a factor of 40 and of 40 000.
    fn systems() -> [System; 4] {
        [0.0, 1e5, 4e6, 4e9].map(|damping| cart_on(&cart_links(damping)))
    }

    /// A motion whose velocity is a parabola in time, and the force under which the system takes it: a cubic over `h` s.
    fn motion(system: &System, h: f64) -> (impl Fn(f64) -> State, CubicForce) {
        let (stiffness, damping) = system.tangent(&[0.0; 12], Instant::FIRST);
        let frequency = *system.frequency();
        // Coefficients of velocity and of ω times the displacement, in the fraction of the step.
        let free = |mode: usize| if frequency[mode] > 0.0 { 1.0 } else { 0.0 };
        let speed = [0, 1, 2].map(|k| [0, 1, 2, 3, 4, 5].map(|mode| free(mode) * number(6 * k + mode)));
        let mut place = [[0.0; 6]; 4];
        for mode in 0..6 {
            place[0][mode] = free(mode) * number(50 + mode);
            for k in 0..3 {
                place[k + 1][mode] = frequency[mode] * h * speed[k][mode] / (k + 1) as f64;
            }
        }
        let mut force = [NO_FORCE; 4];
        for k in 0..4 {
            for i in 0..6 {
                force[k][i] = if k < 2 { (k + 1) as f64 * speed[k + 1][i] / h } else { 0.0 };
                for j in 0..6 {
                    force[k][i] += stiffness[j][i] * place[k][j];
                    force[k][i] += if k < 3 { damping[j][i] * speed[k][j] } else { 0.0 };
                }
            }
        }
        let state = move |at: f64| {
            core::array::from_fn(|i| {
                let coefficient = |k: usize| {
                    if i < 6 {
                        place[k][i]
                    } else if k < 3 {
                        speed[k][i - 6]
                    } else {
                        0.0
                    }
                };
                coefficient(0) + at * (coefficient(1) + at * (coefficient(2) + at * coefficient(3)))
            })
        };
        (state, CubicForce(force))
    }

    /// What is lost of a state, over the size of the states that are added up.
    fn lost(got: &State, want: &State, begin: &State) -> f64 {
        let mut off = *got;
        add_scaled(&mut off, want, -1.0);
        energy_norm(&off) / f64::max(energy_norm(want), energy_norm(begin))
    }

    fn end(step: &CubicStep, system: &System, CubicForce(force): &CubicForce, begin: &State) -> State {
        let mut end = step.apply(system, begin, [&force[0], &force[1]]);
        let [curved, _] = step.curved(system, [&force[2], &force[3]]);
        add_scaled(&mut end, &curved, 1.0);
        end
    }

    #[test]
    fn a_motion_in_closed_form_is_exact_by_propagator_and_by_series() {
        for system in systems() {
            let series = PowerSeries::new(&system);
            for h in [1e-6, 1e-4, 1e-3, 1e-2, 0.1] {
                let (state, force) = motion(&system, h);
                let propagator = CubicPropagator::new(&system, h);
                for step in [CubicStep::Propagator(&propagator), CubicStep::Series(series, h)] {
                    let off = lost(&end(&step, &system, &force, &state(0.0)), &state(1.0), &state(0.0));
                    assert!(off < 2e-12, "{h}: {off:e}");
                }
                // Any part of the step, by the part of its force.
                for at in [0.1, 0.5, 0.9] {
                    let got = advance_cubic(&system, &series, at * h, &force.part(0.0, at), &state(0.0));
                    let off = lost(&got, &state(at), &state(0.0));
                    assert!(off < 2e-12, "{h} {at}: {off:e}");
                    let rest = force.part(at, 1.0 - at);
                    let got = advance_cubic(&system, &series, (1.0 - at) * h, &rest, &state(at));
                    assert!(lost(&got, &state(1.0), &state(0.0)) < 2e-12, "{h} {at}");
                }
            }
        }
    }

    #[test]
    fn the_difference_is_that_of_a_cubic_and_a_parabola() {
        for system in systems() {
            let h = 1e-3;
            let (_, CubicForce([_, _, quadratic, cubic])) = motion(&system, h);
            let (propagator, series) = (CubicPropagator::new(&system, h), PowerSeries::new(&system));
            let mut parabola = quadratic;
            add_scaled(&mut parabola, &cubic, 1.0);
            for step in [CubicStep::Propagator(&propagator), CubicStep::Series(series, h)] {
                let [both, difference] = step.curved(&system, [&quadratic, &cubic]);
                let [less, _] = step.curved(&system, [&parabola, &NO_FORCE]);
                let mut want = both;
                add_scaled(&mut want, &less, -1.0);
                assert!(lost(&difference, &want, &both) < 1e-13);
            }
        }
    }
}
