//! The search for the largest value of a load within a piece of a run: on the series of linear equations, or on an integration.

use super::extremes::{Extremes, Goal};
use super::loads::Wrench;
use crate::equations::{Equations, PowerSeries, StageData, advance};
use crate::excitation::Ramp;
use crate::numeric::float::{add_scaled, ceil, fma, scale, sqrt};
use crate::system::{Input, NO_FORCE, NO_INPUT, State};

/// Steps of an integration over a piece whose equations have a norm of one, also the fewest, and the most.
const STEPS: f64 = 8.0;
const MOST_INTEGRATED: f64 = 64.0;

/// Most steps of the search for a largest value.
const MOST_STEPS: usize = 60;

/// The same for an inflection between two ends at which the slope has the same sign.
const MOST_INFLECTION_STEPS: usize = 4;

/// Fraction of a piece over which four derivatives of a value give it, and its largest value, to rounding.
const NEAR: f64 = 1e-3;

/// By how much more than a cubic through its ends a value of smooth laws may bow away from its chord, over the bow of the cubic.
const BEYOND_CUBIC: f64 = 0.05;

/// Norm of a step up to which the cubic through the ends of a piece tells whether a value may pass its extreme.
const SMOOTH: f64 = 4.0;

const NO_STATE: State = [0.0; 12];

/// A value and its slope.
type Slope = [f64; 2];

/// A piece, with the load whose value is sought. Times in it are fractions of it.
pub(super) struct Search<'a> {
    pub goal: Goal,
    pub ends: &'a [State; 2],
    /// The load on the segments of the piece.
    pub load: Wrench<'a>,
    pub ramp: &'a Ramp<'a>,
    /// By how much the time of a load at an end is moved into the piece, if it may jump there.
    pub beside: f64,
    /// Time of its start and of its end, s.
    pub times: [f64; 2],
    /// The excitation at its start, and the rise over it, if the load depends on the excitation.
    pub input: [Input; 2],
    pub extremes: &'a mut Extremes,
}

