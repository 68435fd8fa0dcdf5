//! Extremes of signals between the samples, one scene in each lane.
//!
//! Where a signal may pass its extreme in the interval before a sample, by the second differences of its values, the interval waits. At the
//! end of a window the extremes at all of its samples are known, and few intervals are left: those are searched, one of each scene at a
//! time, for the instant at which the slope of the signal is zero. There `v' = λ v + (g/λ) u'`, with a constant u'.

use pulp::{Simd, WithSimd};

use super::aligned_buffer::AlignedBuffer;
use super::bows::MostBow;
use super::drawn::{self, Deviations};
use super::matrix::MAX_MODES;
use super::modal::{ModalScenes, width};
use super::step::exponential;
use super::time_statistics::{HIGH, HIGH_AT, LOW, LOW_AT, STATISTICS};
use super::timeline::{BLOCK, Timeline};
use super::vector::{Complex, Mask, Real};
use crate::batch::equivalent::EquivalentRows;
use crate::batch::requirements::{Requirements, Signal};
use crate::life::COMPONENTS;
use crate::numeric::simd::MAX_LANES;

/// Gain of a value between two samples, over its largest magnitude at the samples, that is rounding.
const ROUNDING: f64 = 1e-12;

/// By how much more than a cubic through its ends a value may bow away from its chord, over the bow of the cubic.
const BEYOND_CUBIC: f64 = 0.25;

/// Turn of the modes in an interval up to which this holds.
const SMOOTH: f64 = 1.5;

/// Most steps of a search.
const MOST_STEPS: usize = 60;

/// Fraction of an interval over which slope and curvature give the largest value to rounding.
const NEAR: f64 = 1e-4;

/// The interval before a sample, in which a signal of one scene may pass its extreme.
#[derive(Debug, Clone, Copy)]
struct Piece {
    signal: usize,
    /// Whether the largest value is sought, or the smallest.
    largest: bool,
    /// Sample of the window at its end.
    end: usize,
    /// Estimate of the largest value in it; of the negative value if the smallest is sought.
    most: f64,
    /// Index of v at its start, and, if the signal is an equivalent load, of the slopes by its components.
    state: usize,
    slopes: usize,
}

/// The pieces that wait for the end of a window.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    /// Of each lane.
    pieces: [Vec<Piece>; MAX_LANES],
    /// v of all lanes at the samples at which pieces begin.
    states: Vec<f64>,
    slopes: Vec<[f64; COMPONENTS]>,
    /// For the intervals of the present block, the index of v at their start, if a piece begins there.
    of_block: [Option<usize>; BLOCK],
}

impl Waiting {
    /// Goes on to the next block.
    pub(super) fn next_block(&mut self) {
        self.of_block = [None; BLOCK];
    }

    pub(super) fn clear(&mut self) {
        for pieces in &mut self.pieces {
            pieces.clear();
        }
        self.states.clear();
        self.slopes.clear();
    }
}

/// Values of a signal at the samples of a block.
pub(super) struct SignalBlock<'a, S: Simd> {
    pub signal: usize,
    pub values: &'a [S::f64s; BLOCK],
    /// At the sample before the block.
    pub last: Real<S>,
    /// Smallest and largest value in the block.
    pub range: [Real<S>; 2],
    /// Smallest and largest value so far.
    pub known: [Real<S>; 2],
    /// Curvature in the intervals that second differences do not show: see [`Kinks`].
    pub hidden: Real<S>,
    /// Whether it is a row, whose smallest value is sought too; the smallest magnitudes are those at the samples.
    pub is_row: bool,
    /// If the signal is an equivalent load.
    pub components: Option<Components<'a, S>>,
}

/// The components of an equivalent load: values of the rows in a block, and the last ones before it.
pub(super) struct Components<'a, S: Simd> {
    pub equivalent: &'a EquivalentRows,
    pub values: &'a [[S::f64s; BLOCK]],
    pub last: &'a [S::f64s],
}

/// A block of the motion, with v of each mode at its samples and before it.
pub(super) struct BlockStates<'a, S: Simd> {
    pub timeline: &'a Timeline,
    pub block: usize,
    pub states: &'a [[S::f64s; BLOCK]],
    pub before: &'a [S::f64s],
}

/// Curvature that second differences do not show: at a sample the rate of the excitation changes, and with it the curvature of a load, by its
/// dampers. The second difference there is that of the mean curvature on both sides.
pub(super) struct Kinks<'a, S: Simd> {
    simd: S,
    modal: &'a ModalScenes,
    width: usize,
    modes: usize,
    /// Largest changes of the rate of each component, with the factors of [`super::bows::Bow::kink`].
    changes: [[Real<S>; 2]; 9],
    components: usize,
}

