//! Draws of the motion: the deviation of its acceleration along x from the estimate, another one for each sample of a batch.

use super::error::BatchError;
use crate::error::Stopped;
use crate::numeric::float::add_scaled;
use crate::numeric::normal::NormalStreams;
use crate::numeric::simd::{Aligned, LANES, Lanes, dispatch_wide};
use crate::numeric::watch::{Watch, check_memory};
use crate::smoother::{BLOCK, BlockStep, Posterior};

/// The posterior of an estimated motion, from which each sample of a batch draws its own acceleration along x.
///
/// A draw is the deviation from the estimate at the samples of the motion. It depends only on the seed and its own number.
#[derive(Debug, Clone)]
pub struct MotionDraws {
    order: usize,
    derivative: usize,
    seed: u64,
    /// For each block of stamps its step, as [`pack`] has it, then m/s² per unit of the state's acceleration at its last stamp.
    steps: Vec<f64>,
    /// For each sample of the motion the first stamp that is not before it, counted from the begin of the first block, and the weight of
    /// its deviation beside that of the stamp before.
    places: Vec<(usize, f64)>,
}

/// Samples between checks of the watch.
const SAMPLES_AT_A_TIME: usize = 4096;

impl MotionDraws {
    /// The draws of a seed at the samples of a motion, at `time` s. `derivative`: index of the acceleration in the state; `unit`: m/s² per
    /// unit of it at each stamp; `stamps`: s, ascending. Deviations are linear between the stamps and constant outside them.
    ///
    /// # Errors
    /// [`BatchError::Length`], [`BatchError::Stopped`].
    ///
    /// # Panics
    /// If `derivative` is not below the order.
    pub fn new(
        posterior: &Posterior,
        (derivative, unit): (usize, &[f64]),
        stamps: &[f64],
        time: &[f64],
        seed: u64,
    ) -> Result<Self, BatchError> {
        let (order, count) = (posterior.order(), posterior.count());
        for (field, got) in [("unit", unit.len()), ("stamps", stamps.len())] {
            if got != count {
                return Err(BatchError::Length { field, expected: count, got });
            }
        }
        assert!(derivative < order, "a number of the state");
        let (blocks, width) = (count.div_ceil(BLOCK), width(order, row_count(order)));
        check_memory((8 * width).saturating_mul(blocks))?;
        check_memory((16 + 2 * size_of::<Lanes>()).saturating_mul(time.len()))?;
        // The first block is the one that may have fewer stamps.
        let lead = BLOCK * blocks - count;
        let (mut steps, mut chain) = (Vec::with_capacity(blocks * width), posterior.steps());
        let mut ends = 0;
        for block in 0..blocks {
            if posterior.watch().stops_at(BLOCK * block) {
                return Err(Stopped::Interrupted.into());
            }
            let begin = ends;
            ends = BLOCK * (block + 1) - lead;
            let parts: Vec<_> = chain.by_ref().take(ends - begin).collect();
            pack(&BlockStep::new(&parts, derivative), order, &unit[begin..ends], &mut steps);
        }
        let mut at = 0;
        let place = |&time: &f64| {
            while at + 1 < count && stamps[at] < time {
                at += 1;
            }
            let share = match at {
                0 => 1.0,
                _ => (time - stamps[at - 1]) / (stamps[at] - stamps[at - 1]),
            };
            (lead + at, share.min(1.0))
        };
        let places = time.iter().map(place).collect();
        Ok(Self { order, derivative, seed, steps, places })
    }

    /// Number of samples of the motion.
    pub fn count(&self) -> usize {
        self.places.len()
    }

    /// The draw of a number, m/s² at the samples of the motion.
    pub fn deviation(&self, number: u64) -> Vec<f64> {
        let mut rows = Vec::new();
        self.draw([number; LANES], Watch::NEVER, &mut rows);
        rows.iter().map(|row| row.0[0]).collect()
    }

    /// The draws of some numbers side by side: a row for each sample of the motion. Meaningless if the watch stops it.
    pub(super) fn draw(&self, numbers: [u64; LANES], watch: Watch, out: &mut Vec<Aligned<Lanes>>) {
        out.resize(self.count(), Aligned([0.0; LANES]));
        match self.order {
            2 => self.fill::<2, { row_count(2) }>(numbers, watch, out),
            3 => self.fill::<3, { row_count(3) }>(numbers, watch, out),
            4 => self.fill::<4, { row_count(4) }>(numbers, watch, out),
            5 => self.fill::<5, { row_count(5) }>(numbers, watch, out),
            _ => self.fill::<6, { row_count(6) }>(numbers, watch, out),
        }
    }

