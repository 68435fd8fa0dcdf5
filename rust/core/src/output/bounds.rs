//! Bounds on loads, from the ranges of the entries of the state.

use super::extremes::Extremes;
use super::loads::{NonlinearLink, Wrench};
use crate::model::{Law, forces};
use crate::numeric::float::fma;
use crate::system::{LinkRow, State};

/// Ranges of the entries of some states.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StateBox {
    low: State,
    high: State,
    middle: State,
    /// Half of each range, and more than rounding can add to a sum of some twenty terms.
    radius: State,
}

/// Rounding of a sum of some twenty terms over the sum of their sizes is far below this.
pub(crate) const ROUNDING: f64 = 1e-13;

/// The middle between two bounds, and half their distance.
pub(crate) type Bounded = [f64; 2];

impl StateBox {
    /// A box without states.
    pub(crate) const NOTHING: Self = Self {
        low: [f64::INFINITY; 12],
        high: [f64::NEG_INFINITY; 12],
        middle: [0.0; 12],
        radius: [f64::INFINITY; 12],
    };

    /// The box of some states.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn of<const N: usize>(states: &[State; N]) -> Self {
        let (mut low, mut high) = (states[0], states[0]);
        for state in states {
            for j in 0..12 {
                low[j] = if state[j] < low[j] { state[j] } else { low[j] };
                high[j] = if state[j] > high[j] { state[j] } else { high[j] };
            }
        }
        Self::between(low, high)
    }

    /// The box between these bounds.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn between(low: State, high: State) -> Self {
        let (mut middle, mut radius) = ([0.0; 12], [0.0; 12]);
        for j in 0..12 {
            middle[j] = 0.5 * (low[j] + high[j]);
            radius[j] = fma(ROUNDING, low[j].abs() + high[j].abs(), 0.5 * (high[j] - low[j]));
        }
        Self { low, high, middle, radius }
    }

    /// The box with the same middle and twice the width.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn widened(&self) -> Self {
        let (mut low, mut high) = (self.low, self.high);
        for j in 0..12 {
            let half = 0.5 * (high[j] - low[j]);
            (low[j], high[j]) = (low[j] - half, high[j] + half);
        }
        Self::between(low, high)
    }

    /// Whether this box is a part of the other.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn is_within(&self, other: &Self) -> bool {
        let mut within = true;
        for j in 0..12 {
            within &= (self.low[j] >= other.low[j]) & (self.high[j] <= other.high[j]);
        }
        within
    }

    /// An entry.
    #[cfg(feature = "std")]
    #[inline(always)]
    pub(crate) fn entry(&self, j: usize) -> Bounded {
        [self.middle[j], self.radius[j]]
    }

    /// Whether a component of a load that does not depend on the excitation directly may pass its extremes. True for NaN.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn may_pass(&self, load: &Wrench, extremes: &Extremes) -> bool {
        let [mut middle, mut radius] = [load.linear.constant; 2];
        for radius in &mut radius {
            *radius = ROUNDING * radius.abs();
        }
        for j in 0..12 {
            for i in 0..6 {
                let coefficient = load.linear.by_state[j][i];
                middle[i] = fma(coefficient, self.middle[j], middle[i]);
                radius[i] = fma(coefficient.abs(), self.radius[j], radius[i]);
            }
        }
        for NonlinearLink { row, elastic, damping } in load.nonlinear.as_slice() {
            let force = self.force(row.link.law(), row);
            for i in 0..6 {
                middle[i] = fma(elastic[i], force[0], middle[i]);
                radius[i] = fma(elastic[i].abs(), force[1], radius[i]);
            }
            if row.link.is_damped_in_contact() {
                let most = self.largest_damping(row);
                for i in 0..6 {
                    radius[i] = fma(damping[i].abs(), most, radius[i]);
                }
            }
        }
        !within(&middle, &radius, extremes)
    }

    /// The elastic load of a link.
    #[cfg_attr(feature = "std", inline(always))]
    fn force(&self, law: &Law, row: &LinkRow) -> Bounded {
        let (mut at, mut reach) = (row.rest, ROUNDING * row.rest.abs());
        for j in 0..6 {
            at = fma(row.deflection[j], self.middle[j], at);
            reach = fma(row.deflection[j].abs(), self.radius[j], reach);
        }
        force_bounds(law, [at, reach])
    }

    /// Largest magnitude of the load of the damper of a link.
    #[cfg_attr(feature = "std", inline(always))]
    fn largest_damping(&self, row: &LinkRow) -> f64 {
        let mut most = 0.0;
        for j in 0..6 {
            most = fma(row.damping[j].abs(), self.middle[6 + j].abs() + self.radius[6 + j], most);
        }
        most
    }
}

/// The force of a law from the bounds on the deflection.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn force_bounds(law: &Law, [at, reach]: Bounded) -> Bounded {
    // No law falls as the deflection grows.
    let [low, high] = forces(law, &[at - reach, at + reach]);
    // Where the force is a small difference of two large ones, these are as large as at an edge.
    let largest = law.edges().last().map_or(0.0, |edge| (law.nominal() * edge).abs());
    let rounding = ROUNDING * (low.abs() + high.abs() + largest);
    [0.5 * (low + high), 0.5 * (high - low) + rounding]
}

/// Whether components between these bounds, their y-z resultant and the magnitude of the moment are within the extremes. False for NaN.
#[cfg_attr(feature = "std", inline(always))]
fn within(middle: &[f64; 6], radius: &[f64; 6], extremes: &Extremes) -> bool {
    let mut within = true;
    // Squares of the smallest and of the largest magnitude.
    let (mut least, mut most) = ([0.0; 6], [0.0; 6]);
    for i in 0..6 {
        let (low, high) = (middle[i] - radius[i], middle[i] + radius[i]);
        within &= (low >= extremes.smallest[i]) & (high <= extremes.largest[i]);
        let (inner, outer) = (middle[i].abs() - radius[i], middle[i].abs() + radius[i]);
        let inner = if inner > 0.0 { inner } else { 0.0 };
        (least[i], most[i]) = (inner * inner, outer * outer);
    }
    let least = [least[1] + least[2], least[3] + least[4] + least[5]];
    let most = [most[1] + most[2], most[3] + most[4] + most[5]];
    for i in 0..2 {
        let (smallest, largest) = (extremes.smallest[6 + i], extremes.largest[6 + i]);
        within &= least[i] * (1.0 - ROUNDING) >= smallest * smallest;
        within &= most[i] * (1.0 + ROUNDING) <= largest * largest;
    }
    within
}