impl<'a, S: Simd> Kinks<'a, S> {
    /// Those of a block. `drawn`: the block of drawn motions.
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        modal: &'a ModalScenes,
        timeline: &Timeline,
        block: usize,
        drawn: &AlignedBuffer,
    ) -> Self {
        let mut changes = [[Real::splat(simd, 0.0); 2]; 9];
        let shared = timeline.bows.kinks(block);
        for (to, from) in changes.iter_mut().zip(shared) {
            *to = [Real::splat(simd, from[0]), Real::splat(simd, from[1])];
        }
        if !drawn.vectors::<S>().is_empty() {
            changes[0] = drawn::kinks(simd, drawn);
        }
        let (modes, components) = (modal.eigenvalues.vectors::<S>().len() / 2, shared.len());
        Self { simd, modal, width: width(modes, components), modes, changes, components }
    }

    /// Of a row.
    #[inline(always)]
    pub(super) fn of(&self, row: usize) -> Real<S> {
        let tiles = self.modal.tiles.vectors::<S>();
        let number = |index: usize| Real::new(self.simd, tiles[ModalScenes::place(row, index, self.width)]);
        let direct = 1 + self.components + 2 * self.modes;
        let mut sum = Real::splat(self.simd, 0.0);
        for component in 0..self.components {
            let [by_rate, by_value] = self.changes[component];
            sum = number(direct + self.components + self.modes + component).mul_add(by_rate, sum);
            sum = number(direct + component).mul_add(by_value, sum);
        }
        sum
    }

    /// Of the sum of the squares of two rows, the largest value of which is this.
    #[inline(always)]
    pub(super) fn of_squares(&self, [y, z]: [usize; 2], largest: Real<S>) -> Real<S> {
        let (y, z) = (self.of(y), self.of(z));
        let root = (y.mul_add(y, z * z) * largest).sqrt();
        root + root
    }

    /// Of an equivalent load.
    #[inline(always)]
    pub(super) fn of_equivalent(&self, equivalent: &EquivalentRows) -> Real<S> {
        let mut sum = Real::splat(self.simd, 0.0);
        for &(row, size, sign) in equivalent.groups.iter().flatten() {
            sum = self.of(row).mul_add(Real::splat(self.simd, size + sign.abs()), sum);
        }
        sum
    }
}

