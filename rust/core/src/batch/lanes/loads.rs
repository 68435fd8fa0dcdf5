//! Loads of many scenes, one in each lane, at the samples of a block.

use pulp::{Simd, WithSimd};

use super::aligned_buffer::AlignedBuffer;
use super::matrix::MAX_MODES;
use super::modal::{ModalScenes, TILE};
use super::timeline::{BLOCK, Timeline};
use super::vector::Real;

/// Samples evaluated at a time for a tile of rows, so that sixteen sums in registers share each loaded number.
const SAMPLES: usize = 4;

/// Smallest and largest value of all rows: over a block if the values at the samples are stored, otherwise over all blocks so far.
pub(super) struct LaneLoads<'a, const STORES_VALUES: bool> {
    pub modal: &'a ModalScenes,
    pub timeline: &'a Timeline,
    pub block: usize,
    /// Whether it is the first block of the motion.
    pub is_first: bool,
    pub states: &'a AlignedBuffer,
    pub values: &'a mut AlignedBuffer,
    pub extremes: &'a mut AlignedBuffer,
}

impl<const STORES_VALUES: bool> WithSimd for LaneLoads<'_, STORES_VALUES> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { modal, timeline, block, is_first, states, values, extremes } = self;
        let components = timeline.components.len();
        let inputs = &timeline.values[block * BLOCK * components..][..BLOCK * components];
        let states = states.vectors::<S>().as_chunks::<BLOCK>().0;
        let width = 1 + components + states.len();
        let tiles = modal.tiles.vectors::<S>().as_chunks::<TILE>().0.chunks_exact(width);
        let extremes = extremes.vectors_mut::<S>().as_chunks_mut::<2>().0.as_chunks_mut::<TILE>().0;
        let values = values.vectors_mut::<S>().as_chunks_mut::<BLOCK>().0.as_chunks_mut::<TILE>().0;
        let mut sizes = [simd.splat_f64s(0.0); 2 * MAX_MODES];
        if !STORES_VALUES {
            for (size, states) in sizes.iter_mut().zip(states) {
                *size = largest(simd, states).lanes;
            }
        }
        for (index, (tile, extremes)) in tiles.zip(extremes).enumerate() {
            let (head, tile) = tile.split_at(1 + components);
            if !STORES_VALUES
                && !is_first
                && !may_be_new(simd, head, timeline.range(block), tile, &sizes, extremes)
            {
                continue;
            }
            for part in 0..BLOCK / SAMPLES {
                let mut sums = head[0].map(|lanes| [Real::new(simd, lanes); SAMPLES]);
                for (component, feed) in head[1..].iter().enumerate() {
                    for sample in 0..SAMPLES {
                        let input =
                            Real::splat(simd, inputs[(part * SAMPLES + sample) * components + component]);
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
                for row in 0..TILE {
                    let [a, b, c, d] = sums[row];
                    let (mut low, mut high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
                    if part > 0 || (!STORES_VALUES && !is_first) {
                        low = low.min(Real::new(simd, extremes[row][0]));
                        high = high.max(Real::new(simd, extremes[row][1]));
                    }
                    extremes[row] = [low.lanes, high.lanes];
                    if STORES_VALUES {
                        values[index][row].as_chunks_mut::<SAMPLES>().0[part] =
                            sums[row].map(|sum| sum.lanes);
                    }
                }
            }
        }
    }
}

/// Largest magnitude.
#[inline(always)]
fn largest<S: Simd>(simd: S, values: &[S::f64s; BLOCK]) -> Real<S> {
    let mut most = [Real::splat(simd, 0.0); 4];
    for k in 0..BLOCK {
        most[k % 4] = most[k % 4].max(Real::new(simd, values[k]).abs());
    }
    most[0].max(most[1]).max(most[2].max(most[3]))
}

/// Whether a row of a tile may have a new extreme in a block, in any lane, by the range of the excitation in the block and the largest
/// deviations of the modes. This test costs a tenth of the evaluation. Most blocks have no new extreme: those after the overshoot of a
/// ramp, and those at standstill.
#[inline(always)]
fn may_be_new<S: Simd>(
    simd: S,
    head: &[[S::f64s; TILE]],
    range: &[[f64; 2]],
    tile: &[[S::f64s; TILE]],
    sizes: &[S::f64s; 2 * MAX_MODES],
    extremes: &[[S::f64s; 2]; TILE],
) -> bool {
    // The rounding error of a sum of some twenty terms is far below this fraction of their sizes.
    let rounding = Real::splat(simd, 1e-13);
    let mut new = rounding.less_than(Real::splat(simd, 0.0));
    for row in 0..TILE {
        let rest = Real::new(simd, head[0][row]);
        let (mut low, mut high, mut size) = (rest, rest, rest.abs());
        for (feed, &[least, most]) in head[1..].iter().zip(range) {
            let feed = Real::new(simd, feed[row]);
            let (a, b) = (feed * Real::splat(simd, least), feed * Real::splat(simd, most));
            (low, high, size) = (low + a.min(b), high + a.max(b), size + a.abs().max(b.abs()));
        }
        let mut spread = Real::splat(simd, 0.0);
        for (coefficients, size) in tile.iter().zip(sizes) {
            spread = Real::new(simd, coefficients[row]).abs().mul_add(Real::new(simd, *size), spread);
        }
        spread = (size + spread).mul_add(rounding, spread);
        let [lowest, highest] = extremes[row].map(|lanes| Real::new(simd, lanes));
        new = new.or((low - spread).less_than(lowest)).or(highest.less_than(high + spread));
    }
    new.any()
}
