//! Intervals in which a signal may pass its extreme between the samples, by the second differences of its values, one scene in each lane. They
//! wait for the end of a window: with the extremes at all samples known, few are left to be searched.

use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::bows::MostBow;
use super::drawn;
use super::modal::{ModalScenes, width};
use super::timeline::{BLOCK, Timeline};
use super::vector::{Number, Real};
use crate::batch::equivalent::EquivalentRows;
use crate::life::COMPONENTS;
use crate::numeric::simd::MAX_LANES;
use crate::output::beyond;

/// Gain of a value between two samples, over its largest magnitude at the samples, that is rounding.
const LEAST_GAIN: f64 = 1e-12;

/// The interval before a sample, in which a signal of one scene may pass its extreme.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub signal: usize,
    /// Whether the largest value is sought, or the smallest.
    pub largest: bool,
    /// Sample of the window at its end.
    pub end: usize,
    /// Estimate of the largest value in it; of the negative value if the smallest is sought.
    pub most: f64,
    /// Indices of v at its ends and, if the signal is an equivalent load, of the slopes by its components.
    pub states: [usize; 2],
    pub slopes: usize,
}

/// The pieces that wait for the end of a window.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    /// Of each lane.
    pub pieces: [Vec<Piece>; MAX_LANES],
    /// v of all lanes at the samples at which pieces begin or end.
    pub states: Vec<f64>,
    pub slopes: Vec<[f64; COMPONENTS]>,
    /// For the sample before the present block and those in it, the index of v, if a piece begins or ends there.
    of_block: [Option<usize>; 1 + BLOCK],
}

impl Waiting {
    /// Goes on to the next block.
    pub(super) fn next_block(&mut self) {
        self.of_block = [None; 1 + BLOCK];
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
        let rounding = Real::splat(simd, LEAST_GAIN) * least.abs().max(most.abs());
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

    /// Lets those wait in which the signal, the negative one if the smallest is sought, may pass the value `known`.
    ///
    /// With the values a and b at its ends and a bow B over the middle of the chord, a piece is highest at `(a + b)/2 + B + (b - a)²/(16 B)`,
    /// if `|b - a| < 4 B`.
    #[inline(always)]
    fn find(&self, simd: S, here: &BlockStates<S>, (known, largest): (Real<S>, bool), waiting: &mut Waiting) {
        let Some(bows) = here.timeline.bows.of(here.block) else { return };
        let (zero, half, four) = (Real::splat(simd, 0.0), Real::splat(simd, 0.5), Real::splat(simd, 4.0));
        let sixteenth = Real::splat(simd, 0.0625);
        let sign = Real::splat(simd, if largest { 1.0 } else { -1.0 });
        // From the sample before the block on, values and second difference quotients; those that are not known are zero.
        let (mut values, mut bends) = ([self.last * sign; BLOCK + 1], [zero; BLOCK + 1]);
        for k in 0..BLOCK {
            values[k + 1] = Real::new(simd, self.values[k]) * sign;
        }
        for k in 0..BLOCK - 1 {
            let [first, second] = bows[k].factors;
            let (first, second) = (Real::splat(simd, first), Real::splat(simd, second));
            bends[k + 1] = first * (values[k + 1] - values[k]) - second * (values[k + 2] - values[k + 1]);
        }
        let mut largest_bend = zero;
        for bend in &bends {
            largest_bend = largest_bend.max(bend.abs());
        }
        // No piece is higher than its higher end and its bow. Most blocks need no division.
        let (mut sizes, mut highest) = ([zero; BLOCK], zero.constant(f64::NEG_INFINITY));
        for (k, bow) in bows.iter().enumerate() {
            if bow.length == 0.0 {
                continue;
            }
            let bend = match bow.known {
                [true, false] => beyond(bends[k].abs(), largest_bend),
                [false, true] => beyond(bends[k + 1].abs(), largest_bend),
                _ => bends[k].max(bends[k + 1]),
            };
            let bent = bend.max(zero) + self.hidden;
            sizes[k] = bent.mul_add(Real::splat(simd, bow.size), zero.constant(bow.unknown));
            highest = highest.max(values[k].max(values[k + 1]) + sizes[k]);
        }
        if !known.less_than(highest).any() {
            return;
        }
        for (k, &size) in sizes.iter().enumerate() {
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
        let states = [k, k + 1].map(|place| {
            let index = waiting.of_block[place].unwrap_or_else(|| {
                let index = waiting.states.len();
                for (states, before) in here.states.iter().zip(here.before) {
                    waiting.states.extend(numbers(if place == 0 { before } else { &states[place - 1] }));
                }
                index
            });
            waiting.of_block[place] = Some(index);
            index
        });
        let (signal, end) = (self.signal, here.block * BLOCK + k);
        let mut piece = Piece { signal, largest, end, most, states, slopes: 0 };
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
