//! The lane integrator: many linear scenes, one in each lane, from block to block of a motion.

use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::curve::Scenes;
use super::drawn::{self, CHANGES, Deviations, set_block};
use super::loads::{BoundPlan, evaluate};
use super::means::{set_means, tiles_with_means};
use super::memory::{Memory, STATISTICS};
use super::modal::{ModalScenes, TILE};
use super::search::Search;
use super::step::set_steps;
use super::time_statistics::{nothing, reduce};
use super::timeline::{BLOCK, Timeline};
use super::vector::{Complex, Real, vectorize};
use crate::batch::requirements::Requirements;
use crate::numeric::watch::Watch;

/// Runs one scene per lane through a motion.
pub(super) struct LaneIntegrator<'a> {
    pub modal: &'a ModalScenes,
    pub timeline: &'a Timeline,
    /// Deviations of the motion of each scene, if they are drawn.
    pub deviations: Option<Deviations<'a>>,
    pub requirements: &'a Requirements,
    /// Index of the first sample of the window in the motion.
    pub first: usize,
    /// Whether nothing but extremes is needed, so that blocks without new ones need not be evaluated.
    pub only_extremes: bool,
    pub memory: &'a mut Memory,
    pub watch: Watch<'a>,
}

impl LaneIntegrator<'_> {
    #[inline(always)]
    pub(super) fn run<S: Simd>(&mut self, simd: S) {
        let &mut Self {
            modal,
            timeline,
            deviations,
            requirements,
            first,
            only_extremes,
            ref mut memory,
            watch,
        } = self;
        let rows = modal.rows.next_multiple_of(TILE);
        if first == 0 {
            let found = memory.found.clear::<S>(requirements.signals.len() * STATISTICS);
            for place in found.as_chunks_mut::<STATISTICS>().0 {
                *place = nothing(simd);
            }
        }
        let start = modal.start.vectors::<S>();
        memory.end.clear::<S>(start.len()).copy_from_slice(start);
        memory.states.clear::<S>(start.len() * BLOCK);
        memory.before.clear::<S>(start.len());
        memory.values.clear::<S>(rows * BLOCK);
        memory.extremes.clear::<S>(rows * 2);
        memory.last.clear::<S>(rows);
        memory.has_means = tiles_with_means(requirements, rows / TILE);
        memory.mean_states.clear::<S>(start.len() * BLOCK);
        memory.means.clear::<S>(rows * BLOCK);
        // A run that was stopped leaves some.
        memory.waiting.clear();
        memory.evaluated.clear();
        memory.evaluated.resize(rows / TILE, true);
        memory.counts.clear();
        memory.counts.resize(requirements.signals.len(), true);
        memory.drawn.clear::<S>(if deviations.is_some() { drawn::SIZE } else { 0 });
        set_steps(simd, &timeline.lengths, modal, &mut memory.steps);
        let steps = BlockSteps::of(start.len() / 2, deviations.is_some());
        let mut plan = BoundPlan::default();
        for block in 0..timeline.blocks() {
            if watch.stops_at(block) {
                return;
            }
            if let Some(deviations) = deviations {
                vectorize!(simd, set_block(simd, deviations, timeline, block, &mut memory.drawn));
            }
            memory.before.vectors_mut::<S>().copy_from_slice(memory.end.vectors::<S>());
            (steps.advance)(simd, modal, timeline, block, memory);
            let is_bounded = only_extremes && block > 0 && plan.bounds_next();
            let bounded = is_bounded.then_some(requirements);
            let all = (steps.evaluate)(simd, modal, timeline, block, bounded, memory);
            if is_bounded {
                plan.note(all);
            }
            if requirements.travel.as_ref().is_some_and(|travel| travel.moves(block * BLOCK, BLOCK)) {
                (steps.set_means)(simd, modal, timeline, block, memory);
            }
            vectorize!(simd, reduce(simd, requirements, modal, timeline, block, first, memory));
        }
        let Memory { waiting, found, .. } = memory;
        let scenes = Scenes { modal, timeline, deviations, requirements };
        Search { scenes, first, waiting, found }.run(simd);
    }
}

