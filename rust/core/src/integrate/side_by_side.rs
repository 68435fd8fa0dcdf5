//! Runs of some preloaded scenes side by side by the exponential method, all through the same instants.
//!
//! Steps over whole intervals of the usual length are made in vector lanes. In the others, and where the error of such a step is too large, each
//! scene steps by itself. Which of them it does depends on the scene alone, and both compute the same bits.

use pulp::{Arch, Simd, WithSimd};

use super::control::Control;
use super::exact::CACHED_STEPS;
use super::exponential::{Exponential, KINK};
use super::method::{Method, Output};
use super::run::Setup;
use super::start::Start;
use super::step_loop::Runner;
use super::switched::{SwitchedEquations, Unswitched};
use crate::equations::{
    BallScenes, Equations, Forces, Propagators, Remainder, Remainders, SmoothEquations, States, number, plus,
};
use crate::error::RunError;
use crate::excitation::{Forcing, ScaledExcitation, Values};
use crate::numeric::float::add_scaled;
use crate::numeric::simd::{Kernel, dispatch};
use crate::output::Record;
use crate::system::{Force, NO_FORCE, State, System};

type ByItself = Exponential<CACHED_STEPS>;

/// Most scenes side by side: the lanes of the widest vectors.
pub(crate) const MAX_SCENES: usize = 8;

/// An error of a scene at the same index.
type Failures = [Option<RunError>; MAX_SCENES];

const NO_FAILURES: Failures = [const { None }; MAX_SCENES];

/// Number of scenes that run side by side: one in each lane of the widest vectors of the processor.
pub(crate) fn scenes_side_by_side() -> usize {
    struct Count;

    impl WithSimd for Count {
        type Output = usize;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F64_LANES
        }
    }

    Arch::new().dispatch(Count)
}

/// A run of one of the scenes.
pub(crate) struct SceneRun<'a> {
    pub system: &'a System,
    pub start: Start,
    pub scaled: ScaledExcitation<'a>,
    pub record: &'a mut dyn Record,
}

/// Runs up to [`scenes_side_by_side`] preloaded scenes through all samples; their final states. `usual`: the interval between samples to be made in lanes,
/// s. All excitations have the same times.
///
/// # Errors
/// For each scene, those of [`super::run`].
pub(crate) fn run_side_by_side(runs: Vec<SceneRun>, rtol: f64, usual: f64) -> Vec<Result<State, RunError>> {
    let method = &Exponential::<CACHED_STEPS>;
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
                scenes.push(Scene { runner, forcing, state, values: [0.0; 9], due: None, place: ends.len() });
                ends.push(Ok(state));
            }
            Err(error) => ends.push(Err(error)),
        }
    }
    if !scenes.is_empty() {
        Arch::new().dispatch(RunKernel { scenes: &mut scenes, modes, usual, ends: &mut ends });
    }
    ends
}

/// A run in progress.
struct Scene<'a, 'e> {
    runner: Runner<'a, ByItself, Unswitched<'e, SmoothEquations<'e>>>,
    forcing: Forcing,
    state: State,
    /// Of the excitation at the last sample.
    values: Values,
    /// The sample of the state, if it is not recorded yet.
    due: Option<usize>,
    /// Index of the run.
    place: usize,
}

impl Scene<'_, '_> {
    /// Records the state, if that is due. (Vectors of numbers that were stored one by one just before would wait for them.)
    #[inline(always)]
    fn record(&mut self) {
        if let Some(k) = self.due.take() {
            self.runner.recorder.sample(k, &self.state);
        }
    }

    /// Modal force of the excitation at sample `k`, whose values it takes.
    #[inline(always)]
    fn force(&mut self, k: usize) -> Force {
        self.forcing.sample(self.runner.recorder.excitation, k, &mut self.values);
        let mut force = NO_FORCE;
        for (column, value) in self.forcing.influence().iter().zip(self.values) {
            add_scaled(&mut force, column, value);
        }
        force
    }
}

/// The step of a scene by itself from sample `k` to the next. `tries`: whether it first tries a single step.
struct StepKernel<'s, 'a, 'e> {
    scene: &'s mut Scene<'a, 'e>,
    k: usize,
    tries: bool,
}

impl Kernel for StepKernel<'_, '_, '_> {
    type Output = Result<(), RunError>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Scene { runner, forcing, state, values, .. } = self.scene;
        let (mut next, mut to) = ([0.0; 12], [0.0; 9]);
        forcing.sample(runner.recorder.excitation, self.k, values);
        let (mut at, mut other, mut from, mut until) = (&mut *state, &mut next, &mut *values, &mut to);
        let (states, ends) = ([&mut at, &mut other], [&mut from, &mut until]);
        if !self.tries || !runner.whole_interval(forcing, self.k, states, ends)? {
            runner.interval(forcing, self.k, [&mut at, &mut other], [&mut from, &mut until])?;
        }
        *state = *at;
        Ok(())
    }
}

