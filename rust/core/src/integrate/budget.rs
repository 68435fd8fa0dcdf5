//! How much work a run may take: a generous multiple of what its input lets expect.
//!
//! The unit is a step of an explicit method, a part of a search, or a part of a power series: 0.1 to 2 µs.

use super::control::Control;
use super::method::Method;
use crate::error::{OtherMethod, RunError};
use crate::excitation::Excitation;
use crate::numeric::float::{dot, pow, sqrt};
use crate::output::Record;
use crate::system::{State, System, finite};

/// Work that every run may take, about a second.
const LEAST_WORK: f64 = 1e6;

/// Work for each interval between samples and each output time. One step is usual; with contact changes and their searches some ten.
const WORK_PER_INTERVAL: f64 = 100.0;

/// Work for each radian of the fastest mode: one step of an explicit method at the limit of its stability takes 3 rad, and at a loose
/// tolerance 0.5 rad; a link that rattles in its clearance changes contact twice in 6 rad, at a cost of some ten parts.
const WORK_PER_RADIAN: f64 = 20.0;

/// Work for each step of a fixed length, over that of the step itself.
const WORK_PER_FIXED_STEP: f64 = 10.0;

/// Longest step of an explicit method that damped modes allow, in radians of the fastest: the limit of Dormand-Prince 5(4) on the real axis.
const MOST_RADIANS_PER_STEP: f64 = 3.31;

/// Most work beside that for each interval: some ten seconds, for steps that the user has chosen a minute. The modes of a guided body are
/// slower than 10 kHz; to follow faster ones, which belong to wrong numbers, may take years.
const MOST_WORK: f64 = 1e8;
const MOST_FIXED_WORK: f64 = 1e8;

/// Addition to the most work for each interval. A mode of 170 Hz, excited anew every 10 ms, takes the implicit method 600 at a tolerance of
/// 1e-9.
const MOST_WORK_PER_INTERVAL: f64 = 5e3;

/// Number of nonlinear links that double the time of a unit of work.
const LINKS_PER_UNIT: f64 = 8.0;

/// Largest modal frequency at rest, rad/s; `damped`: or decay rate.
fn fastest(system: &System, damped: bool) -> f64 {
    let mut fastest = system.highest_frequency();
    for column in system.damping.iter().filter(|_| damped) {
        fastest = f64::max(fastest, column.iter().map(|x| x.abs()).sum());
    }
    fastest
}

/// Largest frequency of the body on a single nonlinear link of nominal stiffness, rad/s: behind an edge it may vibrate faster than at rest.
fn fastest_on_a_link(system: &System) -> f64 {
    let mut fastest = 0.0;
    for (_, row) in system.nonlinear() {
        let mobility = dot(&row.rate, &row.rate);
        fastest = f64::max(fastest, sqrt(row.link.law().nominal() * mobility));
    }
    fastest
}

/// Watches the work of a run.
#[derive(Clone, Copy)]
pub(super) struct Budget {
    /// Work at which the run looks up next, and at which it gives up.
    pub pause: usize,
    most: usize,
    /// Largest modal frequency, rad/s, for the error.
    fastest: f64,
}

impl Budget {
    /// The budget of a run with the method M.
    ///
    /// # Errors
    /// [`RunError::TooLong`] or [`RunError::ShortSteps`], if an explicit method, or steps of this length, cannot pass the motion within it.
    pub fn new<M: Method>(
        system: &System,
        excitation: &Excitation,
        outputs: usize,
        control: Control,
        (start, other): (&State, OtherMethod),
    ) -> Result<Self, RunError> {
        let (duration, count) = (excitation.duration(), excitation.count());
        let radians = duration * fastest(system, M::ERROR_ORDER.is_some());
        let (by_method, most) = match (control, M::ERROR_ORDER) {
            (Control::Fixed { step }, _) => {
                (WORK_PER_FIXED_STEP * M::WORK as f64 * duration / step, MOST_FIXED_WORK)
            }
            // The error of a step falls as its length to the power of the order plus one.
            (Control::Adaptive { rtol }, Some(order)) => {
                (WORK_PER_RADIAN * radians * pow(rtol, -1.0 / f64::from(order + 1)), MOST_WORK)
            }
            (Control::Adaptive { .. }, None) => {
                let radians = f64::max(radians, duration * fastest_on_a_link(system));
                (WORK_PER_RADIAN * radians, MOST_WORK)
            }
        };
        let time_of_unit = 1.0 + system.nonlinear().count() as f64 / LINKS_PER_UNIT;
        let most = most / time_of_unit + MOST_WORK_PER_INTERVAL * count as f64;
        match control {
            Control::Fixed { step } => {
                let (steps, most) = (duration / step, most / M::WORK as f64);
                if steps > most {
                    return Err(RunError::ShortSteps { step, steps, most, other });
                }
            }
            Control::Adaptive { .. } if !M::STABLE => {
                // A body at rest is followed in steps of any length until something acts on it.
                let rests = *start == [0.0; 12] && excitation.riders().is_empty();
                let moves = (0..count).find(|&k| !rests || excitation.input(k) != [0.0; 9]);
                let duration =
                    moves.map_or(0.0, |k| excitation.time(count - 1) - excitation.time(k.saturating_sub(1)));
                let mode = fastest(system, false);
                let steps = duration * mode / MOST_RADIANS_PER_STEP;
                if steps > most {
                    return Err(RunError::TooLong { duration, steps, most, fastest: mode, other });
                }
            }
            Control::Adaptive { .. } => {}
        }
        // Not NaN, if a duration of zero meets an infinite decay rate.
        let by_method = if by_method < most { by_method } else { most };
        let work = LEAST_WORK / time_of_unit + by_method + WORK_PER_INTERVAL * (count + outputs) as f64;
        Ok(Self { pause: 0, most: work as usize, fastest: fastest(system, true) })
    }

    /// Whether to look up after so much work.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn is_due(&self, work: usize) -> bool {
        work >= self.pause
    }

    /// Ends the run in `state` if its record says so, the state has overflowed, or the budget is used up; else the next `pause`. Out of line
    /// and by value: a reference to one field of the loop would keep all of them in memory, and a step of the exact method would take a
    /// quarter longer.
    #[cold]
    #[inline(never)]
    pub fn look_up(
        self,
        work: usize,
        steps: usize,
        record: &mut dyn Record,
        state: &State,
        [time, step]: [f64; 2],
        other: OtherMethod,
    ) -> Result<usize, RunError> {
        if record.stops() {
            return Err(RunError::Interrupted { time });
        }
        if !finite(state) {
            return Err(RunError::OutOfRange);
        }
        if work >= self.most {
            return Err(RunError::TooManySteps { time, step, steps, fastest: self.fastest, other });
        }
        Ok(usize::min(self.most, work + BETWEEN))
    }
}

/// Work, or instants, between two questions to the record whether to stop: a millisecond or so.
pub(super) const BETWEEN: usize = 1024;