/// What is compiled for each number of modes, and for drawn motions. The rest of the loop is not: closures in a generic function are compiled
/// for each of its parameters, whether they depend on them or not.
struct BlockSteps<S: Simd> {
    advance: fn(S, &ModalScenes, &Timeline, usize, &mut Memory),
    evaluate: fn(S, &ModalScenes, &Timeline, usize, Option<&Requirements>, &mut Memory) -> bool,
    set_means: fn(S, &ModalScenes, &Timeline, usize, &mut Memory),
}

impl<S: Simd> BlockSteps<S> {
    fn of(modes: usize, is_drawn: bool) -> Self {
        match modes {
            1 => Self::with::<1>(is_drawn),
            2 => Self::with::<2>(is_drawn),
            3 => Self::with::<3>(is_drawn),
            4 => Self::with::<4>(is_drawn),
            5 => Self::with::<5>(is_drawn),
            _ => Self::with::<6>(is_drawn),
        }
    }

    fn with<const N: usize>(is_drawn: bool) -> Self {
        if is_drawn { Self::compiled::<N, true>() } else { Self::compiled::<N, false>() }
    }

    fn compiled<const N: usize, const DRAWN: bool>() -> Self {
        Self {
            advance: advance::<S, N, DRAWN>,
            evaluate: evaluate_block::<S, DRAWN>,
            set_means: set_block_means::<S, DRAWN>,
        }
    }
}

/// [`evaluate`] in a function of its own.
fn evaluate_block<S: Simd, const DRAWN: bool>(
    simd: S,
    modal: &ModalScenes,
    timeline: &Timeline,
    block: usize,
    bounded: Option<&Requirements>,
    memory: &mut Memory,
) -> bool {
    vectorize!(simd, evaluate::<S, DRAWN>(simd, modal, timeline, block, bounded, memory))
}

/// [`set_means`] in a function of its own.
fn set_block_means<S: Simd, const DRAWN: bool>(
    simd: S,
    modal: &ModalScenes,
    timeline: &Timeline,
    block: usize,
    memory: &mut Memory,
) {
    vectorize!(simd, set_means::<S, DRAWN>(simd, modal, timeline, block, memory));
}

/// Advances from sample to sample of a block.
fn advance<S: Simd, const N: usize, const DRAWN: bool>(
    simd: S,
    modal: &ModalScenes,
    timeline: &Timeline,
    block: usize,
    memory: &mut Memory,
) {
    if let Some(kind) = timeline.kind(block) {
        vectorize!(simd, advance_evenly::<S, N, DRAWN>(simd, kind, timeline, block, memory));
    } else {
        for sample in 0..BLOCK {
            vectorize!(simd, advance_once::<S, N, DRAWN>(simd, modal, timeline, block, sample, memory));
        }
    }
}

