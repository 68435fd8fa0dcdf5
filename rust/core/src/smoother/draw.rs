//! Random deviations of a derivative from its estimate, drawn from the posterior.

use super::posterior::{MAX_ORDER, MarkovStep, Posterior};
use crate::error::Stopped;
use crate::numeric::float::add_scaled;
use crate::numeric::normal::NormalStreams;
use crate::numeric::simd::{LANES, Lanes, dispatch_wide};
use crate::numeric::watch::room;

/// Deviations of eight draws side by side.
#[derive(Debug, Clone)]
pub(crate) struct DeviationDraws {
    normals: NormalStreams,
    /// Deviation of the state.
    pub state: [Lanes; MAX_ORDER],
}

impl DeviationDraws {
    /// Draws number `first` to `first + LANES - 1` of a seed.
    pub(crate) fn new(seed: u64, first: usize) -> Self {
        Self { normals: NormalStreams::new(seed, first), state: [[0.0; LANES]; MAX_ORDER] }
    }

    /// Advances by one step of the chain.
    #[inline(always)]
    pub(crate) fn advance(&mut self, step: &MarkovStep, order: usize) {
        let before = self.state;
        let mut normal = [[0.0; LANES]; MAX_ORDER];
        for number in &mut normal[..order] {
            *number = self.normals.next();
        }
        for i in 0..order {
            let mut sum = [0.0; LANES];
            for j in 0..order {
                add_scaled(&mut sum, &before[j], step.transition[i][j]);
            }
            for j in i..order {
                add_scaled(&mut sum, &normal[j], step.noise_root[i][j]);
            }
            self.state[i] = sum;
        }
    }
}

/// Writes random deviations of a derivative: `out[draw * n + k]`. A draw depends only on the seed and its own number.
///
/// # Errors
/// [`Stopped`].
///
/// # Panics
/// If the length of `out` is not a multiple of the number of samples, or `derivative` is not below the order.
pub fn draw(posterior: &Posterior, derivative: usize, seed: u64, out: &mut [f64]) -> Result<(), Stopped> {
    assert!(derivative < posterior.order(), "a number of the state");
    let count = posterior.count();
    assert_eq!(out.len() % count, 0, "room for whole draws");
    let draws = out.len() / count;
    let mut blocks = room(draws.div_ceil(LANES))?;
    blocks.extend((0..draws).step_by(LANES).map(|first| DeviationDraws::new(seed, first)));
    let mut steps = Vec::with_capacity(SAMPLES_AT_A_TIME);
    let mut from = 0;
    let mut all = posterior.steps();
    while from < count {
        // In blocks of samples, so that each draw is written block by block and not number by number.
        steps.clear();
        steps.extend(all.by_ref().take(SAMPLES_AT_A_TIME));
        for (block, rows) in blocks.iter_mut().zip(out.chunks_mut(LANES * count)) {
            posterior.watch().check()?;
            let order = posterior.order();
            dispatch_wide!(draw_samples(block, &steps, order, derivative, rows, count, from));
        }
        from += steps.len();
    }
    Ok(())
}

/// Samples drawn at a time.
const SAMPLES_AT_A_TIME: usize = 64;

/// Draws a block of samples for eight draws.
#[inline(always)]
fn draw_samples(
    block: &mut DeviationDraws,
    steps: &[MarkovStep],
    order: usize,
    derivative: usize,
    rows: &mut [f64],
    count: usize,
    from: usize,
) {
    let mut values = [[0.0; LANES]; SAMPLES_AT_A_TIME];
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::watch::Watch;
    use crate::smoother::{PosteriorInput, ProcessNoise};

    #[test]
    fn a_draw_is_the_same_among_few_and_many() {
        let (step, variance, segment) = ([1.0; 99], [1.0; 100], [0; 99]);
        let covariance = [4.0, 0.0, 0.0, 4.0];
        let given = PosteriorInput {
            step: &step,
            variance: &variance,
            covariance: &covariance,
            noise: ProcessNoise { segment: &segment, density: &[0.5], oscillator: None },
            watch: Watch::NEVER,
        };
        let chain = Posterior::new(2, given).expect("memory").expect("order 2");
        let (mut few, mut many) = (vec![0.0; 3 * 100], vec![0.0; 20 * 100]);
        draw(&chain, 1, 5, &mut few).expect("memory");
        draw(&chain, 1, 5, &mut many).expect("memory");
        assert_eq!(few, many[..300]);
        assert_ne!(many[..100], many[100..200]);
        draw(&chain, 1, 6, &mut few).expect("memory");
        assert_ne!(few, many[..300]);
    }
}
