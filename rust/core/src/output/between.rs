//! The largest values of loads between two recorded instants, on the solution there.
//!
//! Between instants a load bows away from the chord. Where the chord and the bow may pass the largest value so far, the part of the
//! interval waits, and is searched once all are known, or no more may wait: those that are likely largest first, so that most of the
//! others need no search.

use super::extremes::{Extremes, Goal};
use super::loads::Wrench;
use crate::equations::{Equations, Moments, PowerSeries, Riders, SegmentEquations, SmoothEquations, advance};
use crate::excitation::{Excitation, Forcing, Instant, Ramp};
use crate::numeric::bounded_vec::BoundedVec;
use crate::numeric::float::{add_scaled, fma, sqrt};
use crate::numeric::simd::{Kernel, dispatch};
use crate::system::{Input, LinkRow, ModelLevel, NO_FORCE, NO_INPUT, State, System};

/// Parts that may wait.
const WAITING: usize = 24;

/// The place of a recorded instant: a sample of the excitation, and the time since it, s. None if it is not known.
pub(super) type Place = Option<(usize, f64)>;

/// A part of an interval between samples, without a contact change within it, in which a value may pass its extreme.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub goal: Goal,
    pub sample: usize,
    /// From the sample to the start of the part, s.
    pub since: f64,
    /// Length of the part, s.
    pub h: f64,
    pub ends: [State; 2],
    /// Estimate of the largest value in it, of the negative value if the smallest is sought.
    pub most: f64,
}

/// The parts that wait, and what their search needs.
#[derive(Debug)]
pub(super) struct Between<'a> {
    system: &'a System,
    excitation: &'a Excitation<'a>,
    forcing: Forcing,
    /// The equations of the linear links alone.
    linear: SegmentEquations,
    /// The segments of the nonlinear links in the last part, and the equations on them with their series.
    segments: BoundedVec<u8>,
    on_segments: (SegmentEquations, PowerSeries),
    waiting: [Option<Part>; WAITING],
    count: usize,
    /// Whether loads jump at contact changes, because a damper acts in contact only.
    jumps: bool,
}

impl<'a> Between<'a> {
    pub(super) fn new(system: &'a System, excitation: &'a Excitation<'a>) -> Self {
        let linear = SegmentEquations::of_linear_links(system);
        Self {
            system,
            excitation,
            forcing: Forcing::new(system, &excitation.peak(), [1.0; 2]).with_riders(excitation),
            linear,
            segments: BoundedVec::filled(u8::MAX, nonlinear(system).count()),
            on_segments: (linear, PowerSeries::new(&linear)),
            waiting: [None; WAITING],
            count: 0,
            jumps: system.rows().iter().any(|row| row.link.is_damped_in_contact()),
        }
    }

    pub(super) fn excitation(&self) -> &'a Excitation<'a> {
        self.excitation
    }

    /// The length of the part from one place to a later one, s; zero if there is none, or if they are not next to each other.
    pub(super) fn length(&self, [from, to]: [Place; 2]) -> f64 {
        let (Some((sample, since)), Some((next, later))) = (from, to) else { return 0.0 };
        if next == sample {
            later - since
        } else if next == sample + 1 && later == 0.0 {
            self.excitation.interval(sample) - since
        } else {
            0.0
        }
    }

    /// Whether a load may jump at one of these places.
    pub(super) fn jumps_at(&self, places: [Place; 2]) -> bool {
        self.jumps && places.into_iter().flatten().any(|(_, since)| since > 0.0)
    }

    /// Lets a part wait. Searches all that wait if there are too many.
    pub(super) fn wait(&mut self, part: Part, loads: &[Wrench], extremes: &mut [Extremes]) {
        self.waiting[self.count] = Some(part);
        self.count += 1;
        if self.count == WAITING {
            self.search(loads, extremes);
        }
    }

