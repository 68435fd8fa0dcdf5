//! Linear scenes in vector lanes: one scene in each lane, with the widest vectors of the processor.
//!
//! Files in the order of the data: `vector`, `aligned_buffer` (numbers in lanes, memory for them) → `request`
//! → `assemble`, `dense`, `jacobi` → `undamped` → `damped` → `modal` (from scenes to damped modes), with `handover` (the state at a change of
//! payload); `timeline` (the motion), `drawn` (the motion of each scene) → `step` → `integrate` (from sample to sample, with `memory`) →
//! `loads` → `time_statistics` with `linear_power`, `power_integral` and `nonlinear_intervals`; for extremes between the samples, `bows` → `waiting` → `search` with `curve`. The results
//! of a scene have the same bits in any lane of any width, beside any other scenes. See `numeric::simd` for why these files use `pulp`.

mod aligned_buffer;
mod assemble;
mod block;
mod bows;
mod curve;
mod damped;
mod dense;
mod drawn;
mod handover;
mod integrate;
mod jacobi;
mod linear_power;
mod loads;
mod means;
mod memory;
mod modal;
mod nonlinear_intervals;
mod power_integral;
mod request;
mod search;
mod step;
mod time_statistics;
mod timeline;
mod undamped;
mod vector;
mod waiting;

use pulp::{Scalar, Simd, WithSimd};

use super::requirements::{Requirements, SignalRequest};
use super::time_statistics::RunningStatistics;
use super::windows::Window;
use crate::excitation::Excitation;
use crate::integrate::Start;
use crate::numeric::simd::{LaneCount, MAX_LANES, on_widest};
use crate::numeric::watch::Watch;
use crate::variation::{Base, Instance};
pub(super) use drawn::Deviations;
use handover::set_physical_state;
use integrate::LaneIntegrator;
pub(super) use linear_power::LinearPower;
use memory::Memory;
use modal::{ModalScenes, ModalSetup};
use request::ModalRequest;
use timeline::Timeline;
pub(super) use vector::Real;
use vector::vectorize;

/// Width of the vectors in which linear scenes run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Width {
    /// The widest of the processor: 8 lanes with AVX-512, 4 with AVX2 and FMA, 2 with NEON.
    Widest,
    /// 4 lanes with AVX2 and FMA; one lane on a processor without them.
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

/// A batch prepared for lanes.
#[derive(Debug, Clone)]
pub(super) struct Lanes<'a> {
    /// For each window of the motion.
    parts: Vec<(ModalRequest<'a>, Timeline)>,
    only_extremes: bool,
    width: Width,
}

/// Memory of one thread.
#[derive(Debug, Default)]
pub(super) struct LaneMemory {
    modal: ModalScenes,
    memory: Memory,
}

impl<'a> Lanes<'a> {
    /// `drawn`: whether each scene has a motion of its own.
    pub(super) fn new(base: &Base<'a>, windows: &[Window], start: Start, drawn: bool, width: Width) -> Self {
        let part = |window: &Window| {
            let quasi_static = window.first == 0 && start == Start::QuasiStatic;
            let timeline = Timeline::new(&window.excitation, quasi_static, drawn, &window.requirements.time);
            let request = ModalRequest {
                dofs: base.free.iter().map(|dof| dof as usize).collect(),
                groups: base.groups,
                components: timeline.components.clone(),
                first: timeline.values[..timeline.components.len()].to_vec(),
                rows: window.requirements.rows.clone(),
                quasi_static,
                duration: timeline.duration,
            };
            (request, timeline)
        };
        let only_extremes = windows[0].requirements.signals.iter().all(SignalRequest::needs_only_extremes);
        Self { parts: windows.iter().map(part).collect(), only_extremes, width }
    }

    /// The vector width.
    pub(super) fn width(&self) -> Width {
        self.width
    }