    fn fill<const N: usize, const ROWS: usize>(
        &self,
        numbers: [u64; LANES],
        watch: Watch,
        out: &mut [Aligned<Lanes>],
    ) {
        let mut draw = DrawState::<N>::new(self, numbers);
        let places = self.places.chunks(SAMPLES_AT_A_TIME);
        for (places, out) in places.zip(out.chunks_mut(SAMPLES_AT_A_TIME)) {
            if watch.stops() {
                return;
            }
            dispatch_wide!(write_deviations::<N, ROWS>(&mut draw, places, out));
        }
    }
}

/// Rows of a block of states with so many entries.
const fn row_count(order: usize) -> usize {
    BLOCK - 1 + order
}

/// Number of entries of a packed step, with the unit behind it.
const fn width(order: usize, rows: usize) -> usize {
    rows * order + rows * (rows + 1) / 2 + 1
}

/// Appends a step row by row, each with its entries of the transition and then those of the noise root from the diagonal on; accelerations
/// by their unit at each stamp, m/s².
fn pack(step: &BlockStep, order: usize, unit: &[f64], to: &mut Vec<f64>) {
    let BlockStep { transition, noise_root } = step;
    let empty = BLOCK - unit.len();
    for i in 0..row_count(order) {
        let unit = match i {
            i if i < empty || i >= BLOCK - 1 => 1.0,
            i => unit[i - empty],
        };
        to.extend(transition[i][..order].iter().map(|x| unit * x));
        to.extend(noise_root[i..row_count(order)].iter().map(|column| unit * column[i]));
    }
    to.push(unit[unit.len() - 1]);
}

/// Eight draws on their way through the stamps.
struct DrawState<'a, const N: usize> {
    draws: &'a MotionDraws,
    normals: NormalStreams,
    state: Aligned<[Lanes; N]>,
    /// Number of blocks passed.
    passed: usize,
    /// Deviations at the last stamp before the latest block and at its own, m/s².
    values: Aligned<[Lanes; 1 + BLOCK]>,
}

/// Writes the deviations at some samples.
#[inline(always)]
fn write_deviations<const N: usize, const ROWS: usize>(
    draw: &mut DrawState<N>,
    places: &[(usize, f64)],
    out: &mut [Aligned<Lanes>],
) {
    let mut normals = draw.normals.clone();
    for (&(stamp, share), Aligned(out)) in places.iter().zip(out) {
        while BLOCK * draw.passed <= stamp {
            let mut normal = Aligned([[0.0; LANES]; ROWS]);
            for number in &mut normal.0 {
                *number = normals.next();
            }
            draw.advance(&normal.0);
        }
        let at = 1 + stamp % BLOCK;
        let now = &draw.values.0[at];
        if share == 1.0 {
            *out = *now;
        } else {
            let before = &draw.values.0[at - 1];
            for lane in 0..LANES {
                out[lane] = (1.0 - share) * before[lane] + share * now[lane];
            }
        }
    }
    draw.normals = normals;
}

impl<'a, const N: usize> DrawState<'a, N> {
    fn new(draws: &'a MotionDraws, numbers: [u64; LANES]) -> Self {
        Self {
            draws,
            normals: NormalStreams::numbered(draws.seed, numbers),
            state: Aligned([[0.0; LANES]; N]),
            passed: 0,
            values: Aligned([[0.0; LANES]; 1 + BLOCK]),
        }
    }

