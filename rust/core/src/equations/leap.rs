//! Leaps: the exact solution over many equal intervals at once, and bounds on the states in between.
//!
//! The state moves about a straight path p, the quasi-static one under a force that rises evenly from the first to the last sample:
//! `s = p + z`, `z' = A z + (0, r)`. Entry by entry
//!
//! ```text
//! |z| <= Q (|z(0)| + Σ |∫ exp(A τ) (0, r) dτ|),      Q = max over k of |exp(k A h)|
//! ```
//!
//! at all samples, with one integral for each interval. The rest r is the excitation less the even rise, and the force of weak springs: they
//! hold the path where no link has stiffness, as where all links of one direction are in their clearance.

use nalgebra::Matrix6;

use super::propagator::{Columns, Propagator, add_product, double, identity, matrix, plus_product, product};
use super::{Equations, growth, growth_rate};
use crate::excitation::{Forcing, Instant};
use crate::numeric::float::{add_scaled, fma, sqrt};
use crate::system::{Force, ROUNDING, Square, State, StateBox, size};

/// Number of intervals of a leap.
pub(crate) const LEAP: usize = 32;

/// Samples of the components of an excitation over a leap.
pub(crate) type Stretch = [[f64; LEAP + 1]; 9];

/// Stiffness of the weak springs over that at rest. (Their compliance is 1e6 times that at rest at most, so that of sixteen digits of the path
/// ten are right.)
const WEAK: f64 = 1e-6;

/// Share of the bounds that covers rounding and the digits of the path that are not right.
const MARGIN: f64 = 1e-6;

/// Exact step over [`LEAP`] intervals of h s.
#[derive(Debug, Clone)]
pub struct Leap {
    /// `exp(LEAP A h) - I`.
    change: Columns<12>,
    from_constant: State,
    components: Vec<Component>,
    constant: Force,
    /// `(S + weak springs)⁻¹`.
    compliance: Square,
    /// Q.
    largest: Columns<12>,
    /// `|A²|`, entry by entry.
    second: Columns<12>,
    /// Bound on `|exp(A τ)|` up to h.
    growth: f64,
    h: f64,
}

/// A component of the excitation.
#[derive(Debug, Clone)]
struct Component {
    /// Effects of its samples on the last state.
    effects: [State; LEAP + 1],
    /// Bound on the effect of one sample over the two intervals beside it.
    once: State,
    /// Modal force of a unit, and its size.
    influence: Force,
    size: f64,
}

/// Bounds on the states of a leap.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LeapBounds {
    /// Contains the states at all samples.
    pub samples: StateBox,
    /// How far a state may be out of the box in between.
    pub between: f64,
}

impl Leap {
    /// The leap of intervals of `h` s over which `step` is the exact step.
    #[inline(always)]
    pub(crate) fn new<E: Equations>(
        equations: &E,
        step: &Propagator,
        forcing: &Forcing,
        h: f64,
    ) -> Option<Box<Self>> {
        let (stiffness, _) = equations.tangent(&[0.0; 12], Instant::FIRST);
        let springs = Matrix6::from_fn(|i, j| {
            // Modes that the body does not have get a stiffness, too.
            let weak = if equations.frequency()[i] > 0.0 { WEAK * equations.frequency()[i] } else { 1.0 };
            stiffness[j][i] + if i == j { weak } else { 0.0 }
        });
        let compliance = springs.try_inverse()?.into();

        let one = step.change;
        let (mut power, mut largest) = (identity::<12>(0), identity::<12>(0));
        for _ in 0..LEAP {
            let before = power;
            add_product(&mut power, &one, &before);
            for (column, largest) in power.iter().zip(&mut largest) {
                for i in 0..12 {
                    let entry = column[i].abs();
                    largest[i] = if entry > largest[i] { entry } else { largest[i] };
                }
            }
        }
        let a = matrix(equations);
        let mut second = product(&a, &a);
        for entry in second.as_flattened_mut() {
            *entry = entry.abs();
        }

        let (mut change, mut from_constant) = (one, step.from_constant);
        let mut intervals = 1;
        while intervals < LEAP {
            let before = change;
            let twice = plus_product(&from_constant, &before, &from_constant);
            add_scaled(&mut from_constant, &twice, 1.0);
            double(&mut change, &before);
            intervals *= 2;
        }
        let mut components = Vec::with_capacity(forcing.influence().len());
        for (component, influence) in forcing.influence().iter().enumerate() {
            let (start, end) = (&step.from_start[component], &step.from_end[component]);
            let (mut effects, mut once) = ([[0.0; 12]; LEAP + 1], [0.0; 12]);
            effects[LEAP] = *end;
            effects[LEAP - 1] = plus_product(end, &one, end);
            add_scaled(&mut effects[LEAP - 1], start, 1.0);
            for k in (1..LEAP - 1).rev() {
                effects[k] = plus_product(&effects[k + 1], &one, &effects[k + 1]);
            }
            effects[0] = *start;
            for _ in 1..LEAP {
                effects[0] = plus_product(&effects[0], &one, &effects[0]);
            }
            for i in 0..12 {
                once[i] = start[i].abs() + end[i].abs();
            }
            let size = sqrt(influence.iter().map(|f| f * f).sum());
            components.push(Component { effects, once, influence: *influence, size });
        }
        Some(Box::new(Self {
            change,
            from_constant,
            components,
            constant: *equations.constant(),
            compliance,
            largest,
            second,
            growth: growth(growth_rate(equations), h),
            h,
        }))
    }

