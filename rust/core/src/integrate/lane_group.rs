//! Scenes in vector lanes: their states, and the step of all of them at once.

use pulp::Simd;

use super::exponential::KINK;
use super::lane_scene::{Failures, NO_FAILURES, Scene, step_by_itself};
use super::step_loop::Runner;
use crate::contacts::SwitchedEquations;
use crate::equations::{
    BallScenes, Equations, Forces, Propagators, Remainder, Remainders, States, number, plus,
};

/// Scenes of at most N modes in lanes. Unused lanes repeat the last scene.
pub(super) struct Group<S: Simd, const N: usize> {
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
    pub(super) fn new(simd: S, scenes: &mut [Scene], h: f64, k: usize) -> Option<Box<Self>> {
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
    pub(super) fn take(&mut self, scenes: &mut [Scene], k: usize) {
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

    /// Hands the nonlinear loads at sample `k` to the scenes that stepped in lanes. The lanes of scenes that vibrate freely hold others.
    pub(super) fn hand_over(&mut self, scenes: &mut [Scene], k: usize) {
        for (s, scene) in scenes.iter_mut().enumerate() {
            if scene.runner.steps.was_whole && k >= scene.free_until {
                scene.runner.memory.set_end(&scene.state, self.remainders.one(s));
            }
        }
    }

    /// Steps all scenes from sample `k` to the next. An error is that of the scene at the same index.
    #[inline(always)]
    pub(super) fn advance(&mut self, scenes: &mut [Scene], k: usize) -> Failures {
        for scene in &mut *scenes {
            scene.record();
        }
        let all_free = scenes.iter().all(
            #[inline(always)]
            |scene| k + 1 < scene.free_until,
        );
        if all_free {
            return NO_FAILURES; // The forces are the same up to sample k + 2.
        }
        let after = self.forces(scenes, k + 2);
        let mut errors = self.step();
        self.force = [self.force[1], after];
        let mut failures = NO_FAILURES;
        for (s, scene) in scenes.iter_mut().enumerate() {
            if k < scene.free_until {
                if k + 1 == scene.free_until {
                    self.set(s, scene);
                }
                continue;
            }
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
                scene.unrecorded = Some(k + 1);
                scene.vibrate_freely(k + 1);
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
        let kept = simd.equal_f64s(found.contact_signature, start.contact_signature);
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