impl<S: Simd> SignalBlock<'_, S> {
    /// Lets the pieces wait in which the signal may pass its extremes.
    #[inline(always)]
    pub(super) fn wait(&self, simd: S, here: &BlockStates<S>, waiting: &mut Waiting) {
        let [least, most] = self.known;
        let [low, high] = [self.range[0].min(self.last), self.range[1].max(self.last)];
        let rounding = Real::splat(simd, ROUNDING) * least.abs().max(most.abs());
        // No second difference says more than this reach.
        let MostBow { by_range, by_curvature, unknown } = *here.timeline.bows.most(here.block);
        let by_curvature = Real::splat(simd, by_curvature).mul_add(self.hidden, Real::splat(simd, unknown));
        let reach = Real::splat(simd, by_range).mul_add(high - low, by_curvature);
        for (known, high, largest) in [(most, high, true), (-least, -low, false)] {
            let known = known + rounding;
            if (largest || self.is_row) && known.less_than(high + reach).any() {
                self.find(simd, here, (known, largest), waiting);
            }
        }
    }

    /// Lets those wait in which the signal, the negative one if the smallest is sought, may pass this value.
    ///
    /// With the values a and b at its ends and a bow B over the middle of the chord, a piece is highest at `(a + b)/2 + B + (b - a)²/(16 B)`,
    /// if `|b - a| < 4 B`. Where the curvature at one end is not known, it is on a straight line through those before it.
    #[inline(always)]
    fn find(&self, simd: S, here: &BlockStates<S>, (known, largest): (Real<S>, bool), waiting: &mut Waiting) {
        let Some(bows) = here.timeline.bows.of(here.block) else { return };
        let (zero, half, four) = (Real::splat(simd, 0.0), Real::splat(simd, 0.5), Real::splat(simd, 4.0));
        let sixteenth = Real::splat(simd, 0.0625);
        let two = Real::splat(simd, 2.0);
        let sign = Real::splat(simd, if largest { 1.0 } else { -1.0 });
        // From the sample before the block on, values and second difference quotients; those that are not known are zero.
        let (mut values, mut bends) = ([self.last * sign; BLOCK + 1], [zero; BLOCK + 1]);
        for k in 0..BLOCK {
            values[k + 1] = Real::new(simd, self.values[k]) * sign;
        }
        for k in 0..BLOCK - 1 {
            let [first, second] = bows[k].factors.map(|factor| Real::splat(simd, factor));
            bends[k + 1] = first * (values[k + 1] - values[k]) - second * (values[k + 2] - values[k + 1]);
        }
        for (k, bow) in bows.iter().enumerate() {
            if bow.length == 0.0 {
                continue;
            }
            let bend = match bow.known {
                [true, false] => bends[k].max(two * bends[k] - bends[k - 1]),
                [false, true] => bends[k + 1].max(two * bends[k + 1] - bends[k + 2]),
                _ => bends[k].max(bends[k + 1]),
            };
            let bent = bend.max(zero) + self.hidden;
            let size = bent.mul_add(Real::splat(simd, bow.size), zero.constant(bow.unknown));
            let (change, middle) = (values[k + 1] - values[k], half * (values[k] + values[k + 1]));
            let top = (change * change).mul_add(sixteenth / size, middle + size);
            let passes = change.abs().less_than(four * size).and(known.less_than(top));
            if passes.any() {
                let passes = passes.select(half, zero);
                for lane in 0..S::F64_LANES {
                    if passes.lane(lane) > 0.0 {
                        self.push(here, (k, lane), (top.lane(lane), largest), waiting);
                    }
                }
            }
        }
    }

    /// Lets the piece before a sample of the block wait, in one lane.
    fn push(
        &self,
        here: &BlockStates<S>,
        (k, lane): (usize, usize),
        (most, largest): (f64, bool),
        waiting: &mut Waiting,
    ) {
        let numbers = |lanes: &S::f64s| -> [f64; MAX_LANES] {
            let mut numbers = [0.0; MAX_LANES];
            numbers[..S::F64_LANES].copy_from_slice(pulp::bytemuck::cast_slice(core::slice::from_ref(lanes)));
            numbers
        };
        let state = waiting.of_block[k].unwrap_or_else(|| {
            let index = waiting.states.len();
            for (states, before) in here.states.iter().zip(here.before) {
                waiting.states.extend(numbers(if k == 0 { before } else { &states[k - 1] }));
            }
            index
        });
        waiting.of_block[k] = Some(state);
        let (signal, end) = (self.signal, here.block * BLOCK + k);
        let mut piece = Piece { signal, largest, end, most, state, slopes: 0 };
        let Some(Components { equivalent, values, last }) = self.components else {
            waiting.pieces[lane].push(piece);
            return;
        };
        // The load is the largest of linear combinations of the components: those that hold at the ends.
        let ends = [
            equivalent.components(|row| numbers(if k == 0 { &last[row] } else { &values[row][k - 1] })[lane]),
            equivalent.components(|row| numbers(&values[row][k])[lane]),
        ];
        let slopes = ends.map(|components| equivalent.rule.gradient(&components));
        for slopes in &slopes[..1 + usize::from(slopes[0] != slopes[1])] {
            piece.slopes = waiting.slopes.len();
            waiting.slopes.push(*slopes);
            waiting.pieces[lane].push(piece);
        }
    }
}

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
        simd.vectorize(self);
    }
}

impl WithSimd for Search<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
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
            let [tops, shares] = Curve::new(simd, &self, &some).top(simd, known);
            for (lane, piece) in some.iter().enumerate() {
                if let Some(piece) = piece {
                    self.note::<S>(piece, lane, (tops.lane(lane), shares.lane(lane)));
                }
            }
        }
        self.waiting.clear();
    }
}

