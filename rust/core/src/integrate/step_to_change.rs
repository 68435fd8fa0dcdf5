//! Steps that end at a contact change.

use super::method::Method;
use super::step_control::{Interval, SHORTEST};
use super::step_loop::Runner;
use crate::contacts::SwitchedEquations;
use crate::equations::Equations;
use crate::error::RunError;
use crate::excitation::Ramp;
use crate::numeric::simd::dispatch;
use crate::system::{State, finite};

/// Most attempts to end a step at a contact change: Newton's method, which starts with the error of dense output.
const MAX_ATTEMPTS: usize = 4;

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    /// Makes the step into `next` again, up to the contact change that was found at the fraction `theta`: the fraction at which it ends,
    /// and its error.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn step_to_change(
        &mut self,
        ramp: &Ramp,
        mut theta: f64,
        state: &State,
        next: &mut State,
    ) -> (f64, State) {
        let mut error = [0.0; 12];
        if theta == 0.0 {
            *next = *state;
            return (theta, error);
        }
        // A method with a step error must make the step: its dense output is that of the last step.
        if M::ERROR_ORDER.is_none()
            && let Some(state) = self.equations.state_at_change()
        {
            *next = *state;
            return (theta, error);
        }
        for again in (0..MAX_ATTEMPTS).rev() {
            let end = ramp.values(theta);
            let part = Ramp { h: theta * ramp.h, end: &end, spans_interval: false, ..*ramp };
            (*next, error) = self.method.step(self.equations.equations(), self.memory, &part, state);
            match self.equations.missed_by(next) {
                // Not NaN, and not far from what dense output says.
                Some(later) if again > 0 && later.abs() <= 0.5 * part.h => {
                    theta = f64::min(theta + later / ramp.h, 1.0);
                }
                _ => break,
            }
        }
        (theta, error)
    }

    /// [`Runner::step_to_change`] out of line: a second copy of a nonlinear step in the loop makes every step a twentieth slower.
    #[inline(never)]
    pub(super) fn step_to_change_out_of_line(
        &mut self,
        ramp: &Ramp,
        theta: f64,
        state: &State,
        next: &mut State,
    ) -> (f64, State) {
        dispatch!(self.step_to_change(ramp, theta, state, next))
    }

    /// Whether a step up to a contact change is accepted. Linear equations are as accurate there as in the whole step; those of preloaded
    /// links are not analytic at an edge.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn accept_step_to_change(
        &mut self,
        ramp: &Ramp,
        next: &State,
        error: &State,
        interval: Interval,
        done: f64,
    ) -> Result<bool, RunError> {
        if C::Equations::LINEAR || ramp.h <= 2.0 * SHORTEST * interval.length && finite(next) {
            return Ok(true);
        }
        let before = core::mem::replace(&mut self.steps.at_edge, true);
        let accepted = self.steps.judge(ramp, next, error, interval, done)?;
        if !accepted {
            self.steps.at_edge = before;
            self.summary.rejected += 1;
        }
        Ok(accepted)
    }
}
