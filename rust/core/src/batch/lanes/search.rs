//! The search of the intervals that wait: for the instant at which the slope of the signal is zero, in an interval of each scene at a time.
//! There `v' = λ v + (g/λ) u'`, with a constant u'.

use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::drawn::Deviations;
use super::matrix::MAX_MODES;
use super::memory::{HIGH, HIGH_AT, LOW, LOW_AT, STATISTICS};
use super::modal::{ModalScenes, width};
use super::step::exponential;
use super::timeline::Timeline;
use super::vector::{Complex, Mask, Real, vectorize_once};
use super::waiting::{Piece, Waiting};
use crate::batch::equivalent::EquivalentRows;
use crate::batch::requirements::{Requirements, Signal};
use crate::numeric::simd::MAX_LANES;

/// Turn of the modes in an interval up to which the cubic through its ends, with its error, tells whether a value may pass its extreme.
const SMOOTH: f64 = 1.5;

/// Most steps of a search.
const MOST_STEPS: usize = 60;

/// Fraction of an interval over which slope and curvature give the largest value to rounding.
const NEAR: f64 = 3e-4;

/// Searches the pieces that wait, and notes the extremes found.
pub(super) struct Search<'a> {
    pub modal: &'a ModalScenes,
    pub timeline: &'a Timeline,
    pub deviations: Option<Deviations<'a>>,
    pub requirements: &'a Requirements,
    /// Index of the first sample of the window in the motion.
    pub first: usize,
    pub waiting: &'a mut Waiting,
    pub found: &'a mut AlignedBuffer,
}

