//! Equations linearised about an equilibrium under a constant excitation, about which a preloaded body vibrates freely.

use super::long_step::{LONG_STEP, LongStep, LongStepBounds, LongStepSamples, accelerations, compliance};
use super::propagator::Propagator;
use super::{Equations, SegmentEquations};
use crate::excitation::{Forcing, Instant, Values};
use crate::numeric::float::{add_columns, add_scaled, fma, times};
use crate::numeric::on_heap::{OnHeap, on_heap};
use crate::numeric::simd::dispatch;
use crate::system::{Force, NO_FORCE, State, energy_norm};

/// Linearised equations with their exact steps over intervals of one length.
#[derive(Debug, Clone)]
pub struct Linearized {
    /// The constant excitation, the length of the intervals, s, and the key of the equations.
    valid_for: (Values, f64, u32),
    /// About which the equations are linearised.
    equilibrium: State,
    equations: SegmentEquations,
    step: Propagator,
    long_step: OnHeap<LongStep>,
}

impl Linearized {
    /// The linearised equations under the excitation `values`, for intervals of `h` s. `state`: not far from the equilibrium. None if their
    /// stiffness is singular.
    #[inline(never)]
    pub(crate) fn new<E: Equations>(
        equations: &E,
        forcing: &Forcing,
        values: &Values,
        h: f64,
        state: &State,
    ) -> Option<OnHeap<Self>> {
        dispatch!(linearize(equations, forcing, values, h, state))
    }

    /// Whether they are those of these equations under this excitation, for intervals of this length.
    #[inline(always)]
    pub(crate) fn is_valid_for(&self, values: &Values, h: f64, key: u32) -> bool {
        self.valid_for == (*values, h, key)
    }

    /// Bounds on the states at the next [`LONG_STEP`] samples.
    #[inline(always)]
    pub(crate) fn bounds(&self, state: &State) -> LongStepBounds {
        self.long_step.bounds(&self.equations, &Forcing::NONE, &NO_SAMPLES, state)
    }

    /// Whether these bounds hold from `state` on, too.
    #[inline(always)]
    pub(crate) fn holds(&self, bounds: &LongStepBounds, state: &State) -> bool {
        self.long_step.holds(bounds, state)
    }

    /// Bounds on the error of the modal force in any state within `bounds`. `equations`: those that were linearised.
    #[inline(always)]
    pub(crate) fn force_error<E: Equations>(&self, equations: &E, bounds: &LongStepBounds) -> Force {
        equations.tangent_error(&self.equilibrium, &bounds.samples)
    }

    /// The state [`LONG_STEP`] intervals later.
    #[inline(always)]
    pub(crate) fn long_step(&self, state: &State) -> State {
        self.long_step.apply(&NO_SAMPLES, state)
    }

    /// The states at the next [`LONG_STEP`] samples.
    #[inline(always)]
    pub(crate) fn steps(&self, state: &State) -> [State; LONG_STEP] {
        let (mut states, mut last) = ([[0.0; 12]; LONG_STEP], *state);
        for state in &mut states {
            last = self.step.apply(&last, &[0.0; 9], &[0.0; 9]);
            *state = last;
        }
        states
    }
}

/// Of an excitation without components.
const NO_SAMPLES: LongStepSamples = [[0.0; LONG_STEP + 1]; 9];

/// [`Linearized::new`].
#[inline(always)]
fn linearize<E: Equations>(
    equations: &E,
    forcing: &Forcing,
    values: &Values,
    h: f64,
    state: &State,
) -> Option<OnHeap<Linearized>> {
    let mut force = *equations.constant();
    add_columns(&mut force, forcing.influence(), values);
    let mut at = *state;
    at[6..].fill(0.0);
    for _ in 0..MOST_NEWTON_STEPS {
        let (stiffness, _) = equations.tangent(&at, Instant::FIRST);
        let mut step = [0.0; 12];
        step[..6].copy_from_slice(&times(
            &compliance(equations.frequency(), &stiffness)?,
            &accelerations(equations, &at, &whole_force(equations, &at, &force)),
        ));
        if energy_norm(&step) <= CONVERGED * energy_norm(state) {
            break;
        }
        add_scaled(&mut at, &step, 1.0);
    }
    let (stiffness, damping) = equations.tangent(&at, Instant::FIRST);
    let found = accelerations(equations, &at, &whole_force(equations, &at, &force));
    let mut constant = NO_FORCE;
    for i in 0..6 {
        constant[i] = found[i];
        for j in 0..6 {
            constant[i] = fma(stiffness[j][i], at[j], constant[i]);
        }
    }
    let linear = SegmentEquations::new(*equations.frequency(), [stiffness, damping], constant);
    let step = Propagator::new(&linear, &[], h);
    let long_step = LongStep::new(&linear, &step, &Forcing::NONE, h)?;
    let valid_for = (*values, h, equations.key());
    on_heap(Linearized { valid_for, equilibrium: at, equations: linear, step, long_step })
}

