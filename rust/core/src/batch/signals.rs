//! Signals: histories of loads, from which the measures of a batch are computed.

use super::measure::Statistic;

/// A signal: a history from which statistics are computed, by the indices of its load rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Signal {
    Row(usize),
    /// `√(y² + z²)` of two rows.
    Resultant(usize, usize),
    /// Equivalent load by the index of its rows.
    Equivalent(usize),
    /// The same, whose power is integrated over the distance.
    Power(usize),
}

/// One load: a component of a group's load, or the drive force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum LoadRow {
    Group { component: usize, group: usize },
    Drive,
}

/// A signal and the statistics that it is needed for.
#[derive(Debug, Clone, Copy)]
pub(super) struct SignalRequest {
    pub signal: Signal,
    pub extremes: bool,
    /// Whether the smallest value is one of the extremes needed.
    pub smallest: bool,
    /// Times of the extremes.
    pub times: bool,
    pub squares: bool,
}

impl SignalRequest {
    /// Without statistics.
    pub(super) fn new(signal: Signal) -> Self {
        Self { signal, extremes: false, smallest: false, times: false, squares: false }
    }

    /// Adds what a statistic needs.
    pub(super) fn add(&mut self, statistic: Statistic) {
        use Statistic::{Min, Rms, Start, TimeOfMax, TimeOfMin};
        self.extremes |= !matches!(statistic, Rms | Start);
        self.smallest |= matches!(statistic, Min | TimeOfMin);
        self.times |= matches!(statistic, TimeOfMin | TimeOfMax);
        self.squares |= statistic == Rms;
    }

    /// Whether a block in which bounds rule out a new extreme needs no evaluation. Bounds on magnitudes are upper ones.
    pub(super) fn needs_only_extremes(&self) -> bool {
        !self.squares
            && match self.signal {
                Signal::Row(_) => true,
                Signal::Resultant(..) | Signal::Equivalent(_) => !self.smallest,
                Signal::Power(_) => false,
            }
    }
}