impl Search<'_> {
    /// Searches on the series of linear equations: between an end where the value rises and one where it falls, first where the cubic
    /// through both ends is largest, then where the derivatives there say.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn follow<E: Equations>(&mut self, equations: &E, series: &PowerSeries) {
        let mut ends = [[0.0; 2]; 2];
        let mut bends = [0.0; 2];
        for (i, state) in self.ends.iter().enumerate() {
            let local = self.derivatives(equations, state, i as f64, 3);
            (ends[i], bends[i]) = (local.slope(0.0), local.bend());
            self.note_end(i, ends[i][0]);
        }
        let (mut a, mut b) = (0.0, 1.0);
        let [rises, falls] = [ends[0][1] > 0.0, ends[1][1] < 0.0];
        let is_smooth = series.norm(self.ramp.h) <= SMOOTH;
        if rises != falls && is_smooth && self.stays_below(&ends, bends) {
            return;
        }
        if rises != falls && (bends[0] * bends[1] > 0.0 || (bends[0] < 0.0) == rises) {
            // The slope has the same sign at both ends, and may have the other one where the curvature is zero.
            let (side, mut zero) = (usize::from(rises), [(0.0, bends[0]), (1.0, bends[1])]);
            for _ in 0..MOST_INFLECTION_STEPS {
                let [(from, bend), (to, last_bend)] = zero;
                let share = if bend * last_bend < 0.0 { bend / (bend - last_bend) } else { 0.5 };
                let theta = from + (to - from) * share;
                let middle = self.derivatives(equations, &self.state_at(equations, series, theta), theta, 3);
                (ends[side], bends[side]) = (middle.slope(0.0), middle.bend());
                (a, b) = if rises { (0.0, theta) } else { (theta, 1.0) };
                let slope = ends[side][1];
                let is_far = slope.abs() > bends[side].abs() * (to - from);
                if is_far || (slope > 0.0) != rises {
                    break;
                }
                zero[usize::from((bends[side] > 0.0) == rises)] = (theta, bends[side]);
            }
        }
        let h = b - a;
        let [start, end] = [[ends[0][0], ends[0][1] * h], [ends[1][0], ends[1][1] * h]];
        let error = if is_smooth {
            cubic_error(start, end, [bends[0] * h * h, bends[1] * h * h])
        } else {
            f64::INFINITY
        };
        if !self.may_pass(&[start, end], error) {
            return;
        }
        let mut theta = fma(top(start, end), h, a);
        for _ in 0..MOST_STEPS {
            let local = self.derivatives(equations, &self.state_at(equations, series, theta), theta, 4);
            let step = local.top();
            if step.abs() <= NEAR {
                self.note(local.slope(step)[0], theta + step);
                return;
            }
            let here = local.slope(0.0);
            self.note(here[0], theta);
            if here[1] > 0.0 {
                a = theta;
            } else {
                b = theta;
            }
            theta += step;
            // Not for NaN.
            if !(theta > a && theta < b) {
                theta = 0.5 * (a + b);
            }
            if b - a <= 2.0 * f64::EPSILON * b {
                return;
            }
        }
    }

    /// The state at a time.
    #[cfg_attr(feature = "std", inline(always))]
    fn state_at<E: Equations>(&self, equations: &E, series: &PowerSeries, theta: f64) -> State {
        let end = self.ramp.values(theta);
        let ramp = Ramp { h: theta * self.ramp.h, end: &end, ..*self.ramp };
        advance(equations, series, &ramp, &self.ends[0])
    }

    /// Notes the value at an end.
    #[cfg_attr(feature = "std", inline(always))]
    fn note_end(&mut self, end: usize, value: f64) {
        self.note(value, if end == 0 { self.beside } else { 1.0 - self.beside });
    }

    /// The first `count` derivatives of the value, from that of order 0, at a state of linear equations.
    #[cfg_attr(feature = "std", inline(always))]
    fn derivatives<E: Equations>(&self, equations: &E, state: &State, theta: f64, count: usize) -> Taylor {
        let goal = self.goal;
        let mut local = Taylor { rows: [[0.0; 4]; 3], goal };
        local.set(0, &self.load.at(state, &self.input_at(theta)));
        let mut rate = equations.rate(state, &self.ramp.force(theta), (&StageData::NONE, 0));
        scale(&mut rate, self.ramp.h);
        local.set(1, &self.load.rate(state, &rate, &self.input[1]));
        let mut force = self.ramp.rise();
        for order in 2..count {
            rate = equations.linear(&rate, &force);
            scale(&mut rate, self.ramp.h);
            local.set(order, &self.load.rate(state, &rate, &NO_INPUT));
            force = NO_FORCE;
        }
        local
    }

    /// Searches on cubics through the steps of an integration by the Runge-Kutta method of order 4. `norm`: of the equations over the piece.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn integrate<E: Equations>(&mut self, equations: &E, norm: f64) {
        let steps = ceil((STEPS * norm).clamp(STEPS, MOST_INTEGRATED));
        let size = 1.0 / steps;
        let mut stage_data = StageData::NONE;
        let mut ends = [[0.0; 2]; 2];
        equations.prepare(self.ramp, &[0.0, 1.0], &mut stage_data);
        for node in 0..2 {
            let state = &self.ends[node];
            let mut rate = equations.rate(state, &self.ramp.force(node as f64), (&stage_data, node));
            scale(&mut rate, self.ramp.h);
            ends[node] = self.slope(state, &rate, node as f64);
            self.note_end(node, ends[node][0]);
        }
        let bow = cubic(&ends, top(ends[0], ends[1])) - f64::min(ends[0][0], ends[1][0]);
        if !self.may_pass(&ends, BEYOND_CUBIC * bow) {
            return;
        }
        let (mut state, mut from) = (self.ends[0], 0.0);
        let mut before = [ends[0][0], ends[0][1] * size];
        for step in 1..=steps as usize {
            let (until, last) = (step as f64 * size, state);
            let (mut here, mut highest) = (before, None);
            // In a loop, as two copies of a step would be twice its large code.
            loop {
                let to = highest.unwrap_or(until);
                let reached = self.step(equations, &mut stage_data, [from, to], &last);
                if highest.is_some() {
                    self.note(self.slope(&reached, &NO_STATE, to)[0], to);
                    break;
                }
                let rate = self.change(equations, &stage_data, [until, 1.0], 2, &reached);
                let [value, slope] = self.slope(&reached, &rate, until);
                (state, here) = (reached, [value, slope * (until - from)]);
                if !(before[1] > 0.0 && here[1] < 0.0) {
                    break;
                }
                // The value itself at the top of the cubic: laws have corners in their slope.
                highest = Some(fma(top(before, here), until - from, from));
            }
            (before, from) = (here, until);
        }
    }

    /// The state after a step of the Runge-Kutta method of order 4 between two times.
    #[cfg_attr(feature = "std", inline(always))]
    fn step<E: Equations>(
        &self,
        equations: &E,
        stage_data: &mut StageData,
        [from, until]: [f64; 2],
        start: &State,
    ) -> State {
        let (size, middle) = (until - from, 0.5 * (from + until));
        equations.prepare(self.ramp, &[from, middle, until], stage_data);
        let (mut state, mut change) = (*start, NO_STATE);
        // Time of a stage and its place among the nodes, what it moves on by the stage before, and its weight.
        let stages = [
            (from, 0, 0.0, 1.0 / 6.0),
            (middle, 1, 0.5, 1.0 / 3.0),
            (middle, 1, 0.5, 1.0 / 3.0),
            (until, 2, 1.0, 1.0 / 6.0),
        ];
        for (time, node, share, weight) in stages {
            change = self.change(equations, stage_data, [time, size], node, &moved(start, &change, share));
            add_scaled(&mut state, &change, weight);
        }
        state
    }

    /// Change of a state over a step of this size at its rate at a time, which is a node of the stage_data.
    #[cfg_attr(feature = "std", inline(always))]
    fn change<E: Equations>(
        &self,
        equations: &E,
        stage_data: &StageData,
        [time, size]: [f64; 2],
        node: usize,
        state: &State,
    ) -> State {
        let mut rate = equations.rate(state, &self.ramp.force(time), (stage_data, node));
        scale(&mut rate, size * self.ramp.h);
        rate
    }

    /// The value and its slope over the piece, from a state and its change over a piece at its rate there.
    #[cfg_attr(feature = "std", inline(always))]
    fn slope(&self, state: &State, rate: &State, theta: f64) -> Slope {
        let mut local = Taylor { rows: [[0.0; 4]; 3], goal: self.goal };
        local.set(0, &self.load.at(state, &self.input_at(theta)));
        local.set(1, &self.load.rate(state, rate, &self.input[1]));
        local.slope(0.0)
    }

    /// The excitation, if the load depends on it.
    #[cfg_attr(feature = "std", inline(always))]
    fn input_at(&self, theta: f64) -> Input {
        let mut input = self.input[0];
        add_scaled(&mut input, &self.input[1], theta);
        input
    }

    /// Whether the value may pass its extreme between these ends, by the cubic through them and its error.
    #[cfg_attr(feature = "std", inline(always))]
    fn may_pass(&self, ends: &[Slope; 2], error: f64) -> bool {
        let rises_and_falls = ends[0][1] > 0.0 && ends[1][1] < 0.0;
        rises_and_falls && cubic(ends, top(ends[0], ends[1])) + error > self.extremes.of(self.goal)
    }

    /// Whether a value whose slope has the same sign at both ends stays below its extreme: the cubic through them has no turn, and its error
    /// is too small.
    #[cfg_attr(feature = "std", inline(always))]
    fn stays_below(&self, ends: &[Slope; 2], bends: [f64; 2]) -> bool {
        let [[start, first], [end, last]] = *ends;
        let chord = 3.0 * (end - start);
        let has_no_turn = first * chord >= 0.0 && f64::max(first.abs(), last.abs()) <= chord.abs();
        has_no_turn
            && f64::max(start, end) + cubic_error(ends[0], ends[1], bends) <= self.extremes.of(self.goal)
    }

    /// Notes a value at a time.
    #[cfg_attr(feature = "std", inline(always))]
    fn note(&mut self, value: f64, theta: f64) {
        let [start, end] = self.times;
        self.extremes.note(self.goal, value, f64::min(fma(theta, self.ramp.h, start), end));
    }
}

