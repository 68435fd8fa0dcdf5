//! Loads of many scenes, one in each lane, at the samples of a block.

use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::dense::MAX_MODES;
use super::drawn::{self, CHANGES};
use super::memory::{HIGH, LOW, Memory, STATISTICS};
use super::modal::{ModalScenes, TILE, width};
use super::timeline::{BLOCK, Timeline};
use super::vector::{Complex, Number, Real};
use crate::batch::equivalent::added;
use crate::batch::requirements::{Requirements, Signal, SignalRequest};

/// Samples evaluated at a time for a tile of rows, so that sixteen sums in registers share each loaded number.
pub(super) const SAMPLES: usize = 4;

/// Evaluates the rows of loads in a block: their values, and the smallest and the largest one. `bounded`: the requirements, if tiles without
/// a new extreme of a signal are passed over, by bounds. Whether all tiles were evaluated.
#[inline(always)]
pub(super) fn evaluate<S: Simd, const DRAWN: bool>(
    simd: S,
    modal: &ModalScenes,
    timeline: &Timeline,
    block: usize,
    bounded: Option<&Requirements>,
    memory: &mut Memory,
) -> bool {
    let Memory {
        states,
        before,
        values,
        extremes,
        found,
        last,
        counts,
        evaluated,
        were_evaluated,
        drawn,
        ..
    } = memory;
    let components = timeline.components.len();
    let inputs = Inputs::<DRAWN> { drawn, timeline, block, components };
    let mut ranges = [[Real::splat(simd, 0.0); 2]; 9];
    for (to, [least, most]) in ranges.iter_mut().zip(timeline.range(block)) {
        *to = [Real::splat(simd, 0.5 * (least + most)), Real::splat(simd, 0.5 * (most - least))];
    }
    if DRAWN {
        let ([least, most], half) = (drawn::range(simd, drawn), Real::splat(simd, 0.5));
        ranges[0] = [half * (least + most), half * (most - least)];
    }
    let ranges = &ranges[..components];
    let (states, before) = (states.vectors::<S>().as_chunks::<BLOCK>().0, before.vectors::<S>());
    let width = width(states.len() / 2, components);
    let tiles = modal.tiles.vectors::<S>().as_chunks::<TILE>().0.chunks_exact(width);
    let extremes = extremes.vectors_mut::<S>().as_chunks_mut::<2>().0.as_chunks_mut::<TILE>().0;
    let last = last.vectors_mut::<S>().as_chunks_mut::<TILE>().0;
    let values = values.vectors_mut::<S>().as_chunks_mut::<BLOCK>().0.as_chunks_mut::<TILE>().0;
    were_evaluated.clone_from(evaluated);
    counts.fill(true);
    evaluated.fill(true);
    if let Some(requirements) = bounded {
        let mut sizes = [Real::splat(simd, 0.0); MAX_MODES];
        let deviations = Deviations { modal, states, before, inputs, ranges };
        if ranges.len() == 1 {
            deviations.find::<true>(simd, timeline.longest(block), &mut sizes);
        } else {
            deviations.find::<false>(simd, timeline.longest(block), &mut sizes);
        }
        for (tile, extremes) in tiles.clone().zip(&mut *extremes) {
            let (head, tile) = tile.split_at(1 + components);
            *extremes = row_bounds(simd, head, ranges, tile.split_at(states.len()).1, &sizes);
        }
        evaluated.fill(false);
        let bounds = extremes.as_flattened();
        let found = found.vectors::<S>().as_chunks::<STATISTICS>().0;
        for ((signal, found), counts) in requirements.signals.iter().zip(found).zip(counts) {
            *counts = may_be_new(simd, requirements, signal, bounds, found);
            if *counts {
                for row in requirements.rows_of(signal.signal) {
                    evaluated[row / TILE] = true;
                }
            }
        }
    }
    for (index, (tile, extremes)) in tiles.zip(extremes).enumerate() {
        if !evaluated[index] {
            continue;
        }
        let (head, tile) = tile.split_at(1 + components);
        let (tile, _) = tile.split_at(states.len());
        if !were_evaluated[index] {
            for row in 0..TILE {
                let mut sum = Real::new(simd, head[0][row]);
                for (component, feed) in head[1..].iter().enumerate() {
                    sum = Real::new(simd, feed[row]).mul_add(inputs.before(simd, component), sum);
                }
                for (coefficients, state) in tile.iter().zip(before) {
                    sum = Real::new(simd, coefficients[row]).mul_add(Real::new(simd, *state), sum);
                }
                last[index][row] = sum.lanes;
            }
        }
        for part in 0..BLOCK / SAMPLES {
            let sums = row_sums(simd, head, tile, states, part, &inputs);
            for row in 0..TILE {
                let [a, b, c, d] = sums[row];
                let (mut low, mut high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
                if part > 0 {
                    low = low.min(Real::new(simd, extremes[row][0]));
                    high = high.max(Real::new(simd, extremes[row][1]));
                }
                extremes[row] = [low.lanes, high.lanes];
                for sample in 0..SAMPLES {
                    values[index][row][part * SAMPLES + sample] = sums[row][sample].lanes;
                }
            }
        }
    }
    evaluated.iter().all(|evaluated| *evaluated)
}

/// The rows of a tile at some of the samples of a block.
#[inline(always)]
pub(super) fn row_sums<S: Simd>(
    simd: S,
    head: &[[S::f64s; TILE]],
    tile: &[[S::f64s; TILE]],
    states: &[[S::f64s; BLOCK]],
    part: usize,
    inputs: &impl BlockInputs,
) -> [[Real<S>; SAMPLES]; TILE] {
    let mut sums = [[Real::splat(simd, 0.0); SAMPLES]; TILE];
    for row in 0..TILE {
        sums[row] = [Real::new(simd, head[0][row]); SAMPLES];
    }
    for (component, feed) in head[1..].iter().enumerate() {
        for sample in 0..SAMPLES {
            let input = inputs.at(simd, part * SAMPLES + sample, component);
            for row in 0..TILE {
                sums[row][sample] = Real::new(simd, feed[row]).mul_add(input, sums[row][sample]);
            }
        }
    }
    // Not unrolled: 16 sums and 4 + 4 loaded numbers fill the registers.
    for (coefficients, states) in tile.iter().zip(states) {
        let states = &states.as_chunks::<SAMPLES>().0[part];
        for row in 0..TILE {
            for sample in 0..SAMPLES {
                sums[row][sample] = Real::new(simd, coefficients[row])
                    .mul_add(Real::new(simd, states[sample]), sums[row][sample]);
            }
        }
    }
    sums
}

/// Which blocks are bounded before they are evaluated. Bounds take about as long as the evaluation of a tile. Where a block needs all of its
/// tiles, as under noise, the next one mostly does, too, and is evaluated without bounds.
#[derive(Debug, Default)]
pub(super) struct BoundPlan {
    /// Blocks without bounds before the next one with bounds.
    left: usize,
    /// Number of blocks without bounds after the last one with bounds.
    pause: usize,
}

/// Largest number of blocks in a row without bounds.
const MOST_UNBOUNDED: usize = 4;

impl BoundPlan {
    /// Whether the next block is bounded.
    pub(super) fn bounds_next(&mut self) -> bool {
        if self.left == 0 {
            return true;
        }
        self.left -= 1;
        false
    }

    /// Notes whether a bounded block needed all of its tiles.
    pub(super) fn note(&mut self, all: bool) {
        self.pause = if all { usize::min(2 * self.pause + 1, MOST_UNBOUNDED) } else { 0 };
        self.left = self.pause;
    }
}

/// Smallest squared size that is told from zero.
const TINY: f64 = 1e-280;

/// Rounding of a sum of some twenty terms over the sum of their sizes is far below this.
const SUM_ROUNDING: f64 = 1e-13;

/// The excitation at the samples of a block. (No closure, whose body would not have the instructions of the caller.)
#[derive(Clone, Copy)]
pub(super) struct Inputs<'a, const DRAWN: bool> {
    pub drawn: &'a AlignedBuffer,
    pub timeline: &'a Timeline,
    pub block: usize,
    pub components: usize,
}

