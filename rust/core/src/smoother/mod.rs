//! Kalman filter and fixed-interval smoother of a sampled motion: the kernels behind the Python module `estimation`.
//!
//! The state is the position and its first N - 1 derivatives, N = 2 to 6; the N-th is white noise whose intensity is
//! constant in each cell, a stretch of intervals between samples. A sample is the position (or, for velocity samples,
//! the velocity in its place) plus white noise of its own variance. All is in the caller's units; a time unit near the
//! sampling step keeps the numbers tame.
//!
//! Filter: Kalman 1960 with the exact noise of each interval. Smoother: backwards with the score r and its variance
//! (de Jong 1989; Durbin and Koopman 2012, section 4.4), which give also the derivative of the likelihood by each
//! intensity and, for each sample, its residual against the estimate without it (de Jong and Penzer 1998).
//!
//! Samples rounded to a quantum are replaced by normal ones, their sites (`rounding`).

mod draw;
mod motion;
mod posterior;
mod rounding;

pub(crate) use draw::Drawn;
pub use draw::draw;
pub use posterior::{Given, MOST, Posterior, Square, Step};

use motion::Motion;
use rounding::Others;
pub use rounding::Rounded;

/// The samples: n values, their noise variances, n - 1 steps of time between them.
#[derive(Clone, Copy)]
pub struct Samples<'a> {
    /// Time from each sample to the next, > 0.
    pub step: &'a [f64],
    /// Measured values, or those of their sites.
    pub value: &'a [f64],
    /// Variance of each value's noise, > 0.
    pub variance: &'a [f64],
}

/// The normal samples that stand for rounded ones: n values and variances > 0, in and out.
pub struct Sites<'a> {
    /// Their values.
    pub value: &'a mut [f64],
    /// Variances of their noise.
    pub variance: &'a mut [f64],
}

/// What is known of the state before the first sample.
#[derive(Clone, Copy)]
pub struct Start<'a> {
    /// N numbers.
    pub mean: &'a [f64],
    /// N x N numbers by rows.
    pub covariance: &'a [f64],
}

/// Intensity of the white noise: `of[cell[k]]` in the interval after sample k.
#[derive(Clone, Copy)]
pub struct Intensity<'a> {
    /// n - 1 numbers of cells.
    pub cell: &'a [u32],
    /// One intensity per cell, >= 0.
    pub of: &'a [f64],
}

/// Numbers for each sample that a pass backwards leaves.
pub struct Smoothed<'a> {
    /// n x 3: value and its first two derivatives (of order 2 only the first).
    pub mean: &'a mut [[f64; 3]],
    /// n x 3: their variances.
    pub variance: &'a mut [[f64; 3]],
    /// n x 2: u and D; u/D is the sample less its estimate from all others, 1/D the variance of that.
    pub residual: &'a mut [[f64; 2]],
}

/// What `adapt` works on.
pub struct Adapted<'a> {
    /// Time from each sample to the next, > 0.
    pub step: &'a [f64],
    /// The samples.
    pub rounded: Rounded<'a>,
    /// n - 1 numbers of cells.
    pub cell: &'a [u32],
    /// One intensity per cell, in and out.
    pub of: &'a mut [f64],
    /// In and out.
    pub sites: Sites<'a>,
    /// Variance of the noise before rounding, in and out.
    pub level: f64,
    /// n numbers, out.
    pub told: &'a mut [f64],
}

/// How `adapt` chooses intensities and noise level.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// Rounds.
    pub rounds: usize,
    /// Intensity that each cell is drawn to.
    pub usual: f64,
    /// Weight of that, in squared noises of the cell; the tail of the prior is the heavier the smaller it is.
    pub weight: f64,
    /// Smallest noise level.
    pub floor: f64,
}

/// Forward pass: (sum of ln F, sum of v^2/F) over the innovations v and their variances F; None if `order` is not 2 to 6.
#[must_use]
pub fn likelihood(order: usize, samples: Samples, start: Start, intensity: Intensity) -> Option<(f64, f64)> {
    match order {
        2 => Some(Passes::<2>::sums(samples, start, intensity)),
        3 => Some(Passes::<3>::sums(samples, start, intensity)),
        4 => Some(Passes::<4>::sums(samples, start, intensity)),
        5 => Some(Passes::<5>::sums(samples, start, intensity)),
        6 => Some(Passes::<6>::sums(samples, start, intensity)),
        _ => None,
    }
}

