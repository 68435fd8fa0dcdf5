//! Likelihood of the samples, and smoothed estimates with their variances.

use super::data::{ProcessNoise, Samples, Smoothed, Start};
use super::passes::ForwardBackward;
use super::transition::{Transition, with_transition};
use super::variance_recovery::{LostRange, recover_variances};
use crate::error::Stopped;
use crate::numeric::simd::dispatch;

/// Likelihood by a forward pass: (sum of ln F, sum of v^2/F) over the innovations v and their variances F; None if `order`, the number of
/// states, is not 2 to 6 (with an oscillator 4 to 6).
///
/// # Errors
/// [`Stopped::Interrupted`].
pub fn likelihood(
    order: usize,
    samples: Samples,
    start: Start,
    noise: ProcessNoise,
) -> Result<Option<(f64, f64)>, Stopped> {
    let found = with_transition!(order, noise.oscillator, N, T => {
        dispatch!(likelihood_of_order::<N, T>(samples, start, noise))
    });
    samples.watch.check()?;
    Ok(found)
}

/// Smoothed estimates by both passes; None if `order` is not 2 to 6 (with an oscillator 4 to 6).
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
