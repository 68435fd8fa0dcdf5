//! Radau IIA, five stages, order 9: implicit, L-stable and stiffly accurate, for scenes of any stiffness.
//!
//! In the eigenvectors of the collocation matrix the stages decouple into `(λ - h A) w = r`, and the second-order structure of A leaves
//! only the velocity half of each: `(λ² + λ h Ĉ + h² S ω) w_v = λ r_v - h S r_s`, one real and two complex systems of n equations. They
//! are inverted once per step length, so all steps of a uniform trace share the inverses.
//!
//! `tangent`: these systems. `newton`: the iteration for equations that are not linear.

mod newton;
mod tangent;
#[cfg(test)]
mod tests;

use super::method::Method;
use super::step_cache::StepCache;
use super::tableau::RADAU;
use crate::equations::{Equations, StageData};
use crate::excitation::Ramp;
use crate::numeric::float::add_scaled;
use crate::system::State;
use newton::LastStep;
use tangent::{NO_STAGE_FORCES, Parts, Tangent, end, stages};

/// The implicit method.
#[derive(Debug, Clone, Copy, Default)]
pub struct Radau;

/// Cached tangents, 2.3 kB each.
const CACHED_TANGENTS: usize = 8;

/// Memory of one run: tangents by step length, and the last step.
#[derive(Debug, Clone)]
pub struct Stages {
    tangents: StepCache<Tangent, CACHED_TANGENTS>,
    parts: Parts,
    last_step: LastStep,
    /// At the start of the step and at the nodes.
    stage_data: StageData,
    /// Differences of the stages from the start of the last step, computed at the first request for dense output.
    dense: Option<[State; 5]>,
}

impl Method for Radau {
    type Memory = Stages;
    const WORK: usize = 8;
    const ERROR_ORDER: Option<u32> = Some(5);
    const STABLE: bool = true;

    fn memory(&self) -> Stages {
        Stages {
            tangents: StepCache::new(),
            parts: [[[0.0; 12]; 2]; 3],
            last_step: LastStep::NONE,
            stage_data: StageData::NONE,
            dense: None,
        }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn step<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Stages,
        ramp: &Ramp,
        state: &State,
    ) -> (State, State) {
        memory.dense = None;
        if !E::LINEAR {
            let Stages { tangents, parts, last_step, stage_data, .. } = memory;
            let place = tangents.entry(ramp.h, equations.key()).0;
            return newton::step(equations, (place, stage_data), parts, last_step, ramp, state);
        }
        let Stages { tangents, parts, stage_data, .. } = memory;
        let place = tangents.entry(ramp.h, equations.key()).0;
        if place.is_none() {
            // Not in a closure, which would be compiled for the oldest processor.
            *place = Some(Tangent::new(equations, state, ramp));
        }
        let Some(tangent) = place else { unreachable!("just made") };
        // The force is linear in time, so the right-hand sides of all stages are combinations of two vectors.
        let (rate, rise) = (equations.rate(state, &ramp.force(0.0), (stage_data, 0)), ramp.rise());
        tangent.begin(equations, &rate, &rise, &NO_STAGE_FORCES, parts);
        (end(state, parts), tangent.error(equations, &rate, parts))
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn between<E: Equations>(
        &self,
        _: &E,
        memory: &mut Stages,
        _: &Ramp,
        state: &State,
        theta: f64,
    ) -> State {
        // The collocation polynomial through the start and the five stages.
        if memory.dense.is_none() {
            memory.dense = Some(stages(&memory.parts));
        }
        let Some(stages) = &memory.dense else { unreachable!("just made") };
        let nodes = &RADAU.nodes;
        let mut there = *state;
        for stage in 0..5 {
            let mut weight = theta / nodes[stage];
            for other in 0..5 {
                if other != stage {
                    weight *= (theta - nodes[other]) * (1.0 / (nodes[stage] - nodes[other]));
                }
            }
            add_scaled(&mut there, &stages[stage], weight);
        }
        there
    }
}
