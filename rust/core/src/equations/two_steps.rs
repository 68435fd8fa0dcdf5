//! Two exact steps of equal length at once.
//!
//! The second step of a [`Propagator`] waits for the first. Written as functions of the state before both, neither waits:
//!
//! ```text
//! x(h)  = x(0) +        E x(0) + B₀ f(0) + B₁ f(h)
//! x(2h) = x(0) + (2 E + E²) x(0) + (B₀ + E B₀) f(0) + (B₀ + B₁ + E B₁) f(h) + B₁ f(2h)
//! ```

use super::columns::{add_product, double};
use super::propagator::Propagator;
use crate::excitation::Values;
use crate::numeric::bounded_vec::BoundedVec;
use crate::numeric::float::add_scaled;
use crate::numeric::simd::{Aligned, dispatch_wide};
use crate::system::State;

/// The state after two steps, and that after one, each in 16 places: packed into 24, vectors would lie across both.
type Pair = Aligned<[f64; 32]>;

/// The states after one and after two steps of a [`Propagator`].
#[derive(Debug, Clone)]
pub struct TwoSteps {
    exp_minus_identity: [Pair; 12],
    from_constant: Pair,
    /// Effects of each component of the excitation, by its value at the start, in the middle and at the end.
    effects: BoundedVec<[Pair; 3], 9>,
}

impl TwoSteps {
    /// Two of these steps.
    #[inline(always)]
    pub(crate) fn new(step: &Propagator) -> Self {
        let mut effects = BoundedVec::filled([Aligned([0.0; 32]); 3], step.components);
        for (component, to) in effects.as_mut_slice().iter_mut().enumerate() {
            let (from_start, from_end) = (&step.from_start[component], &step.from_end[component]);
            let once = [*from_start, *from_end, [0.0; 12]];
            let mut twice = once;
            add_scaled(&mut twice[1], from_start, 1.0);
            add_scaled(&mut twice[2], from_end, 1.0);
            add_product::<0, 12, 3>(&mut twice, &step.exp_minus_identity, &once);
            for place in 0..3 {
                to[place] = pair(&twice[place], &once[place]);
            }
        }
        let (mut twice, mut constant) = (step.exp_minus_identity, [step.from_constant]);
        double(&mut twice, &step.exp_minus_identity);
        double(&mut constant, &step.exp_minus_identity);
        let mut exp_minus_identity = [Aligned([0.0; 32]); 12];
        for j in 0..12 {
            exp_minus_identity[j] = pair(&twice[j], &step.exp_minus_identity[j]);
        }
        Self { exp_minus_identity, from_constant: pair(&constant[0], &step.from_constant), effects }
    }

    /// Steps from `state` under the excitation `values`, the first of which are at `state`; writes the state after each step to `states`, an
    /// even number, one fewer than the values.
    pub(crate) fn follow(&self, state: &State, values: &[Values], states: &mut [State]) {
        dispatch_wide!(follow(self, state, values, states));
    }
}

/// [`TwoSteps::follow`].
#[inline(always)]
fn follow(steps: &TwoSteps, state: &State, values: &[Values], states: &mut [State]) {
    let mut state = *state;
    for (states, values) in states.as_chunks_mut::<2>().0.iter_mut().zip(values.windows(3).step_by(2)) {
        // The excitation first, because it does not depend on the state.
        let mut sum = steps.from_constant.0;
        for (component, effects) in steps.effects.as_slice().iter().enumerate() {
            for place in 0..3 {
                add_scaled(&mut sum, &effects[place].0, values[place][component]);
            }
        }
        // Two sums side by side: each addition to a single one would wait for the one before.
        let mut second = pair(&state, &state).0;
        for j in (0..12).step_by(2) {
            add_scaled(&mut sum, &steps.exp_minus_identity[j].0, state[j]);
            add_scaled(&mut second, &steps.exp_minus_identity[j + 1].0, state[j + 1]);
        }
        for i in 0..32 {
            sum[i] += second[i];
        }
        state.copy_from_slice(&sum[..12]);
        states[0].copy_from_slice(&sum[16..28]);
        states[1] = state;
    }
}

#[inline(always)]
fn pair(first: &State, second: &State) -> Pair {
    let mut pair = [0.0; 32];
    pair[..12].copy_from_slice(first);
    pair[16..28].copy_from_slice(second);
    Aligned(pair)
}