/// Most steps of Newton's method; it ends at a step below `CONVERGED` times the size of the first state. The equilibrium need not be exact,
/// because the error is bounded about the state found.
const MOST_NEWTON_STEPS: usize = 8;
const CONVERGED: f64 = 1e-6;

/// With the nonlinear loads in a state.
#[inline(always)]
fn whole_force<E: Equations>(equations: &E, state: &State, force: &Force) -> Force {
    let mut sum = *force;
    add_scaled(&mut sum, &equations.remainder(state).force, 1.0);
    sum
}

#[cfg(test)]
mod tests {
    use crate::equations::{Equations, SmoothEquations};
    use crate::excitation::{Excitation, Instant};
    use crate::system::{State, StateBox, System};
    use crate::yardstick::{cart_links, cart_on, number};
    use crate::{Law, Link};

    /// The cart on rows of balls, rows of rollers, or both and springs.
    fn systems() -> [System; 3] {
        [[1.5, 1.5, 1.5], [10.0 / 9.0; 3], [1.5, 10.0 / 9.0, 0.0]].map(|exponents| {
            let mut links = cart_links(1e5);
            for (i, link) in links.iter_mut().enumerate().filter(|(i, _)| exponents[i % 3] > 1.0) {
                let law = Law::preloaded(link.stiffness(), 600.0 + 40.0 * i as f64, exponents[i % 3]);
                let law = law.expect("a law");
                *link = Link::with_law(link.point(), link.direction(), law, 1e5).expect("a link");
            }
            cart_on(&links)
        })
    }

    /// Modal force of all loads at a state, without dampers.
    fn loads(equations: &SmoothEquations, state: &State) -> [f64; 6] {
        let rate = equations.linear(state, &equations.remainder(state).force);
        core::array::from_fn(|i| rate[6 + i])
    }

    #[test]
    fn no_load_is_farther_off_the_tangent_than_its_bound() {
        let (samples, mut tight, mut crossed) = ([[0.0; 3]; 2], 0, 0);
        let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
        for system in systems() {
            let equations = SmoothEquations::at_rest(&system, &excitation);
            for case in 0..200 {
                // The state in which the laws are linearised is near the middle of the box, or at its border.
                let size = 0.3 * 10f64.powf(-2.0 * number(1000 + case).abs() - 1.0 * (case % 3) as f64);
                let mut at = [0.0; 12];
                let (mut low, mut high) = (at, at);
                for j in 0..system.mode_count() {
                    at[j] = 0.4 * number(20 * case + j);
                    let middle = at[j] + size * number(20 * case + 6 + j);
                    (low[j], high[j]) = (middle - size, middle + size);
                }
                let bounds = equations.tangent_error(&at, &StateBox::between(low, high));
                let (stiffness, _) = equations.tangent(&at, Instant::FIRST);
                let at_middle = loads(&equations, &at);
                let mut largest = [0f64; 6];
                for point in 0..64 {
                    let mut state = at;
                    for j in 0..6 {
                        // Corners of the box and points within.
                        let place = if point < 32 {
                            f64::from(point >> j & 1)
                        } else {
                            0.5 + 0.5 * number(64 * case + 6 * point as usize + j)
                        };
                        state[j] = low[j] + place * (high[j] - low[j]);
                    }
                    let found = loads(&equations, &state);
                    for i in 0..6 {
                        let tangent: f64 = (0..6).map(|j| stiffness[j][i] * (at[j] - state[j])).sum();
                        largest[i] = f64::max(largest[i], (found[i] - at_middle[i] - tangent).abs());
                    }
                }
                for i in 0..system.mode_count() {
                    assert!(
                        largest[i] <= bounds[i] * (1.0 + 1e-9) + 1e-9,
                        "{}: {} {}",
                        case,
                        largest[i],
                        bounds[i]
                    );
                    tight += usize::from(largest[i] > 0.2 * bounds[i]);
                }
                let opens = system.rows().iter().any(|row| row.segment_at(&low) != row.segment_at(&high));
                assert!(!opens || bounds[0].is_infinite(), "{case}");
                crossed += usize::from(bounds[0].is_infinite());
            }
        }
        assert!(tight > 300 && (50..400).contains(&crossed), "{tight} {crossed}");
    }
}
