//! Mean loads between the samples of a block, one scene in each lane, in closed form.
//!
//! Between two samples `v' = λ v + (g/λ) u'` with a constant u', so that the mean of v over an interval of length h is
//! `(v1 - v0 - (g/λ) (u1 - u0)) / (λ h)`. A row is linear in v and u: its mean is its value at their means.

use pulp::Simd;

use super::loads::{BlockInputs, Inputs, SAMPLES, row_sums};
use super::memory::Memory;
use super::modal::{ModalScenes, TILE, width};
use super::timeline::{BLOCK, Timeline};
use super::vector::{Complex, Real};
use crate::batch::requirements::{Requirements, Signal};

/// Whether each tile of rows has one of which mean loads are made.
pub(super) fn tiles_with_means(requirements: &Requirements, tiles: usize) -> Vec<bool> {
    let mut needed = vec![false; tiles];
    for request in &requirements.signals {
        if let Signal::Power(_) = request.signal {
            requirements.rows_of(request.signal).for_each(|row| needed[row / TILE] = true);
        }
    }
    needed
}

/// Computes the mean of each needed row over the interval before each sample of a block; without meaning where the interval has no length.
#[inline(always)]
pub(super) fn set_means<S: Simd, const DRAWN: bool>(
    simd: S,
    modal: &ModalScenes,
    timeline: &Timeline,
    block: usize,
    memory: &mut Memory,
) {
    let Memory { states, before, drawn, mean_states, means, has_means, .. } = memory;
    let components = timeline.components.len();
    let inputs = MeanInputs(Inputs::<DRAWN> { drawn, timeline, block, components });
    let (states, before) = (states.vectors::<S>().as_chunks::<BLOCK>().0, before.vectors::<S>());
    let modes = states.len() / 2;
    let drives = modal.drive.vectors::<S>().as_chunks::<2>().0;
    let eigenvalues = modal.eigenvalues.vectors::<S>().as_chunks::<2>().0;
    let mean_states = mean_states.vectors_mut::<S>().as_chunks_mut::<BLOCK>().0.as_chunks_mut::<2>().0;
    let Some(intervals) = timeline.intervals[block * BLOCK..].first_chunk::<BLOCK>() else { return };
    for (mode, [re, im]) in mean_states.iter_mut().enumerate() {
        let eigenvalue = Complex::of(simd, eigenvalues[mode]);
        let size = eigenvalue.norm_squared();
        let inverse = Complex::new(eigenvalue.re / size, -(eigenvalue.im / size));
        let mut last = Complex::of(simd, [before[2 * mode], before[2 * mode + 1]]);
        for k in 0..BLOCK {
            let now = Complex::of(simd, [states[2 * mode][k], states[2 * mode + 1][k]]);
            let mut gained = Complex::new(now.re - last.re, now.im - last.im);
            for component in 0..components {
                let drive = Complex::of(simd, drives[component * modes + mode]);
                let change = -inputs.0.change(simd, k, component);
                gained =
                    Complex::new(drive.re.mul_add(change, gained.re), drive.im.mul_add(change, gained.im));
            }
            let rate = if intervals[k] > 0.0 { 1.0 / intervals[k] } else { 0.0 };
            let mean = (gained * inverse).scale(Real::splat(simd, rate));
            (re[k], im[k]) = (mean.re.lanes, mean.im.lanes);
            last = now;
        }
    }
    let mean_states = mean_states.as_flattened();
    let tiles = modal.tiles.vectors::<S>().as_chunks::<TILE>().0.chunks_exact(width(modes, components));
    let means = means.vectors_mut::<S>().as_chunks_mut::<BLOCK>().0.as_chunks_mut::<TILE>().0;
    for ((tile, means), is_needed) in tiles.zip(means).zip(has_means) {
        if !*is_needed {
            continue;
        }
        let (head, tile) = tile.split_at(1 + components);
        for part in 0..BLOCK / SAMPLES {
            let sums = row_sums(simd, head, &tile[..2 * modes], mean_states, part, &inputs);
            for row in 0..TILE {
                for sample in 0..SAMPLES {
                    means[row][part * SAMPLES + sample] = sums[row][sample].lanes;
                }
            }
        }
    }
}

/// The means of the excitation over the intervals before the samples of a block.
struct MeanInputs<'a, const DRAWN: bool>(Inputs<'a, DRAWN>);

impl<const DRAWN: bool> BlockInputs for MeanInputs<'_, DRAWN> {
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, sample: usize, component: usize) -> Real<S> {
        let half = Real::splat(simd, -0.5);
        self.0.change(simd, sample, component).mul_add(half, self.0.at(simd, sample, component))
    }
}
