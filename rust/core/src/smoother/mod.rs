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
mod lost;
mod motion;
mod passes;
mod posterior;
mod roots;
mod rounding;

pub(crate) use draw::Drawn;
pub use draw::draw;
pub use posterior::{Given, MOST, Posterior, Square, Step};

use crate::simd::{Kernel, widest};
use lost::Lost;
use passes::Passes;
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
    /// One number per cell, out: the noise that the last round found in it over what its intensity made expect.
    pub found: &'a mut [f64],
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
        2 => Some(widest(Sums::<2> { samples, start, intensity })),
        3 => Some(widest(Sums::<3> { samples, start, intensity })),
        4 => Some(widest(Sums::<4> { samples, start, intensity })),
        5 => Some(widest(Sums::<5> { samples, start, intensity })),
        6 => Some(widest(Sums::<6> { samples, start, intensity })),
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
    let runs = match order {
        2 => widest(Smoothing::<2> { samples, start, intensity, out }),
        3 => widest(Smoothing::<3> { samples, start, intensity, out }),
        4 => widest(Smoothing::<4> { samples, start, intensity, out }),
        5 => widest(Smoothing::<5> { samples, start, intensity, out }),
        6 => widest(Smoothing::<6> { samples, start, intensity, out }),
        _ => return None,
    };
    lost::find(&runs, order, samples, intensity, out.variance);
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
        2 => widest(Adapting::<2> { start, rule, on: adapted }),
        3 => widest(Adapting::<3> { start, rule, on: adapted }),
        4 => widest(Adapting::<4> { start, rule, on: adapted }),
        5 => widest(Adapting::<5> { start, rule, on: adapted }),
        6 => widest(Adapting::<6> { start, rule, on: adapted }),
        _ => return None,
    }
    Some(())
}

const HARDLY: f64 = 1e-9; // of the usual intensity: the least a cell can have
const HARD: f64 = 1e12; // and the most
/// Variance over the terms that it is left of, below which rounding tells on it.
const LOST: f64 = 1e-6;

/// The sums of `likelihood`.
struct Sums<'a, const N: usize> {
    samples: Samples<'a>,
    start: Start<'a>,
    intensity: Intensity<'a>,
}

impl<const N: usize> Kernel for Sums<'_, N> {
    type Output = (f64, f64);

    #[inline(always)]
    fn run(self) -> (f64, f64) {
        let Self { samples, start, intensity } = self;
        let (mut determinant, mut misfit) = (0.0, 0.0);
        Passes::<N>::forward(samples, start, intensity, |at| {
            determinant += at.variance.ln();
            misfit += at.innovation * at.innovation / at.variance;
        });
        (determinant, misfit)
    }
}

/// `smooth` of N states.
struct Smoothing<'a, 'b, const N: usize> {
    samples: Samples<'a>,
    start: Start<'a>,
    intensity: Intensity<'a>,
    out: &'a mut Smoothed<'b>,
}

impl<const N: usize> Kernel for Smoothing<'_, '_, N> {
    /// Where variances are lost in rounding.
    type Output = Vec<Lost>;

    #[inline(always)]
    fn run(self) -> Vec<Lost> {
        let Self { samples, start, intensity, out } = self;
        let mut runs = Vec::new();
        let mut passes = Passes::<N>::new();
        passes.filter(samples, start, intensity);
        passes.backward(
            samples,
            intensity,
            |_, _, _| {},
            |k, at, score, residual| {
                out.residual[k] = residual;
                let mut sound = true;
                for i in 0..N.min(3) {
                    let row = &at.covariance[i];
                    let (mut mean, mut variance) = (at.mean[i], row[i]);
                    let mut terms = row[i];
                    for a in 0..N {
                        mean += row[a] * score.r[a];
                        let mut sum = 0.0;
                        for b in 0..N {
                            let term = score.variance[a][b] * row[b];
                            sum += term;
                            terms += (row[a] * term).abs();
                        }
                        variance -= row[a] * sum;
                    }
                    out.mean[k][i] = mean;
                    out.variance[k][i] = variance.max(0.0);
                    sound &= variance >= LOST * terms;
                }
                if !sound {
                    Lost::add(&mut runs, k, &at.covariance);
                }
            },
        );
        runs
    }
}

/// `adapt` of N states.
struct Adapting<'a, 'b, const N: usize> {
    start: Start<'a>,
    rule: Rule,
    on: &'a mut Adapted<'b>,
}

impl<const N: usize> Kernel for Adapting<'_, '_, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { start, rule, on } = self;
        let mut passes = Passes::<N>::new();
        let mut shown = vec![[0.0; 2]; on.of.len()];
        let count = on.told.len();
        let mut others = Others { mean: vec![0.0; count], variance: vec![0.0; count] };
        for round in 1..=rule.rounds {
            let samples = Samples { step: on.step, value: on.sites.value, variance: on.sites.variance };
            let intensity = Intensity { cell: on.cell, of: on.of };
            passes.filter(samples, start, intensity);
            shown.fill([0.0; 2]);
            passes.backward(
                samples,
                intensity,
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
                for (ratio, [found, expected]) in on.found.iter_mut().zip(&shown) {
                    // What is expected of a cell can vanish in rounding: then nothing is known of it.
                    *ratio = if *expected > 0.0 { found / expected } else { 1.0 };
                }
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
