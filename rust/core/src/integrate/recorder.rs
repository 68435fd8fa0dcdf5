//! The recorded instants of a run: samples of the excitation, or output times.

use super::method::Output;
use crate::excitation::Excitation;
use crate::output::Record;
use crate::system::{NO_INPUT, State, StateBox};

/// Passes the instants of a run to its record.
pub(super) struct Recorder<'a> {
    pub(super) excitation: &'a Excitation<'a>,
    pub(super) output: Output<'a>,
    pub(super) record: &'a mut dyn Record,
    /// Whether the instants are recorded as the run passes samples: all samples, or output times of an exact run that all are samples.
    pub(super) at_samples: bool,
    pub(super) recorded: usize,
}

/// Whether all output times are times of samples.
pub(super) fn are_samples(times: &[f64], excitation: &Excitation) -> bool {
    let (mut k, last) = (0, excitation.count() - 1);
    times.iter().all(|&time| {
        while k < last && excitation.time(k) < time {
            k += 1;
        }
        excitation.time(k) == time
    })
}

impl Recorder<'_> {
    /// Leaves out the next `count` samples if no state in the box would change the record; whether it did.
    pub(super) fn leave_out(&mut self, count: usize, states: &StateBox) -> bool {
        let left_out = self.record.leave_out(count, states);
        self.recorded += if left_out { count } else { 0 };
        left_out
    }

    /// Records sample `k`.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn sample(&mut self, k: usize, state: &State) {
        self.samples(k, core::slice::from_ref(state));
    }

    /// Records the samples from sample `first` on, with these states, if samples are recorded, or those of them that are output times.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn samples(&mut self, first: usize, states: &[State]) {
        if let Output::Samples = self.output {
            self.record.samples(self.excitation, first, states);
            self.recorded += states.len();
        } else if self.at_samples {
            self.output_times(first, states);
        }
    }

    /// Records the output times among the samples from sample `first` on.
    #[inline(never)]
    fn output_times(&mut self, first: usize, states: &[State]) {
        let Output::Times(times) = self.output else { return };
        for (k, state) in (first..).zip(states) {
            while let Some(&time) = times.get(self.recorded)
                && time == self.excitation.time(k)
            {
                self.time(time, state);
            }
        }
    }

    /// The last sample before the next output time, at least `k`; any sample if samples are recorded, or no further times.
    pub(super) fn last_before_time(&self, k: usize) -> usize {
        let Output::Times(times) = self.output else { return usize::MAX };
        if self.at_samples {
            return usize::MAX;
        }
        let Some(&next) = times.get(self.recorded) else { return usize::MAX };
        let (mut last, mut after) = (k, self.excitation.count());
        while after - last > 1 {
            let middle = last.midpoint(after);
            if self.excitation.time(middle) < next {
                last = middle;
            } else {
                after = middle;
            }
        }
        last
    }

    /// Records an output time.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn time(&mut self, time: f64, state: &State) {
        let input = if self.record.needs_input() { self.excitation.input_at(time) } else { NO_INPUT };
        self.record.instant(time, state, &input);
        self.recorded += 1;
    }

    /// Records the remaining output times, for instance if the excitation has no duration.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn remaining_times(&mut self, state: &State) {
        if let Output::Times(times) = self.output {
            for &time in &times[self.recorded..] {
                self.time(time, state);
            }
        }
    }
}