/// Values of the components of the excitation for the samples of a block.
pub(super) trait BlockInputs {
    fn at<S: Simd>(&self, simd: S, sample: usize, component: usize) -> Real<S>;
}

impl<const DRAWN: bool> BlockInputs for Inputs<'_, DRAWN> {
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, sample: usize, component: usize) -> Real<S> {
        if DRAWN && component == 0 {
            Real::new(simd, self.drawn.vectors::<S>()[drawn::VALUES + sample])
        } else {
            let at = self.block * BLOCK + sample;
            Real::splat(simd, self.timeline.values[at * self.components + component])
        }
    }
}

impl<const DRAWN: bool> Inputs<'_, DRAWN> {
    /// The change from the sample before.
    #[inline(always)]
    pub(super) fn change<S: Simd>(&self, simd: S, sample: usize, component: usize) -> Real<S> {
        if DRAWN && component == 0 {
            Real::new(simd, self.drawn.vectors::<S>()[CHANGES + sample])
        } else {
            let at = self.block * BLOCK + sample;
            Real::splat(simd, self.timeline.changes[at * self.components + component])
        }
    }

    /// At the last sample before the block.
    #[inline(always)]
    fn before<S: Simd>(&self, simd: S, component: usize) -> Real<S> {
        if DRAWN && component == 0 {
            Real::new(simd, self.drawn.vectors::<S>()[drawn::BEFORE])
        } else {
            let at = self.block * BLOCK - 1;
            Real::splat(simd, self.timeline.values[at * self.components + component])
        }
    }
}

