//! Loads of many scenes side by side at the samples of a block.

use pulp::{Simd, WithSimd};

use super::modal::{Modal, TILE};
use super::room::Room;
use super::timeline::{BLOCK, Timeline};
use super::vector::Real;

/// Samples of which the values of a tile of rows are worked out at a time: sixteen sums in the registers, which share each number loaded.
const SAMPLES: usize = 4;

/// Smallest, largest and first value of all rows over a block, and, if they are kept, the values at its samples.
pub(super) struct Loads<'a, const KEPT: bool> {
    pub modal: &'a Modal,
    pub line: &'a Timeline,
    pub block: usize,
    pub states: &'a Room,
    pub values: &'a mut Room,
    pub extremes: &'a mut Room,
}

impl<const KEPT: bool> WithSimd for Loads<'_, KEPT> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { modal, line, block, states, values, extremes } = self;
        let components = line.components.len();
        let inputs = &line.values[block * BLOCK * components..][..BLOCK * components];
        let states = states.vectors::<S>().as_chunks::<BLOCK>().0;
        let width = 1 + components + states.len();
        let tiles = modal.tiles.vectors::<S>().as_chunks::<TILE>().0.chunks_exact(width);
        let extremes = extremes.vectors_mut::<S>().as_chunks_mut::<3>().0.as_chunks_mut::<TILE>().0;
        let values = values.vectors_mut::<S>().as_chunks_mut::<BLOCK>().0.as_chunks_mut::<TILE>().0;
        for (index, (tile, extremes)) in tiles.zip(extremes).enumerate() {
            let (head, tile) = tile.split_at(1 + components);
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
                // A loop that is not unrolled: 16 sums, 4 + 4 numbers loaded, and nothing to keep elsewhere.
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
                    if part > 0 {
                        low = low.min(Real::new(simd, extremes[row][0]));
                        high = high.max(Real::new(simd, extremes[row][1]));
                    }
                    let first = if part == 0 { a.lanes } else { extremes[row][2] };
                    extremes[row] = [low.lanes, high.lanes, first];
                    if KEPT {
                        values[index][row].as_chunks_mut::<SAMPLES>().0[part] =
                            sums[row].map(|sum| sum.lanes);
                    }
                }
            }
        }
    }
}
