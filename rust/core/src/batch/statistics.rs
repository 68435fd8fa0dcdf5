//! Running statistics of a signal.

/// What is known of a signal so far.
#[derive(Debug, Clone, Copy)]
pub(super) struct RunningStatistics {
    pub smallest: f64,
    pub largest: f64,
    /// At which instants.
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