/// Scenes of at most N modes in lanes. Unused lanes repeat the last scene.
struct Group<S: Simd, const N: usize> {
    simd: S,
    h: f64,
    propagators: Propagators<S, N>,
    balls: BallScenes<S, N>,
    weight: States<S>,
    states: States<S>,
    /// At the states.
    remainders: Remainders<S>,
    /// Modal force of the excitation there, and at the next sample. (A vector that is loaded right after its numbers were stored one by one
    /// waits for them.)
    force: [Forces<S>; 2],
}

impl<S: Simd, const N: usize> Group<S, N> {
    /// The scenes at sample `k` for steps of `h` s, once all have propagators of this length; none if their links differ in kind.
    #[inline(never)]
    fn new(simd: S, scenes: &mut [Scene], h: f64, k: usize) -> Option<Box<Self>> {
        let last = scenes.len() - 1;
        let places = (0..S::F64_LANES).map(|lane| usize::min(lane, last));
        let balls = BallScenes::new(simd, places.clone().map(|s| scenes[s].runner.equations.equations()))?;
        let mut each = Vec::with_capacity(scenes.len());
        for scene in &mut *scenes {
            each.push(*scene.runner.memory.propagator(h, scene.runner.equations.equations().key())?);
        }
        let zero = simd.splat_f64s(0.0);
        let mut group = Box::new(Self {
            simd,
            h,
            propagators: Propagators::new(simd, places.clone().map(|s| &each[s])),
            balls,
            weight: [zero; 12],
            states: [zero; 12],
            remainders: Remainders::none(simd),
            force: [[zero; 6]; 2],
        });
        for (lane, s) in places.enumerate() {
            let weights = scenes[s].runner.steps.norm.weight();
            for (weight, one) in group.weight.iter_mut().zip(weights) {
                *number::<S>(weight, lane) = *one;
            }
        }
        group.take(scenes, k);
        Some(group)
    }

    /// Takes the states of all scenes, at sample `k`.
    #[inline(always)]
    fn take(&mut self, scenes: &mut [Scene], k: usize) {
        for (s, scene) in scenes.iter_mut().enumerate() {
            self.set(s, scene);
        }
        self.force = [self.forces(scenes, k), self.forces(scenes, k + 1)];
    }

    /// Modal forces of the excitation at sample `k`, or at the last one before it.
    #[inline(always)]
    fn forces(&self, scenes: &mut [Scene], k: usize) -> Forces<S> {
        let [_, mut forces] = self.force;
        let k = usize::min(k, scenes[0].runner.recorder.excitation.count() - 1);
        for (s, scene) in scenes.iter_mut().enumerate() {
            let one = scene.force(k);
            for i in 0..6 {
                *number::<S>(&mut forces[i], s) = one[i];
            }
        }
        forces
    }

    /// Takes the state of a scene.
    #[inline(always)]
    fn set(&mut self, s: usize, scene: &Scene) {
        for (entry, one) in self.states.iter_mut().zip(scene.state) {
            *number::<S>(entry, s) = one;
        }
        let Runner { memory, equations, .. } = &scene.runner;
        self.remainders.set(s, &memory.start(equations.equations(), &scene.state));
    }

    /// Hands the nonlinear loads at the states to the scenes that stepped in lanes.
    fn hand_over(&mut self, scenes: &mut [Scene]) {
        for (s, scene) in scenes.iter_mut().enumerate() {
            if scene.runner.steps.was_whole {
                scene.runner.memory.set_end(&scene.state, self.remainders.one(s));
            }
        }
    }

    /// Steps all scenes from sample `k` to the next. An error is that of the scene at the same index.
    #[inline(always)]
    fn advance(&mut self, scenes: &mut [Scene], k: usize) -> Failures {
        for scene in &mut *scenes {
            scene.record();
        }
        let after = self.forces(scenes, k + 2);
        let mut errors = self.step();
        self.force = [self.force[1], after];
        let mut failures = NO_FAILURES;
        for (s, scene) in scenes.iter_mut().enumerate() {
            let error = *number::<S>(&mut errors, s);
            let tried = match scene.runner.look_up_budget(k, &scene.state) {
                Ok(()) => scene.runner.may_be_whole(self.h),
                Err(failure) => {
                    failures[s] = Some(failure);
                    continue;
                }
            };
            if tried && scene.runner.is_whole(self.h, error) {
                for (one, entry) in scene.state.iter_mut().zip(&mut self.states) {
                    *one = *number::<S>(entry, s);
                }
                scene.due = Some(k + 1);
                continue;
            }
            if tried {
                // As after a step that the scene tried by itself.
                scene.runner.memory.set_end(&[f64::NAN; 12], Remainder::NONE);
            }
            failures[s] = step_by_itself(scene, k, false).err();
            self.set(s, scene);
        }
        failures
    }

