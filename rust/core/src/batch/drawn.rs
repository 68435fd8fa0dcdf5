//! The drawn motions of samples that run at a time.

use super::Batch;
use super::lanes::Deviations;
use crate::numeric::simd::{LANES, Lanes};

/// Drawn motions of up to eight samples.
#[derive(Default)]
pub(super) struct Drawn {
    /// Deviations from the estimate at the samples of the motion, m/s².
    rows: Vec<Lanes>,
    /// The same in another order of the samples.
    ordered: Vec<Lanes>,
    /// Acceleration of one of the samples, m/s².
    acceleration: Vec<[f64; 3]>,
}

impl Drawn {
    /// Draws the motions of the samples with these rows of values, at least one and at most eight.
    pub(super) fn draw(&mut self, batch: &Batch, values: &[f64], columns: usize) {
        if let Some((draws, column)) = batch.draws {
            let last = values.len() / columns - 1;
            let number = |lane| values[usize::min(lane, last) * columns + column] as u64;
            draws.draw(core::array::from_fn(number), batch.watch, &mut self.rows);
        }
    }

    /// The deviations of the samples at these places, side by side; none if the motion is not drawn.
    pub(super) fn deviations(&mut self, batch: &Batch, places: &[usize]) -> Option<Deviations<'_>> {
        batch.draws?;
        let first = *places.first()?;
        let side_by_side = places.iter().zip(first..).all(|(&place, expected)| place == expected);
        if side_by_side && first + batch.lanes.count() <= LANES {
            return Some(Deviations::new(&self.rows, first));
        }
        let place = |lane: usize| places[usize::min(lane, places.len() - 1)];
        self.ordered.clear();
        self.ordered.extend(self.rows.iter().map(|row| core::array::from_fn(|lane| row[place(lane)])));
        Some(Deviations::new(&self.ordered, 0))
    }

    /// The acceleration of the sample at this place; none if the motion is not drawn.
    pub(super) fn motion(&mut self, batch: &Batch, place: usize) -> Option<&[[f64; 3]]> {
        batch.draws?;
        let estimate = &batch.motion.excitation;
        self.acceleration.clear();
        self.acceleration.extend(self.rows.iter().enumerate().map(|(k, row)| {
            let [x, y, z] = core::array::from_fn(|component| estimate.component(k, component));
            [x + row[place], y, z]
        }));
        Some(&self.acceleration)
    }
}
