//! Rounded samples: what is measured is that value plus noise lies within half a quantum of the sample.
//!
//! Rounding is no white noise where a quantum holds many samples: then it is their changes that tell where the axis is. Each
//! sample is replaced by a normal one, its site, with which the estimate has the moments that the sample gives to what
//! all others say of it (expectation propagation, Minka 2001; Rasmussen and Williams 2006, section 3.6).

use crate::float::{erfc, exp, log, sqrt};

/// Samples rounded to a quantum (0: not rounded).
#[derive(Clone, Copy)]
pub struct Rounded<'a> {
    /// n values.
    pub value: &'a [f64],
    /// Step to which they are rounded, >= 0.
    pub quantum: f64,
}

/// A sample seen from what all others say of it: logarithm of its probability, with the first derivative by their mean
/// and the negative second.
pub(super) struct Seen {
    pub told: f64,
    pub slope: f64,
    pub curvature: f64,
}

/// Quantum over standard deviation up to which rounding is normal noise of quantum^2/12: the next term is below 1e-4.
const FINE: f64 = 0.7;
/// Standard deviations to the nearer edge from which on a sample says nothing.
const INSIDE: f64 = 7.0;
/// ln sqrt(2 pi)
const LOG_ROOT_TWO_PI: f64 = 0.918_938_533_204_672_7;
/// Largest variance of a site, in squared quanta: it then says nothing.
const NOTHING: f64 = 1e6;
/// Share of the site before that is kept: all sites move at once, and would overshoot.
const KEPT: f64 = 0.3;
/// Least variance of a site over the total one, so that sites of noiseless samples stay finite.
const TIGHT: f64 = 1e-6;

impl Rounded<'_> {
    /// Sample k, given the mean and variance that all others say and the variance `level` of the noise before rounding.
    pub(super) fn seen(&self, k: usize, mean: f64, variance: f64, level: f64) -> Seen {
        let rest = self.value[k] - mean;
        let total = variance + level;
        if self.quantum * self.quantum <= FINE * FINE * total {
            let total = total + self.quantum * self.quantum / 12.0;
            let told = -0.5 * (rest * rest / total + log(total)) - LOG_ROOT_TWO_PI;
            return Seen { told, slope: rest / total, curvature: 1.0 / total };
        }
        let deviation = sqrt(total);
        // By symmetry the nearer edge is the lower one; edges in standard deviations from the mean.
        let sign = if rest < 0.0 { -1.0 } else { 1.0 };
        let (near, far) =
            ((rest.abs() - 0.5 * self.quantum) / deviation, (rest.abs() + 0.5 * self.quantum) / deviation);
        let log_q = log(self.quantum);
        if near < -INSIDE {
            return Seen { told: -log_q, slope: 0.0, curvature: 0.0 };
        }
        // Over the density at the near edge, so that nothing vanishes far out.
        let at_far = exp(-0.5 * (far - near) * (far + near));
        let inside = tail(near) - at_far * tail(far);
        let (slope, bend) = ((1.0 - at_far) / inside, (near - far * at_far) / inside);
        Seen {
            told: log(inside) - 0.5 * near * near - LOG_ROOT_TWO_PI - log_q,
            slope: sign * slope / deviation,
            curvature: (slope * slope - bend).max(0.0) / total,
        }
    }

    /// The site, (value, variance), that gives the moments of what was seen, moved from the one `before`.
    pub(super) fn site(&self, seen: &Seen, mean: f64, variance: f64, before: (f64, f64)) -> (f64, f64) {
        let rest = (1.0 - seen.curvature * variance).max(TIGHT);
        let mut precision = seen.curvature / rest;
        let mut shift = seen.slope / rest; // precision times distance from the mean
        precision += KEPT * (1.0 / before.1 - precision);
        shift += KEPT * ((before.0 - mean) / before.1 - shift);
        let most = NOTHING * self.quantum * self.quantum;
        if precision * most < 1.0 && self.quantum > 0.0 {
            (mean, most)
        } else {
            (mean + shift / precision, 1.0 / precision)
        }
    }
}

/// Area of the normal density beyond x over the density at x (Mills' ratio).
fn tail(x: f64) -> f64 {
    if x > 25.0 {
        let y = 1.0 / (x * x);
        return (1.0 - y * (1.0 - 3.0 * y)) / x;
    }
    const HALF_PI_ROOT: f64 = 1.253_314_137_315_500_3;
    HALF_PI_ROOT * exp(0.5 * x * x) * erfc(x * core::f64::consts::FRAC_1_SQRT_2)
}