impl Search<'_> {
    /// The extreme so far that a piece may pass; the negative one if it is the smallest.
    fn extreme<S: Simd>(&self, piece: &Piece, lane: usize) -> f64 {
        let at = piece.signal * STATISTICS;
        if piece.largest {
            self.found.lane(at + HIGH, lane, S::F64_LANES)
        } else {
            -self.found.lane(at + LOW, lane, S::F64_LANES)
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
    /// v at its start, and `(g/λ) u'`.
    state: [Complex<S>; MAX_MODES],
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
        let Search { modal, timeline, deviations, requirements, .. } = search;
        let (zero, one) = (Real::splat(simd, 0.0), Real::splat(simd, 1.0));
        let none = Complex::new(zero, zero);
        let eigenvalues_of = modal.eigenvalues.vectors::<S>().as_chunks::<2>().0;
        let (n, components) = (usize::min(eigenvalues_of.len(), MAX_MODES), timeline.components.len());
        let interval = |piece: &Option<Piece>| piece.map_or(0.0, |piece| timeline.intervals[piece.end]);
        let length = Real::gather(simd, |lane| interval(&some[lane]));
        let (mut eigenvalues, mut state) = ([none; MAX_MODES], [none; MAX_MODES]);
        for mode in 0..n {
            eigenvalues[mode] = Complex::of(simd, eigenvalues_of[mode]);
            let number = |i: usize| {
                let at = |piece: Piece, lane| {
                    search.waiting.states[piece.state + (2 * mode + i) * MAX_LANES + lane]
                };
                Real::gather(simd, |lane| some[lane].map_or(0.0, |piece| at(piece, lane)))
            };
            state[mode] = Complex::new(number(0), number(1));
        }
        // The excitation at the start, and its rate, 0 in a lane without an interval.
        let moves = zero.less_than(length);
        let (mut start, mut rate) = ([zero; 9], [zero; 9]);
        for component in 0..components {
            let input = |back: usize| {
                Real::gather(simd, |lane| {
                    let Some(piece) = some[lane] else { return 0.0 };
                    let value = timeline.values[(piece.end - back) * components + component];
                    match deviations {
                        Some(deviations) if component == 0 => {
                            value + deviations.at(simd, piece.end - back).lane(lane)
                        }
                        _ => value,
                    }
                })
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
        Self { zero, n, length, eigenvalues, state, drive, rows, is_square, is_smooth, sign }
    }

    /// Value, slope and curvature at a time after the start, s.
    #[inline(always)]
    fn at(&self, simd: S, time: Real<S>) -> [Real<S>; 3] {
        let mut sums = [[self.zero; 3]; 2];
        for (sums, row) in sums.iter_mut().zip(&self.rows) {
            (sums[0], sums[1]) = (row.slope.mul_add(time, row.constant), row.slope);
        }
        for mode in 0..self.n {
            let (change, mean) = exponential(simd, self.eigenvalues[mode].scale(time));
            let mut v = change.mul_add(self.state[mode], self.state[mode]);
            v = v + self.drive[mode].scale(time) * mean;
            let rate = self.eigenvalues[mode].mul_add(v, self.drive[mode]);
            let derivatives = [v, rate, self.eigenvalues[mode] * rate];
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

    /// The largest value where the slope changes its sign from above to below, and its share of the interval; -∞ where it does not, or where
    /// the cubic through the ends tells that it is not above the `known` one.
    #[inline(always)]
    fn top(&self, simd: S, known: Real<S>) -> [Real<S>; 2] {
        let (zero, half) = (self.zero, self.zero.constant(0.5));
        let (mut top, mut at) = (zero.constant(f64::NEG_INFINITY), zero);
        let (mut from, mut to) = (zero, self.length);
        let (mut start, mut rise, mut time) = (zero, zero, zero);
        let mut open = zero.less_than(self.length);
        for number in 0..MOST_STEPS {
            let [value, slope, bend] = self.at(simd, time);
            // First at both ends, then at the top of the cubic.
            if number == 0 {
                (start, rise, time) = (value, slope, self.length);
                continue;
            }
            if number == 1 {
                open = open.and(zero.less_than(rise)).and(slope.less_than(zero));
                let [highest, share] = self.cubic([start, rise], [value, slope]);
                let above = highest + self.zero.constant(BEYOND_CUBIC) * (highest - start.min(value));
                open = open.and(known.less_than(above).or(self.is_smooth.not()));
                time = open.select(self.length * share, zero);
                continue;
            }
            if !open.any() {
                break;
            }
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
        [top, at / zero.less_than(self.length).select(self.length, zero.constant(1.0))]
    }

    /// The largest value of the cubic with these values and slopes at the ends, rising at the first and falling at the last, and its share of
    /// the interval.
    #[inline(always)]
    fn cubic(&self, [start, rise]: [Real<S>; 2], [end, fall]: [Real<S>; 2]) -> [Real<S>; 2] {
        let [zero, half, two, three] = [0.0, 0.5, 2.0, 3.0].map(|number| self.zero.constant(number));
        let (rise, fall, change) = (rise * self.length, fall * self.length, end - start);
        let (square, cube) = (three * change - two * rise - fall, rise + fall - two * change);
        let root = (square * square - three * cube * rise).max(zero).sqrt();
        let share = rise / (root - square);
        // Of ends so close that rounding decides, the middle.
        let inside = zero.less_than(share).and(share.less_than(zero.constant(1.0)));
        let share = inside.select(share, half);
        [cube.mul_add(share, square).mul_add(share, rise).mul_add(share, start), share]
    }
}
