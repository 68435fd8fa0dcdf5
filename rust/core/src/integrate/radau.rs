//! Radau IIA, five stages, order 9: implicit, L-stable and stiffly accurate, for scenes of any stiffness.
//!
//! In the eigenvectors of the collocation matrix the stages part into `(λ - h A) w = r`, and the second-order structure of A leaves of
//! each only the velocity half: `(λ² + λ h Ĉ + h² S ω) w_v = λ r_v - h S r_s`, one real and two complex systems of n
//! equations. They are inverted once per step length; steps from knot to knot of a uniform trace share one.
//!
//! Equations that are not linear are solved by Newton's iteration on the same systems ([`newton`]).

mod newton;
#[cfg(test)]
mod tests;

use nalgebra::{Complex, Matrix6};

use super::Method;
use super::drive::Ramp;
use super::kept::Kept;
use super::tableau::{Eigenpart, RADAU};
use crate::equations::{Equations, Square};
use crate::float::add_scaled;
use crate::system::{Force, State};
use newton::Course;

/// The implicit method.
#[derive(Debug, Clone, Copy, Default)]
pub struct Radau;

/// Step lengths of which the tangents are remembered, 2.3 kB each.
const KEPT: usize = 8;

/// Tangents for some step lengths, and the last step.
#[derive(Debug, Clone)]
pub struct Stages {
    kept: Kept<Tangent, KEPT>,
    parts: Parts,
    course: Course,
    /// What each stage adds to the start of the last step, once it was asked for.
    dense: Option<[State; 5]>,
}

/// Stage parts of a step, one for each eigenvalue: real and imaginary halves.
type Parts = [[State; 2]; 3];

/// How often each part counts.
const COUNTS: [f64; 3] = [1.0, 2.0, 2.0];

/// What the stages of one step length are solved with.
#[derive(Debug, Clone)]
struct Tangent {
    h: f64,
    inverses: [Inverse; 3],
    /// Columns of `h S`.
    pull: Square,
    /// Columns of Ĉ.
    damping: Square,
}

/// Columns of `(λ² + λ h Ĉ + h² S ω)⁻¹`, real and imaginary parts.
#[derive(Debug, Clone, Copy)]
struct Inverse {
    re: Square,
    im: Square,
}

impl Inverse {
    fn new(frequency: &[f64; 6], pull: &Square, damping: &Square, h: f64, part: &Eigenpart) -> Self {
        let lambda = Complex::new(part.value[0], part.value[1]);
        let mut matrix = Matrix6::from_fn(|i, j| lambda * (h * damping[j][i]));
        for i in 0..6 {
            for j in 0..6 {
                let elastic = Complex::from(pull[j][i] * (h * frequency[j]));
                matrix[(i, j)] += if i == j { lambda * lambda + elastic } else { elastic };
            }
        }
        // The eigenvalues of A lie in the left half plane and λ in the right: never singular, unless it is out of range, and then
        // the run ends with that.
        let inverse =
            matrix.try_inverse().unwrap_or_else(|| Matrix6::repeat(Complex::new(f64::NAN, f64::NAN)));
        let columns = |pick: fn(Complex<f64>) -> f64| {
            core::array::from_fn(|j| core::array::from_fn(|i| pick(inverse[(i, j)])))
        };
        Self { re: columns(|z| z.re), im: columns(|z| z.im) }
    }

    /// The inverse times a complex vector.
    #[cfg_attr(feature = "std", inline(always))]
    fn apply(&self, [re, im]: &[[f64; 6]; 2]) -> [[f64; 6]; 2] {
        let (rr, ri) = (times(&self.re, re), times(&self.re, im));
        let (ir, ii) = (times(&self.im, re), times(&self.im, im));
        let mut out = [[0.0; 6]; 2];
        for i in 0..6 {
            out[0][i] = rr[i] - ii[i];
            out[1][i] = ri[i] + ir[i];
        }
        out
    }
}