/// The value near a point: of the component that is sought, or of those whose magnitude is sought, the derivatives there from order 0 on.
struct Taylor {
    rows: [[f64; 4]; 3],
    goal: Goal,
}

impl Taylor {
    #[cfg_attr(feature = "std", inline(always))]
    fn set(&mut self, order: usize, load: &[f64; 6]) {
        match self.goal {
            Goal { value: 6, .. } => (self.rows[0][order], self.rows[1][order]) = (load[1], load[2]),
            Goal { value: 7, .. } => {
                for i in 0..3 {
                    self.rows[i][order] = load[3 + i];
                }
            }
            Goal { value, largest, .. } => {
                self.rows[0][order] = if largest { load[value] } else { -load[value] }
            }
        }
    }

    /// The value and its slope at a distance from the point.
    #[cfg_attr(feature = "std", inline(always))]
    fn slope(&self, x: f64) -> Slope {
        let (mut square, mut product, mut first) = (0.0, 0.0, [0.0; 2]);
        for (i, [value, slope, second, third]) in self.rows.iter().enumerate() {
            let y = fma(x, fma(0.5 * x, fma(x / 3.0, *third, *second), *slope), *value);
            let dy = fma(x, fma(0.5 * x, *third, *second), *slope);
            square = fma(y, y, square);
            product = fma(y, dy, product);
            if i == 0 {
                first = [y, dy];
            }
        }
        if self.goal.value < 6 {
            return first;
        }
        let size = sqrt(square);
        [size, if size > 0.0 { product / size } else { 0.0 }]
    }

