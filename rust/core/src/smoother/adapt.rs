//! Adaptation of process noise, measurement noise and site approximations to the samples.

use super::data::{
    Oscillator, ProcessNoise, Rounded, Samples, SiteApproximations, Start, are_finite, is_not_negative,
    is_positive,
};
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

impl Adapted<'_> {
    /// Whether lengths agree, and numbers are in their ranges.
    fn agrees_with(&self, order: usize, start: &Start, rule: &AdaptationRule) -> bool {
        let count = self.rounded.value.len();
        let (samples, noise) = self.given();
        [samples.value.len(), self.log_density.len(), self.noise_ratio.len()]
            == [count, count, self.density.len()]
            && samples.agree_with(order, start, &noise)
            && are_finite(self.rounded.value)
            && [self.rounded.quantum, rule.prior_weight].into_iter().all(is_not_negative)
            && [rule.typical_density, rule.min_noise_variance, self.noise_variance]
                .into_iter()
                .all(is_positive)
    }

    /// The site approximations as samples, and the process noise.
    #[inline(always)]
    fn given(&self) -> (Samples<'_>, ProcessNoise<'_>) {
        let Self { step, watch, segment, oscillator, .. } = *self;
        let samples = Samples { step, value: self.sites.value, variance: self.sites.variance, watch };
        (samples, ProcessNoise { segment, density: self.density, oscillator })
    }
}

/// How [`adapt`] chooses noise densities and noise variance.
#[derive(Clone, Copy, Debug)]
pub struct AdaptationRule {
    /// Number of rounds.
    pub rounds: usize,
    /// Process-noise density that the prior favours in each segment, > 0.
    pub typical_density: f64,
    /// Weight of the prior as a number of samples of the noise; a smaller weight means a heavier tail.
    pub prior_weight: f64,
    /// Smallest variance of the measurement noise, > 0.
    pub min_noise_variance: f64,
}

/// Adapts process-noise densities, site approximations and the noise variance, all in place. None if `order`, the number of
/// states, is not 2 to 6 (with an oscillator 4 to 6), lengths do not agree, or a number is out of its range.
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
    if !adapted.agrees_with(order, &start, &rule) {
        return Ok(None);
    }
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
        let (samples, noise) = adapted.given();
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

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: AdaptationRule =
        AdaptationRule { rounds: 3, typical_density: 1.0, prior_weight: 1.0, min_noise_variance: 1e-6 };

    /// Whether samples are adapted by a rule: with a value of the sample 3, and so many places for log densities.
    fn adapts(rule: AdaptationRule, value: f64, places: usize) -> bool {
        let mut samples: Vec<f64> = (0..20).map(|k| f64::sin(f64::from(k)).round()).collect();
        samples[3] = value;
        let (mut values, mut variances) = (samples.clone(), [0.1; 20]);
        let (mut log_density, mut density, mut noise_ratio) = (vec![0.0; places], [1.0], [0.0]);
        let mut adapted = Adapted {
            step: &[1.0; 19],
            rounded: Rounded { value: &samples, quantum: 1.0 },
            segment: &[0; 19],
            density: &mut density,
            oscillator: None,
            sites: SiteApproximations { value: &mut values, variance: &mut variances },
            noise_variance: 0.1,
            log_density: &mut log_density,
            watch: Watch::NEVER,
            noise_ratio: &mut noise_ratio,
        };
        let start = Start { mean: &[0.0; 2], covariance: &[1e3, 0.0, 0.0, 1e3] };
        let found = adapt(2, start, rule, &mut adapted).expect("memory").is_some();
        assert!(!found || adapted.noise_variance.is_finite() && are_finite(adapted.log_density));
        found
    }

    #[test]
    fn rules_and_samples_out_of_their_range_are_refused() {
        assert!(adapts(RULE, 1.0, 20));
        assert!(!adapts(RULE, f64::NAN, 20) && !adapts(RULE, 1.0, 19));
        for wrong in [f64::NAN, -1.0, f64::INFINITY] {
            assert!(!adapts(AdaptationRule { typical_density: wrong, ..RULE }, 1.0, 20), "{wrong}");
            assert!(!adapts(AdaptationRule { prior_weight: wrong, ..RULE }, 1.0, 20), "{wrong}");
            assert!(!adapts(AdaptationRule { min_noise_variance: wrong, ..RULE }, 1.0, 20), "{wrong}");
        }
    }
}
