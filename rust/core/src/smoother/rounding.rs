//! Rounded samples: the measured value plus noise lies within half a quantum of the sample.
//!
//! Rounding is not white noise where many samples have the same value: then only their changes contain information. Expectation propagation
//! (Minka 2001; Rasmussen and Williams 2006, section 3.6) replaces each sample by a normal one, its site approximation. With it, the estimate
//! at that sample has the mean and variance that follow from the exact interval and all other samples.

use super::data::{Rounded, SiteApproximations};
use crate::numeric::float::log;
use crate::numeric::simd::dispatch_wide;

/// Cavity distributions: the distribution of each sample given all others, n means and variances.
pub(super) struct Cavity {
    pub mean: Vec<f64>,
    pub variance: Vec<f64>,
}

/// Quantum over standard deviation up to which rounding counts as normal noise of variance quantum^2/12; the error of the moments is then at
/// most 3e-4 of the deviation.
const FINE_QUANTUM: f64 = 0.7;
/// Distance from both edges of the quantum, in standard deviations, beyond which a sample has no information.
const FAR_INSIDE: f64 = 7.0;
/// Largest variance of a site, in squared quanta; it then has no information.
const MAX_SITE_VARIANCE: f64 = 1e6;
/// Weight of the previous site in an update (damping), because all sites change at once and would overshoot.
const SITE_DAMPING: f64 = 0.3;
/// Smallest variance of a site over the total variance, so that sites of noiseless samples stay finite.
const MIN_SITE_VARIANCE: f64 = 1e-6;
/// ln sqrt(2 pi)
const LOG_ROOT_TWO_PI: f64 = 0.918_938_533_204_672_7;

impl Rounded<'_> {
    /// Matches the sites to the moments by samples and cavities. `noise_variance`: of the measurement noise before rounding. Returns two sums
    /// over the samples: of the squared first derivative, and of the negative second derivative, of the logarithm of a sample's probability
    /// with respect to the cavity mean. Their ratio is 1 at the true noise variance.
    pub(super) fn update_sites(
        &self,
        cavity: &mut Cavity,
        noise_variance: f64,
        sites: &mut SiteApproximations,
    ) -> [f64; 2] {
        dispatch_wide!(self.update_all(cavity, noise_variance, sites));
        // In order, so that the bits of the sums do not depend on the width of vectors.
        let mut sums = [0.0; 2];
        for (slope, curvature) in cavity.mean.iter().zip(&cavity.variance) {
            sums[0] += slope * slope;
            sums[1] += curvature;
        }
        sums
    }

    /// Logarithm of the probability density of each sample given all others.
    pub(super) fn log_densities(&self, cavity: &Cavity, noise_variance: f64, log_density: &mut [f64]) {
        for (k, log_density) in log_density.iter_mut().enumerate() {
            let rest = self.value[k] - cavity.mean[k];
            let total = cavity.variance[k] + noise_variance;
            *log_density = if self.is_fine(total) {
                let total = total + self.quantum * self.quantum / 12.0;
                -0.5 * (rest * rest / total + log(total)) - LOG_ROOT_TWO_PI
            } else {
                let edges = Edges::new(rest, self.quantum, total.sqrt());
                let near = edges.near.max(-FAR_INSIDE);
                log(edges.area().1 / self.quantum) - 0.5 * near * near - LOG_ROOT_TWO_PI
            };
        }
    }

    /// Updates all sites, without branches, for vector loops.
    #[inline(always)]
    fn update_all(&self, cavity: &mut Cavity, noise_variance: f64, sites: &mut SiteApproximations) {
        let count = self.value.len();
        let (value, mean) = (&self.value[..count], &mut cavity.mean[..count]);
        let variance = &mut cavity.variance[..count];
        let (site, spread) = (&mut sites.value[..count], &mut sites.variance[..count]);
        let quantum = self.quantum;
        let least = if quantum > 0.0 { 1.0 / (MAX_SITE_VARIANCE * quantum * quantum) } else { 0.0 };
        for k in 0..count {
            let (slope, curvature) = self.derivatives(value[k] - mean[k], variance[k] + noise_variance);
            let rest = (1.0 - curvature * variance[k]).max(MIN_SITE_VARIANCE);
            let mut precision = curvature / rest;
            let mut shift = slope / rest; // precision times distance from the mean
            let before = 1.0 / spread[k];
            precision += SITE_DAMPING * (before - precision);
            shift += SITE_DAMPING * ((site[k] - mean[k]) * before - shift);
            let informative = precision > least;
            site[k] = if informative { mean[k] + shift / precision } else { mean[k] };
            spread[k] = if informative { 1.0 / precision } else { 1.0 / least };
            mean[k] = slope;
            variance[k] = curvature;
        }
    }

    #[inline(always)]
    fn is_fine(&self, total: f64) -> bool {
        self.quantum * self.quantum <= FINE_QUANTUM * FINE_QUANTUM * total
    }

    /// First and negative second derivative of the logarithm of a sample's probability with respect to the mean, which is `rest` below the
    /// sample.
    #[inline(always)]
    fn derivatives(&self, rest: f64, total: f64) -> (f64, f64) {
        let rounding = total + self.quantum * self.quantum / 12.0;
        let deviation = total.sqrt();
        let edges = Edges::new(rest, self.quantum, deviation);
        let (at_far, inside) = edges.area();
        let slope = (1.0 - at_far) / inside;
        let curvature = (edges.near - edges.far * at_far) / inside;
        let informative = if edges.near < -FAR_INSIDE { 0.0 } else { 1.0 };
        if self.is_fine(total) {
            (rest / rounding, 1.0 / rounding)
        } else {
            (
                informative * (slope / deviation).copysign(rest),
                informative * (slope * slope - curvature).max(0.0) / total,
            )
        }
    }
}