/// Both passes; None if `order` is not 2 to 6.
pub fn smooth(
    order: usize,
    samples: Samples,
    start: Start,
    intensity: Intensity,
    out: &mut Smoothed,
) -> Option<()> {
    match order {
        2 => Passes::<2>::smooth(samples, start, intensity, out),
        3 => Passes::<3>::smooth(samples, start, intensity, out),
        4 => Passes::<4>::smooth(samples, start, intensity, out),
        5 => Passes::<5>::smooth(samples, start, intensity, out),
        6 => Passes::<6>::smooth(samples, start, intensity, out),
        _ => return None,
    }
    Some(())
}

/// Adapts the intensity of each cell (`of`), the sites and the noise level (variance before rounding), all in place.
///
/// `told` (n) gets the logarithm of each sample's probability density given all others, as the last round found it.
/// None for another order.
///
/// Each round multiplies an intensity by the square root of what the scores show over what they should show, which never
/// lowers the likelihood (Zhou, Hu, Zhou and Lange 2019), and the noise level likewise; the prior of a cell's intensity is
/// inverse gamma (Student's t).
pub fn adapt(order: usize, start: Start, rule: Rule, adapted: &mut Adapted) -> Option<()> {
    match order {
        2 => Passes::<2>::adapt(start, rule, adapted),
        3 => Passes::<3>::adapt(start, rule, adapted),
        4 => Passes::<4>::adapt(start, rule, adapted),
        5 => Passes::<5>::adapt(start, rule, adapted),
        6 => Passes::<6>::adapt(start, rule, adapted),
        _ => return None,
    }
    Some(())
}

const HARDLY: f64 = 1e-9; // of the usual intensity: the least a cell can have
const HARD: f64 = 1e12; // and the most
/// State before a sample, as the filter has it: what the pass backwards needs.
#[derive(Clone, Copy)]
struct Predicted<const N: usize> {
    mean: [f64; N],
    covariance: [[f64; N]; N],
    innovation: f64,
    variance: f64,
}

/// The predictions of a forward pass, the covariances as lower triangles: half the memory, of which this is most.
struct Passes<const N: usize> {
    kept: Vec<f64>,
}

/// Score of all samples from here on, and its variance.
struct Score<const N: usize> {
    r: [f64; N],
    variance: [[f64; N]; N],
}

impl<const N: usize> Passes<N> {
    const ROW: usize = N + N * (N + 1) / 2 + 2;

    fn keep(&mut self, at: &Predicted<N>) {
        self.kept.extend_from_slice(&at.mean);
        for i in 0..N {
            self.kept.extend_from_slice(&at.covariance[i][..=i]);
        }
        self.kept.extend_from_slice(&[at.innovation, at.variance]);
    }

    fn count(&self) -> usize {
        self.kept.len() / Self::ROW
    }

    fn at(&self, k: usize) -> Predicted<N> {
        let row = &self.kept[k * Self::ROW..(k + 1) * Self::ROW];
        let mut covariance = [[0.0; N]; N];
        let mut from = N;
        for i in 0..N {
            for j in 0..=i {
                covariance[i][j] = row[from];
                covariance[j][i] = row[from];
                from += 1;
            }
        }
        let mean = core::array::from_fn(|i| row[i]);
        Predicted { mean, covariance, innovation: row[Self::ROW - 2], variance: row[Self::ROW - 1] }
    }

    /// Runs the filter and shows each prediction.
    fn forward(samples: Samples, start: Start, intensity: Intensity, mut show: impl FnMut(Predicted<N>)) {
        let mut mean: [f64; N] = core::array::from_fn(|i| start.mean[i]);
        let mut p: [[f64; N]; N] =
            core::array::from_fn(|i| core::array::from_fn(|j| start.covariance[i * N + j]));
        let mut motion = Motion::<N>::new(1.0);
        for k in 0..samples.value.len() {
            if k > 0 {
                motion.set(samples.step[k - 1]);
                motion.ahead(&mut mean);
                motion.spread(&mut p, intensity.of[intensity.cell[k - 1] as usize]);
            }
            let variance = p[0][0].max(0.0) + samples.variance[k];
            let innovation = samples.value[k] - mean[0];
            show(Predicted { mean, covariance: p, innovation, variance });
            let gain: [f64; N] = core::array::from_fn(|i| p[i][0] / variance);
            for i in 0..N {
                mean[i] += gain[i] * innovation;
            }
            // Column by column, so that p[j][0] is still the one before the update where it is used.
            let column: [f64; N] = core::array::from_fn(|j| p[j][0]);
            for i in 0..N {
                for j in 0..N {
                    p[i][j] -= gain[i] * column[j];
                }
            }
        }
    }

    fn sums(samples: Samples, start: Start, intensity: Intensity) -> (f64, f64) {
        let (mut determinant, mut misfit) = (0.0, 0.0);
        Self::forward(samples, start, intensity, |at| {
            determinant += at.variance.ln();
            misfit += at.innovation * at.innovation / at.variance;
        });
        (determinant, misfit)
    }

