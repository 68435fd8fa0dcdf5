//! Adaptation of process noise, measurement noise and site approximations to the samples.

use super::data::{Oscillator, ProcessNoise, Rounded, Samples, SiteApproximations, Start};
use super::passes::ForwardBackward;
use super::rounding::Cavity;
use super::transition::{Transition, with_transition};
use crate::error::Stopped;
use crate::numeric::simd::dispatch;
use crate::numeric::watch::{Watch, filled};

/// Input and result of [`adapt`].
pub struct Adapted<'a> {
    /// Time from each sample to the next, > 0.
    pub step: &'a [f64],
    /// The samples.
    pub rounded: Rounded<'a>,
    /// Segment of each interval, n - 1 numbers.
    pub segment: &'a [u32],
    /// Process-noise density of each segment, in and out.
    pub density: &'a mut [f64],
    /// Oscillator through which the process noise acts.
    pub oscillator: Option<Oscillator>,
    /// Site approximations, in and out.
    pub sites: SiteApproximations<'a>,
    /// Variance of the measurement noise before rounding, in and out.
    pub noise_variance: f64,
    /// Logarithm of the probability density of each sample given all others, n numbers, out.
    pub log_density: &'a mut [f64],
    /// Whether to stop.
    pub watch: Watch<'a>,
    /// Squared process noise in each segment over its expected value (normalised innovation variance), in the last round, out.
    pub noise_ratio: &'a mut [f64],
}

/// How [`adapt`] chooses noise densities and noise variance.
#[derive(Clone, Copy, Debug)]
pub struct AdaptationRule {
    /// Number of rounds.
    pub rounds: usize,
    /// Process-noise density that the prior favours in each segment.
    pub typical_density: f64,
    /// Weight of the prior as a number of samples of the noise; a smaller weight means a heavier tail.
    pub prior_weight: f64,
    /// Smallest variance of the measurement noise.
    pub min_noise_variance: f64,
}

/// Adapts process-noise densities, site approximations and the noise variance, all in place. None if `order`, the number of
/// states, is not 2 to 6 (with an oscillator 4 to 6).
///
/// Each round multiplies a density, and the noise variance, by the square root of squared scores over their expectation. This never lowers
/// the likelihood (Zhou, Hu, Zhou and Lange 2019). The prior of a segment's density is inverse gamma, which makes the noise Student's t.
///
/// # Errors
/// [`Stopped`].
pub fn adapt(
    order: usize,
    start: Start,
    rule: AdaptationRule,
    adapted: &mut Adapted,
) -> Result<Option<()>, Stopped> {
    with_transition!(order, adapted.oscillator, N, T => {
        dispatch!(adapt_of_order::<N, T>(start, rule, adapted))
    })
    .transpose()
}

/// Smallest and largest noise density of a segment, relative to the typical one.
const MIN_DENSITY_RATIO: f64 = 1e-9;
const MAX_DENSITY_RATIO: f64 = 1e12;

/// [`adapt`] for the order N.
#[inline(always)]
fn adapt_of_order<const N: usize, T: Transition<N>>(
    start: Start,
    rule: AdaptationRule,
    adapted: &mut Adapted,
) -> Result<(), Stopped> {
    let mut passes = ForwardBackward::<N, T>::new();
    let mut evidence = filled([0.0; 2], adapted.density.len())?;
    let count = adapted.log_density.len();
    let mut cavity = Cavity { mean: filled(0.0, count)?, variance: filled(0.0, count)? };
    for round in 1..=rule.rounds {
        let samples = Samples {
            step: adapted.step,
            value: adapted.sites.value,
            variance: adapted.sites.variance,
            watch: adapted.watch,
        };
        let noise = ProcessNoise {
            segment: adapted.segment,
            density: adapted.density,
            oscillator: adapted.oscillator,
        };
        passes.filter(samples, start, noise)?;
        evidence.fill([0.0; 2]);
        passes.backward(
            samples,
            noise,
            |k, transition, score| {
                let (mut found, mut expected) = (0.0, 0.0);
                for i in 0..N {
                    for j in 0..i {
                        found += 2.0 * transition.noise()[i][j] * score.r[i] * score.r[j];
                        expected += 2.0 * transition.noise()[i][j] * score.variance[i][j];
                    }
                    found += transition.noise()[i][i] * score.r[i] * score.r[i];
                    expected += transition.noise()[i][i] * score.variance[i][i];
                }
                let sums = &mut evidence[adapted.segment[k] as usize];
                sums[0] += found;
                sums[1] += expected;
            },
            |k, _, _, [u, d]| {
                cavity.mean[k] = adapted.sites.value[k] - u / d;
                cavity.variance[k] = (1.0 / d - adapted.sites.variance[k]).max(0.0);
            },
        )?;
        if round == rule.rounds {
            adapted.rounded.log_densities(&cavity, adapted.noise_variance, adapted.log_density);
            for (ratio, [found, expected]) in adapted.noise_ratio.iter_mut().zip(&evidence) {
                // The expectation can vanish in rounding; the samples then do not determine the density of the segment.
                *ratio = if *expected > 0.0 { found / expected } else { 1.0 };
            }
        }
        let scores = adapted.rounded.update_sites(&mut cavity, adapted.noise_variance, &mut adapted.sites);
        for (q, [found, expected]) in adapted.density.iter_mut().zip(&evidence) {
            let up = found + rule.prior_weight * rule.typical_density / (*q * *q);
            let down = expected.max(0.0) + rule.prior_weight / *q + f64::MIN_POSITIVE;
            *q = (*q * (up / down).sqrt())
                .clamp(MIN_DENSITY_RATIO * rule.typical_density, MAX_DENSITY_RATIO * rule.typical_density);
        }
        adapted.noise_variance =
            (adapted.noise_variance * (scores[0] / scores[1]).sqrt()).max(rule.min_noise_variance);
    }
    Ok(())
}