    /// The curvature at the point.
    #[cfg_attr(feature = "std", inline(always))]
    fn bend(&self) -> f64 {
        if self.goal.value < 6 {
            return self.rows[0][2];
        }
        let (mut square, mut product, mut bend) = (0.0, 0.0, 0.0);
        for [value, first, second, _] in &self.rows {
            square = fma(*value, *value, square);
            product = fma(*value, *first, product);
            bend = fma(*first, *first, fma(*value, *second, bend));
        }
        if square > 0.0 { (bend - product * product / square) / sqrt(square) } else { 0.0 }
    }

    /// Distance to the largest value, where the slope is zero by its derivatives at the point.
    #[cfg_attr(feature = "std", inline(always))]
    fn top(&self) -> f64 {
        // Slope, its rate, and half of the rate of that: of the component, or of half the square of the magnitude.
        let (mut slope, mut rate, mut half) = (0.0, 0.0, 0.0);
        for [value, first, second, third] in &self.rows {
            slope = fma(*value, *first, slope);
            rate = fma(*first, *first, fma(*value, *second, rate));
            half = fma(1.5 * first, *second, fma(0.5 * value, *third, half));
        }
        if self.goal.value < 6 {
            let [_, first, second, third] = self.rows[0];
            (slope, rate, half) = (first, second, 0.5 * third);
        }
        let x = -slope / rate;
        // Once more, by the slope at x.
        x - fma(x, fma(x, half, rate), slope) / fma(2.0 * x, half, rate)
    }
}

/// Coefficients of the square and of the cube of the share, of the cubic with these values and slopes at both ends.
#[cfg_attr(feature = "std", inline(always))]
fn higher([start, rise]: Slope, [end, fall]: Slope) -> [f64; 2] {
    [3.0 * (end - start) - 2.0 * rise - fall, 2.0 * (start - end) + rise + fall]
}

/// Where the cubic with these values and slopes at both ends, rising at the first and falling at the last, is largest.
#[cfg_attr(feature = "std", inline(always))]
fn top(from: Slope, to: Slope) -> f64 {
    let ([square, cube], rise, fall) = (higher(from, to), from[1], to[1]);
    let share = rise / (sqrt(f64::max(fma(square, square, -3.0 * cube * rise), 0.0)) - square);
    // Of ends so close that rounding decides, the root of the straight slope.
    if share > 0.0 && share < 1.0 { share } else { rise / (rise - fall) }
}

/// The cubic with these values and slopes at both ends.
#[cfg_attr(feature = "std", inline(always))]
fn cubic(&[from, to]: &[Slope; 2], share: f64) -> f64 {
    let [square, cube] = higher(from, to);
    fma(fma(fma(cube, share, square), share, from[1]), share, from[0])
}

/// Twice the error of the cubic with these values and slopes at both ends, by the error of its curvature there.
#[cfg_attr(feature = "std", inline(always))]
fn cubic_error(from: Slope, to: Slope, bends: [f64; 2]) -> f64 {
    let [square, cube] = higher(from, to);
    let errors = [2.0 * square - bends[0], fma(6.0, cube, 2.0 * square) - bends[1]];
    f64::max(errors[0].abs(), errors[1].abs()) / 16.0
}

/// The state moved by a share of a change.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn moved(state: &State, by: &State, share: f64) -> State {
    let mut moved = *state;
    add_scaled(&mut moved, by, share);
    moved
}
