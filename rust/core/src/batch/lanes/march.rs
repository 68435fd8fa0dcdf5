//! Many scenes side by side from block to block of a motion.

use pulp::{Simd, WithSimd};

use super::loads::Loads;
use super::modal::{Modal, TILE};
use super::room::Room;
use super::step::Steps;
use super::tally::{FOUND, Reduce, nothing};
use super::timeline::{BLOCK, Timeline};
use super::vector::{Complex, Real};
use crate::batch::reduce::Needs;

/// Memory of a worker, and what a march leaves in it.
#[derive(Debug, Default)]
pub(super) struct Memory {
    states: Room,
    values: Room,
    extremes: Room,
    steps: Room,
    /// [`FOUND`] numbers for each track.
    pub found: Room,
    /// v at the end.
    pub end: Room,
}

/// Runs as many scenes as there are lanes through a motion.
pub(super) struct March<'a, const N: usize> {
    pub modal: &'a Modal,
    pub line: &'a Timeline,
    pub needs: &'a Needs,
    /// Whether more is asked than the extremes of rows.
    pub kept: bool,
    pub memory: &'a mut Memory,
}

impl<const N: usize> WithSimd for March<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { modal, line, needs, kept, memory } = self;
        let Memory { states, values, extremes, steps, found, end } = memory;
        let rows = modal.rows.next_multiple_of(TILE);
        for place in found.clear::<S>(needs.tracks.len() * FOUND).as_chunks_mut::<FOUND>().0 {
            *place = nothing(simd);
        }
        end.clear::<S>(2 * N);
        states.clear::<S>(2 * N * BLOCK);
        values.clear::<S>(if kept { rows * BLOCK } else { 0 });
        extremes.clear::<S>(rows * 2);
        simd.vectorize(Steps { lengths: &line.lengths, modal, to: steps });
        for block in 0..line.blocks() {
            if let Some(kind) = line.kind(block) {
                simd.vectorize(Advance::<N> { steps, kind, line, block, states, end });
            } else {
                for sample in 0..BLOCK {
                    simd.vectorize(AdvanceOnce::<N> { modal, steps, line, block, sample, states, end });
                }
            }
            if kept {
                simd.vectorize(Loads::<true> { modal, line, block, states, values, extremes });
            } else {
                simd.vectorize(Loads::<false> { modal, line, block, states, values, extremes });
            }
            if kept {
                simd.vectorize(Reduce { needs, line, block, starts: &modal.starts, values, extremes, found });
            }
        }
        if !kept {
            simd.vectorize(Reduce { needs, line, block: 0, starts: &modal.starts, values, extremes, found });
        }
    }
}

/// From sample to sample of a block by the same step.
struct Advance<'a, const N: usize> {
    steps: &'a Room,
    kind: usize,
    line: &'a Timeline,
    block: usize,
    states: &'a mut Room,
    /// v before and after.
    end: &'a mut Room,
}

impl<const N: usize> WithSimd for Advance<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { steps, kind, line, block, states, end } = self;
        let components = line.components.len();
        let steps = steps.vectors::<S>().as_chunks::<2>().0.as_chunks::<N>().0;
        let Some((step, by_input)) = steps[kind * (1 + components)..][..1 + components].split_first() else {
            return;
        };
        let changes = &line.changes[block * BLOCK * components..][..BLOCK * components];
        let Some(end) = end.vectors_mut::<S>().as_chunks_mut::<2>().0.first_chunk_mut::<N>() else { return };
        let states = states.vectors_mut::<S>().as_chunks_mut::<BLOCK>().0.as_chunks_mut::<2>().0;
        let Some(states) = states.first_chunk_mut::<N>() else { return };
        let inside = usize::min(BLOCK, line.count - block * BLOCK);
        let mut state = *end;
        // One component, as mostly: a loop of its own, of which the compiler knows that it has one.
        if let [by_input] = by_input {
            let Some(changes) = changes.first_chunk::<BLOCK>() else { return };
            for k in 0..inside {
                state = advanced(simd, step, core::slice::from_ref(by_input), &changes[k..k + 1], &state);
                for mode in 0..N {
                    (states[mode][0][k], states[mode][1][k]) = (state[mode][0], state[mode][1]);
                }
            }
        } else {
            for k in 0..inside {
                state =
                    advanced(simd, step, by_input, &changes[k * components..(k + 1) * components], &state);
                for mode in 0..N {
                    (states[mode][0][k], states[mode][1][k]) = (state[mode][0], state[mode][1]);
                }
            }
        }
        for mode in 0..N {
            for k in inside..BLOCK {
                (states[mode][0][k], states[mode][1][k]) = (state[mode][0], state[mode][1]);
            }
        }
        *end = state;
    }
}

/// To one sample of a block.
struct AdvanceOnce<'a, const N: usize> {
    modal: &'a Modal,
    steps: &'a mut Room,
    line: &'a Timeline,
    block: usize,
    sample: usize,
    states: &'a mut Room,
    end: &'a mut Room,
}

impl<const N: usize> WithSimd for AdvanceOnce<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { modal, steps, line, block, sample, states, end } = self;
        let components = line.components.len();
        let at = block * BLOCK + sample;
        let kind = match &line.kinds {
            Some(kinds) => kinds[at] as usize,
            None => {
                let lengths = core::slice::from_ref(&line.intervals[at]);
                simd.vectorize(Steps { lengths, modal, to: &mut *steps });
                0
            }
        };
        let steps = steps.vectors::<S>().as_chunks::<2>().0.as_chunks::<N>().0;
        let Some((step, by_input)) = steps[kind * (1 + components)..][..1 + components].split_first() else {
            return;
        };
        let Some(end) = end.vectors_mut::<S>().as_chunks_mut::<2>().0.first_chunk_mut::<N>() else { return };
        if at < line.count {
            *end = advanced(simd, step, by_input, &line.changes[at * components..(at + 1) * components], end);
        }
        let states = states.vectors_mut::<S>().as_chunks_mut::<BLOCK>().0.as_chunks_mut::<2>().0;
        for (states, end) in states.iter_mut().zip(end) {
            (states[0][sample], states[1][sample]) = (end[0], end[1]);
        }
    }
}

/// One step: see [`Steps`].
#[inline(always)]
fn advanced<S: Simd, const N: usize>(
    simd: S,
    step: &[[S::f64s; 2]; N],
    by_input: &[[[S::f64s; 2]; N]],
    changes: &[f64],
    state: &[[S::f64s; 2]; N],
) -> [[S::f64s; 2]; N] {
    // What the excitation adds first, as it is known before the state.
    let zero = Real::splat(simd, 0.0);
    let mut rise = [Complex::new(zero, zero); N];
    for (index, (by_input, &change)) in by_input.iter().zip(changes).enumerate() {
        let change = Real::splat(simd, change);
        for mode in 0..N {
            let by_input = Complex::of(simd, by_input[mode]);
            rise[mode] = if index == 0 {
                by_input.scale(change)
            } else {
                Complex::new(
                    by_input.re.mul_add(change, rise[mode].re),
                    by_input.im.mul_add(change, rise[mode].im),
                )
            };
        }
    }
    for mode in 0..N {
        rise[mode] = Complex::of(simd, step[mode]).mul_add(Complex::of(simd, state[mode]), rise[mode]);
    }
    let mut next = *state;
    for mode in 0..N {
        next[mode] = (Complex::of(simd, state[mode]) + rise[mode]).lanes();
    }
    next
}
