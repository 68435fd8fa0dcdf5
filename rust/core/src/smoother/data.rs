//! Samples in, estimates out.

use crate::numeric::watch::Watch;

/// The samples: n values, the variances of their noise, and the n - 1 intervals of time between them.
#[derive(Clone, Copy)]
pub struct Samples<'a> {
    /// Time from each sample to the next, > 0.
    pub step: &'a [f64],
    /// Measured values, or values of their site approximations.
    pub value: &'a [f64],
    /// Variance of each value's measurement noise, > 0; infinite: there is no value.
    pub variance: &'a [f64],
    /// Whether to stop.
    pub watch: Watch<'a>,
}

impl Samples<'_> {
    /// Whether samples, prior and process noise of a number of states agree in their lengths, and their numbers are in their ranges.
    pub(super) fn agree_with(&self, order: usize, start: &Start, noise: &ProcessNoise) -> bool {
        let (count, intervals) = (self.value.len(), self.value.len().saturating_sub(1));
        let oscillates = noise.oscillator.is_none_or(|Oscillator { frequency, damping, .. }| {
            is_positive(frequency) && is_not_negative(damping)
        });
        [self.variance.len(), self.step.len(), noise.segment.len()] == [count, intervals, intervals]
            && [start.mean.len(), start.covariance.len()] == [order, order * order]
            && [self.value, start.mean, start.covariance].iter().all(|numbers| are_finite(numbers))
            && self.step.iter().copied().all(is_positive)
            && self.variance.iter().all(|&variance| variance > 0.0)
            && noise.density.iter().copied().all(is_not_negative)
            && noise.segment.iter().all(|&segment| (segment as usize) < noise.density.len())
            && oscillates
    }
}

pub(super) fn is_positive(number: f64) -> bool {
    number > 0.0 && number.is_finite()
}

pub(super) fn is_not_negative(number: f64) -> bool {
    number >= 0.0 && number.is_finite()
}

pub(super) fn are_finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.is_finite())
}

/// Prior of the state before the first sample.
#[derive(Clone, Copy)]
pub struct Start<'a> {
    /// Mean, N numbers.
    pub mean: &'a [f64],
    /// Covariance, N x N by rows.
    pub covariance: &'a [f64],
}

/// Oscillator between the drive and the sampled point, through which the process noise acts (`ringing`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillator {
    /// Undamped natural frequency w, in radians per unit of time, > 0.
    pub frequency: f64,
    /// Damping ratio D, >= 0.
    pub damping: f64,
    /// Index of the acceleration in the state, with at least two numbers after it.
    pub acceleration: usize,
}

/// Process noise: white noise on the last number of the state, of constant spectral density in each segment, a stretch of intervals between
/// samples.
#[derive(Clone, Copy)]
pub struct ProcessNoise<'a> {
    /// Segment of the interval after each sample, n - 1 numbers.
    pub segment: &'a [u32],
    /// Noise density of each segment, >= 0.
    pub density: &'a [f64],
    /// Oscillator through which the noise acts.
    pub oscillator: Option<Oscillator>,
}

impl ProcessNoise<'_> {
    /// Density in the interval after sample k.
    #[inline(always)]
    pub(super) fn after(&self, k: usize) -> f64 {
        self.density[self.segment[k] as usize]
    }
}

/// Estimates at each sample, to be filled.
pub struct Smoothed<'a> {
    /// n x 3: the first three numbers of the state, without an oscillator the value and its first two derivatives (of order 2 only the first).
    pub mean: &'a mut [[f64; 3]],
    /// n x 3: variances of `mean`.
    pub variance: &'a mut [[f64; 3]],
    /// n x 2: u and D. u/D is the leave-one-out residual, the sample minus its estimate from all others; 1/D is its variance.
    pub residual: &'a mut [[f64; 2]],
}

/// Site approximations: normal samples that replace rounded ones (expectation propagation); n values and variances > 0, in and out.
pub struct SiteApproximations<'a> {
    /// Values of the sites.
    pub value: &'a mut [f64],
    /// Variances of the sites.
    pub variance: &'a mut [f64],
}

/// Samples rounded to a quantum.
#[derive(Clone, Copy)]
pub struct Rounded<'a> {
    /// n values.
    pub value: &'a [f64],
    /// Step to which they are rounded, >= 0; zero for samples that are not rounded.
    pub quantum: f64,
}
