//! The drawn motions of samples that run at a time.

use super::lanes::Deviations;
use super::motion_draws::MotionDraws;
use crate::excitation::Excitation;
use crate::numeric::simd::{Aligned, LANES, Lanes, MAX_LANES};
use crate::numeric::watch::Watch;

/// Drawn motions of up to eight samples.
#[derive(Default)]
pub(super) struct Drawn {
    /// Deviations from the estimate at the samples of the motion, m/s².
    rows: Vec<Aligned<Lanes>>,
    /// The same in another order of the samples.
    ordered: Vec<Aligned<Lanes>>,
    /// Accelerations of some of the samples, m/s².
    accelerations: [Vec<[f64; 3]>; MAX_LANES],
}

impl Drawn {
    /// Draws the motions of the samples with these rows of values, at least one and at most eight. `draws`: with the column of the numbers.
    pub(super) fn draw(
        &mut self,
        draws: Option<(&MotionDraws, usize)>,
        values: &[f64],
        columns: usize,
        watch: Watch,
    ) {
        if let Some((draws, column)) = draws {
            let last = values.len() / columns - 1;
            let number = |lane| values[usize::min(lane, last) * columns + column] as u64;
            draws.draw(core::array::from_fn(number), watch, &mut self.rows);
        }
    }

    /// The deviations of the samples at these places, side by side in so many lanes; none if the motion is not drawn.
    pub(super) fn deviations(&mut self, places: &[usize], lanes: usize) -> Option<Deviations<'_>> {
        let first = *places.first().filter(|_| !self.rows.is_empty())?;
        let side_by_side = places.iter().zip(first..).all(|(&place, expected)| place == expected);
        if side_by_side && first + lanes <= LANES {
            return Some(Deviations::new(&self.rows, first));
        }
        let place = |lane: usize| places[usize::min(lane, places.len() - 1)];
        self.ordered.clear();
        let ordered = |Aligned(row): &Aligned<Lanes>| Aligned(core::array::from_fn(|lane| row[place(lane)]));
        self.ordered.extend(self.rows.iter().map(ordered));
        Some(Deviations::new(&self.ordered, 0))
    }

    /// The acceleration of the sample at this place; none if the motion is not drawn.
    pub(super) fn motion(&mut self, estimate: &Excitation, place: usize) -> Option<&[[f64; 3]]> {
        self.set_motions(estimate, &[place]);
        self.motion_in(0)
    }

    /// Computes the accelerations of the samples at up to [`MAX_LANES`] places.
    pub(super) fn set_motions(&mut self, estimate: &Excitation, places: &[usize]) {
        for (acceleration, &place) in self.accelerations.iter_mut().zip(places) {
            acceleration.clear();
            acceleration.extend(self.rows.iter().enumerate().map(|(k, Aligned(row))| {
                let [x, y, z] = core::array::from_fn(|component| estimate.component(k, component));
                [x + row[place], y, z]
            }));
        }
    }

    /// The acceleration of the sample at the place of this index in the last [`Drawn::set_motions`]; none if the motion is not drawn.
    pub(super) fn motion_in(&self, index: usize) -> Option<&[[f64; 3]]> {
        (!self.rows.is_empty()).then_some(&self.accelerations[index][..])
    }
}