/// What bounds z of each mode from the sample before a block to its last one.
struct Deviations<'a, S: Simd, const DRAWN: bool> {
    modal: &'a ModalScenes,
    states: &'a [[S::f64s; BLOCK]],
    before: &'a [S::f64s],
    inputs: Inputs<'a, DRAWN>,
    /// Middle and half of the range of each component of the excitation.
    ranges: &'a [[Real<S>; 2]],
}

impl<S: Simd, const DRAWN: bool> Deviations<'_, S, DRAWN> {
    /// Largest distance of z of each mode from its quasi-static value in the middle of the range of the excitation, and more than rounding
    /// can add to its effect. (Noise of the excitation is in v and in the quasi-static value, so that the two together are smaller than
    /// either.) `ONE`: whether there is one component, as usual. `longest`: interval, s.
    ///
    /// Between two samples the distance d follows `d' = λ d + λ (g/λ) (u - middle)`, so that it grows by at most `|λ| h |g/λ| half`.
    #[inline(always)]
    fn find<const ONE: bool>(&self, simd: S, longest: f64, sizes: &mut [Real<S>; MAX_MODES]) {
        let Self { modal, states, before, inputs, ranges } = self;
        let drives = modal.drive.vectors::<S>().as_chunks::<2>().0;
        let eigenvalues = modal.eigenvalues.vectors::<S>().as_chunks::<2>().0;
        let states = states.as_chunks::<2>().0;
        let count = if ONE { 1 } else { ranges.len() };
        let mut first = [simd.splat_f64s(0.0); BLOCK];
        if ONE {
            for k in 0..BLOCK {
                first[k] = (ranges[0][0] - inputs.at(simd, k, 0)).lanes;
            }
        }
        let longest = Real::splat(simd, longest);
        for (mode, ([re, im], size)) in states.iter().zip(sizes).enumerate() {
            let mut reach = Real::splat(simd, 0.0);
            let mut most = [Real::splat(simd, TINY); 4];
            let mut z = Complex::of(simd, [before[2 * mode], before[2 * mode + 1]]);
            for component in 0..count {
                let drive = Complex::of(simd, drives[component * states.len() + mode]);
                reach = (drive.re.abs() + drive.im.abs()).mul_add(ranges[component][1], reach);
                let off = ranges[component][0] - inputs.before(simd, component);
                z = Complex::new(drive.re.mul_add(off, z.re), drive.im.mul_add(off, z.im));
            }
            most[0] = most[0].max(z.norm_squared());
            for k in 0..BLOCK {
                let mut z = Complex::of(simd, [re[k], im[k]]);
                for component in 0..count {
                    let off = if ONE {
                        Real::new(simd, first[k])
                    } else {
                        ranges[component][0] - inputs.at(simd, k, component)
                    };
                    let drive = Complex::of(simd, drives[component * states.len() + mode]);
                    z = Complex::new(drive.re.mul_add(off, z.re), drive.im.mul_add(off, z.im));
                }
                most[k % 4] = most[k % 4].max(z.norm_squared());
            }
            let largest = most[0].max(most[1]).max(most[2].max(most[3])).sqrt();
            let turn = Complex::of(simd, eigenvalues[mode]).norm_squared().sqrt() * longest;
            let between = turn.mul_add(reach, largest);
            *size = (between + reach).mul_add(Real::splat(simd, SUM_ROUNDING), between);
        }
    }
}

