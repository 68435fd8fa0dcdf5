//! Likelihood of the samples, and smoothed estimates with their variances.

use core::marker::PhantomData;

use super::data::{ProcessNoise, Samples, Smoothed, Start};
use super::passes::ForwardBackward;
use super::transition::{Transition, with_transition};
use super::variance_recovery::{LostRange, recover_variances};
use crate::error::Stopped;
use crate::numeric::simd::{Kernel, dispatch};

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
        dispatch(LikelihoodKernel::<N, T> { samples, start, noise, transition: PhantomData })
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
        dispatch(SmoothKernel::<N, T> { samples, start, noise, out, transition: PhantomData })
    });
    let Some(ranges) = ranges.transpose()? else { return Ok(None) };
    recover_variances(&ranges, order, samples, noise, out.variance)?;
    Ok(Some(()))
}

/// Variance over the size of its terms below which it has lost its digits in rounding.
const LOST_DIGITS: f64 = 1e-6;

/// [`likelihood`] for the order N.
struct LikelihoodKernel<'a, const N: usize, T> {
    transition: PhantomData<T>,
    samples: Samples<'a>,
    start: Start<'a>,
    noise: ProcessNoise<'a>,
}

impl<const N: usize, T: Transition<N>> Kernel for LikelihoodKernel<'_, N, T> {
    type Output = (f64, f64);

    #[inline(always)]
    fn run(self) -> (f64, f64) {
        let Self { samples, start, noise, .. } = self;
        let (mut determinant, mut misfit) = (0.0, 0.0);
        ForwardBackward::<N, T>::forward(samples, start, noise, |at| {
            determinant += at.variance.ln();
            misfit += at.innovation * at.innovation / at.variance;
        });
        (determinant, misfit)
    }
}

/// [`smooth`] for the order N.
struct SmoothKernel<'a, 'b, const N: usize, T> {
    transition: PhantomData<T>,
    samples: Samples<'a>,
    start: Start<'a>,
    noise: ProcessNoise<'a>,
    out: &'a mut Smoothed<'b>,
}

impl<const N: usize, T: Transition<N>> Kernel for SmoothKernel<'_, '_, N, T> {
    /// Ranges of samples whose variances are lost in rounding.
    type Output = Result<Vec<LostRange>, Stopped>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { samples, start, noise, out, .. } = self;
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
}
