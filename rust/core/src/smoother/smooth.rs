//! Likelihood of the samples, and smoothed estimates with their variances.

use super::data::{ProcessNoise, Samples, Smoothed, Start};
use super::passes::ForwardBackward;
use super::variance_recovery::{LostRange, recover_variances};
use crate::error::Stopped;
use crate::numeric::simd::{Kernel, dispatch};

/// Likelihood by a forward pass: (sum of ln F, sum of v^2/F) over the innovations v and their variances F; None if `order` is not 2 to 6.
///
/// # Errors
/// [`Stopped::Interrupted`].
pub fn likelihood(
    order: usize,
    samples: Samples,
    start: Start,
    noise: ProcessNoise,
) -> Result<Option<(f64, f64)>, Stopped> {
    let found = match order {
        2 => Some(dispatch(LikelihoodKernel::<2> { samples, start, noise })),
        3 => Some(dispatch(LikelihoodKernel::<3> { samples, start, noise })),
        4 => Some(dispatch(LikelihoodKernel::<4> { samples, start, noise })),
        5 => Some(dispatch(LikelihoodKernel::<5> { samples, start, noise })),
        6 => Some(dispatch(LikelihoodKernel::<6> { samples, start, noise })),
        _ => None,
    };
    samples.watch.check()?;
    Ok(found)
}

/// Smoothed estimates by both passes; None if `order` is not 2 to 6.
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
    let ranges = match order {
        2 => dispatch(SmoothKernel::<2> { samples, start, noise, out }),
        3 => dispatch(SmoothKernel::<3> { samples, start, noise, out }),
        4 => dispatch(SmoothKernel::<4> { samples, start, noise, out }),
        5 => dispatch(SmoothKernel::<5> { samples, start, noise, out }),
        6 => dispatch(SmoothKernel::<6> { samples, start, noise, out }),
        _ => return Ok(None),
    }?;
    recover_variances(&ranges, order, samples, noise, out.variance)?;
    Ok(Some(()))
}

/// Variance over the size of its terms below which it has lost its digits in rounding.
const LOST_DIGITS: f64 = 1e-6;

/// [`likelihood`] for the order N.
struct LikelihoodKernel<'a, const N: usize> {
    samples: Samples<'a>,
    start: Start<'a>,
    noise: ProcessNoise<'a>,
}

impl<const N: usize> Kernel for LikelihoodKernel<'_, N> {
    type Output = (f64, f64);

    #[inline(always)]
    fn run(self) -> (f64, f64) {
        let Self { samples, start, noise } = self;
        let (mut determinant, mut misfit) = (0.0, 0.0);
        ForwardBackward::<N>::forward(samples, start, noise, |at| {
            determinant += at.variance.ln();
            misfit += at.innovation * at.innovation / at.variance;
        });
        (determinant, misfit)
    }
}

/// [`smooth`] for the order N.
struct SmoothKernel<'a, 'b, const N: usize> {
    samples: Samples<'a>,
    start: Start<'a>,
    noise: ProcessNoise<'a>,
    out: &'a mut Smoothed<'b>,
}

impl<const N: usize> Kernel for SmoothKernel<'_, '_, N> {
    /// Ranges of samples whose variances are lost in rounding.
    type Output = Result<Vec<LostRange>, Stopped>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { samples, start, noise, out } = self;
        let mut ranges = Vec::new();
        let mut passes = ForwardBackward::<N>::new();
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
