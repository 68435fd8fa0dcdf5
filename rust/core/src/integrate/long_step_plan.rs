//! When a run tries a long step.

use super::method::Output;
use super::recorder::Recorder;
use crate::equations::{LONG_STEP, LongStepSamples};

/// When a run tries a long step. Without `std` never.
pub(super) struct LongStepPlan {
    /// Sample of the next attempt.
    pub next: usize,
    /// Intervals from a failed attempt to the next, and the most of them.
    pause: usize,
    longest_pause: usize,
    /// Memory for the samples of a long step.
    pub samples: LongStepSamples,
}

impl LongStepPlan {
    pub(super) fn new(recorder: &Recorder) -> Self {
        let possible = cfg!(feature = "std")
            && matches!(recorder.output, Output::Samples)
            && !recorder.record.needs_all();
        // Under a noisy motion hardly any attempt succeeds; there they must take no time.
        let next = if possible { 0 } else { usize::MAX };
        Self { next, pause: LONG_STEP, longest_pause: 8 * LONG_STEP, samples: [[0.0; LONG_STEP + 1]; 9] }
    }

    /// Notes an attempt at sample `k`, and the sample that was reached.
    pub(super) fn note(&mut self, k: usize, reached: usize) {
        if reached > k {
            (self.next, self.pause, self.longest_pause) = (reached, LONG_STEP, 2 * LONG_STEP);
        } else {
            // Even, so that the steps before it take the same pairs of steps as without an attempt.
            self.next = (k + self.pause).next_multiple_of(2);
            self.pause = usize::min(2 * self.pause, self.longest_pause);
        }
    }
}