/// Advances from sample to sample of a block with one interval length.
#[inline(always)]
fn advance_evenly<S: Simd, const N: usize, const DRAWN: bool>(
    simd: S,
    kind: usize,
    timeline: &Timeline,
    block: usize,
    memory: &mut Memory,
) {
    let Memory { steps, drawn, states, end, .. } = memory;
    let components = timeline.components.len();
    let steps = steps.vectors::<S>().as_chunks::<2>().0.as_chunks::<N>().0;
    let Some((step, by_input)) = steps[kind * (1 + components)..][..1 + components].split_first() else {
        return;
    };
    let changes = &timeline.changes[block * BLOCK * components..][..BLOCK * components];
    let Some(end) = end.vectors_mut::<S>().as_chunks_mut::<2>().0.first_chunk_mut::<N>() else { return };
    let states = states.vectors_mut::<S>().as_chunks_mut::<BLOCK>().0.as_chunks_mut::<2>().0;
    let Some(states) = states.first_chunk_mut::<N>() else { return };
    let inside = usize::min(BLOCK, timeline.count - block * BLOCK);
    let mut state = *end;
    // A separate loop for the usual case of one component, whose count the compiler knows.
    if let [by_input] = by_input {
        let Some(changes) = changes.first_chunk::<BLOCK>() else { return };
        for k in 0..inside {
            let (by_input, changes) = (core::slice::from_ref(by_input), &changes[k..k + 1]);
            let drawn = drawn_change::<S, DRAWN>(simd, drawn, k);
            state = advanced::<S, N, DRAWN>(simd, step, by_input, changes, drawn, &state);
            for mode in 0..N {
                (states[mode][0][k], states[mode][1][k]) = (state[mode][0], state[mode][1]);
            }
        }
    } else {
        for k in 0..inside {
            let changes = &changes[k * components..(k + 1) * components];
            let drawn = drawn_change::<S, DRAWN>(simd, drawn, k);
            state = advanced::<S, N, DRAWN>(simd, step, by_input, changes, drawn, &state);
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

/// Advances to one sample of a block, with an interval length of its own.
#[inline(always)]
fn advance_once<S: Simd, const N: usize, const DRAWN: bool>(
    simd: S,
    modal: &ModalScenes,
    timeline: &Timeline,
    block: usize,
    sample: usize,
    memory: &mut Memory,
) {
    let Memory { steps, drawn, states, end, .. } = memory;
    let components = timeline.components.len();
    let at = block * BLOCK + sample;
    let kind = match &timeline.kinds {
        Some(kinds) => kinds[at] as usize,
        None => {
            let lengths = core::slice::from_ref(&timeline.intervals[at]);
            set_steps(simd, lengths, modal, &mut *steps);
            0
        }
    };
    let steps = steps.vectors::<S>().as_chunks::<2>().0.as_chunks::<N>().0;
    let Some((step, by_input)) = steps[kind * (1 + components)..][..1 + components].split_first() else {
        return;
    };
    let Some(end) = end.vectors_mut::<S>().as_chunks_mut::<2>().0.first_chunk_mut::<N>() else { return };
    if at < timeline.count {
        let changes = &timeline.changes[at * components..(at + 1) * components];
        let drawn = drawn_change::<S, DRAWN>(simd, drawn, sample);
        *end = advanced::<S, N, DRAWN>(simd, step, by_input, changes, drawn, end);
    }
    let states = states.vectors_mut::<S>().as_chunks_mut::<BLOCK>().0.as_chunks_mut::<2>().0;
    for (states, end) in states.iter_mut().zip(end) {
        (states[0][sample], states[1][sample]) = (end[0], end[1]);
    }
}

/// Change of the first component of the excitation at a sample of a block, if the motion of each scene is drawn.
#[inline(always)]
fn drawn_change<S: Simd, const DRAWN: bool>(simd: S, drawn: &AlignedBuffer, sample: usize) -> S::f64s {
    if DRAWN { drawn.vectors::<S>()[CHANGES + sample] } else { simd.splat_f64s(0.0) }
}

/// One step: see [`set_steps`]. `drawn`: the change of the first component, if the motion of each scene is drawn.
#[inline(always)]
fn advanced<S: Simd, const N: usize, const DRAWN: bool>(
    simd: S,
    step: &[[S::f64s; 2]; N],
    by_input: &[[[S::f64s; 2]; N]],
    changes: &[f64],
    drawn: S::f64s,
    state: &[[S::f64s; 2]; N],
) -> [[S::f64s; 2]; N] {
    // The effect of the excitation first, because it does not depend on the state.
    let zero = Real::splat(simd, 0.0);
    let mut rise = [Complex::new(zero, zero); N];
    for (index, (by_input, &change)) in by_input.iter().zip(changes).enumerate() {
        let change = if DRAWN && index == 0 { Real::new(simd, drawn) } else { Real::splat(simd, change) };
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
