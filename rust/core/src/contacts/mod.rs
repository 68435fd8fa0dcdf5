//! Contact changes: on which segment of its law each link is, and when it leaves this segment (event location).
//!
//! Between two contact changes the equations are linear, so every deflection is known at any time and no change is missed. Two cheap tests
//! prove for most steps that they contain no change:
//!
//! 1. The deflections at both ends are within the edges, by more than the path can bow out between them. This follows from a bound on the
//!    second derivative of the state, which is carried from step to step and recomputed only where it is not sufficient.
//! 2. The control points of the cubics through both ends are within the edges, or those of their slopes show that a link only moves away
//!    from its edge, as after it has passed it. Both by more than the error of the cubics, which follows from the fourth derivative.
//!
//! Only the other steps are searched, on the power series of the exact solution.

mod block;
mod path;
mod search;
mod segments;
mod smooth;
mod switched;

pub(crate) use smooth::SmoothContacts;
pub(crate) use switched::{SwitchedEquations, Unswitched};

use segments::{Change, Segments, bow};

use crate::equations::{LongStepBounds, SegmentEquations};
use crate::excitation::{Forcing, Ramp, Values};
use crate::numeric::float::fma;
use crate::numeric::simd::dispatch;
use crate::system::{State, System, energy_norm};

/// Contacts of one run.
#[derive(Debug, Clone)]
pub(crate) struct Contacts<'a> {
    segments: Segments<'a>,
    /// Bound on the second derivative of the state at the end of the last step.
    curvature: f64,
    /// Slopes of the excitation over the last step, and its values at the end.
    slopes: Values,
    values: Values,
    ball: ClearanceBall,
    /// The change that ends the present step, and the state there.
    change: Option<(Change, State)>,
    /// Links that have changed their segment so far.
    changes: usize,
    /// Work of all searches so far, in parts of a power series.
    searched: usize,
}

impl<'a> Contacts<'a> {
    /// The contacts in `state`, in which a run starts. `load_scale`: size of the loads, N.
    pub(crate) fn new(system: &'a System, state: &State, load_scale: f64) -> Self {
        let mut contacts = Self {
            segments: Segments::new(system, state, load_scale, 0.0),
            curvature: f64::INFINITY,
            slopes: [0.0; 9],
            values: [0.0; 9],
            ball: ClearanceBall::NONE,
            change: None,
            changes: 0,
            searched: 0,
        };
        contacts.cross(state);
        contacts
    }

    /// The first change in a step that may contain one.
    #[inline(never)]
    fn search(&mut self, ramp: &Ramp, state: &State) -> Option<(Change, State)> {
        let (change, searched) = dispatch!(search::search(&self.segments, ramp, state));
        self.searched += searched;
        change
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn switch(&mut self, state: &State) {
        if let Some((Change { crossing: Some(crossing), .. }, _)) = self.change.take() {
            self.changes += self.segments.cross(state, crossing);
        }
        self.segments.update();
        self.curvature = f64::INFINITY;
    }
}

impl SwitchedEquations for Contacts<'_> {
    type Equations = SegmentEquations;

