//! Simplified Newton iteration on the stages, for equations that are not linear (Hairer & Wanner, IV.8).
//!
//! It starts from the solution of the tangent plus the nonlinear force of the last step, extrapolated. It ends when the remaining
//! iteration error is small compared with the error of the step itself, so it needs no tolerance of its own. The rate of `ω η` is always
//! linear; only the velocity halves are iterated, and the halves of `ω η` follow.

use super::tangent::{COUNTS, NO_STAGE_FORCES, Parts, StageForces, Tangent, end, upper};
use crate::equations::{Equations, StageData};
use crate::excitation::Ramp;
use crate::integrate::tableau::RADAU;
use crate::numeric::float::{add_scaled, sqrt, times};
use crate::system::{Force, NO_FORCE, State, energy_norm};

/// Shares of the right-hand side at each stage in each part: the inverse of the matrix of eigenvectors, computed as they were.
pub(super) const SHARES: [[[f64; 2]; 5]; 3] = [
    [
        [27.697693775684087, 0.0],
        [12.783337911304406, 0.0],
        [3.20848938671343, 0.0],
        [-0.9514904122489162, 0.0],
        [0.7415504960259897, 0.0],
    ],
    [
        [2.672093218917456, 1.8740299037199024],
        [2.2968077838795806, -1.9924828681719424],
        [-1.5181801617297122, -0.5222078208040094],
        [0.5253300951157295, 0.5920492840689743],
        [-0.13638930593214812, -0.22495888507839018],
    ],
    [
        [-16.5209401067595, -4.305721989937646],
        [-8.688476739531783, 4.849995704764404],
        [-0.08606453162700278, 0.9573643198484372],
        [-0.04958488899127132, 1.20934600304247],
        [0.2656140579191533, -0.5237317439676688],
    ],
];

/// Largest number of iterations with one tangent.
const MAX_ITERATIONS: usize = 10;

/// Contraction above which the next step gets a new tangent.
const SLOW_CONTRACTION: f64 = 0.1;

/// Contraction above which the iteration counts as stalled.
const STALLED_CONTRACTION: f64 = 0.5;

/// Lower bound for the contraction, because a single measured ratio may be better than the next.
const MIN_CONTRACTION: f64 = 1e-4;

/// Allowed iteration error over the error of the step. With a tenth, the observed order is the same as for a converged iteration.
const ITERATION_ERROR_SHARE: f64 = 0.1;

/// Size of an update relative to the state below which it is rounding.
const UPDATE_ROUNDING: f64 = 1e-15;

/// Largest contraction, predicted from the tangents at the stages, at which a stalled iteration counts as converged to rounding.
const SMALL_TANGENT_CHANGE: f64 = 0.25;

/// Step length relative to the last step beyond which the iteration starts without extrapolation.
const MAX_STEP_RATIO: f64 = 2.0;

/// The start of a step and its nodes.
const NODES: [f64; 6] = {
    let [a, b, c, d, e] = RADAU.nodes;
    [0.0, a, b, c, d, e]
};

/// What acts during a step: the ramp, its force at the nodes, and the stage_data at [`NODES`].
struct Given<'a> {
    ramp: &'a Ramp<'a>,
    stage_data: &'a StageData,
    forces: [Force; 5],
}

/// The last step: stages, nonlinear forces and contraction.
#[derive(Debug, Clone, Copy)]
pub(super) struct LastStep {
    /// Key of its equations.
    key: u32,
    /// Its length.
    h: f64,
    /// The state that it led to.
    end: State,
    /// The states of its stages.
    states: [State; 5],
    /// Rates of their velocities less the excitation.
    own: [[f64; 6]; 5],
    /// Factor by which an iteration reduces the update.
    contraction: f64,
    /// Ratio of step lengths that `weights` belong to.
    ratio: f64,
    /// Weights that extrapolate from the stages of the last step to the parts of the next.
    weights: [[[f64; 5]; 2]; 3],
}

