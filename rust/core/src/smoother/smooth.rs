//! Likelihood of the samples, and smoothed estimates with their variances.

use super::data::{ProcessNoise, Samples, Smoothed, Start};
use super::passes::ForwardBackward;
use super::transition::{Transition, with_transition};
use super::variance_recovery::{LostRange, recover_variances};
use crate::error::Stopped;
use crate::numeric::simd::dispatch;

/// Likelihood by a forward pass: (sum of ln F, sum of v^2/F) over the innovations v and their variances F; None if `order`, the number of
/// states, is not 2 to 6 (with an oscillator 4 to 6), lengths do not agree, or a number is out of its range.
///
/// # Errors
/// [`Stopped::Interrupted`].
pub fn likelihood(
    order: usize,
    samples: Samples,
    start: Start,
    noise: ProcessNoise,
) -> Result<Option<(f64, f64)>, Stopped> {
    if !samples.agree_with(order, &start, &noise) {
        return Ok(None);
    }
    let found = with_transition!(order, noise.oscillator, N, T => {
        dispatch!(likelihood_of_order::<N, T>(samples, start, noise))
    });
    samples.watch.check()?;
    Ok(found)
}

/// Smoothed estimates by both passes; None where [`likelihood`] has none, or if `out` has not as many places as there are samples.
///
/// # Errors
/// [`Stopped`].
pub fn smooth(
    order: usize,
    samples: Samples,
    start: Start,
    noise: ProcessNoise,
    out: &mut Smoothed,
) -> Result<Option<()>, Stopped> {
    let places = [out.mean.len(), out.variance.len(), out.residual.len()];
    if places != [samples.value.len(); 3] || !samples.agree_with(order, &start, &noise) {
        return Ok(None);
    }
    let ranges = with_transition!(order, noise.oscillator, N, T => {
        dispatch!(smooth_of_order::<N, T>(samples, start, noise, out))
    });
    let Some(ranges) = ranges.transpose()? else { return Ok(None) };
    recover_variances(&ranges, order, samples, noise, out.variance)?;
    Ok(Some(()))
}

/// Variance over the size of its terms below which it has lost its digits in rounding.
const LOST_DIGITS: f64 = 1e-6;

/// [`likelihood`] for the order N.
#[inline(always)]
fn likelihood_of_order<const N: usize, T: Transition<N>>(
    samples: Samples,
    start: Start,
    noise: ProcessNoise,
) -> (f64, f64) {
    let (mut determinant, mut misfit) = (0.0, 0.0);
    ForwardBackward::<N, T>::forward(samples, start, noise, |at| {
        determinant += at.variance.ln();
        misfit += at.innovation * at.innovation / at.variance;
    });
    (determinant, misfit)
}

/// [`smooth`] for the order N.
#[inline(always)]
fn smooth_of_order<const N: usize, T: Transition<N>>(
    samples: Samples,
    start: Start,
    noise: ProcessNoise,
    out: &mut Smoothed,
) -> Result<Vec<LostRange>, Stopped> {
    let mut ranges = Vec::new();
    let mut passes = ForwardBackward::<N, T>::new();
    passes.filter(samples, start, noise)?;
    passes.backward(
        samples,
        noise,
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
                sound &= variance >= LOST_DIGITS * terms;
            }
            if !sound {
                LostRange::add(&mut ranges, k, &at.covariance);
            }
        },
    )?;
    Ok(ranges)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::watch::Watch;

    /// Whether 20 samples are smoothed: with so many intervals, variances and places, and a value of the sample 3.
    fn smooths([intervals, variances, places]: [usize; 3], value: f64) -> bool {
        let mut values = [0.5; 20];
        values[3] = value;
        let (step, variance, segment) = (vec![1.0; intervals], vec![0.1; variances], [0; 19]);
        let samples = Samples { step: &step, value: &values, variance: &variance, watch: Watch::NEVER };
        let start = Start { mean: &[0.0; 2], covariance: &[1.0, 0.0, 0.0, 1.0] };
        let noise = ProcessNoise { segment: &segment, density: &[1.0], oscillator: None };
        let (mut mean, mut residual) = (vec![[0.0; 3]; places], vec![[0.0; 2]; places]);
        let mut variance = mean.clone();
        let out = &mut Smoothed { mean: &mut mean, variance: &mut variance, residual: &mut residual };
        smooth(2, samples, start, noise, out).expect("memory").is_some()
    }

    #[test]
    fn short_arrays_and_samples_that_are_not_finite_are_refused() {
        assert!(smooths([19, 20, 20], 1.0));
        for lengths in [[5, 20, 20], [20, 20, 20], [19, 5, 20], [19, 20, 5]] {
            assert!(!smooths(lengths, 1.0), "{lengths:?}");
        }
        assert!(!smooths([19, 20, 20], f64::NAN) && !smooths([19, 20, 20], f64::INFINITY));
    }
}
