//! Exact propagation over many equal intervals at once, a long step, with bounds on the states in between.
//!
//! The state moves about a straight path p, the quasi-static one under a force that rises evenly from the first to the last sample:
//! `s = p + z`, `z' = A z + (0, r)`. Entry by entry
//!
//! ```text
//! |z| <= Q (|z(0)| + Σ |∫ exp(A τ) (0, r) dτ|),      Q = max over k of |exp(k A h)|
//! ```
//!
//! at all samples, with one integral for each interval. The residual force r is the excitation less its linear interpolation, and the
//! imbalance of the path: a small diagonal stiffness makes it unique where no link has stiffness, as in clearance.

use nalgebra::Matrix6;

use super::columns::{Columns, add_product, double, identity, plus_product, product, three_sums, whole};
use super::exponential::matrix;
use super::propagator::Propagator;
use super::{Equations, growth, growth_rate};
use crate::excitation::{Forcing, Instant};
use crate::numeric::bounded_vec::BoundedVec;
use crate::numeric::float::{add_scaled, fma, sqrt, times};
use crate::numeric::on_heap::{OnHeap, on_heap};
use crate::system::{Force, SUM_ROUNDING, Square, State, StateBox, energy_norm};

/// Number of intervals of a long step: a power of two, for the doubling of its matrices; its samples are summed three at a time.
pub(crate) const LONG_STEP: usize = if cfg!(feature = "std") { 32 } else { 2 };
const _: () = assert!(LONG_STEP.is_power_of_two() && (LONG_STEP + 1).is_multiple_of(3));

/// Samples of the components of an excitation over a long step.
pub(crate) type LongStepSamples = [[f64; LONG_STEP + 1]; 9];

/// Stiffness of the weak springs over that at rest.
const WEAK: f64 = 1e-6;

/// Share of the bounds that covers rounding.
const MARGIN: f64 = 1e-6;

/// Exact step over [`LONG_STEP`] intervals of h s.
#[derive(Debug, Clone)]
pub struct LongStep {
    /// `exp(LONG_STEP A h) - I`.
    exp_minus_identity: Columns<12>,
    from_constant: State,
    components: BoundedVec<Component, 9>,
    /// `(S + weak springs)⁻¹`.
    compliance: Square,
    /// Q.
    largest: Columns<12>,
    /// `|A²|`, entry by entry; zero if contacts cannot change.
    second: Columns<12>,
    /// Bound on `|exp(A τ)|` up to h.
    growth: f64,
    h: f64,
}

/// A component of the excitation.
#[derive(Debug, Clone, Copy)]
struct Component {
    /// Effects of its samples on the last state.
    effects: [State; LONG_STEP + 1],
    /// Bound on the effect of a sample over the two intervals beside it.
    beside: State,
}

/// Bounds on the states of a long step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LongStepBounds {
    /// Contains the states at all samples.
    pub samples: StateBox,
    /// How far a state may be out of the box between them.
    pub bow: f64,
    /// Start of the path.
    path: State,
    /// Bound on |z| at all samples.
    reach: State,
    /// Bound on what the unbalanced force and the rounding of the path add to each entry of z.
    everywhere: f64,
}

