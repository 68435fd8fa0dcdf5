//! Variance recovery where the backward pass loses its digits.
//!
//! After a gap, in a sudden jump and at the first samples the variances of the filter are very large. The backward pass then subtracts nearly
//! equal covariances, and only rounding remains. The chain of `posterior` subtracts nothing; these variances are computed from it.

use super::data::{ProcessNoise, Samples};
use super::posterior::{Posterior, PosteriorInput};
use crate::error::Stopped;

/// A range of samples with lost variances, and the covariance predicted for the first one.
pub(super) struct LostRange {
    first: usize,
    last: usize,
    covariance: Vec<f64>,
}

impl LostRange {
    /// Adds sample k; samples come from the last to the first.
    pub fn add<const N: usize>(ranges: &mut Vec<Self>, k: usize, covariance: &[[f64; N]; N]) {
        let covariance = covariance.as_flattened().to_vec();
        match ranges.last_mut() {
            Some(range) if range.first == k + 1 => (range.first, range.covariance) = (k, covariance),
            _ => ranges.push(Self { first: k, last: k, covariance }),
        }
    }
}

/// Number of samples after a range that the chain includes, at first and at most. The information of later samples on the range decays within
/// some time constants.
const FIRST_REACH: usize = 64;
const MAX_REACH: usize = 4096;
/// Relative difference up to which the variance after the range agrees with that of the backward pass.
const AGREEMENT: f64 = 1e-3;

/// Writes the variances of all ranges. order: 2 to 6.
pub(super) fn recover_variances(
    ranges: &[LostRange],
    order: usize,
    samples: Samples,
    noise: ProcessNoise,
    variance: &mut [[f64; 3]],
) -> Result<(), Stopped> {
    let count = variance.len();
    let mut found = Vec::new();
    for range in ranges {
        let mut reach = FIRST_REACH;
        loop {
            let end = count.min(range.last + 1 + reach);
            let given = PosteriorInput {
                step: &samples.step[range.first..end - 1],
                variance: &samples.variance[range.first..end],
                covariance: &range.covariance,
                noise: ProcessNoise { segment: &noise.segment[range.first..end - 1], ..noise },
                watch: samples.watch,
            };
            let Some(chain) = Posterior::new(order, given)? else { return Ok(()) };
            // One more than the range, to check whether enough samples were included.
            samples.watch.check()?;
            found.clear();
            found.extend(chain.variances().take(range.last + 2 - range.first));
            let enough = end == count
                || reach >= MAX_REACH
                || found[range.last + 1 - range.first]
                    .iter()
                    .zip(&variance[range.last + 1])
                    .all(|(found, known)| (found - known).abs() <= AGREEMENT * known);
            if enough {
                break;
            }
            reach *= 4;
        }
        let length = range.last + 1 - range.first;
        variance[range.first..=range.last].copy_from_slice(&found[..length]);
    }
    Ok(())
}
