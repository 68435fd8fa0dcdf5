//! The one loop of all methods: from sample to sample of the excitation.

use super::budget::{BETWEEN, Budget};
use super::long_step_plan::LongStepPlan;
use super::method::{Method, Output, Summary};
use super::recorder::Recorder;
use super::step_control::{Interval, Plan, StepControl};
use crate::contacts::SwitchedEquations;
use crate::equations::Equations;
use crate::error::RunError;
use crate::excitation::{Forcing, Instant, Ramp, Values};
use crate::system::{State, finite};

/// State of a run in progress.
pub(super) struct Runner<'a, M: Method, C> {
    pub method: &'a M,
    // By reference, so that the other fields stay in registers from step to step.
    pub memory: &'a mut M::Memory,
    pub equations: &'a mut C,
    pub steps: StepControl,
    pub recorder: Recorder<'a>,
    pub summary: Summary,
    pub budget: Budget,
}

impl<M: Method, C: SwitchedEquations> Runner<'_, M, C> {
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn run(mut self, forcing: &Forcing, start: State) -> Result<Summary, RunError> {
        let excitation = self.recorder.excitation;
        // References that swap keep both states in memory. In registers, their entries would be unpacked and packed in every step.
        let (mut state, mut next): (&mut State, &mut State) = (&mut { start }, &mut [0.0; 12]);
        let (mut from, mut to): (&mut Values, &mut Values) = (&mut [0.0; 9], &mut [0.0; 9]);
        forcing.sample(excitation, 0, from);
        self.recorder.sample(0, state);
        let (mut k, mut retry_from, mut passed) = (0, 0, 0);
        let mut plan = LongStepPlan::new(&self.recorder);
        while k + 1 < excitation.count() {
            if M::EXACT_IF_LINEAR
                && self.whole_interval(forcing, k, [&mut state, &mut next], [&mut from, &mut to])?
            {
                k += 1;
                if cfg!(feature = "std") {
                    k = self.vibrate_freely(forcing, k, state);
                }
                continue;
            }
            if M::ERROR_ORDER.is_none() && k >= retry_from {
                if cfg!(feature = "std")
                    && k >= plan.next
                    && let Some(reached) =
                        self.long_step(&mut plan, forcing, k, [&mut state, &mut next], from)
                {
                    k = reached;
                    continue;
                }
                let start = k;
                let until = usize::min(plan.next, self.recorder.last_before_time(k));
                k = self.step_equal_intervals(
                    forcing,
                    k,
                    until,
                    [&mut state, &mut next],
                    [&mut from, &mut to],
                );
                passed += k - start;
                if k == plan.next {
                    continue;
                }
                if k + 1 == excitation.count() {
                    break;
                }
                if k > start && self.budget.is_due(self.work()) {
                    self.look_up_budget(k, state)?;
                    continue;
                }
                // The length of the intervals changes here: go on with steps of the new length.
                if k > start && excitation.interval(k) != excitation.interval(start) {
                    continue;
                }
                retry_from = if passed < FEW_SAMPLES { k + PAUSE } else { k };
                passed = 0;
            }
            k = self.interval(forcing, k, [&mut state, &mut next], [&mut from, &mut to])?;
        }
        self.end(state)
    }

    /// Work of the run so far.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn work(&self) -> usize {
        M::WORK * (self.summary.steps + self.summary.rejected) + self.equations.searched()
    }

    /// Steps from sample `k`, at which `state` and the values `from` are, over one interval, or several that lie on a straight line;
    /// returns the sample reached, to which they then belong.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn interval(
        &mut self,
        forcing: &Forcing,
        k: usize,
        [state, next]: [&mut &mut State; 2],
        [from, to]: [&mut &mut Values; 2],
    ) -> Result<usize, RunError> {
        let excitation = self.recorder.excitation;
        // A method with a step error may step over samples where the slope of the excitation does not change. With contact changes, short
        // steps are cheaper to search. A method with propagators reuses steps of equal length.
        let merges = self.steps.controller.is_some() && !C::Equations::PIECEWISE && !M::EXACT_IF_LINEAR;
        let until = if merges { forcing.straight_until(excitation, k) } else { k + 1 };
        let start = excitation.time(k);
        let length = if until == k + 1 { excitation.interval(k) } else { excitation.time(until) - start };
        forcing.sample(excitation, until, to);
        let ramp = Ramp::whole(length, [&**from, &**to], forcing, Instant { first: k, until, since: 0.0 });
        self.step_over(Interval { first: k, until, start, length }, &ramp, state, next)?;
        core::mem::swap(from, to);
        if self.recorder.at_samples {
            self.recorder.sample(until, state);
        }
        Ok(until)
    }

    /// The summary of a run that has reached the last sample, in `state`.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn end(mut self, state: &State) -> Result<Summary, RunError> {
        if !finite(state) {
            return Err(RunError::OutOfRange);
        }
        self.recorder.remaining_times(state);
        (self.summary.recorded, self.summary.end) = (self.recorder.recorded, *state);
        let seen = self.method.contact_changes(self.equations.equations(), self.memory);
        self.summary.contact_changes = self.equations.changes() + seen;
        Ok(self.summary)
    }

    /// Steps from the start of an interval, at which `state` is, to its end.
    // Long: the steps of the loop share the state in registers, and each call is one thing that a step does.
    #[cfg_attr(feature = "std", inline(always))]
    fn step_over<'s>(
        &mut self,
        interval: Interval,
        whole: &Ramp,
        state: &mut &'s mut State,
        next: &mut &'s mut State,
    ) -> Result<(), RunError> {
        let Interval { first, start, length, .. } = interval;
        let mut k = first + 1;
        let mut parts;
        let mut done = 0.0;
        let mut plan = Plan { left: 0.0, h: 0.0 };
        while done < length {
            let steps = self.summary.steps + self.summary.rejected;
            let work = self.work();
            if self.budget.is_due(work) {
                let (at, other) = ([start + done, plan.h], self.steps.other);
                self.budget.pause =
                    self.budget.look_up(work, steps, self.recorder.record, state, at, other)?;
            }
            self.steps.update_plan(&mut plan, length - done, length);
            let mut last = plan.left == 1.0;
            let mut ramp = if last && done == 0.0 {
                plan.h = length;
                *whole
            } else {
                let end = if last { 1.0 } else { (done + plan.h) / length };
                parts = [whole.values(done / length), whole.values(end)];
                let part = whole.later(done);
                Ramp { h: plan.h, start: &parts[0], end: &parts[1], spans_interval: false, ..part }
            };
            if !self.attempt(&ramp, state, next, interval, done)? {
                plan.left = 0.0;
                continue;
            }
            let change = self.equations.first_change(
                &ramp,
                [state, next],
                #[cfg_attr(feature = "std", inline(always))]
                |equations, theta| self.method.between(equations, self.memory, &ramp, state, theta),
            );
            let shorter;
            if let Some(theta) = change {
                let (theta, error) = if C::Equations::LINEAR {
                    self.step_to_change(&ramp, theta, state, next)
                } else {
                    self.step_to_change_out_of_line(&ramp, theta, state, next)
                };
                shorter = ramp.values(theta);
                ramp = Ramp { h: theta * plan.h, end: &shorter, spans_interval: false, ..ramp };
                if !self.accept_step_to_change(&ramp, next, &error, interval, done)? {
                    plan.left = 0.0;
                    continue;
                }
                plan = Plan { left: 1.0, h: ramp.h };
                last &= theta == 1.0;
            }
            self.record_step(&mut k, &ramp, state, interval, done, last)?;
            core::mem::swap(state, next);
            if change.is_some() {
                self.equations.cross(state);
                let since = if last { length } else { done + ramp.h };
                let place = self.place(interval, since);
                self.recorder.record.contact_change(place, state, self.equations.segments());
            }
            self.steps.at_edge = change.is_some() && !C::Equations::LINEAR;
            self.summary.steps += 1;
            done = match (last, change) {
                (true, _) => length,
                (false, Some(_)) => done + plan.h,
                // Not by adding up the steps: a million roundings would accumulate.
                (false, None) => length - (plan.left - 1.0) * plan.h,
            };
            plan.left -= 1.0;
        }
        Ok(())
    }

    /// Makes a step into `next`; false if its error is too large.
    #[cfg_attr(feature = "std", inline(always))]
    fn attempt(
        &mut self,
        ramp: &Ramp,
        state: &State,
        next: &mut State,
        interval: Interval,
        done: f64,
    ) -> Result<bool, RunError> {
        let error;
        (*next, error) = self.method.step(self.equations.equations(), self.memory, ramp, state);
        let accepted = self.steps.judge(ramp, next, &error, interval, done)?;
        self.summary.rejected += usize::from(!accepted);
        Ok(accepted)
    }

    /// Dense output of the last step.
    #[cfg_attr(feature = "std", inline(always))]
    fn between(&mut self, ramp: &Ramp, state: &State, theta: f64) -> State {
        self.method.between(self.equations.equations(), self.memory, ramp, state, theta)
    }

    /// The sample before an instant that is `since` s after the start of an interval, and the time since it, s: no more than the interval
    /// after it. The same samples are before it as in `record_step`.
    #[cfg_attr(feature = "std", inline(always))]
    fn place(&self, Interval { first, until, start, .. }: Interval, since: f64) -> (usize, f64) {
        let excitation = self.recorder.excitation;
        let mut sample = first;
        while sample + 1 < until && excitation.time(sample + 1) - start <= since {
            sample += 1;
        }
        let passed = if sample == first { 0.0 } else { excitation.time(sample) - start };
        (sample, f64::min(since - passed, excitation.interval(sample)))
    }

    /// Records the instants within the last step, which began `done` s after the start of the interval: samples from `k` on, or output times.
    #[cfg_attr(feature = "std", inline(always))]
    fn record_step(
        &mut self,
        k: &mut usize,
        ramp: &Ramp,
        state: &State,
        interval: Interval,
        done: f64,
        last: bool,
    ) -> Result<(), RunError> {
        let Interval { until, start, .. } = interval;
        match self.recorder.output {
            Output::Samples => {
                while *k < until && (last || self.recorder.excitation.time(*k) - start <= done + ramp.h) {
                    let theta = f64::min((self.recorder.excitation.time(*k) - start - done) / ramp.h, 1.0);
                    let there = self.between(ramp, state, theta);
                    self.recorder.sample(*k, &there);
                    *k += 1;
                }
            }
            Output::Times(_) if self.recorder.at_samples => {}
            Output::Times(times) => {
                let end = last && until + 1 == self.recorder.excitation.count();
                self.record_times(times, ramp, state, start, done, end)?;
            }
        }
        Ok(())
    }

    /// Records the output times within the last step, which began `done` s after `start`; at the `end` also all
    /// remaining ones.
    #[cfg_attr(feature = "std", inline(always))]
    fn record_times(
        &mut self,
        times: &[f64],
        ramp: &Ramp,
        state: &State,
        start: f64,
        done: f64,
        end: bool,
    ) -> Result<(), RunError> {
        while let Some(&time) = times.get(self.recorder.recorded) {
            let theta = if ramp.h > 0.0 { (time - start - done) / ramp.h } else { f64::INFINITY };
            if theta > 1.0 && !end {
                break;
            }
            let there = self.between(ramp, state, theta.clamp(0.0, 1.0));
            self.recorder.time(time, &there);
            if self.recorder.recorded.is_multiple_of(BETWEEN) && self.recorder.record.stops() {
                return Err(RunError::Interrupted { time });
            }
        }
        Ok(())
    }
}

/// A fast path over no more intervals than this was not worth its tests: near edges under a noisy motion most of them fail. Then the next one
/// is tried after a pause of so many intervals.
const FEW_SAMPLES: usize = 4;
const PAUSE: usize = 8;