impl LongStep {
    /// The long step of intervals of `h` s over which `step` is the exact step.
    #[inline(always)]
    pub(crate) fn new<E: Equations>(
        equations: &E,
        step: &Propagator,
        forcing: &Forcing,
        h: f64,
    ) -> Option<OnHeap<Self>> {
        let (stiffness, _) = equations.tangent(&[0.0; 12], Instant::FIRST);
        let compliance = compliance(equations.frequency(), &stiffness)?;

        let once = step.exp_minus_identity;
        let (mut power, mut largest) = (identity::<12>(0), identity::<12>(0));
        for _ in 0..LONG_STEP {
            let before = power;
            add_product::<0, 12, 12>(&mut power, &once, &before);
            for (column, largest) in power.iter().zip(&mut largest) {
                for i in 0..12 {
                    let entry = column[i].abs();
                    // NaN stays.
                    largest[i] = if entry <= largest[i] { largest[i] } else { entry };
                }
            }
        }
        let mut second = [[0.0; 12]; 12];
        if E::PIECEWISE {
            let a = matrix(equations);
            second = product::<0, 12, 12>(whole(&a), whole(&a));
            for entry in second.as_flattened_mut() {
                *entry = entry.abs();
            }
        }

        let (mut exp_minus_identity, mut from_constant) = (once, step.from_constant);
        let mut intervals = 1;
        while intervals < LONG_STEP {
            let before = exp_minus_identity;
            let second_half = plus_product(&from_constant, &before, &from_constant);
            add_scaled(&mut from_constant, &second_half, 1.0);
            double(&mut exp_minus_identity, &before);
            intervals *= 2;
        }
        let none = Component { effects: [[0.0; 12]; LONG_STEP + 1], beside: [0.0; 12] };
        let mut components = BoundedVec::filled(none, forcing.influence().len());
        for (component, to) in components.as_mut_slice().iter_mut().enumerate() {
            let (start, end) = (&step.from_start[component], &step.from_end[component]);
            let Component { effects, beside } = to;
            effects[LONG_STEP] = *end;
            effects[LONG_STEP - 1] = plus_product(end, &once, end);
            add_scaled(&mut effects[LONG_STEP - 1], start, 1.0);
            for k in (1..LONG_STEP - 1).rev() {
                effects[k] = plus_product(&effects[k + 1], &once, &effects[k + 1]);
            }
            effects[0] = *start;
            for _ in 1..LONG_STEP {
                effects[0] = plus_product(&effects[0], &once, &effects[0]);
            }
            for i in 0..12 {
                beside[i] = start[i].abs() + end[i].abs();
            }
        }
        on_heap(Self {
            exp_minus_identity,
            from_constant,
            components,
            compliance,
            largest,
            second,
            growth: growth(growth_rate(equations), h),
            h,
        })
    }

    /// Bounds on the states of a long step from `state` by the same equations, under a forcing with these samples.
    #[inline(always)]
    pub(crate) fn bounds<E: Equations>(
        &self,
        equations: &E,
        forcing: &Forcing,
        samples: &LongStepSamples,
        state: &State,
    ) -> LongStepBounds {
        let duration = LONG_STEP as f64 * self.h;
        // Force at both ends of the even rise. Of the rest: bounds on its effects, and on its size.
        let (mut forces, mut vibration, mut rest) = ([*equations.constant(); 2], [0.0; 12], 0.0);
        for (i, (component, samples)) in self.components.as_slice().iter().zip(samples).enumerate() {
            let influence = &forcing.influence()[i];
            let (first, rise) = (samples[0], samples[LONG_STEP] - samples[0]);
            add_scaled(&mut forces[0], influence, first);
            add_scaled(&mut forces[1], influence, samples[LONG_STEP]);
            let (mut sum, mut most) = (0.0, 0.0);
            for k in 1..LONG_STEP {
                let off = (samples[k] - fma(k as f64 / LONG_STEP as f64, rise, first)).abs();
                sum += off;
                most = if off > most { off } else { most };
            }
            add_scaled(&mut vibration, &component.beside, sum);
            rest = fma(forcing.size[i], most, rest);
        }

        // The path: its velocity follows from the rise, its start from the force on a state with this velocity.
        let mut rise = [0.0; 6];
        for i in 0..6 {
            rise[i] = forces[1][i] - forces[0][i];
        }
        let travel = times(&self.compliance, &rise);
        let mut ends = [*state; 2];
        for i in 0..6 {
            let frequency = equations.frequency()[i];
            let velocity = if frequency > 0.0 { travel[i] / (duration * frequency) } else { 0.0 };
            (ends[0][6 + i], ends[1][6 + i]) = (velocity, velocity);
        }
        let to_path = times(&self.compliance, &accelerations(equations, &ends[0], &forces[0]));
        for i in 0..6 {
            ends[0][i] += to_path[i];
            ends[1][i] = ends[0][i] + travel[i];
        }
        // On a path that balances all forces there is no acceleration.
        let first = accelerations(equations, &ends[0], &forces[0]);
        let last = accelerations(equations, &ends[1], &forces[1]);
        let mut square = 0.0;
        for i in 0..6 {
            let (first, last) = (first[i].abs(), last[i].abs());
            let most = if first > last { first } else { last };
            square = fma(most, most, square);
        }
        let unbalanced = sqrt(square);
        rest += unbalanced;

        let rounding = SUM_ROUNDING * (energy_norm(&ends[0]) + energy_norm(&ends[1]));
        let everywhere = fma(self.growth * duration, unbalanced, rounding);
        // Twice the bound of rounding, so that the bounds serve the next long step too once the vibration has decayed to rounding.
        let all = everywhere + 2.0 * SUM_ROUNDING * energy_norm(state) + rounding;
        for i in 0..12 {
            vibration[i] += (state[i] - ends[0][i]).abs() + all;
        }
        let reach = self.reach(&vibration);
        let (mut low, mut high) = ([0.0; 12], [0.0; 12]);
        for i in 0..12 {
            let (a, b) = (ends[0][i], ends[1][i]);
            let (least, most) = if a < b { (a, b) } else { (b, a) };
            (low[i], high[i]) = (least - reach[i], most + reach[i]);
        }
        let bow = if E::PIECEWISE { self.bow(&reach, rest) } else { 0.0 };
        LongStepBounds { samples: StateBox::between(low, high), bow, path: ends[0], reach, everywhere }
    }