    /// Bounds on the states of a leap from `state`, by the same equations.
    #[inline(always)]
    pub(crate) fn bounds<E: Equations>(&self, equations: &E, state: &State, stretch: &Stretch) -> LeapBounds {
        let duration = LEAP as f64 * self.h;
        // Force at the start, its rise, and the rest: bounds on its effects, and its largest size.
        let (mut force, mut rise, mut vibration, mut rest) = (self.constant, [0.0; 6], [0.0; 12], 0.0);
        for (component, samples) in self.components.iter().zip(stretch) {
            let (first, change) = (samples[0], samples[LEAP] - samples[0]);
            add_scaled(&mut force, &component.influence, first);
            for i in 0..6 {
                rise[i] = fma(component.influence[i], change, rise[i]);
            }
            let (mut sum, mut most) = (0.0, 0.0);
            for k in 1..LEAP {
                let off = (samples[k] - fma(k as f64 / LEAP as f64, change, first)).abs();
                sum += off;
                most = if off > most { off } else { most };
            }
            add_scaled(&mut vibration, &component.once, sum);
            rest = fma(component.size, most, rest);
        }

        // The path: its velocity follows from the rise, its start from the force on a state with this velocity.
        let travel = times(&self.compliance, &rise);
        let mut ends = [*state; 2];
        for i in 0..6 {
            let frequency = equations.frequency()[i];
            let velocity = if frequency > 0.0 { travel[i] / (duration * frequency) } else { 0.0 };
            (ends[0][6 + i], ends[1][6 + i]) = (velocity, velocity);
        }
        let pull = equations.linear(&ends[0], &force);
        let mut of_springs = [0.0; 6];
        of_springs.copy_from_slice(&pull[6..]);
        let to_path = times(&self.compliance, &of_springs);
        let mut held = 0.0;
        for i in 0..6 {
            let (first, last) = (to_path[i].abs(), (to_path[i] + travel[i]).abs());
            ends[0][i] += to_path[i];
            ends[1][i] = ends[0][i] + travel[i];
            let spring = WEAK * equations.frequency()[i] * if first > last { first } else { last };
            held = fma(spring, spring, held);
        }
        rest += sqrt(held);

        let everywhere = fma(self.growth * duration, sqrt(held), ROUNDING * (size(state) + size(&ends[1])));
        for i in 0..12 {
            vibration[i] += (state[i] - ends[0][i]).abs() + everywhere;
        }
        let mut reach = [0.0; 12];
        for (column, &entry) in self.largest.iter().zip(&vibration) {
            add_scaled(&mut reach, column, (1.0 + MARGIN) * entry);
        }
        let (mut low, mut high) = ([0.0; 12], [0.0; 12]);
        for i in 0..12 {
            let (a, b) = (ends[0][i], ends[1][i]);
            let (least, most) = if a < b { (a, b) } else { (b, a) };
            (low[i], high[i]) = (least - reach[i], most + reach[i]);
        }
        let between = if E::PIECEWISE { self.between(&reach, rest) } else { 0.0 };
        LeapBounds { samples: StateBox::between(low, high), between }
    }

    /// How far a state may be from the line between its neighbours at samples: as far as its second derivative lets it bow out, with z up to
    /// `reach`, and twice the effect of a rest up to this size.
    #[inline(always)]
    fn between(&self, reach: &State, rest: f64) -> f64 {
        let mut derivative = [0.0; 12];
        for (column, &entry) in self.second.iter().zip(reach) {
            add_scaled(&mut derivative, column, entry);
        }
        self.growth * self.h * fma(0.125 * self.h, size(&derivative), 2.0 * rest)
    }

    /// The state at the end of a leap.
    #[inline(always)]
    pub(crate) fn apply(&self, state: &State, stretch: &Stretch) -> State {
        let (mut sum, mut second, mut third) = (self.from_constant, *state, [0.0; 12]);
        for (component, samples) in self.components.iter().zip(stretch) {
            for k in (0..LEAP + 1).step_by(3) {
                add_scaled(&mut sum, &component.effects[k], samples[k]);
                add_scaled(&mut second, &component.effects[k + 1], samples[k + 1]);
                add_scaled(&mut third, &component.effects[k + 2], samples[k + 2]);
            }
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

/// A matrix by columns times a vector.
#[inline(always)]
fn times(columns: &Square, vector: &[f64; 6]) -> [f64; 6] {
    let mut sum = [0.0; 6];
    for (column, &entry) in columns.iter().zip(vector) {
        add_scaled(&mut sum, column, entry);
    }
    sum
}