impl Search<'_> {
    /// Runs the search. (A call of its own: within the loop over the blocks it would take the stack of a thread many times over.)
    #[inline(never)]
    pub(super) fn run<S: Simd>(self, simd: S) {
        vectorize_once!(simd, self.search(simd));
    }

    #[inline(always)]
    fn search<S: Simd>(mut self, simd: S) {
        for lane in 0..S::F64_LANES {
            let mut pieces = core::mem::take(&mut self.waiting.pieces[lane]);
            pieces.retain(|piece| piece.most > self.extreme::<S>(piece, lane));
            // Those that are likely highest first, so that most of the others need no search.
            pieces.sort_unstable_by(|a, b| {
                (a.signal, a.largest).cmp(&(b.signal, b.largest)).then(b.most.total_cmp(&a.most))
            });
            self.waiting.pieces[lane] = pieces;
        }
        let mut next = [0; MAX_LANES];
        loop {
            let mut some: [Option<Piece>; MAX_LANES] = [None; MAX_LANES];
            for lane in 0..S::F64_LANES {
                while let Some(piece) = self.waiting.pieces[lane].get(next[lane]) {
                    next[lane] += 1;
                    if piece.most > self.extreme::<S>(piece, lane) {
                        some[lane] = Some(*piece);
                        break;
                    }
                }
            }
            if some.iter().all(Option::is_none) {
                break;
            }
            let known = Real::gather(simd, |lane| match &some[lane] {
                Some(piece) => self.extreme::<S>(piece, lane),
                None => f64::INFINITY,
            });
            let curve = Curve::new(simd, &self, &some);
            let [tops, times] = curve.top(simd, known);
            let is_equivalent = |piece: &Piece| self.equivalent_of(piece).is_some();
            let states = some.iter().flatten().any(is_equivalent).then(|| curve.state(simd, times));
            for (lane, piece) in some.iter().enumerate() {
                let Some(piece) = piece else { continue };
                let share = times.lane(lane) / self.timeline.intervals[piece.end];
                self.note::<S>(piece, lane, (tops.lane(lane), share));
                if let Some(states) = &states {
                    self.search_again(simd, piece, (lane, next[lane]), (tops.lane(lane), share), states);
                }
            }
        }
        self.waiting.clear();
    }

    /// The extreme so far that a piece may pass; the negative one if it is the smallest.
    fn extreme<S: Simd>(&self, piece: &Piece, lane: usize) -> f64 {
        let at = piece.signal * STATISTICS;
        if piece.largest {
            self.found.lane(at + HIGH, lane, S::F64_LANES)
        } else {
            -self.found.lane(at + LOW, lane, S::F64_LANES)
        }
    }

    /// The equivalent load that a piece is of.
    fn equivalent_of(&self, piece: &Piece) -> Option<&EquivalentRows> {
        match self.requirements.signals[piece.signal].signal {
            Signal::Equivalent(index) => Some(&self.requirements.equivalents[index]),
            _ => None,
        }
    }

    /// If a piece is of an equivalent load that is another linear combination at the top found, or without one in the middle, because a
    /// component changes its sign and back, notes this load, and lets the piece with that combination wait at a place in its lane. With each
    /// top the load is larger, so this ends.
    fn search_again<S: Simd>(
        &mut self,
        simd: S,
        piece: &Piece,
        (lane, place): (usize, usize),
        (top, share): (f64, f64),
        states: &[Complex<S>; MAX_MODES],
    ) {
        let Some(equivalent) = self.equivalent_of(piece) else { return };
        let components =
            equivalent.components(|row| self.value::<S>(simd, row, (piece.end, lane), share, states));
        let slopes = equivalent.rule.gradient(&components);
        let load = slopes.iter().zip(components).map(|(slope, component)| slope * component).sum();
        let is_higher = load > self.extreme::<S>(piece, lane);
        if slopes != self.waiting.slopes[piece.slopes] && (is_higher || top == f64::NEG_INFINITY) {
            self.note::<S>(piece, lane, (load, share));
            self.waiting.slopes.push(slopes);
            let again = Piece { slopes: self.waiting.slopes.len() - 1, ..*piece };
            self.waiting.pieces[lane].insert(place, again);
        }
    }

    /// The value of a row in one lane, at a share of the interval before a sample, with v there.
    fn value<S: Simd>(
        &self,
        simd: S,
        row: usize,
        (end, lane): (usize, usize),
        share: f64,
        states: &[Complex<S>; MAX_MODES],
    ) -> f64 {
        let (components, modes) =
            (self.timeline.components.len(), self.modal.eigenvalues.vectors::<S>().len() / 2);
        let width = width(modes, components);
        let number =
            |index: usize| self.modal.tiles.lane(ModalScenes::place(row, index, width), lane, S::F64_LANES);
        let mut value = number(0);
        for component in 0..components {
            let [last, now] = [1, 0].map(|back| self.input(simd, end - back, component, lane));
            value += number(1 + component) * (last + share * (now - last));
        }
        for (mode, v) in states[..modes].iter().enumerate() {
            let at = 1 + components + 2 * mode;
            value += number(at) * v.re.lane(lane) + number(at + 1) * v.im.lane(lane);
        }
        value
    }

    /// A component of the excitation at a sample, in one lane.
    fn input<S: Simd>(&self, simd: S, sample: usize, component: usize, lane: usize) -> f64 {
        let value = self.timeline.values[sample * self.timeline.components.len() + component];
        match self.deviations {
            Some(deviations) if component == 0 => value + deviations.at(simd, sample).lane(lane),
            _ => value,
        }
    }

    /// Notes the top of a piece, at a share of its interval.
    fn note<S: Simd>(&mut self, piece: &Piece, lane: usize, (top, share): (f64, f64)) {
        if top > self.extreme::<S>(piece, lane) {
            let at = piece.signal * STATISTICS;
            let (value, place) = if piece.largest { (HIGH, HIGH_AT) } else { (LOW, LOW_AT) };
            *self.found.lane_mut(at + value, lane, S::F64_LANES) = if piece.largest { top } else { -top };
            *self.found.lane_mut(at + place, lane, S::F64_LANES) =
                (self.first + piece.end - 1) as f64 + share;
        }
    }
}

/// Most numbers of a row: its constant, and the factors on the excitation and on v.
const NUMBERS: usize = 1 + 9 + 2 * MAX_MODES;