    /// Bound on |z| at all samples, from the bound on |z(0)| plus all integrals.
    #[inline(always)]
    fn reach(&self, vibration: &State) -> State {
        let mut reach = [0.0; 12];
        for (column, &entry) in self.largest.iter().zip(vibration) {
            add_scaled(&mut reach, column, (1.0 + MARGIN) * entry);
        }
        reach
    }

    /// Whether these bounds of a long step under a constant excitation hold for another long step from `state`, under the same excitation.
    #[inline(always)]
    pub(crate) fn holds(&self, bounds: &LongStepBounds, state: &State) -> bool {
        let everywhere = fma(SUM_ROUNDING, energy_norm(state), bounds.everywhere);
        let mut vibration = [0.0; 12];
        for i in 0..12 {
            vibration[i] = (state[i] - bounds.path[i]).abs() + everywhere;
        }
        let reach = self.reach(&vibration);
        let mut holds = true;
        for i in 0..12 {
            holds &= reach[i] <= bounds.reach[i]; // false for NaN
        }
        holds
    }

    /// How far a state may be from the straight line between those at two samples. With z up to `reach`, its second derivative lets it
    /// bow out; a rest up to this size acts at the sample and in between.
    #[inline(always)]
    fn bow(&self, reach: &State, rest: f64) -> f64 {
        let derivative = times(&self.second, reach);
        self.growth * self.h * fma(0.125 * self.h, energy_norm(&derivative), 2.0 * rest)
    }

    /// The state at the end of a long step.
    #[inline(always)]
    pub(crate) fn apply(&self, samples: &LongStepSamples, state: &State) -> State {
        let (mut sum, mut second, mut third) = (self.from_constant, *state, [0.0; 12]);
        for (component, samples) in self.components.as_slice().iter().zip(samples) {
            for k in (0..LONG_STEP + 1).step_by(3) {
                add_scaled(&mut sum, &component.effects[k], samples[k]);
                add_scaled(&mut second, &component.effects[k + 1], samples[k + 1]);
                add_scaled(&mut third, &component.effects[k + 2], samples[k + 2]);
            }
        }
        three_sums([sum, second, third], &self.exp_minus_identity, state)
    }

    /// The state at the end of a long step from `state`. `effect`: the state to which the same excitation leads from zero.
    #[inline(always)]
    pub(crate) fn repeat(&self, effect: &State, state: &State) -> State {
        three_sums([*effect, *state, [0.0; 12]], &self.exp_minus_identity, state)
    }
}

/// `(S + weak springs)⁻¹`.
pub(super) fn compliance(frequency: &[f64; 6], stiffness: &Square) -> Option<Square> {
    let springs = Matrix6::from_fn(|i, j| {
        // Modes that the body does not have get a stiffness, too.
        let weak = if frequency[i] > 0.0 { WEAK * frequency[i] } else { 1.0 };
        stiffness[j][i] + if i == j { weak } else { 0.0 }
    });
    Some(springs.try_inverse()?.into())
}

/// The accelerations of a state under a force.
#[inline(always)]
pub(super) fn accelerations<E: Equations>(equations: &E, state: &State, force: &Force) -> [f64; 6] {
    let rate = equations.linear(state, force);
    let mut accelerations = [0.0; 6];
    accelerations.copy_from_slice(&rate[6..]);
    accelerations
}