impl Tangent {
    /// That at `state`, for steps of length `h`.
    #[cfg_attr(feature = "std", inline(always))]
    fn new<E: Equations>(equations: &E, state: &State, h: f64) -> Self {
        let (stiffness, damping) = equations.tangent(state);
        Self::inverted(equations.frequency(), stiffness, damping, h)
    }

    #[inline(never)]
    fn inverted(frequency: &[f64; 6], stiffness: Square, damping: Square, h: f64) -> Self {
        let pull = stiffness.map(|column| column.map(|entry| h * entry));
        let inverses = RADAU.parts.each_ref().map(|part| Inverse::new(frequency, &pull, &damping, h, part));
        Self { h, inverses, pull, damping }
    }

    /// `h S s` of the elastic half s of a vector.
    #[cfg_attr(feature = "std", inline(always))]
    fn pulled<E: Equations>(&self, equations: &E, vector: &State) -> [f64; 6] {
        if E::PIECES || !E::LINEAR {
            return times(&self.pull, &upper(vector));
        }
        // Linear throughout: the coordinates are the modes of just these equations, and S = ω.
        let frequency = equations.frequency();
        let mut out = [0.0; 6];
        for i in 0..6 {
            out[i] = self.h * frequency[i] * vector[i];
        }
        out
    }

    /// Solves `(γ - h A) x = r` for the real eigenvalue γ.
    #[cfg_attr(feature = "std", inline(always))]
    fn solve_real<E: Equations>(&self, equations: &E, r: &State) -> State {
        let (h, frequency, gamma) = (self.h, equations.frequency(), RADAU.parts[0].value[0]);
        let pulled = self.pulled(equations, r);
        let mut moved = [0.0; 6];
        for i in 0..6 {
            moved[i] = gamma * r[6 + i] - pulled[i];
        }
        let v = times(&self.inverses[0].re, &moved);
        let mut x = [0.0; 12];
        for i in 0..6 {
            x[i] = (r[i] + h * frequency[i] * v[i]) / gamma;
            x[6 + i] = v[i];
        }
        x
    }

    /// Solves `(λ - h A) w = r` for the complex eigenvalue `index`.
    #[cfg_attr(feature = "std", inline(always))]
    fn solve_complex<E: Equations>(&self, equations: &E, index: usize, [re, im]: &[State; 2]) -> [State; 2] {
        let (h, frequency, [a, b]) = (self.h, equations.frequency(), RADAU.parts[index].value);
        let size = a * a + b * b;
        let (pulled_re, pulled_im) = (self.pulled(equations, re), self.pulled(equations, im));
        let mut moved = [[0.0; 6]; 2];
        for i in 0..6 {
            moved[0][i] = a * re[6 + i] - b * im[6 + i] - pulled_re[i];
            moved[1][i] = a * im[6 + i] + b * re[6 + i] - pulled_im[i];
        }
        let [v_re, v_im] = self.inverses[index].apply(&moved);
        let mut w = [[0.0; 12]; 2];
        for i in 0..6 {
            let hw = h * frequency[i];
            let (s_re, s_im) = (re[i] + hw * v_re[i], im[i] + hw * v_im[i]);
            w[0][i] = (s_re * a + s_im * b) / size;
            w[1][i] = (s_im * a - s_re * b) / size;
            w[0][6 + i] = v_re[i];
            w[1][6 + i] = v_im[i];
        }
        w
    }