    /// Steps all states to the next sample; returns the errors. See `exponential` for the scheme.
    #[inline(always)]
    fn step(&mut self) -> S::f64s {
        let (simd, start) = (self.simd, &self.remainders);
        let [zero, h, two, three] = [0.0, self.h, 2.0, 3.0].map(
            #[inline(always)]
            |x| simd.splat_f64s(x),
        );
        let [now, mut rise] = self.force;
        let first = plus(simd, now, &start.force);
        for i in 0..N {
            rise[i] = simd.mul_add_f64s(start.rate[i], h, simd.sub_f64s(rise[i], now[i]));
        }
        let tangent = self.propagators.apply(simd, &self.states, [&first, &rise]);
        let found = self.balls.remainder(simd, &tangent);
        let (mut quadratic, mut cubic) = ([zero; 6], [zero; 6]);
        let (mut moved, mut grown) = (zero, zero);
        for i in 0..N {
            let along = simd.mul_add_f64s(h, start.rate[i], start.force[i]);
            let value = simd.sub_f64s(found.force[i], along);
            let slope = simd.mul_f64s(h, simd.sub_f64s(found.rate[i], start.rate[i]));
            quadratic[i] = simd.sub_f64s(simd.mul_f64s(three, value), slope);
            cubic[i] = simd.sub_f64s(slope, simd.mul_f64s(two, value));
            let way = simd.sub_f64s(tangent[i], self.states[i]);
            let growth = simd.sub_f64s(found.force[i], start.force[i]);
            moved = simd.mul_add_f64s(way, way, moved);
            grown = simd.mul_add_f64s(growth, growth, grown);
        }
        let [correction, by_rate] = self.propagators.curved(simd, [&quadratic, &cubic]);
        let kept = simd.equal_f64s(found.open_rows, start.open_rows);
        let kink = simd.select_f64s(kept, zero, simd.splat_f64s(KINK));
        let slopes = simd.mul_f64s(h, simd.sqrt_f64s(simd.div_f64s(grown, moved)));
        let slopes = simd.select_f64s(simd.less_than_f64s(zero, moved), slopes, zero);
        let (contraction, mut sum) = (simd.add_f64s(kink, slopes), zero);
        for i in (0..12).filter(
            #[inline(always)]
            |i| i % 6 < N,
        ) {
            let error =
                simd.mul_add_f64s(contraction, simd.abs_f64s(correction[i]), simd.abs_f64s(by_rate[i]));
            let load = simd.mul_f64s(self.weight[i], error);
            sum = simd.add_f64s(sum, simd.mul_f64s(load, load));
        }
        (self.states, self.remainders) = (plus(simd, tangent, &correction), found);
        simd.sqrt_f64s(sum)
    }
}

/// Steps a scene by itself from sample `k` to the next. `tries`: whether it first tries a single step.
#[inline(never)]
fn step_by_itself(scene: &mut Scene, k: usize, tries: bool) -> Result<(), RunError> {
    dispatch(StepKernel { scene, k, tries })
}

/// [`run_side_by_side`] as a kernel, from the start on.
struct RunKernel<'r, 'a, 'e> {
    scenes: &'r mut Vec<Scene<'a, 'e>>,
    modes: usize,
    usual: f64,
    ends: &'r mut [Result<State, RunError>],
}

impl WithSimd for RunKernel<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // Most bodies have five modes, as the drive holds x.
        if self.modes <= 5 { self.run::<S, 5>(simd) } else { self.run::<S, 6>(simd) }
    }
}

impl RunKernel<'_, '_, '_> {
    #[inline(always)]
    fn run<S: Simd, const N: usize>(self, simd: S) {
        let Self { scenes, usual, ends, .. } = self;
        let excitation = scenes[0].runner.recorder.excitation;
        for scene in scenes.iter_mut() {
            scene.runner.recorder.first_sample(&scene.state);
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
                        group.hand_over(scenes);
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
                group.hand_over(scenes);
            }
            for s in (0..scenes.len()).rev() {
                if let Some(error) = &failures[s] {
                    ends[scenes.remove(s).place] = Err(error.clone());
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