/// A row of loads in an interval, `constant + slope τ + Σ (re Re v + im Im v)`.
#[derive(Clone, Copy)]
struct Row<S: Simd> {
    constant: Real<S>,
    slope: Real<S>,
    modes: [[Real<S>; 2]; MAX_MODES],
}

/// A signal in an interval, another one in each lane.
struct Curve<S: Simd> {
    zero: Real<S>,
    n: usize,
    /// Length of the interval, s; zero in a lane without one.
    length: Real<S>,
    eigenvalues: [Complex<S>; MAX_MODES],
    /// v at its ends, and `(g/λ) u'`.
    ends: [[Complex<S>; MAX_MODES]; 2],
    drive: [Complex<S>; MAX_MODES],
    /// The row, or both of those whose sum of squares is the signal.
    rows: [Row<S>; 2],
    is_square: Mask<S>,
    /// Where cubics tell what happens in the interval: the modes turn little in it.
    is_smooth: Mask<S>,
    /// -1 where the smallest value is sought.
    sign: Real<S>,
}

impl<S: Simd> Curve<S> {
    #[inline(always)]
    fn new(simd: S, search: &Search, some: &[Option<Piece>; MAX_LANES]) -> Self {
        let Search { modal, timeline, requirements, .. } = search;
        let (zero, one) = (Real::splat(simd, 0.0), Real::splat(simd, 1.0));
        let none = Complex::new(zero, zero);
        let eigenvalues_of = modal.eigenvalues.vectors::<S>().as_chunks::<2>().0;
        let (n, components) = (usize::min(eigenvalues_of.len(), MAX_MODES), timeline.components.len());
        let interval = |piece: &Option<Piece>| piece.map_or(0.0, |piece| timeline.intervals[piece.end]);
        let length = Real::gather(simd, |lane| interval(&some[lane]));
        let (mut eigenvalues, mut ends) = ([none; MAX_MODES], [[none; MAX_MODES]; 2]);
        for mode in 0..n {
            eigenvalues[mode] = Complex::of(simd, eigenvalues_of[mode]);
            for (end, to) in ends.iter_mut().enumerate() {
                let number = |i: usize| {
                    let at = |piece: Piece, lane| {
                        search.waiting.states[piece.states[end] + (2 * mode + i) * MAX_LANES + lane]
                    };
                    Real::gather(simd, |lane| some[lane].map_or(0.0, |piece| at(piece, lane)))
                };
                to[mode] = Complex::new(number(0), number(1));
            }
        }
        // The excitation at the start, and its rate, 0 in a lane without an interval.
        let moves = zero.less_than(length);
        let (mut start, mut rate) = ([zero; 9], [zero; 9]);
        for component in 0..components {
            let input = |back: usize| {
                let at = |piece: Piece, lane| search.input(simd, piece.end - back, component, lane);
                Real::gather(simd, |lane| some[lane].map_or(0.0, |piece| at(piece, lane)))
            };
            start[component] = input(1);
            rate[component] = moves.select((input(0) - start[component]) / moves.select(length, one), zero);
        }
        let mut drive = [none; MAX_MODES];
        let drives = modal.drive.vectors::<S>().as_chunks::<2>().0;
        for component in 0..components {
            for mode in 0..n {
                let by_input = Complex::of(simd, drives[component * n + mode]);
                drive[mode] = Complex::new(
                    by_input.re.mul_add(rate[component], drive[mode].re),
                    by_input.im.mul_add(rate[component], drive[mode].im),
                );
            }
        }
        // The numbers of the rows of each lane.
        let width = width(n, components);
        let mut numbers = [[[0.0; MAX_LANES]; NUMBERS]; 2];
        let mut is_square = [0.0; MAX_LANES];
        for (lane, piece) in some.iter().enumerate() {
            let Some(piece) = piece else { continue };
            let mut add = |which: usize, row: usize, weight: f64| {
                for (number, to) in numbers[which][..1 + components + 2 * n].iter_mut().enumerate() {
                    to[lane] +=
                        weight * modal.tiles.lane(ModalScenes::place(row, number, width), lane, S::F64_LANES);
                }
            };
            match requirements.signals[piece.signal].signal {
                Signal::Row(row) => add(0, row, 1.0),
                Signal::Resultant(y, z) => {
                    add(0, y, 1.0);
                    add(1, z, 1.0);
                    is_square[lane] = 1.0;
                }
                Signal::Equivalent(index) | Signal::Power(index) => {
                    let rows = requirements.equivalents[index].rows;
                    for (row, slope) in rows.into_iter().zip(search.waiting.slopes[piece.slopes]) {
                        if let Some(row) = row {
                            add(0, row, slope);
                        }
                    }
                }
            }
        }
        let coefficient =
            |which: usize, number: usize| Real::gather(simd, |lane| numbers[which][number][lane]);
        let mut rows = [Row { constant: zero, slope: zero, modes: [[zero; 2]; MAX_MODES] }; 2];
        for (which, row) in rows.iter_mut().enumerate() {
            row.constant = coefficient(which, 0);
            for component in 0..components {
                let feed = coefficient(which, 1 + component);
                row.constant = feed.mul_add(start[component], row.constant);
                row.slope = feed.mul_add(rate[component], row.slope);
            }
            for mode in 0..n {
                let at = 1 + components + 2 * mode;
                row.modes[mode] = [coefficient(which, at), coefficient(which, at + 1)];
            }
        }
        let squares = Real::gather(simd, |lane| is_square[lane]);
        let sign = Real::gather(simd, |lane| match some[lane] {
            Some(piece) if !piece.largest => -1.0,
            _ => 1.0,
        });
        let is_square = zero.less_than(squares);
        let mut fastest = zero;
        for value in &eigenvalues[..n] {
            fastest = fastest.max(value.norm_squared());
        }
        let is_smooth = (fastest * length * length).less_than(zero.constant(SMOOTH * SMOOTH));
        Self { zero, n, length, eigenvalues, ends, drive, rows, is_square, is_smooth, sign }
    }