    #[cfg_attr(feature = "std", inline(always))]
    fn equations(&self) -> &SegmentEquations {
        &self.segments.current.equations
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn first_change(
        &mut self,
        ramp: &Ramp,
        [state, next]: [&State; 2],
        _: impl FnMut(&SegmentEquations, f64) -> State,
    ) -> Option<f64> {
        self.ball = ClearanceBall::NONE;
        let growth = self.segments.growth(ramp.h);
        let ends = [ramp.start, ramp.end];
        let slope_change =
            growth * ramp.forcing.slope_change(ramp.h, ends, &mut self.slopes, &mut self.values);
        self.curvature = fma(growth, self.curvature, slope_change);
        // These tests fail for NaN, as they must.
        if self.segments.ends_clear(ramp.h, state, next, self.curvature) {
            return None;
        }
        let second = self.segments.second_derivative(ramp, state);
        self.curvature = growth * energy_norm(&second);
        if self.segments.ends_clear(ramp.h, state, next, self.curvature) {
            return None;
        }
        let clear = self.segments.cubics_clear(ramp.h, [state, next], &second);
        self.change = if clear { None } else { self.search(ramp, state) };
        self.change.map(|(change, _)| change.theta)
    }

    /// By the distance of the step from an earlier state, or by the deflections, first with the bound that is carried from step to step, then
    /// with that of this step alone.
    #[cfg_attr(feature = "std", inline(always))]
    fn stays(&mut self, ramp: &Ramp, state: &State, next: &State) -> bool {
        let growth = self.segments.growth(ramp.h);
        let (mut slopes, mut values) = (self.slopes, self.values);
        let slope_change =
            growth * ramp.forcing.slope_change(ramp.h, [ramp.start, ramp.end], &mut slopes, &mut values);
        let mut curvature = fma(growth, self.curvature, slope_change);
        if let Some(squared_distance) = self.ball.reaches(next, bow(ramp.h, curvature)) {
            self.ball.squared_distance = squared_distance;
        } else {
            if !self.segments.ends_clear(ramp.h, state, next, curvature) {
                curvature = growth * energy_norm(&self.segments.second_derivative(ramp, state));
                if !self.segments.ends_clear(ramp.h, state, next, curvature) {
                    return false;
                }
            }
            self.ball = ClearanceBall::around(next, self.segments.slack(next));
        }
        (self.curvature, self.slopes, self.values) = (curvature, slopes, values);
        true
    }

    /// By the first test of `stays`.
    #[inline(always)]
    fn steps_without_change(
        &mut self,
        h: f64,
        forcing: &Forcing,
        values: &[Values],
        states: &[State],
    ) -> usize {
        let growth = self.segments.growth(h);
        let (mut slopes, mut last, mut curvature) = (self.slopes, self.values, self.curvature);
        let (mut ball, mut count) = (self.ball, 0);
        for (ends, state) in values.windows(2).zip(states) {
            let slope_change = growth * forcing.slope_change(h, [&ends[0], &ends[1]], &mut slopes, &mut last);
            let after = fma(growth, curvature, slope_change);
            let Some(squared_distance) = ball.reaches(state, bow(h, after)) else { break };
            (curvature, ball.squared_distance) = (after, squared_distance);
            count += 1;
        }
        if count > 0 {
            let ramp = [&values[count - 1], &values[count]];
            forcing.slope_change(h, ramp, &mut self.slopes, &mut self.values);
            (self.curvature, self.ball) = (curvature, ball);
        }
        count
    }

    #[inline(always)]
    fn stays_over(&self, bounds: &LongStepBounds) -> bool {
        self.segments.box_clear(bounds)
    }

    #[inline(always)]
    fn invalidate_bounds(&mut self) {
        (self.curvature, self.ball) = (f64::INFINITY, ClearanceBall::NONE);
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn state_at_change(&self) -> Option<&State> {
        self.change.as_ref().map(|(_, state)| state)
    }

    #[inline(never)]
    fn cross(&mut self, state: &State) {
        dispatch!(self.switch(state));
    }

    fn segments(&self) -> &[(usize, u8)] {
        self.segments.present()
    }

    fn changes(&self) -> usize {
        self.changes
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn searched(&self) -> usize {
        self.searched
    }
}

/// States around an earlier one, in which no link is past an edge.
#[derive(Debug, Clone, Copy)]
struct ClearanceBall {
    /// `ω η` of the earlier state.
    center: [f64; 6],
    /// How far a state may be from it.
    radius: f64,
    /// Square of how far the last one is.
    squared_distance: f64,
}

impl ClearanceBall {
    const NONE: Self = Self { center: [0.0; 6], radius: f64::NEG_INFINITY, squared_distance: 0.0 };

    #[cfg_attr(feature = "std", inline(always))]
    fn around(state: &State, radius: f64) -> Self {
        let mut center = [0.0; 6];
        center.copy_from_slice(&state[..6]);
        Self { center, radius, squared_distance: 0.0 }
    }

    /// The square of the distance of `next`, if the path there from the last state stays in the ball. The path leaves the straight line by
    /// at most `bow`.
    #[cfg_attr(feature = "std", inline(always))]
    fn reaches(&self, next: &State, bow: f64) -> Option<f64> {
        let room = self.radius - bow;
        let distance = squared_distance_of(&self.center, next);
        // These tests fail for NaN, as they must.
        let stays = room >= 0.0 && distance <= room * room && self.squared_distance <= room * room;
        if stays { Some(distance) } else { None }
    }
}

/// Square of the distance of a state from `center` in `ω η`, which deflections depend on.
#[cfg_attr(feature = "std", inline(always))]
fn squared_distance_of(center: &[f64; 6], state: &State) -> f64 {
    let mut sums = [0.0; 2];
    for pair in 0..3 {
        for i in 0..2 {
            let off = state[2 * pair + i] - center[2 * pair + i];
            sums[i] = fma(off, off, sums[i]);
        }
    }
    sums[0] + sums[1]
}
