//! Draws of the motion: the deviation of its acceleration along x from the estimate, another one for each sample of a batch.

use super::error::BatchError;
use crate::error::Stopped;
use crate::numeric::float::add_scaled;
use crate::numeric::normal::NormalStreams;
use crate::numeric::simd::{Kernel, LANES, Lanes, dispatch_wide};
use crate::numeric::watch::{Watch, check_memory};
use crate::smoother::Posterior;

/// The posterior of an estimated motion, from which each sample of a batch draws its own acceleration along x.
///
/// A draw is the deviation from the estimate at the samples of the motion. It depends only on the seed and its own number.
#[derive(Debug, Clone)]
pub struct MotionDraws {
    order: usize,
    derivative: usize,
    seed: u64,
    /// For each stamp of the posterior the step to it: the transition by rows, then the upper triangle of the noise root by rows.
    steps: Vec<f64>,
    /// m/s² per unit of the state's acceleration at each stamp.
    unit: Vec<f64>,
    /// For each sample of the motion the first stamp that is not before it, and the weight of its deviation beside that of the stamp before.
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
        let width = width(order);
        check_memory((8 * width + 8).saturating_mul(count))?;
        check_memory((16 + 2 * size_of::<Lanes>()).saturating_mul(time.len()))?;
        let mut steps = Vec::with_capacity(count * width);
        for (k, step) in posterior.steps().enumerate() {
            if posterior.watch().stops_at(k) {
                return Err(Stopped::Interrupted.into());
            }
            for row in &step.transition[..order] {
                steps.extend_from_slice(&row[..order]);
            }
            for (i, row) in step.noise_root[..order].iter().enumerate() {
                steps.extend_from_slice(&row[i..order]);
            }
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
            (at, share.min(1.0))
        };
        let places = time.iter().map(place).collect();
        Ok(Self { order, derivative, seed, steps, unit: unit.to_vec(), places })
    }

    /// Number of samples of the motion.
    pub fn count(&self) -> usize {
        self.places.len()
    }

    /// The draw of a number, m/s² at the samples of the motion.
    pub fn deviation(&self, number: u64) -> Vec<f64> {
        let mut rows = Vec::new();
        self.draw([number; LANES], Watch::NEVER, &mut rows);
        rows.iter().map(|row| row[0]).collect()
    }

    /// The draws of some numbers side by side: a row for each sample of the motion. Incomplete if the watch stops it.
    pub(super) fn draw(&self, numbers: [u64; LANES], watch: Watch, rows: &mut Vec<Lanes>) {
        rows.clear();
        rows.resize(self.count(), [0.0; LANES]);
        match self.order {
            2 => self.fill::<2>(numbers, watch, rows),
            3 => self.fill::<3>(numbers, watch, rows),
            4 => self.fill::<4>(numbers, watch, rows),
            5 => self.fill::<5>(numbers, watch, rows),
            _ => self.fill::<6>(numbers, watch, rows),
        }
    }

    fn fill<const N: usize>(&self, numbers: [u64; LANES], watch: Watch, rows: &mut [Lanes]) {
        let mut walk = Walk::<N> {
            draws: self,
            normals: NormalStreams::numbered(self.seed, numbers),
            state: [[0.0; LANES]; N],
            passed: 0,
            before: [0.0; LANES],
            now: [0.0; LANES],
        };
        let places = self.places.chunks(SAMPLES_AT_A_TIME);
        for (places, rows) in places.zip(rows.chunks_mut(SAMPLES_AT_A_TIME)) {
            if watch.stops() {
                return;
            }
            dispatch_wide(WalkKernel { walk: &mut walk, places, rows });
        }
    }
}

/// Number of entries of a packed step.
const fn width(order: usize) -> usize {
    order * order + order * (order + 1) / 2
}

/// Eight draws on their way through the stamps.
struct Walk<'a, const N: usize> {
    draws: &'a MotionDraws,
    normals: NormalStreams,
    state: [Lanes; N],
    /// Number of stamps passed.
    passed: usize,
    /// Deviation at the last two of them, m/s².
    before: Lanes,
    now: Lanes,
}

/// Writes the deviations at some samples.
struct WalkKernel<'a, 'b, const N: usize> {
    walk: &'a mut Walk<'b, N>,
    places: &'a [(usize, f64)],
    rows: &'a mut [Lanes],
}

impl<const N: usize> Kernel for WalkKernel<'_, '_, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { walk, places, rows } = self;
        let Walk { draws, normals, state, passed, before, now } = walk;
        for (&(stamp, share), row) in places.iter().zip(rows) {
            while *passed <= stamp {
                let step = &draws.steps[*passed * width(N)..][..width(N)];
                advance(state, step, normals);
                *before = *now;
                *now = state[draws.derivative].map(|x| draws.unit[*passed] * x);
                *passed += 1;
            }
            if share == 1.0 {
                *row = *now;
            } else {
                for lane in 0..LANES {
                    row[lane] = (1.0 - share) * before[lane] + share * now[lane];
                }
            }
        }
    }
}

/// Advances by one packed step of the chain.
#[inline(always)]
fn advance<const N: usize>(state: &mut [Lanes; N], step: &[f64], normals: &mut NormalStreams) {
    let (transition, root) = step.split_at(N * N);
    let mut normal = [[0.0; LANES]; N];
    for number in &mut normal {
        *number = normals.next();
    }
    let (before, mut at) = (*state, 0);
    for i in 0..N {
        let mut sum = [0.0; LANES];
        for j in 0..N {
            add_scaled(&mut sum, &before[j], transition[N * i + j]);
        }
        for j in i..N {
            add_scaled(&mut sum, &normal[j], root[at]);
            at += 1;
        }
        state[i] = sum;
    }
}
