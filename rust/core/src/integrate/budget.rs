//! How much work a run may take: a generous multiple of what its input lets expect.
//!
//! The unit is a step of an explicit method, a part of a search, or a part of a power series: 0.1 to 2 µs.

use super::control::Control;
use crate::excitation::Excitation;
use crate::numeric::float::pow;
use crate::system::System;

/// Work that every run may take, about a second.
const LEAST_WORK: f64 = 1e6;

/// Work for each interval between samples and each output time. One step is usual; with contact changes and their searches some ten.
const WORK_PER_INTERVAL: f64 = 200.0;

/// Work for each radian of the fastest mode: one step of an explicit method at the limit of its stability takes 3 rad, and at a loose
/// tolerance 0.5 rad; a link that rattles in its clearance changes contact twice in 6 rad, at a cost of some ten parts.
const WORK_PER_RADIAN: f64 = 20.0;

/// Fastest turning that is followed, rad/s: 160 kHz. The modes of a guided body are slower than 10 kHz. A faster one belongs to a wrong
/// number, and would not be over in days.
const FASTEST: f64 = 1e6;

/// Work for each step of a fixed length.
const WORK_PER_FIXED_STEP: f64 = 10.0;

/// Most work of any run, a minute or so.
const MOST_WORK: f64 = 1e8;

/// Largest modal frequency at rest, damping included, rad/s.
pub(super) fn fastest(system: &System) -> f64 {
    let mut fastest = system.frequency.iter().fold(0.0, |most, x| f64::max(most, *x));
    for column in &system.damping {
        fastest = f64::max(fastest, column.iter().map(|x| x.abs()).sum());
    }
    fastest
}

/// The work that a run may take. `error_order`: that of the method's error estimate.
pub(super) fn budget(
    system: &System,
    excitation: &Excitation,
    outputs: usize,
    control: Control,
    error_order: Option<u32>,
) -> usize {
    let (duration, intervals) = (excitation.duration(), excitation.count() + outputs);
    let mut by_method = WORK_PER_RADIAN * duration * f64::min(fastest(system), FASTEST);
    match (control, error_order) {
        // The error of a step falls as its length to the power of the order plus one.
        (Control::Adaptive { rtol }, Some(order)) => by_method *= pow(rtol, -1.0 / f64::from(order + 1)),
        (Control::Adaptive { .. }, None) => {}
        (Control::Fixed { step }, _) => by_method += WORK_PER_FIXED_STEP * duration / step,
    }
    let work = LEAST_WORK + WORK_PER_INTERVAL * intervals as f64 + by_method;
    // Not `min`, for which an infinite duration of no frequency, a NaN, would be no limit.
    if work < MOST_WORK { work as usize } else { MOST_WORK as usize }
}
