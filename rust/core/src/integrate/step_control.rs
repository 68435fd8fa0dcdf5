//! The steps of a run: their sizes, and whether they are accepted.

use super::control::{Control, Controller, ErrorNorm};
use crate::error::{OtherMethod, RunError};
use crate::excitation::Ramp;
use crate::numeric::float::{ceil, floor};
use crate::system::{State, finite, speed};

/// Choice and acceptance of the steps of a run.
pub(super) struct StepControl {
    pub control: Control,
    /// None for fixed steps, and for a method without step error.
    pub controller: Option<Controller>,
    pub norm: ErrorNorm,
    /// Whether the method has a step error.
    pub has_error: bool,
    /// Whether there are edges at which the equations are not analytic.
    pub has_edges: bool,
    /// Whether the step starts or ends at one of them.
    pub at_edge: bool,
    /// Way out if the run fails.
    pub other: OtherMethod,
    /// Whether the last interval was one step, if the method tries that first.
    pub was_whole: bool,
    /// Bound on the speed `|η'|`: the size of the first state and the impulse of the excitation so far, for fixed steps.
    pub reach: f64,
}

/// One interval of the excitation, or several that lie on one straight line: from sample `first` to sample `until`.
#[derive(Clone, Copy)]
pub(super) struct Interval {
    pub first: usize,
    pub until: usize,
    /// Time of the first sample, s.
    pub start: f64,
    /// s.
    pub length: f64,
}

/// Equal steps planned for the rest of an interval: how many are left, and their length, s.
pub(super) struct Plan {
    pub left: f64,
    pub h: f64,
}

impl StepControl {
    /// Whether a step to `next` with this estimated error is accepted.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn judge(
        &mut self,
        ramp: &Ramp,
        next: &State,
        error: &State,
        interval: Interval,
        done: f64,
    ) -> Result<bool, RunError> {
        let (time, h) = (interval.start + done, ramp.h);
        // Without a step error no free motion grows, and a state that overflows stays infinite: one test at the end suffices.
        let mut bounded = !self.has_error || finite(next);
        if let Some(controller) = &mut self.controller {
            let error = if bounded { self.norm.of(error) } else { f64::INFINITY };
            let no_margin = self.at_edge || interval.until > interval.first + 1;
            let rounding =
                || if self.has_edges && bounded { STATE_ROUNDING * self.norm.of(next) } else { 0.0 };
            if !controller.accept(h, error, no_margin, rounding) {
                if h <= 2.0 * SHORTEST * interval.length {
                    // Within so short a time from an edge the error falls hardly faster than the step.
                    if self.has_edges && controller.is_negligible(error) {
                        return Ok(true);
                    }
                    return Err(RunError::StepTooSmall {
                        time,
                        step: h,
                        error: controller.error_ratio(),
                        other: self.other,
                    });
                }
                return Ok(false);
            }
        } else if self.has_error {
            // Springs and dampers are passive, and their potential is lowest at rest, so |η'| grows no faster than ∫ |f| dt.
            self.reach += ramp.impulse();
            // Before it acts, a state is rounding only.
            bounded &= speed(next) <= DIVERGENCE * self.reach || self.norm.of(next) <= DIVERGENCE_FLOOR;
        }
        if bounded { Ok(true) } else { Err(RunError::Diverged { time, step: h, other: self.other }) }
    }

    /// Replans the `rest` of an interval of `length` s if the step size has changed.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn update_plan(&mut self, plan: &mut Plan, rest: f64, length: f64) {
        let wanted = match (&mut self.controller, self.control) {
            (Some(controller), _) => controller.split(rest),
            (None, Control::Fixed { step }) if plan.left == 0.0 => ceil(rest / step * (1.0 - 1e-12)),
            (None, Control::Fixed { .. }) => plan.left,
            (None, Control::Adaptive { .. }) => 1.0,
        };
        if plan.left == 0.0 || wanted > plan.left || 1.25 * wanted <= plan.left {
            (plan.left, plan.h) = (1.0, rest);
            if wanted > 1.0 {
                plan.left = f64::min(wanted, f64::max(1.0, floor(rest / length / SHORTEST)));
                plan.h = rest / plan.left;
            }
        }
    }
}

/// Largest speed of a stable run over the bound from the impulse of the excitation.
const DIVERGENCE: f64 = 100.0;

/// Estimated error of a step that is rounding of its states, over their size. After an edge steps are so short that their share of the
/// tolerance may be less.
const STATE_ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Norm of a state over the load scale below which divergence is not tested. Rounding is some 1e-15 of the preloads.
const DIVERGENCE_FLOOR: f64 = 1e-6;

/// Shortest step, as a fraction of the interval that it lies in.
pub(super) const SHORTEST: f64 = 1e-9;
