//! Variances that the pass backwards loses in rounding, found again by the chain of `posterior`, which subtracts nothing.
//!
//! After a gap, in a violent jump and at the first samples the filter knows next to nothing, and what the score takes off
//! its variances leaves rounding alone.

use super::data::{ProcessNoise, Samples};
use super::posterior::{Posterior, PosteriorInput};

/// A run of samples with lost variances, and what the filter knows of the first one before it is seen.
pub(super) struct LostRange {
    first: usize,
    last: usize,
    covariance: Vec<f64>,
}

impl LostRange {
    /// Adds sample k; they come from the last to the first.
    pub fn add<const N: usize>(ranges: &mut Vec<Self>, k: usize, covariance: &[[f64; N]; N]) {
        let covariance = covariance.as_flattened().to_vec();
        match ranges.last_mut() {
            Some(run) if run.first == k + 1 => (run.first, run.covariance) = (k, covariance),
            _ => ranges.push(Self { first: k, last: k, covariance }),
        }
    }
}

/// Samples after a run that are looked at, first and at most: what later ones tell of it fades in some time constants.
const NEAR: usize = 64;
const FAR: usize = 4096;
/// Share by which the first variances after a run may miss what they are.
const MISS: f64 = 1e-3;

/// Writes the variances of all ranges. order: 2 to 6.
pub(super) fn recover_variances(
    ranges: &[LostRange],
    order: usize,
    samples: Samples,
    noise: ProcessNoise,
    variance: &mut [[f64; 3]],
) {
    let count = variance.len();
    let mut found = Vec::new();
    for run in ranges {
        let mut reach = NEAR;
        loop {
            let end = count.min(run.last + 1 + reach);
            let given = PosteriorInput {
                step: &samples.step[run.first..end - 1],
                variance: &samples.variance[run.first..end],
                covariance: &run.covariance,
                noise: ProcessNoise { segment: &noise.segment[run.first..end - 1], density: noise.density },
            };
            let Some(chain) = Posterior::new(order, given) else { return };
            // One more than the run: it tells whether enough samples were looked at.
            found.clear();
            found.extend(chain.variances().take(run.last + 2 - run.first));
            let enough = end == count
                || reach >= FAR
                || found[run.last + 1 - run.first]
                    .iter()
                    .zip(&variance[run.last + 1])
                    .all(|(found, known)| (found - known).abs() <= MISS * known);
            if enough {
                break;
            }
            reach *= 4;
        }
        let length = run.last + 1 - run.first;
        variance[run.first..=run.last].copy_from_slice(&found[..length]);
    }
}