    fn filter(&mut self, samples: Samples, start: Start, intensity: Intensity) {
        self.kept.clear();
        self.kept.reserve_exact(samples.value.len() * Self::ROW);
        Self::forward(samples, start, intensity, |at| self.keep(&at));
    }

    /// Runs backwards. Shows each interval's motion with the score after it, then the sample before with its own.
    fn backward(
        &self,
        step: &[f64],
        mut interval: impl FnMut(usize, &Motion<N>, &Score<N>),
        mut sample: impl FnMut(usize, &Predicted<N>, &Score<N>, [f64; 2]),
    ) {
        let mut score = Score { r: [0.0; N], variance: [[0.0; N]; N] };
        let mut motion = Motion::<N>::new(1.0);
        for k in (0..self.count()).rev() {
            let at = self.at(k);
            if k + 1 < self.count() {
                motion.set(step[k]);
                interval(k, &motion, &score);
                motion.back(&mut score.r);
                motion.gather(&mut score.variance);
            }
            let gain: [f64; N] = core::array::from_fn(|i| at.covariance[i][0] / at.variance);
            let mut passed = [0.0; N];
            for i in 0..N {
                for j in 0..N {
                    passed[i] += score.variance[i][j] * gain[j];
                }
            }
            let (mut u, mut d) = (at.innovation / at.variance, 1.0 / at.variance);
            for i in 0..N {
                u -= gain[i] * score.r[i];
                d += gain[i] * passed[i];
            }
            score.r[0] += u;
            for i in 0..N {
                score.variance[0][i] -= passed[i];
                score.variance[i][0] -= passed[i];
            }
            score.variance[0][0] += d;
            sample(k, &at, &score, [u, d]);
        }
    }

    fn smooth(samples: Samples, start: Start, intensity: Intensity, out: &mut Smoothed) {
        let mut passes = Self { kept: Vec::new() };
        passes.filter(samples, start, intensity);
        passes.backward(
            samples.step,
            |_, _, _| {},
            |k, at, score, residual| {
                out.residual[k] = residual;
                for i in 0..N.min(3) {
                    let row = &at.covariance[i];
                    let (mut mean, mut variance) = (at.mean[i], row[i]);
                    for a in 0..N {
                        mean += row[a] * score.r[a];
                        let mut sum = 0.0;
                        for b in 0..N {
                            sum += score.variance[a][b] * row[b];
                        }
                        variance -= row[a] * sum;
                    }
                    out.mean[k][i] = mean;
                    out.variance[k][i] = variance.max(0.0);
                }
            },
        );
    }

    fn adapt(start: Start, rule: Rule, on: &mut Adapted) {
        let mut passes = Self { kept: Vec::new() };
        let mut shown = vec![[0.0; 2]; on.of.len()];
        let count = on.told.len();
        let mut others = Others { mean: vec![0.0; count], variance: vec![0.0; count] };
        for round in 1..=rule.rounds {
            let samples = Samples { step: on.step, value: on.sites.value, variance: on.sites.variance };
            passes.filter(samples, start, Intensity { cell: on.cell, of: on.of });
            shown.fill([0.0; 2]);
            passes.backward(
                on.step,
                |k, motion, score| {
                    let (mut found, mut expected) = (0.0, 0.0);
                    for i in 0..N {
                        for j in 0..i {
                            found += 2.0 * motion.noise[i][j] * score.r[i] * score.r[j];
                            expected += 2.0 * motion.noise[i][j] * score.variance[i][j];
                        }
                        found += motion.noise[i][i] * score.r[i] * score.r[i];
                        expected += motion.noise[i][i] * score.variance[i][i];
                    }
                    let sums = &mut shown[on.cell[k] as usize];
                    sums[0] += found;
                    sums[1] += expected;
                },
                |k, _, _, [u, d]| {
                    others.mean[k] = on.sites.value[k] - u / d;
                    others.variance[k] = (1.0 / d - on.sites.variance[k]).max(0.0);
                },
            );
            if round == rule.rounds {
                on.rounded.tell(&others, on.level, on.told);
            }
            let noise = on.rounded.renew(&mut others, on.level, &mut on.sites);
            for (q, [found, expected]) in on.of.iter_mut().zip(&shown) {
                let up = found + rule.weight * rule.usual / (*q * *q);
                let down = expected.max(0.0) + rule.weight / *q + f64::MIN_POSITIVE;
                *q = (*q * (up / down).sqrt()).clamp(HARDLY * rule.usual, HARD * rule.usual);
            }
            on.level = (on.level * (noise[0] / noise[1]).sqrt()).max(rule.floor);
        }
    }
}
