//! Linear scenes side by side in the lanes of vector registers, a scene in each: the widest of the processor at hand, chosen when they run.
//!
//! Files in the order of the data: `vector`, `room` (numbers in lanes, and memory for them), `assemble` → `dense`, `jacobi` → `modal` (from
//! scenes to damped modes), `timeline` (the motion) → `step` → `march` (from sample to sample) → `loads` → `tally` (what is kept of them). A
//! scene gives the same bits in any lane of any width, whatever its neighbours are.

mod assemble;
mod dense;
mod jacobi;
mod loads;
mod march;
mod modal;
mod room;
mod step;
mod tally;
mod timeline;
mod vector;

use pulp::{Arch, Scalar, Simd, WithSimd};

use super::instance::{Base, Instance};
use super::reduce::{Needs, Tally, Track};
use crate::excitation::Excitation;
use march::{March, Memory};
use modal::{Modal, SetUp, Wanted};
use timeline::Timeline;

/// Width of the vectors that linear scenes are run in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// The widest of the processor: 8 lanes with AVX-512, 4 with AVX2 and FMA, 2 with NEON.
    Widest,
    /// 4 lanes, AVX2 and FMA; one where the processor has none.
    Four,
    /// One lane, on any processor.
    One,
}

impl Width {
    /// The width of that name: `widest`, `four` or `one`.
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [("widest", Self::Widest), ("four", Self::Four), ("one", Self::One)];
        all.into_iter().find(|(known, _)| *known == name).map(|(_, width)| width)
    }
}

/// Most lanes of any processor.
pub(super) const MOST_LANES: usize = 8;

/// A batch, ready to be run in lanes.
#[derive(Debug, Clone)]
pub(super) struct Lanes<'a> {
    wanted: Wanted<'a>,
    line: Timeline,
    kept: bool,
    width: Width,
}

/// What one thread owns.
#[derive(Debug, Default)]
pub(super) struct LaneMemory {
    modal: Modal,
    memory: Memory,
}

impl<'a> Lanes<'a> {
    pub(super) fn new(base: &Base<'a>, excitation: &Excitation, needs: &Needs, width: Width) -> Self {
        let line = Timeline::new(excitation, &needs.time, &needs.travel);
        let wanted = Wanted {
            dofs: base.free.iter().map(|dof| dof as usize).collect(),
            groups: base.groups,
            components: line.components.clone(),
            first: line.values[..line.components.len()].to_vec(),
            rows: needs.rows.clone(),
            duration: line.duration,
        };
        let more = |wanted: &super::reduce::Wanted| {
            wanted.times || wanted.squares || !matches!(wanted.track, Track::Row(_))
        };
        Self { wanted, line, kept: needs.tracks.iter().any(more), width }
    }

    /// Scenes that run at a time.
    pub(super) fn count(&self) -> usize {
        self.dispatch(Count)
    }

    /// Runs up to [`Lanes::count`] scenes of linear links.
    pub(super) fn run(&self, needs: &Needs, scenes: &[&Instance], memory: &mut LaneMemory) {
        self.dispatch(Run { lanes: self, needs, scenes, memory });
    }

    /// What is known of a scene of the last run, a track each; false where the lanes are not right to what the arithmetic allows: such a
    /// scene is left to be run by itself.
    pub(super) fn tallies(
        &self,
        needs: &Needs,
        memory: &LaneMemory,
        lane: usize,
        out: &mut Vec<Tally>,
    ) -> bool {
        let lanes = self.count();
        let LaneMemory { modal, memory } = memory;
        let finite = (0..2 * self.wanted.dofs.len()).all(|i| memory.end.lane(i, lane, lanes).is_finite());
        let finite = tally::tallies(needs, &memory.found, lane, lanes, out) && finite;
        finite && modal.sound.lane(0, lane, lanes) > 0.0
    }

    fn dispatch<Op: WithSimd>(&self, op: Op) -> Op::Output {
        match self.width {
            Width::Widest => Arch::new().dispatch(op),
            #[cfg(target_arch = "x86_64")]
            Width::Four => match pulp::x86::V3::try_new() {
                Some(simd) => Simd::vectorize(simd, op),
                None => Simd::vectorize(Scalar, op),
            },
            _ => Simd::vectorize(Scalar, op),
        }
    }
}

/// Number of lanes.
struct Count;

impl WithSimd for Count {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F64_LANES
    }
}

/// [`Lanes::run`] for the processor at hand.
struct Run<'a, 'b> {
    lanes: &'a Lanes<'b>,
    needs: &'a Needs,
    scenes: &'a [&'a Instance],
    memory: &'a mut LaneMemory,
}

impl WithSimd for Run<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.lanes.wanted.dofs.len() {
            1 => self.run::<S, 1>(simd),
            2 => self.run::<S, 2>(simd),
            3 => self.run::<S, 3>(simd),
            4 => self.run::<S, 4>(simd),
            5 => self.run::<S, 5>(simd),
            _ => self.run::<S, 6>(simd),
        }
    }
}

impl Run<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const N: usize>(self, simd: S) {
        let Self { lanes, needs, scenes, memory } = self;
        let LaneMemory { modal, memory } = memory;
        // Lanes without a scene of their own repeat the last one.
        let mut all = [scenes[scenes.len() - 1]; MOST_LANES];
        all[..scenes.len()].copy_from_slice(scenes);
        simd.vectorize(SetUp { scenes: &all, wanted: &lanes.wanted, to: modal });
        simd.vectorize(March::<N> { modal, line: &lanes.line, needs, kept: lanes.kept, memory });
    }
}