    /// The parts of a step whose right-hand sides are those of the tangent: `rate` at the start, `rise` of the modal force, and
    /// `bend` more on the velocities (for equations that are not linear).
    #[cfg_attr(feature = "std", inline(always))]
    fn begin<E: Equations>(&self, equations: &E, rate: &State, rise: &Force, bend: &Bend, parts: &mut Parts) {
        for (index, part) in RADAU.parts.iter().enumerate() {
            let mut r = [[0.0; 12]; 2];
            for half in 0..2 {
                for i in 0..12 {
                    r[half][i] = self.h * part.constant[half] * rate[i];
                }
                for i in 0..6 {
                    r[half][6 + i] += self.h * part.linear[half] * rise[i];
                }
                if !E::LINEAR {
                    for i in 0..6 {
                        r[half][6 + i] += bend[index][half][i];
                    }
                }
            }
            parts[index] = if index == 0 {
                [self.solve_real(equations, &r[0]), [0.0; 12]]
            } else {
                self.solve_complex(equations, index, &r)
            };
        }
    }

    /// The estimated error of a step, filtered by (γ - h A)⁻¹ so that stiff parts do not inflate it (Hairer & Wanner, eq. IV.8.19).
    #[cfg_attr(feature = "std", inline(always))]
    fn error<E: Equations>(&self, equations: &E, rate: &State, parts: &Parts) -> State {
        let mut residual = [0.0; 12];
        for (index, part) in RADAU.parts.iter().enumerate() {
            let w = &parts[index];
            for i in 0..12 {
                residual[i] += COUNTS[index] * (part.error[0] * w[0][i] - part.error[1] * w[1][i]);
            }
        }
        let gamma = RADAU.parts[0].value[0];
        for i in 0..12 {
            residual[i] = self.h * rate[i] + gamma * residual[i];
        }
        self.solve_real(equations, &residual)
    }
}

impl Method for Radau {
    type Memory = Stages;
    const ERROR_ORDER: Option<u32> = Some(5);

    fn memory(&self) -> Stages {
        Stages { kept: Kept::new(), parts: [[[0.0; 12]; 2]; 3], course: Course::NONE, dense: None }
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
            return newton::step(equations, memory, ramp, state);
        }
        let Stages { kept, parts, .. } = memory;
        let place = kept.place(ramp.h, equations.key()).0;
        if place.is_none() {
            // Not in a closure, which would be compiled for the oldest processor.
            *place = Some(Tangent::new(equations, state, ramp.h));
        }
        let Some(tangent) = place else { unreachable!("just made") };
        // The force is linear in time, so all right-hand sides lie in two vectors.
        let (rate, rise) = (equations.rate(state, &ramp.force(0.0)), ramp.rise());
        tangent.begin(equations, &rate, &rise, &NO_BEND, parts);
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

/// What each stage adds to the start of a step.
#[cfg_attr(feature = "std", inline(always))]
fn stages(parts: &Parts) -> [State; 5] {
    let mut stages = [[0.0; 12]; 5];
    for stage in 0..5 {
        for (index, (part, [re, im])) in RADAU.parts.iter().zip(parts).enumerate() {
            let [a, b] = part.vector[stage];
            add_scaled(&mut stages[stage], re, COUNTS[index] * a);
            add_scaled(&mut stages[stage], im, COUNTS[index] * -b);
        }
    }
    stages
}

/// What is added to the velocities' right-hand sides of the parts.
type Bend = [[[f64; 6]; 2]; 3];

const NO_BEND: Bend = [[[0.0; 6]; 2]; 3];

/// The state at the end of a step.
#[cfg_attr(feature = "std", inline(always))]
fn end(state: &State, parts: &Parts) -> State {
    let mut next = *state;
    for (part, count) in parts.iter().zip(&COUNTS) {
        for i in 0..12 {
            next[i] += count * part[0][i];
        }
    }
    next
}

/// The elastic half of a state.
#[cfg_attr(feature = "std", inline(always))]
fn upper(state: &State) -> [f64; 6] {
    core::array::from_fn(|i| state[i])
}

/// Matrix (by columns) times vector.
#[cfg_attr(feature = "std", inline(always))]
fn times(columns: &[[f64; 6]; 6], vector: &[f64; 6]) -> [f64; 6] {
    let mut out = [0.0; 6];
    for (column, &factor) in columns.iter().zip(vector) {
        add_scaled(&mut out, column, factor);
    }
    out
}
