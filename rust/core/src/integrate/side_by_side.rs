//! Runs of some preloaded scenes side by side by the exponential method, all through the same instants.
//!
//! Steps over whole intervals of the usual length are made in vector lanes. In the others, and where the error of such a step is too large,
//! each scene steps by itself. Which of them it does depends on the scene alone, and both compute the same bits.

use pulp::{Simd, WithSimd};

use super::control::Control;
use super::exponential::Exponential;
use super::lane_group::Group;
use super::lane_scene::{NO_FAILURES, Scene, step_by_itself};
use super::method::{Method, Output};
use super::run::Setup;
use super::start::Start;
use crate::contacts::Unswitched;
use crate::equations::SmoothEquations;
use crate::error::RunError;
use crate::excitation::ScaledExcitation;
use crate::numeric::simd::{LaneCount, on_widest};
use crate::output::Record;
use crate::system::{State, System};

/// Number of scenes that run side by side: one in each lane of the widest vectors of the processor.
pub(crate) fn scenes_side_by_side() -> usize {
    on_widest(LaneCount)
}

/// A run of one of the scenes.
pub(crate) struct SceneRun<'a> {
    pub system: &'a System,
    pub start: Start,
    pub scaled: ScaledExcitation<'a>,
    pub record: &'a mut dyn Record,
}

/// Runs up to [`scenes_side_by_side`] preloaded scenes through all samples; their final states. `usual`: the interval between samples to be
/// made in lanes, s. All excitations have the same times.
///
/// # Errors
/// For each scene, those of [`super::run`].
pub(crate) fn run_side_by_side(runs: Vec<SceneRun>, rtol: f64, usual: f64) -> Vec<Result<State, RunError>> {
    let method = &Exponential;
    let modes = runs.iter().map(|run| run.system.mode_count()).max().unwrap_or(0);
    let equations: Vec<SmoothEquations> =
        runs.iter().map(|run| SmoothEquations::at_rest(run.system, run.scaled.excitation)).collect();
    let mut unswitched: Vec<Unswitched<SmoothEquations>> = equations.iter().map(Unswitched).collect();
    let mut memories: Vec<_> = runs.iter().map(|_| method.memory()).collect();
    let mut ends = Vec::with_capacity(runs.len());
    let mut scenes = Vec::with_capacity(runs.len());
    let control = Control::Adaptive { rtol };
    for ((run, equations), memory) in runs.into_iter().zip(&mut unswitched).zip(&mut memories) {
        let SceneRun { system, start, scaled, record } = run;
        match Setup::new(system, method, control, start, &scaled, Output::Samples, record) {
            Ok(setup) => {
                let (forcing, state) = (setup.forcing, setup.start);
                let runner = setup.runner(memory, equations);
                let (values, unrecorded, free_until, place) = ([0.0; 9], None, 0, ends.len());
                scenes.push(Scene { runner, forcing, state, values, unrecorded, free_until, place });
                ends.push(Ok(state));
            }
            Err(error) => ends.push(Err(error)),
        }
    }
    if !scenes.is_empty() {
        let (scenes, ends) = (&mut scenes, &mut ends[..]);
        // Most bodies have five modes, as the drive holds x.
        if modes <= 5 {
            on_widest(RunKernel::<5> { scenes, usual, ends });
        } else {
            on_widest(RunKernel::<6> { scenes, usual, ends });
        }
    }
    ends
}

/// [`run_side_by_side`] as a kernel, from the start on, for scenes of at most N modes.
struct RunKernel<'r, 'a, 'e, const N: usize> {
    scenes: &'r mut Vec<Scene<'a, 'e>>,
    usual: f64,
    ends: &'r mut [Result<State, RunError>],
}

impl<const N: usize> WithSimd for RunKernel<'_, '_, '_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { scenes, usual, ends } = self;
        let excitation = scenes[0].runner.recorder.excitation;
        for scene in scenes.iter_mut() {
            scene.runner.recorder.sample(0, &scene.state);
        }
        let mut group = None;
        for k in 0..excitation.count() - 1 {
            let is_usual = excitation.interval(k) == usual;
            if is_usual && group.is_none() {
                group = Group::<S, N>::new(simd, scenes, usual, k);
            }
            let failures = match &mut group {
                Some(group) if is_usual => group.advance(scenes, k),
                _ => {
                    let mut failures = NO_FAILURES;
                    if let Some(group) = &mut group {
                        group.hand_over(scenes, k);
                    }
                    for (failure, scene) in failures.iter_mut().zip(scenes.iter_mut()) {
                        scene.record();
                        *failure = step_by_itself(scene, k, true).err();
                    }
                    if let Some(group) = &mut group {
                        group.take(scenes, k + 1);
                    }
                    failures
                }
            };
            if failures.iter().all(Option::is_none) {
                continue;
            }
            // The others go on in another group.
            if let Some(mut group) = group.take() {
                group.hand_over(scenes, k + 1);
            }
            for s in (0..scenes.len()).rev() {
                if let Some(error) = &failures[s] {
                    ends[scenes.remove(s).place] = Err(*error);
                }
            }
            if scenes.is_empty() {
                return;
            }
        }
        for mut scene in scenes.drain(..) {
            scene.record();
            ends[scene.place] = scene.runner.end(&scene.state).map(|summary| summary.end);
        }
    }
}
