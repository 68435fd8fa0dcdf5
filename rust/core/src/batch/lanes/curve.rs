//! A signal within an interval, another one in each lane, and the instant at which its slope is zero. There `v' = λ v + (g/λ) u'`, with a
//! constant u'.

use pulp::Simd;

use super::dense::MAX_MODES;
use super::drawn::Deviations;
use super::modal::{ModalScenes, width};
use super::step::exponential;
use super::timeline::Timeline;
use super::vector::{Complex, Mask, Number, Real};
use super::waiting::{Piece, Waiting};
use crate::batch::requirements::{Requirements, Signal};
use crate::numeric::simd::MAX_LANES;

/// Turn of the modes in an interval up to which the cubic through its ends, with its error, tells whether a value may pass its extreme.
const SMOOTH: f64 = 1.5;

/// Most steps of a search.
const MOST_STEPS: usize = 60;

/// Fraction of an interval over which slope and curvature give the largest value to rounding.
const NEAR: f64 = 3e-4;

/// Scenes side by side and their motion.
pub(super) struct Scenes<'a> {
    pub modal: &'a ModalScenes,
    pub timeline: &'a Timeline,
    pub deviations: Option<Deviations<'a>>,
    pub requirements: &'a Requirements,
}

impl Scenes<'_> {
    /// A component of the excitation at a sample, in one lane.
    pub(super) fn input<S: Simd>(&self, simd: S, sample: usize, component: usize, lane: usize) -> f64 {
        let value = self.timeline.values[sample * self.timeline.components.len() + component];
        match self.deviations {
            Some(deviations) if component == 0 => value + deviations.at(simd, sample).lane(lane),
            _ => value,
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
pub(super) struct Curve<S: Simd> {
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
    pub(super) fn new(
        simd: S,
        scenes: &Scenes,
        waiting: &Waiting,
        some: &[Option<Piece>; MAX_LANES],
    ) -> Self {
        let Scenes { modal, timeline, requirements, .. } = scenes;
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
                        waiting.states[piece.states[end] + (2 * mode + i) * MAX_LANES + lane]
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
                let at = |piece: Piece, lane| scenes.input(simd, piece.end - back, component, lane);
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
                    for (row, slope) in rows.into_iter().zip(waiting.slopes[piece.slopes]) {
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
    pub(super) fn state(&self, simd: S, time: Real<S>) -> [Complex<S>; MAX_MODES] {
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
    pub(super) fn top(&self, simd: S, known: Real<S>) -> [Real<S>; 2] {
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