/// Edges of the quantum of a sample, in standard deviations from the mean; by symmetry the near edge is the lower one.
struct Edges {
    near: f64,
    far: f64,
}

impl Edges {
    #[inline(always)]
    fn new(rest: f64, quantum: f64, deviation: f64) -> Self {
        Self { near: (rest.abs() - 0.5 * quantum) / deviation, far: (rest.abs() + 0.5 * quantum) / deviation }
    }

    /// Normal density at the far edge, and area between the edges, both divided by the density at the near edge, so that they do not
    /// underflow far from the mean.
    #[inline(always)]
    fn area(&self) -> (f64, f64) {
        let at_far = exp(-0.5 * (self.far - self.near) * (self.far + self.near));
        (at_far, mills_ratio(self.near.max(-FAR_INSIDE)) - at_far * mills_ratio(self.far))
    }
}

/// Area of the normal density beyond x over the density at x (Mills' ratio), to 2e-7 (Press et al., Numerical Recipes,
/// section 6.2: Chebyshev approximation of erfc).
#[inline(always)]
fn mills_ratio(x: f64) -> f64 {
    const HALF_PI_ROOT: f64 = 1.253_314_137_315_500_3;
    const ROOT_TWO_PI: f64 = 2.506_628_274_631_000_7;
    let t = 1.0 / (1.0 + 0.5 * core::f64::consts::FRAC_1_SQRT_2 * x.abs());
    let mut sum = 0.170_872_77;
    for c in [
        -0.822_152_23,
        1.488_515_87,
        -1.135_203_98,
        0.278_868_07,
        -0.186_288_06,
        0.096_784_18,
        0.374_091_96,
        1.000_023_68,
        -1.265_512_23,
    ] {
        sum = sum * t + c;
    }
    let beyond = HALF_PI_ROOT * t * exp(sum);
    let below = ROOT_TWO_PI * exp(0.5 * x.min(0.0) * x.min(0.0)) - beyond;
    if x < 0.0 { below } else { beyond }
}

/// e^x to 1e-10 for x up to 700, and nearly 0 below -700: without a branch, for vectors.
#[inline(always)]
fn exp(x: f64) -> f64 {
    const LN_2: f64 = core::f64::consts::LN_2;
    const WHOLE: f64 = 6_755_399_441_055_744.0; // 1.5 2^52: adding it rounds to a whole number, in the lowest bits
    let x = x.max(-700.0);
    let shifted = x * core::f64::consts::LOG2_E + WHOLE;
    let r = x - (shifted - WHOLE) * LN_2;
    let mut sum = 1.0 / 362_880.0;
    for c in [1.0 / 40_320.0, 1.0 / 5_040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        sum = sum * r + c;
    }
    sum * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)
}

#[cfg(test)]
mod tests {
    use super::{Cavity, Rounded, SiteApproximations, exp, mills_ratio};

    #[test]
    fn the_exponential_and_the_tail_are_those_of_the_library() {
        for i in -6900..6900 {
            let x = 0.1 * f64::from(i);
            assert!((exp(x) / libm::exp(x) - 1.0).abs() < 1e-9, "{x}");
        }
        for i in -700..2500 {
            let x = 0.01 * f64::from(i);
            let true_one = 1.253_314_137_315_500_3 * libm::exp(0.5 * x * x) * libm::erfc(x / 2.0_f64.sqrt());
            assert!((mills_ratio(x) / true_one - 1.0).abs() < 4e-7, "{x}");
        }
    }

    /// Mean and variance of a normal number given that, with noise, it was rounded to `value`: by summing.
    fn moments(value: f64, quantum: f64, mean: f64, variance: f64, noise_variance: f64) -> (f64, f64) {
        let mut sums = [0.0; 3];
        let deviation = variance.sqrt();
        for i in -4000..=4000 {
            let x = mean + deviation * 0.002 * f64::from(i);
            let edge = |e: f64| 0.5 * libm::erfc(-(e - x) / (2.0 * noise_variance).sqrt());
            let likely = edge(value + 0.5 * quantum) - edge(value - 0.5 * quantum);
            let weight = likely * (-0.5 * (x - mean) * (x - mean) / variance).exp();
            sums = [sums[0] + weight, sums[1] + weight * x, sums[2] + weight * x * x];
        }
        let first = sums[1] / sums[0];
        (first, sums[2] / sums[0] - first * first)
    }

    #[test]
    fn a_site_gives_the_moments_of_the_rounded_sample() {
        for (mean, variance, noise_variance) in
            [(0.2, 0.3, 0.01), (0.9, 0.3, 0.2), (-0.4, 0.02, 0.001), (0.6, 0.01, 0.05), (2.0, 3.0, 1.0)]
        {
            let (mut site, mut spread) = ([0.0], [0.3]);
            for _ in 0..60 {
                let mut cavity = Cavity { mean: vec![mean], variance: vec![variance] };
                let rounded = Rounded { value: &[0.0], quantum: 1.0 };
                let mut sites = SiteApproximations { value: &mut site, variance: &mut spread };
                rounded.update_sites(&mut cavity, noise_variance, &mut sites);
            }
            let precision = 1.0 / variance + 1.0 / spread[0];
            let found = ((mean / variance + site[0] / spread[0]) / precision, 1.0 / precision);
            let right = moments(0.0, 1.0, mean, variance, noise_variance);
            assert!((found.0 - right.0).abs() < 3e-4 * variance.sqrt(), "{found:?} {right:?}");
            assert!((found.1 - right.1).abs() < 3e-4 * variance, "{found:?} {right:?}");
        }
    }
}