    /// v at a time after the start, s.
    #[inline(always)]
    fn state(&self, simd: S, time: Real<S>) -> [Complex<S>; MAX_MODES] {
        let mut state = self.ends[0];
        for mode in 0..self.n {
            let (change, mean) = exponential(simd, self.eigenvalues[mode].scale(time));
            let v = change.mul_add(self.ends[0][mode], self.ends[0][mode]);
            state[mode] = v + self.drive[mode].scale(time) * mean;
        }
        state
    }

    /// Value, slope and curvature at a time after the start, s, with v there.
    #[inline(always)]
    fn at(&self, time: Real<S>, state: &[Complex<S>; MAX_MODES]) -> [Real<S>; 3] {
        let mut sums = [[self.zero; 3]; 2];
        for (sums, row) in sums.iter_mut().zip(&self.rows) {
            (sums[0], sums[1]) = (row.slope.mul_add(time, row.constant), row.slope);
        }
        for mode in 0..self.n {
            let rate = self.eigenvalues[mode].mul_add(state[mode], self.drive[mode]);
            let derivatives = [state[mode], rate, self.eigenvalues[mode] * rate];
            for (sums, row) in sums.iter_mut().zip(&self.rows) {
                let [re, im] = row.modes[mode];
                for order in 0..3 {
                    sums[order] = re.mul_add(derivatives[order].re, sums[order]);
                    sums[order] = im.mul_add(derivatives[order].im, sums[order]);
                }
            }
        }
        let [[y, dy, ddy], [z, dz, ddz]] = sums;
        let square = y.mul_add(y, z * z);
        let slope = y.mul_add(dy, z * dz);
        let bend = dy.mul_add(dy, y.mul_add(ddy, dz.mul_add(dz, z * ddz)));
        let Self { sign, is_square, .. } = *self;
        [
            sign * is_square.select(square, y),
            sign * is_square.select(slope + slope, dy),
            sign * is_square.select(bend + bend, ddy),
        ]
    }

