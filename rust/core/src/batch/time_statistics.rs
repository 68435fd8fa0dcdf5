//! Running statistics of one signal of one sample.

/// Running statistics of a signal.
#[derive(Debug, Clone, Copy)]
pub(super) struct RunningStatistics {
    pub smallest: f64,
    pub largest: f64,
    /// Instants of the extremes.
    pub at_smallest: usize,
    pub at_largest: usize,
    /// Weighted sum of squares, or of powers.
    pub sum: f64,
    pub start: f64,
}

impl RunningStatistics {
    /// Before the first instant.
    pub(super) const NONE: Self = Self {
        smallest: f64::INFINITY,
        largest: f64::NEG_INFINITY,
        at_smallest: 0,
        at_largest: 0,
        sum: 0.0,
        start: 0.0,
    };
}