    /// Advances by one block.
    #[inline(always)]
    fn advance<const ROWS: usize>(&mut self, normal: &[Lanes; ROWS]) {
        let width = width(N, ROWS);
        let mut step = &self.draws.steps[self.passed * width..][..width];
        let before = self.state.0;
        self.values.0[0] = self.values.0[BLOCK];
        for i in 0..ROWS {
            let (row, rest) = step.split_at(N + ROWS - i);
            let mut sum = [0.0; LANES];
            for j in 0..N {
                add_scaled(&mut sum, &before[j], row[j]);
            }
            for j in i..ROWS {
                add_scaled(&mut sum, &normal[j], row[N + j - i]);
            }
            match i {
                i if i + 1 < BLOCK => self.values.0[1 + i] = sum,
                i => self.state.0[i + 1 - BLOCK] = sum,
            }
            step = rest;
        }
        self.values.0[BLOCK] = self.state.0[self.draws.derivative].map(|x| step[0] * x);
        self.passed += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smoother::{PosteriorInput, ProcessNoise};
    use nalgebra::DMatrix;

    /// Stamps: two blocks and a part of one.
    const COUNT: usize = 21;

    /// Deviations at all stamps per unit of each random number that the draws take, a column for each.
    fn response<const N: usize, const ROWS: usize>(draws: &MotionDraws) -> DMatrix<f64> {
        let blocks = COUNT.div_ceil(BLOCK);
        let mut all = DMatrix::zeros(COUNT, blocks * ROWS);
        for column in 0..blocks * ROWS {
            let mut draw = DrawState::<N>::new(draws, [0; LANES]);
            for block in 0..blocks {
                let one = |row| [f64::from(u8::from(column == block * ROWS + row)); LANES];
                draw.advance::<ROWS>(&core::array::from_fn(one));
                for (at, value) in draw.values.0[1..].iter().enumerate() {
                    // The first block is the one that is not full.
                    if let Some(stamp) = (BLOCK * block + at + COUNT).checked_sub(BLOCK * blocks) {
                        all[(stamp, column)] = value[0];
                    }
                }
            }
        }
        all
    }

    /// The largest difference between the covariance of the draws and that of the chain, relative to the standard deviations.
    fn error<const N: usize, const ROWS: usize>(derivative: usize, variance: f64) -> f64 {
        let step: Vec<f64> = (1..COUNT).map(|k| 1.1 + 0.8 * (k as f64).sin()).collect();
        let variance: Vec<f64> = (0..COUNT).map(|k| variance * (1.0 + (k % 4) as f64)).collect();
        let covariance: Vec<f64> = DMatrix::<f64>::identity(N, N).scale(9.0).iter().copied().collect();
        let segment: Vec<u32> = (1..COUNT as u32).map(|k| k / 5 % 3).collect();
        let noise = ProcessNoise { segment: &segment, density: &[0.3, 20.0, 1e-3], oscillator: None };
        let watch = Watch::NEVER;
        let given =
            PosteriorInput { step: &step, variance: &variance, covariance: &covariance, noise, watch };
        let chain = Posterior::new(N, given).expect("memory").expect("an order from 2 to 6");
        let stamps: Vec<f64> = (0..COUNT).map(|k| step[..k].iter().sum()).collect();
        let unit: Vec<f64> = (0..COUNT).map(|k| 1.0 + 0.1 * k as f64).collect();
        let draws = MotionDraws::new(&chain, (derivative, &unit), &stamps, &stamps, 1).expect("valid");
        // States per unit of each random number of the chain, stamp after stamp.
        let mut state = DMatrix::zeros(N, N * COUNT);
        let mut exact = DMatrix::zeros(COUNT, N * COUNT);
        for (k, step) in chain.steps().enumerate() {
            state = DMatrix::from_fn(N, N, |i, j| step.transition[i][j]) * state;
            let root = DMatrix::from_fn(N, N, |i, j| step.noise_root[i][j]);
            state.view_mut((0, N * k), (N, N)).copy_from(&root);
            exact.set_row(k, &state.row(derivative).scale(unit[k]));
        }
        let exact = &exact * exact.transpose();
        let found = response::<N, ROWS>(&draws);
        let scale = exact.diagonal().map(f64::sqrt);
        (&found * found.transpose() - exact).component_div(&(&scale * scale.transpose())).amax()
    }

    #[test]
    fn draws_have_the_covariance_of_the_posterior() {
        // From samples that tell little to such that tell nearly all.
        for variance in [1e3, 1.0, 1e-6] {
            let all = [
                error::<2, { row_count(2) }>(1, variance),
                error::<3, { row_count(3) }>(1, variance),
                error::<3, { row_count(3) }>(2, variance),
                error::<4, { row_count(4) }>(2, variance),
                error::<5, { row_count(5) }>(2, variance),
                error::<6, { row_count(6) }>(2, variance),
            ];
            // Some roundings of each variance.
            assert!(all.iter().all(|error| *error < 1e-12), "{variance}: {all:?}");
        }
    }
}