/// Bounds on the rows of a tile between the sample before a block and its last one, by the range of the excitation there and the largest
/// deviations of the modes. They cost a tenth of the evaluation of the tile. Most blocks have no new extreme: those after the overshoot of a
/// ramp, and those at standstill.
#[inline(always)]
fn row_bounds<S: Simd>(
    simd: S,
    head: &[[S::f64s; TILE]],
    ranges: &[[Real<S>; 2]],
    effects: &[[S::f64s; TILE]],
    sizes: &[Real<S>; MAX_MODES],
) -> [[S::f64s; 2]; TILE] {
    let rounding = Real::splat(simd, SUM_ROUNDING);
    let (direct, moduli) = effects.split_at(ranges.len());
    let mut bounds = [[simd.splat_f64s(0.0); 2]; TILE];
    for row in 0..TILE {
        let mut middle = Real::new(simd, head[0][row]);
        let (mut size, mut spread) = (middle.abs(), Real::splat(simd, 0.0));
        for ((feed, direct), &[at, half]) in head[1..].iter().zip(direct).zip(ranges) {
            let feed = Real::new(simd, feed[row]);
            middle = feed.mul_add(at, middle);
            size = feed.abs().mul_add(at.abs() + half, size);
            spread = Real::new(simd, direct[row]).mul_add(half, spread);
        }
        for (modulus, size) in moduli.iter().zip(sizes) {
            spread = Real::new(simd, modulus[row]).mul_add(*size, spread);
        }
        spread = (size + spread).mul_add(rounding, spread);
        bounds[row] = [(middle - spread).lanes, (middle + spread).lanes];
    }
    bounds
}

/// Whether a signal may have a new extreme in a block, in any lane, by bounds on each row and the statistics so far.
#[inline(always)]
fn may_be_new<S: Simd>(
    simd: S,
    requirements: &Requirements,
    request: &SignalRequest,
    bounds: &[[S::f64s; 2]],
    found: &[S::f64s; STATISTICS],
) -> bool {
    if !request.extremes {
        return false; // The first block has given the value at the start.
    }
    let zero = Real::splat(simd, 0.0);
    let (least, most) = (Real::new(simd, found[LOW]), Real::new(simd, found[HIGH]));
    let largest = match request.signal {
        Signal::Row(row) => {
            let (lowest, highest) = (Real::new(simd, bounds[row][0]), Real::new(simd, bounds[row][1]));
            return lowest.less_than(least).or(most.less_than(highest)).any();
        }
        Signal::Resultant(y, z) => {
            let (y, z) =
                (largest_by(simd, &bounds[y], zero, 1.0, 0.0), largest_by(simd, &bounds[z], zero, 1.0, 0.0));
            y.mul_add(y, z * z)
        }
        Signal::Equivalent(index) | Signal::Power(index) => {
            let equivalent = &requirements.equivalents[index];
            let mut groups = [zero; 2];
            for (sum, terms) in groups.iter_mut().zip(&equivalent.groups) {
                for &(row, size, sign) in terms {
                    *sum = largest_by(simd, &bounds[row], *sum, size, sign);
                }
            }
            equivalent.rule.combined(groups)
        }
    };
    most.less_than(largest).any()
}

/// The largest `sum + size |value| + sign value` of a value within bounds.
#[inline(always)]
fn largest_by<S: Simd>(simd: S, bounds: &[S::f64s; 2], sum: Real<S>, size: f64, sign: f64) -> Real<S> {
    let (lowest, highest) = (Real::new(simd, bounds[0]), Real::new(simd, bounds[1]));
    added(sum, lowest, size, sign).max(added(sum, highest, size, sign))
}