/// A step of equations that are not linear. Without convergence the state and its error are infinite.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn step<E: Equations>(
    equations: &E,
    (place, stage_data): (&mut Option<Tangent>, &mut StageData),
    parts: &mut Parts,
    last_step: &mut LastStep,
    ramp: &Ramp,
    state: &State,
) -> (State, State) {
    equations.prepare(ramp, &NODES, stage_data);
    let (rate, rise) = (equations.rate(state, &ramp.force(0.0), (stage_data, 0)), ramp.rise());
    let mut forces = [NO_FORCE; 5];
    for stage in 0..5 {
        forces[stage] = ramp.force(RADAU.nodes[stage]);
    }
    let given = Given { ramp, stage_data, forces };
    let same = last_step.key == equations.key() && last_step.h == ramp.h;
    if !same {
        last_step.contraction = 1.0;
    }
    let mut fresh = place.is_none() || same && last_step.contraction > SLOW_CONTRACTION;
    let mut again = false;
    loop {
        if fresh {
            // Not in a closure, which would be compiled for the oldest processor.
            *place = Some(Tangent::new(equations, state, ramp));
        }
        let Some(tangent) = place else { unreachable!("just made") };
        let extra = if again { NO_STAGE_FORCES } else { last_step.extrapolated(equations, tangent, state) };
        tangent.begin(equations, &rate, &rise, &extra, parts);
        if let Some(error) = last_step.converge(equations, tangent, &given, state, &rate, parts) {
            let next = end(state, parts);
            (last_step.key, last_step.h, last_step.end) = (equations.key(), ramp.h, next);
            return (next, error);
        }
        if again {
            *last_step = LastStep::NONE;
            return ([f64::INFINITY; 12], [f64::INFINITY; 12]);
        }
        // Second attempt, with a new tangent and without extrapolation.
        (fresh, again) = (true, true);
    }
}

impl LastStep {
    /// Before the first step.
    pub(super) const NONE: Self = Self {
        key: 0,
        h: f64::NAN,
        end: [f64::NAN; 12],
        states: [[0.0; 12]; 5],
        own: [[0.0; 6]; 5],
        contraction: 1.0,
        ratio: f64::NAN,
        weights: [[[0.0; 5]; 2]; 3],
    };

    /// The force beyond the tangent, less that at the start of the step, extrapolated by the polynomial through the stages of the last
    /// step; zero where the step does not continue it.
    #[cfg_attr(feature = "std", inline(always))]
    fn extrapolated<E: Equations>(&mut self, equations: &E, tangent: &Tangent, state: &State) -> StageForces {
        let ratio = tangent.h / self.h;
        if self.key != equations.key() || self.end != *state || ratio > MAX_STEP_RATIO {
            return NO_STAGE_FORCES;
        }
        if ratio != self.ratio {
            (self.ratio, self.weights) = (ratio, weights(ratio));
        }
        let mut extra = NO_STAGE_FORCES;
        for stage in 0..5 {
            let there = &self.states[stage];
            let mut beyond = times(&tangent.step_stiffness, &upper(there));
            add_scaled(&mut beyond, &self.own[stage], tangent.h);
            for (j, column) in tangent.damping.iter().enumerate() {
                add_scaled(&mut beyond, column, tangent.h * there[6 + j]);
            }
            for index in 0..3 {
                for half in 0..2 {
                    add_scaled(&mut extra[index][half], &beyond, self.weights[index][half][stage]);
                }
            }
        }
        extra
    }

    /// Iterates on the parts; returns the estimated error of the step, or none without convergence.
    #[cfg_attr(feature = "std", inline(always))]
    fn converge<E: Equations>(
        &mut self,
        equations: &E,
        tangent: &Tangent,
        given: &Given,
        state: &State,
        rate: &State,
        parts: &mut Parts,
    ) -> Option<State> {
        let size_of_state = f64::max(energy_norm(state), energy_norm(&end(state, parts)));
        // A single iteration does not measure the contraction, so the estimate is doubled from step to step.
        self.contraction = f64::min(1.0, 2.0 * self.contraction);
        let mut before = f64::INFINITY;
        for iteration in 0..MAX_ITERATIONS {
            self.evaluate(equations, given, state, parts);
            let update = self.improve(equations, tangent, &given.forces, parts);
            if !update.is_finite() {
                return None;
            }
            if iteration > 0 {
                self.contraction = f64::max(MIN_CONTRACTION, update / before);
            }
            let error = tangent.error(equations, rate, parts);
            if update <= UPDATE_ROUNDING * size_of_state
                || self.contraction < 1.0 && self.small(update, energy_norm(&error), size_of_state)
            {
                return Some(error);
            }
            if iteration > 0 && self.contraction > STALLED_CONTRACTION || iteration + 1 == MAX_ITERATIONS {
                // If the tangent hardly changes between the stages, only rounding has stalled the iteration.
                return if self.tangent_changes(equations, tangent, given.ramp) { None } else { Some(error) };
            }
            before = update;
        }
        None
    }

    /// Whether the iteration error after an update is small compared with the error of the step.
    ///
    /// The estimate of that error has order 5, hence is proportional to `h⁶`, the error itself to `h¹⁰`: to the power 5/3 of the
    /// estimate.
    #[cfg_attr(feature = "std", inline(always))]
    fn small(&self, update: f64, error: f64, size_of_state: f64) -> bool {
        let left = update * self.contraction / (1.0 - self.contraction) / ITERATION_ERROR_SHARE;
        left * left * left * (size_of_state * size_of_state) <= error * error * error * (error * error)
    }

