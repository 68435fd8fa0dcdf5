//! Running statistics of one signal of one sample.

use guideload_life::Number;

use crate::life::Rule;

/// Running statistics of a signal.
#[derive(Debug, Clone, Copy)]
pub(super) struct RunningStatistics {
    pub smallest: f64,
    pub largest: f64,
    /// s.
    pub time_of_smallest: f64,
    pub time_of_largest: f64,
    /// Weighted sum of squares, or integral of powers.
    pub sum: f64,
    /// Rounding errors of the integral so far.
    pub rest: f64,
    pub start: f64,
}

impl RunningStatistics {
    /// Before the first instant.
    pub(super) const NONE: Self = Self {
        smallest: f64::INFINITY,
        largest: f64::NEG_INFINITY,
        time_of_smallest: 0.0,
        time_of_largest: 0.0,
        sum: 0.0,
        rest: 0.0,
        start: 0.0,
    };

    /// The statistics of a load that a preload raises: the larger the load without it, the larger the one with it.
    pub(super) fn with_preload(self, rule: &Rule<f64>) -> Self {
        let [smallest, largest] = [self.smallest, self.largest].map(|load| rule.with_preload(load));
        Self { smallest, largest, ..self }
    }

    /// Adds to the integral, and the rounding error to `rest`, so that the length of the motion costs no digits.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn add(&mut self, term: f64) {
        let [sum, error] = self.sum.plus(term);
        (self.sum, self.rest) = (sum, self.rest + error);
    }
}
