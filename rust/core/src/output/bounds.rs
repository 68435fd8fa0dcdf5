//! Bounds on loads, from the ranges of the entries of the state.

use super::extremes::Extremes;
use super::loads::{NonlinearLink, Wrench};
use crate::model::{Law, forces};
use crate::numeric::float::fma;
use crate::system::{Bounded, LinkRow, SUM_ROUNDING, StateBox};

/// Half the range of an entry between some instants and in between, over that at the instants: 1.16 for six instants per period of a
/// vibration.
const BETWEEN: f64 = 1.25;

impl StateBox {
    /// Which values of a load may pass their extremes at instants with states in the box, or between them: the components, the y-z resultant
    /// of the force, and the magnitude of the moment. `inputs`: of the excitation at these instants. True for NaN.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn may_pass(&self, load: &Wrench, inputs: &[Bounded; 9], extremes: &Extremes) -> [bool; 8] {
        let mut states = *self;
        for radius in &mut states.radius {
            *radius *= BETWEEN;
        }
        let [mut middle, mut radius] = [load.linear.constant; 2];
        for radius in &mut radius {
            *radius = SUM_ROUNDING * radius.abs();
        }
        for j in 0..12 {
            for i in 0..6 {
                let coefficient = load.linear.by_state[j][i];
                middle[i] = fma(coefficient, states.middle[j], middle[i]);
                radius[i] = fma(coefficient.abs(), states.radius[j], radius[i]);
            }
        }
        if load.linear.by_input_at_all {
            for (column, [at, reach]) in load.linear.by_input.iter().zip(inputs) {
                for i in 0..6 {
                    middle[i] = fma(column[i], *at, middle[i]);
                    radius[i] = fma(column[i].abs(), *reach, radius[i]);
                }
            }
        }
        for NonlinearLink { row, elastic, damping } in load.nonlinear.as_slice() {
            let force = states.force(row.link.law(), row);
            for i in 0..6 {
                middle[i] = fma(elastic[i], force[0], middle[i]);
                radius[i] = fma(elastic[i].abs(), force[1], radius[i]);
            }
            if row.link.is_damped_in_contact() {
                let most = states.largest_damping(row);
                for i in 0..6 {
                    radius[i] = fma(damping[i].abs(), most, radius[i]);
                }
            }
        }
        outside(&middle, &radius, extremes)
    }

    /// The elastic load of a link.
    #[cfg_attr(feature = "std", inline(always))]
    fn force(&self, law: &Law, row: &LinkRow) -> Bounded {
        let (mut at, mut reach) = (row.rest, SUM_ROUNDING * row.rest.abs());
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
    let rounding = SUM_ROUNDING * (low.abs() + high.abs() + largest);
    [0.5 * (low + high), 0.5 * (high - low) + rounding]
}

/// Which of the components between these bounds, their y-z resultant and the magnitude of the moment may be outside the extremes. True for
/// NaN, and for infinite squares before the first instant.
#[cfg_attr(feature = "std", inline(always))]
fn outside(middle: &[f64; 6], radius: &[f64; 6], extremes: &Extremes) -> [bool; 8] {
    let mut outside = [true; 8];
    // Squares of the smallest and of the largest magnitude.
    let (mut least, mut most) = ([0.0; 6], [0.0; 6]);
    for i in 0..6 {
        let (low, high) = (middle[i] - radius[i], middle[i] + radius[i]);
        outside[i] = !((low >= extremes.smallest[i]) & (high <= extremes.largest[i]));
        let (inner, outer) = (middle[i].abs() - radius[i], middle[i].abs() + radius[i]);
        let inner = if inner > 0.0 { inner } else { 0.0 };
        (least[i], most[i]) = (inner * inner, outer * outer);
    }
    let least = [least[1] + least[2], least[3] + least[4] + least[5]];
    let most = [most[1] + most[2], most[3] + most[4] + most[5]];
    for i in 0..2 {
        // The smallest one is below zero where it is not wanted.
        let (smallest, largest) = (f64::max(extremes.smallest[6 + i], 0.0), extremes.largest[6 + i]);
        outside[6 + i] = !((least[i] * (1.0 - SUM_ROUNDING) >= smallest * smallest)
            & (most[i] * (1.0 + SUM_ROUNDING) <= largest * largest)
            & (largest >= 0.0));
    }
    outside
}