    /// States of the stages and their rates.
    #[cfg_attr(feature = "std", inline(always))]
    fn evaluate<E: Equations>(
        &mut self,
        equations: &E,
        Given { stage_data, forces, .. }: &Given,
        state: &State,
        parts: &Parts,
    ) {
        for stage in 0..5 {
            let mut there = *state;
            for (index, (part, [re, im])) in RADAU.parts.iter().zip(parts).enumerate() {
                let [a, b] = part.vector[stage];
                add_scaled(&mut there, re, COUNTS[index] * a);
                add_scaled(&mut there, im, COUNTS[index] * -b);
            }
            let rate = equations.rate(&there, &forces[stage], (stage_data, 1 + stage));
            self.states[stage] = there;
            for i in 0..6 {
                self.own[stage][i] = rate[6 + i] - forces[stage][i];
            }
        }
    }

    /// Performs one iteration; returns the size of the update.
    #[cfg_attr(feature = "std", inline(always))]
    fn improve<E: Equations>(
        &self,
        equations: &E,
        tangent: &Tangent,
        forces: &[Force; 5],
        parts: &mut Parts,
    ) -> f64 {
        let (h, frequency) = (tangent.h, equations.frequency());
        let mut sum = 0.0;
        for (index, part) in RADAU.parts.iter().enumerate() {
            let [a, b] = part.value;
            let mut r = [[0.0; 6]; 2];
            for stage in 0..5 {
                for half in 0..2 {
                    let share = h * SHARES[index][stage][half];
                    for i in 0..6 {
                        r[half][i] += share * (self.own[stage][i] + forces[stage][i]);
                    }
                }
            }
            let [re, im] = &mut parts[index];
            let mut moved = [[0.0; 6]; 2];
            for i in 0..6 {
                let left_re = r[0][i] - (a * re[6 + i] - b * im[6 + i]);
                let left_im = r[1][i] - (a * im[6 + i] + b * re[6 + i]);
                moved[0][i] = a * left_re - b * left_im;
                moved[1][i] = a * left_im + b * left_re;
            }
            let v = if index == 0 {
                [times(&tangent.inverses[0].re, &moved[0]), [0.0; 6]]
            } else {
                tangent.inverses[index].apply(&moved)
            };
            let over = 1.0 / (a * a + b * b);
            for i in 0..6 {
                let hw = h * frequency[i] * over;
                let s = [hw * (a * v[0][i] + b * v[1][i]), hw * (a * v[1][i] - b * v[0][i])];
                re[i] += s[0];
                im[i] += s[1];
                re[6 + i] += v[0][i];
                im[6 + i] += v[1][i];
                sum += COUNTS[index] * (s[0] * s[0] + s[1] * s[1] + v[0][i] * v[0][i] + v[1][i] * v[1][i]);
            }
        }
        sqrt(sum)
    }

    /// Whether the tangent changes so much between the stages that the iteration may not contract.
    #[cfg_attr(feature = "std", inline(always))]
    fn tangent_changes<E: Equations>(&self, equations: &E, tangent: &Tangent, ramp: &Ramp) -> bool {
        let (h, frequency, gamma) = (tangent.h, equations.frequency(), RADAU.parts[0].value[0]);
        let mut changes = false;
        for (state, node) in self.states.iter().zip(RADAU.nodes) {
            let (stiffness, damping) = equations.tangent(state, ramp.instant(node));
            let mut sum = 0.0;
            for j in 0..6 {
                let mut off = [0.0; 6];
                for i in 0..6 {
                    off[i] = (h * stiffness[j][i] - tangent.step_stiffness[j][i]) * (h * frequency[j])
                        + gamma * h * (damping[j][i] - tangent.damping[j][i]);
                }
                for entry in times(&tangent.inverses[0].re, &off) {
                    sum += entry * entry;
                }
            }
            // NaN counts as such a change.
            changes |= sum > SMALL_TANGENT_CHANGE * SMALL_TANGENT_CHANGE || sum.is_nan();
        }
        changes
    }
}

/// Weights of the stages of the last step in the parts of a step `ratio` times as long: Lagrange polynomials, less the value at the end.
fn weights(ratio: f64) -> [[[f64; 5]; 2]; 3] {
    let nodes = &RADAU.nodes;
    let mut weights = [[[0.0; 5]; 2]; 3];
    for stage in 0..5 {
        let at = 1.0 + ratio * nodes[stage];
        for from in 0..5 {
            let mut weight = 1.0;
            for other in (0..5).filter(|&other| other != from) {
                weight *= (at - nodes[other]) / (nodes[from] - nodes[other]);
            }
            if from == 4 {
                weight -= 1.0;
            }
            for index in 0..3 {
                for half in 0..2 {
                    weights[index][half][from] += SHARES[index][stage][half] * weight;
                }
            }
        }
    }
    weights
}