    /// The largest value where the slope changes its sign from above to below, and its time, s; -∞ and half of the length where it does
    /// not, or where the cubic through the ends tells that it is not above the `known` one.
    #[inline(always)]
    fn top(&self, simd: S, known: Real<S>) -> [Real<S>; 2] {
        let (zero, half) = (self.zero, self.zero.constant(0.5));
        let (mut top, mut at) = (zero.constant(f64::NEG_INFINITY), half * self.length);
        let mut known_ends = [[zero; 3]; 2];
        for (end, to) in known_ends.iter_mut().enumerate() {
            *to = self.at(if end == 0 { zero } else { self.length }, &self.ends[end]);
        }
        let [mut from, mut to] = [zero, self.length];
        let [[_, rise, bend], [_, fall, last_bend]] = known_ends;
        // Where the slope has the same sign at both ends, it may have the other one in between, where the curvature is about zero.
        let turns = (bend * last_bend).less_than(zero);
        let [rises, falls] = [zero.less_than(rise), fall.less_than(zero)];
        let dips = turns.and(rises).and_not(falls).and(bend.less_than(zero));
        let humps = turns.and(falls).and_not(rises).and(zero.less_than(bend));
        if dips.or(humps).any() {
            let time = dips.or(humps).select(self.length * bend / (bend - last_bend), zero);
            let middle = self.at(time, &self.state(simd, time));
            to = dips.select(time, to);
            from = humps.select(time, from);
            for i in 0..3 {
                known_ends[0][i] = humps.select(middle[i], known_ends[0][i]);
                known_ends[1][i] = dips.select(middle[i], known_ends[1][i]);
            }
        }
        let mut open = zero.less_than(to - from);
        open = open.and(zero.less_than(known_ends[0][1])).and(known_ends[1][1].less_than(zero));
        let [above, share] = self.cubic(known_ends, to - from);
        open = open.and(known.less_than(above).or(self.is_smooth.not()));
        let mut time = open.select((to - from).mul_add(share, from), zero);
        for _ in 0..MOST_STEPS {
            if !open.any() {
                break;
            }
            let [value, slope, bend] = self.at(time, &self.state(simd, time));
            let step = open.and(bend.less_than(zero)).select(-slope / bend, self.length);
            let higher = (half * slope).mul_add(step, value);
            let better = open.and(top.less_than(value));
            (top, at) = (better.select(value, top), better.select(time, at));
            let near = open.and(step.abs().less_than(self.length * zero.constant(NEAR)));
            (top, at) = (near.select(higher, top), near.select(time + step, at));
            open = open.and_not(near);
            let rises = zero.less_than(slope);
            from = rises.select(time, from);
            to = rises.select(to, time);
            let next = time + step;
            let inside = from.less_than(next).and(next.less_than(to));
            time = open.select(inside.select(next, half * (from + to)), time);
        }
        [top, at]
    }

    /// The largest value of the cubic with these values and slopes at the ends of a part of this length, rising at the first and falling at
    /// the last, with twice its error, and its share of the part. The error is a 32nd of the length squared times that of the curvature at an end.
    #[inline(always)]
    fn cubic(&self, ends: [[Real<S>; 3]; 2], length: Real<S>) -> [Real<S>; 2] {
        let [[start, rise, bend], [end, fall, last_bend]] = ends;
        let [zero, half, two, three] = [0.0, 0.5, 2.0, 3.0].map(|number| self.zero.constant(number));
        let (rise, fall, change) = (rise * length, fall * length, end - start);
        let (square, cube) = (three * change - two * rise - fall, rise + fall - two * change);
        let root = (square * square - three * cube * rise).max(zero).sqrt();
        let share = rise / (root - square);
        // Of ends so close that rounding decides, the middle.
        let inside = zero.less_than(share).and(share.less_than(zero.constant(1.0)));
        let share = inside.select(share, half);
        let highest = cube.mul_add(share, square).mul_add(share, rise).mul_add(share, start);
        let (area, curved) = (length * length, two * square);
        let errors = [curved - bend * area, zero.constant(6.0).mul_add(cube, curved) - last_bend * area];
        [errors[0].abs().max(errors[1].abs()).mul_add(zero.constant(1.0 / 16.0), highest), share]
    }
}
