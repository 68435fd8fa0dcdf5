//! Draws of a derivative's deviation from its estimate, from all that fit the samples.

use super::posterior::{MOST, Posterior, Step};
use crate::float::add_scaled;
use crate::normal::{LANES, Lanes, Normals};
use crate::simd::{Kernel, widest_of_all};

/// Deviations of some draws side by side.
#[derive(Debug, Clone)]
pub(crate) struct Drawn {
    normals: Normals,
    /// The state's.
    pub state: [Lanes; MOST],
}

impl Drawn {
    /// Draws number `first` to `first + LANES - 1` of a seed.
    pub(crate) fn new(seed: u64, first: usize) -> Self {
        Self { normals: Normals::new(seed, first), state: [[0.0; LANES]; MOST] }
    }

    /// Goes a step on.
    #[inline(always)]
    pub(crate) fn advance(&mut self, step: &Step, order: usize) {
        let before = self.state;
        let mut normal = [[0.0; LANES]; MOST];
        for number in &mut normal[..order] {
            *number = self.normals.next();
        }
        for i in 0..order {
            let mut sum = [0.0; LANES];
            for j in 0..order {
                add_scaled(&mut sum, &before[j], step.carry[i][j]);
            }
            for j in i..order {
                add_scaled(&mut sum, &normal[j], step.noise[i][j]);
            }
            self.state[i] = sum;
        }
    }
}

/// Writes draws of the deviation of a derivative: `out[draw * n + k]`. A draw depends on the seed and its number alone.
///
/// # Panics
/// If `out` is not of a length that is a multiple of the number of samples, or `derivative` not below the order.
pub fn draw(posterior: &Posterior, derivative: usize, seed: u64, out: &mut [f64]) {
    assert!(derivative < posterior.order(), "a number of the state");
    let count = posterior.count();
    assert_eq!(out.len() % count, 0, "room for whole draws");
    let draws = out.len() / count;
    let mut blocks: Vec<Drawn> = (0..draws).step_by(LANES).map(|first| Drawn::new(seed, first)).collect();
    let mut steps = Vec::with_capacity(STRETCH);
    let mut from = 0;
    let mut all = posterior.steps();
    while from < count {
        // Some samples at a time, so that each draw is written in pieces and not number by number.
        steps.clear();
        steps.extend(all.by_ref().take(STRETCH));
        for (block, rows) in blocks.iter_mut().zip(out.chunks_mut(LANES * count)) {
            let order = posterior.order();
            widest_of_all(Stretch { block, steps: &steps, order, derivative, rows, count, from });
        }
        from += steps.len();
    }
}

/// Samples that are drawn at a time.
const STRETCH: usize = 64;

/// Some samples of some draws.
struct Stretch<'a> {
    block: &'a mut Drawn,
    steps: &'a [Step],
    order: usize,
    derivative: usize,
    rows: &'a mut [f64],
    count: usize,
    from: usize,
}

impl Kernel for Stretch<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { block, steps, order, derivative, rows, count, from } = self;
        let mut values = [[0.0; LANES]; STRETCH];
        for (step, value) in steps.iter().zip(&mut values) {
            block.advance(step, order);
            *value = block.state[derivative];
        }
        for (lane, row) in rows.chunks_exact_mut(count).enumerate() {
            for (out, value) in row[from..].iter_mut().zip(&values[..steps.len()]) {
                *out = value[lane];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smoother::{Given, Intensity};

    #[test]
    fn a_draw_is_the_same_among_few_and_many() {
        let (step, variance, cell) = ([1.0; 99], [1.0; 100], [0; 99]);
        let covariance = [4.0, 0.0, 0.0, 4.0];
        let given = Given {
            step: &step,
            variance: &variance,
            covariance: &covariance,
            intensity: Intensity { cell: &cell, of: &[0.5] },
        };
        let chain = Posterior::new(2, given).expect("order 2");
        let (mut few, mut many) = (vec![0.0; 3 * 100], vec![0.0; 20 * 100]);
        draw(&chain, 1, 5, &mut few);
        draw(&chain, 1, 5, &mut many);
        assert_eq!(few, many[..300]);
        assert_ne!(many[..100], many[100..200]);
        draw(&chain, 1, 6, &mut few);
        assert_ne!(few, many[..300]);
    }
}