    /// Searches the parts that wait.
    pub(super) fn search(&mut self, loads: &[Wrench], extremes: &mut [Extremes]) {
        let Self { waiting, count, .. } = self;
        let waiting = &mut waiting[..*count];
        waiting.sort_unstable_by(|a, b| {
            let most = |part: &Option<Part>| part.map_or(f64::NEG_INFINITY, |part| part.most);
            most(b).total_cmp(&most(a))
        });
        for index in 0..self.count {
            if let Some(part) = self.waiting[index].take() {
                let Goal { load, .. } = part.goal;
                dispatch(SearchKernel {
                    between: self,
                    part: &part,
                    load: &loads[load],
                    extremes: &mut extremes[load],
                });
            }
        }
        self.count = 0;
    }
}

/// Searches a part.
struct SearchKernel<'a, 'b> {
    between: &'b mut Between<'a>,
    part: &'b Part,
    load: &'b Wrench<'b>,
    extremes: &'b mut Extremes,
}

impl Kernel for SearchKernel<'_, '_> {
    type Output = ();

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) {
        let Self { between, part, load, extremes } = self;
        if part.most <= extremes.of(part.goal) {
            return;
        }
        let (system, excitation, forcing) = (between.system, between.excitation, between.forcing);
        let (mut start, mut end) = ([0.0; 9], [0.0; 9]);
        forcing.sample(excitation, part.sample, &mut start);
        forcing.sample(excitation, part.sample + 1, &mut end);
        let length = excitation.interval(part.sample);
        let begin = Instant { first: part.sample, until: part.sample + 1, since: 0.0 };
        let whole = Ramp::whole(length, [&start, &end], &forcing, begin);
        let shares = [part.since / length, (part.since + part.h) / length];
        let (start, end) = (whole.values(shares[0]), whole.values(shares[1]));
        let ramp =
            Ramp { h: part.h, start: &start, end: &end, spans_interval: false, ..whole.later(part.since) };
        let mut input = [NO_INPUT; 2];
        if load.linear.by_input_at_all {
            input = shares.map(|share| excitation.input_between(part.sample, share));
            let first = input[0];
            add_scaled(&mut input[1], &first, -1.0);
        }
        let time = excitation.time(part.sample) + part.since;
        let mut scope = Scope { part, load, ramp: &ramp, time, input, extremes };
        between.find_equations(part);
        let (equations, series) = &between.on_segments;
        if system.model_level() == ModelLevel::SmoothNonlinear || !excitation.riders().is_empty() {
            scope.integrate(&SmoothEquations::new(system, *equations, Riders::new(system, excitation)));
        } else {
            scope.follow(equations, series);
        }
    }
}

impl Between<'_> {
    /// Finds the equations that hold in a part, by the segments of the links in its middle.
    #[cfg_attr(feature = "std", inline(always))]
    fn find_equations(&mut self, part: &Part) {
        let mut middle = moved(&part.ends[0], &part.ends[1], 1.0);
        scale(&mut middle, 0.5);
        let mut same = true;
        for (known, row) in self.segments.as_mut_slice().iter_mut().zip(nonlinear(self.system)) {
            let segment = row.link.law().segment_of(row.deflection_at(&middle)) as u8;
            same &= *known == segment;
            *known = segment;
        }
        if !same {
            let mut segments = self.segments.as_slice().iter();
            let segment = |_: &LinkRow| segments.next().map_or(0, |segment| *segment as usize);
            let equations = self.linear.with_links(self.system, segment);
            self.on_segments = (equations, PowerSeries::new(&equations));
        }
    }
}

fn nonlinear(system: &System) -> impl Iterator<Item = &LinkRow> {
    system.rows().iter().filter(|row| !row.link.law().is_linear())
}

/// Steps of an integration over a part.
const STEPS: usize = 32;
const STEP: f64 = 1.0 / STEPS as f64;

/// Most steps of the search for a largest value.
const MOST_STEPS: usize = 60;

/// Fraction of a part over which four derivatives of a value give it, and its largest value, to rounding.
const NEAR: f64 = 1e-3;

/// By how much more than a cubic through its ends a value may bow away from its chord, over the bow of the cubic.
const BEYOND_CUBIC: f64 = 0.05;

/// Parts of a power series up to which the cubic through the ends of a part tells whether a value may pass its extreme.
const SMOOTH: f64 = 4.0;

/// Fraction of a part by which its ends are looked at inside of it: at a contact change, where a damper may begin to act, on its own side.
const INSIDE: f64 = 1e-8;