    /// Whether scenes in lanes can start like this. A given state is one of single scenes.
    pub(super) fn can_start(&self, start: Start) -> bool {
        matches!(start, Start::AtRest | Start::QuasiStatic)
    }

    /// Number of scenes that run at a time.
    pub(super) fn count(&self) -> usize {
        self.dispatch(LaneCount)
    }

    /// Runs up to [`Lanes::count`] scenes with linear links. `deviations`: of the motion of each of them, if they are drawn.
    /// With meaningless results if the watch stops it.
    pub(super) fn run(
        &self,
        windows: &[Window],
        scenes: &[&Instance],
        deviations: Option<Deviations>,
        memory: &mut LaneMemory,
        watch: Watch,
    ) {
        self.dispatch(Run { lanes: self, windows, scenes, deviations, memory, watch });
    }

    /// Writes the statistics of each signal of a scene of the last run through the excitation. False if rounding in the lanes leaves too few
    /// digits; such a scene must run by itself.
    pub(super) fn statistics(
        &self,
        requirements: &Requirements,
        excitation: &Excitation,
        memory: &LaneMemory,
        lane: usize,
        out: &mut Vec<RunningStatistics>,
    ) -> bool {
        let lanes = self.count();
        let LaneMemory { modal, memory } = memory;
        let finite = (0..2 * self.parts[0].0.dofs.len()).all(|i| memory.end.lane(i, lane, lanes).is_finite());
        let finite =
            time_statistics::statistics(requirements, excitation, &memory.found, lane, lanes, out) && finite;
        finite && modal.accurate.lane(0, lane, lanes) > 0.0
    }

    fn dispatch<Op: WithSimd>(&self, op: Op) -> Op::Output {
        match self.width {
            Width::Widest => on_widest(op),
            #[cfg(target_arch = "x86_64")]
            Width::Four => match pulp::x86::V3::try_new() {
                Some(simd) => Simd::vectorize(simd, op),
                None => Simd::vectorize(Scalar, op),
            },
            _ => Simd::vectorize(Scalar, op),
        }
    }
}

/// [`Lanes::run`] with the vectors of a processor.
struct Run<'a, 'b> {
    lanes: &'a Lanes<'b>,
    windows: &'a [Window<'b>],
    scenes: &'a [&'a Instance],
    deviations: Option<Deviations<'a>>,
    memory: &'a mut LaneMemory,
    watch: Watch<'a>,
}

impl WithSimd for Run<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { lanes, windows, scenes, deviations, memory, watch } = self;
        let LaneMemory { modal, memory } = memory;
        // Unused lanes repeat the last scene.
        let mut all = [scenes[scenes.len() - 1]; MAX_LANES];
        all[..scenes.len()].copy_from_slice(scenes);
        for (index, (window, (request, timeline))) in windows.iter().zip(&lanes.parts).enumerate() {
            let bodies = all.map(|scene| scene.carrying(&window.payloads));
            let kept = (index > 0).then(|| all.map(|scene| scene.carrying(&window.kept)));
            let continues = index + 1 < windows.len();
            let scenes = &all;
            let deviations = deviations.map(|all| all.from(window.first));
            let mut setup = ModalSetup {
                scenes,
                bodies: &bodies,
                deviations,
                kept: kept.as_ref().map(|kept| &kept[..]),
                continues,
                request,
                to: modal,
            };
            vectorize!(simd, setup.compute(simd));
            let mut integrator = LaneIntegrator {
                modal,
                timeline,
                deviations,
                requirements: &window.requirements,
                first: window.first,
                only_extremes: lanes.only_extremes,
                memory,
                watch,
            };
            vectorize!(simd, integrator.run(simd));
            if continues {
                let ModalScenes { drive, state_rows, state, .. } = modal;
                let drawn = deviations.is_some().then_some(&memory.drawn);
                let end = &memory.end;
                vectorize!(simd, set_physical_state(simd, drive, state_rows, timeline, drawn, end, state));
            }
        }
    }
}