/// A value and its slope.
type Slope = [f64; 2];

/// A part, with the load whose value is sought. Times in it are fractions of it.
struct Scope<'a> {
    part: &'a Part,
    load: &'a Wrench<'a>,
    ramp: &'a Ramp<'a>,
    /// Time of its start, s.
    time: f64,
    /// The excitation at its start, and the rise over it, if the load depends on the excitation.
    input: [Input; 2],
    extremes: &'a mut Extremes,
}

impl Scope<'_> {
    /// Searches on the series of linear equations: between an end where the value rises and one where it falls, first where the cubic
    /// through both ends is largest, then where the derivatives there say.
    #[cfg_attr(feature = "std", inline(always))]
    fn follow<E: Equations>(&mut self, equations: &E, series: &PowerSeries) {
        let [start, _] = &self.part.ends;
        let mut ends = [[0.0; 2]; 2];
        for (i, state) in self.part.ends.iter().enumerate() {
            let mut rate = equations.rate(state, &self.ramp.force(i as f64), (&Moments::NONE, 0));
            scale(&mut rate, self.ramp.h);
            let (inside, theta) = self.inside(i, state, &rate);
            ends[i] = self.derivatives(equations, &inside, theta, 2).slope(0.0);
            self.note(ends[i][0], theta);
        }
        if !self.may_pass(&ends, series.norm(self.ramp.h) <= SMOOTH) {
            return;
        }
        let (mut a, mut b, mut theta) = (0.0, 1.0, top(ends[0], ends[1]));
        for _ in 0..MOST_STEPS {
            let end = self.ramp.values(theta);
            let there =
                advance(equations, series, &Ramp { h: theta * self.ramp.h, end: &end, ..*self.ramp }, start);
            let local = self.derivatives(equations, &there, theta, 4);
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

    /// The state near one end of the part, within it, and the fraction of the part.
    #[cfg_attr(feature = "std", inline(always))]
    fn inside(&self, end: usize, state: &State, rate: &State) -> (State, f64) {
        let way = if end == 0 { INSIDE } else { -INSIDE };
        (moved(state, rate, way), end as f64 + way)
    }

    /// The first `count` derivatives of the value, from that of order 0, at a state of linear equations.
    #[cfg_attr(feature = "std", inline(always))]
    fn derivatives<E: Equations>(&self, equations: &E, state: &State, theta: f64, count: usize) -> Local {
        let goal = self.part.goal;
        let mut local = Local { rows: [[0.0; 4]; 3], goal };
        let mut input = self.input[0];
        add_scaled(&mut input, &self.input[1], theta);
        local.set(0, &self.load.at(state, &input));
        let mut rate = equations.rate(state, &self.ramp.force(theta), (&Moments::NONE, 0));
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

    /// Searches on cubics through the steps of an integration by the Runge-Kutta method of order 4.
    #[cfg_attr(feature = "std", inline(always))]
    fn integrate<E: Equations>(&mut self, equations: &E) {
        let mut moments = Moments::NONE;
        let mut ends = [[0.0; 2]; 2];
        equations.prepare(self.ramp, &[0.0, 1.0], &mut moments);
        for node in 0..2 {
            let state = &self.part.ends[node];
            let mut rate = equations.rate(state, &self.ramp.force(node as f64), (&moments, node));
            scale(&mut rate, self.ramp.h);
            let (inside, theta) = self.inside(node, state, &rate);
            ends[node] = self.slope(&inside, &rate);
            self.note(ends[node][0], theta);
        }
        if !self.may_pass(&ends, true) {
            return;
        }
        let (mut state, mut before) = (self.part.ends[0], [0.0; 2]);
        for step in 0..=STEPS {
            let from = step as f64 * STEP;
            let nodes = [from, fma(0.5, STEP, from), from + STEP];
            equations.prepare(self.ramp, &nodes, &mut moments);
            let first = self.change(equations, &moments, &nodes, 0, &state);
            let here = self.slope(&state, &first);
            if step > 0 && before[1] > 0.0 && here[1] < 0.0 {
                let share = top(before, here);
                self.note(cubic(&[before, here], share), fma(share, STEP, from - STEP));
            }
            before = here;
            let second = self.change(equations, &moments, &nodes, 1, &moved(&state, &first, 0.5));
            let third = self.change(equations, &moments, &nodes, 1, &moved(&state, &second, 0.5));
            let fourth = self.change(equations, &moments, &nodes, 2, &moved(&state, &third, 1.0));
            add_scaled(&mut state, &first, 1.0 / 6.0);
            add_scaled(&mut state, &second, 1.0 / 3.0);
            add_scaled(&mut state, &third, 1.0 / 3.0);
            add_scaled(&mut state, &fourth, 1.0 / 6.0);
        }
    }

    /// Change of a state over a step of an integration at its rate at a node.
    #[cfg_attr(feature = "std", inline(always))]
    fn change<E: Equations>(
        &self,
        equations: &E,
        moments: &Moments,
        nodes: &[f64; 3],
        node: usize,
        state: &State,
    ) -> State {
        let mut rate = equations.rate(state, &self.ramp.force(nodes[node]), (moments, node));
        scale(&mut rate, STEP * self.ramp.h);
        rate
    }

    /// The value and its slope, from a state and its rate. Beside smooth laws loads do not depend on the excitation.
    #[cfg_attr(feature = "std", inline(always))]
    fn slope(&self, state: &State, rate: &State) -> Slope {
        let mut local = Local { rows: [[0.0; 4]; 3], goal: self.part.goal };
        local.set(0, &self.load.at(state, &NO_INPUT));
        local.set(1, &self.load.rate(state, rate, &NO_INPUT));
        local.slope(0.0)
    }

    /// Whether the value may pass its extreme between these ends. `by_cubic`: whether the cubic through them tells.
    #[cfg_attr(feature = "std", inline(always))]
    fn may_pass(&self, ends: &[Slope; 2], by_cubic: bool) -> bool {
        if !(ends[0][1] > 0.0 && ends[1][1] < 0.0) {
            return false;
        }
        let highest = cubic(ends, top(ends[0], ends[1]));
        let chord = f64::min(ends[0][0], ends[1][0]);
        !by_cubic || fma(BEYOND_CUBIC, highest - chord, highest) > self.extremes.of(self.part.goal)
    }

    /// Notes a value at a time.
    #[cfg_attr(feature = "std", inline(always))]
    fn note(&mut self, value: f64, theta: f64) {
        self.extremes.note(self.part.goal, value, fma(theta, self.ramp.h, self.time));
    }
}

/// The value near a point: of the component that is sought, or of those whose magnitude is sought, the derivatives there from order 0 on.
struct Local {
    rows: [[f64; 4]; 3],
    goal: Goal,
}

impl Local {
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

/// Where the cubic with these values and slopes at both ends, rising at the first and falling at the last, is largest.
#[cfg_attr(feature = "std", inline(always))]
fn top([start, rise]: Slope, [end, fall]: Slope) -> f64 {
    let (square, cube) = (3.0 * (end - start) - 2.0 * rise - fall, 2.0 * (start - end) + rise + fall);
    let share = rise / (sqrt(f64::max(fma(square, square, -3.0 * cube * rise), 0.0)) - square);
    // Of ends so close that rounding decides, the root of the straight slope.
    if share > 0.0 && share < 1.0 { share } else { rise / (rise - fall) }
}

/// The cubic with these values and slopes at both ends.
#[cfg_attr(feature = "std", inline(always))]
fn cubic([[start, rise], [end, fall]]: &[Slope; 2], share: f64) -> f64 {
    let (square, cube) = (3.0 * (end - start) - 2.0 * rise - fall, 2.0 * (start - end) + rise + fall);
    fma(fma(fma(cube, share, square), share, *rise), share, *start)
}

#[cfg_attr(feature = "std", inline(always))]
fn moved(state: &State, by: &State, share: f64) -> State {
    let mut moved = *state;
    add_scaled(&mut moved, by, share);
    moved
}

#[cfg_attr(feature = "std", inline(always))]
fn scale(state: &mut State, factor: f64) {
    for entry in state {
        *entry *= factor;
    }
}
