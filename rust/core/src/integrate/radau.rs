//! Radau IIA, five stages, order 9: implicit, L-stable and stiffly accurate, for scenes of any stiffness.
//!
//! In the eigenvectors of the collocation matrix the stages part into `(λ - h A) w = r`, and the second-order structure of A leaves of
//! each only the velocity half: `(λ² + λ h Ĉ + h² ω²) w_v = λ r_v - h ω r_s`, one real and two complex systems of n
//! equations. They are inverted once per step length; steps from knot to knot of a uniform trace share one.

use nalgebra::{Complex, Matrix6};

use super::Method;
use super::drive::Ramp;
use super::kept::Kept;
use super::tableau::{Eigenpart, RADAU};
use crate::float::add_scaled;
use crate::system::{State, System};

/// The implicit method.
#[derive(Debug, Clone, Copy, Default)]
pub struct Radau;

/// Step lengths of which the inverses are remembered, 1.7 kB each.
const KEPT: usize = 8;

/// Inverses for some step lengths, and the last step.
#[derive(Debug, Clone)]
pub struct Stages {
    kept: Kept<[Inverse; 3], KEPT>,
    /// Stage parts of the last step: real and imaginary halves.
    parts: [[State; 2]; 3],
}

/// Columns of `(λ² + λ h Ĉ + h² ω²)⁻¹`, real and imaginary parts.
#[derive(Debug, Clone, Copy)]
struct Inverse {
    re: [[f64; 6]; 6],
    im: [[f64; 6]; 6],
}

impl Inverse {
    /// Those of all eigenvalues for steps of length `h`.
    #[inline(never)]
    fn all(system: &System, h: f64) -> [Self; 3] {
        RADAU.parts.each_ref().map(|part| Self::new(system, h, part))
    }

    fn new(system: &System, h: f64, part: &Eigenpart) -> Self {
        let lambda = Complex::new(part.value[0], part.value[1]);
        let mut matrix = system.modal_damping().map(|c| lambda * (h * c));
        for i in 0..6 {
            let hw = h * system.frequency[i];
            matrix[(i, i)] += lambda * lambda + hw * hw;
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

    /// Solves `(γ - h A) x = r` for the real eigenvalue γ.
    #[inline(always)]
    fn solve_real(&self, system: &System, h: f64, r: &State) -> State {
        let gamma = RADAU.parts[0].value[0];
        let mut moved = [0.0; 6];
        for i in 0..6 {
            moved[i] = gamma * r[6 + i] - h * system.frequency[i] * r[i];
        }
        let v = times(&self.re, &moved);
        let mut x = [0.0; 12];
        for i in 0..6 {
            x[i] = (r[i] + h * system.frequency[i] * v[i]) / gamma;
            x[6 + i] = v[i];
        }
        x
    }

    /// Solves `(λ - h A) w = r` for a complex eigenvalue.
    #[inline(always)]
    fn solve_complex(&self, system: &System, h: f64, lambda: [f64; 2], r: &[State; 2]) -> [State; 2] {
        let [a, b] = lambda;
        let size = a * a + b * b;
        let [re, im] = r;
        let mut moved = [[0.0; 6]; 2];
        for i in 0..6 {
            let hw = h * system.frequency[i];
            moved[0][i] = a * re[6 + i] - b * im[6 + i] - hw * re[i];
            moved[1][i] = a * im[6 + i] + b * re[6 + i] - hw * im[i];
        }
        let (rr, ri) = (times(&self.re, &moved[0]), times(&self.re, &moved[1]));
        let (ir, ii) = (times(&self.im, &moved[0]), times(&self.im, &moved[1]));
        let mut w = [[0.0; 12]; 2];
        for i in 0..6 {
            let (v_re, v_im) = (rr[i] - ii[i], ri[i] + ir[i]);
            let hw = h * system.frequency[i];
            let (s_re, s_im) = (re[i] + hw * v_re, im[i] + hw * v_im);
            w[0][i] = (s_re * a + s_im * b) / size;
            w[1][i] = (s_im * a - s_re * b) / size;
            w[0][6 + i] = v_re;
            w[1][6 + i] = v_im;
        }
        w
    }
}

impl Method for Radau {
    type Memory = Stages;
    const ERROR_ORDER: Option<u32> = Some(5);

    fn memory(&self, _: &System) -> Stages {
        Stages { kept: Kept::new(), parts: [[[0.0; 12]; 2]; 3] }
    }

    #[inline(always)]
    fn step(&self, system: &System, memory: &mut Stages, ramp: &Ramp, state: &State) -> (State, State) {
        let h = ramp.h;
        let Stages { kept, parts } = memory;
        let inverses = kept.place(h).0.get_or_insert_with(|| Inverse::all(system, h));
        // The force is linear in time, so all right-hand sides lie in two vectors: the rate at the start and the rise.
        let start = ramp.force(0.0);
        let end = ramp.force(1.0);
        let rate = system.rate(state, &start);
        let mut next = *state;
        let mut residual = [0.0; 12];
        for (index, part) in RADAU.parts.iter().enumerate() {
            let mut r = [[0.0; 12]; 2];
            for half in 0..2 {
                for i in 0..12 {
                    r[half][i] = h * part.constant[half] * rate[i];
                }
                for i in 0..6 {
                    r[half][6 + i] += h * part.linear[half] * (end[i] - start[i]);
                }
            }
            let (w, count) = if index == 0 {
                ([inverses[0].solve_real(system, h, &r[0]), [0.0; 12]], 1.0)
            } else {
                (inverses[index].solve_complex(system, h, part.value, &r), 2.0)
            };
            for i in 0..12 {
                next[i] += count * w[0][i];
                residual[i] += count * (part.error[0] * w[0][i] - part.error[1] * w[1][i]);
            }
            parts[index] = w;
        }
        // Filtered by (γ - h A)⁻¹, so that stiff parts do not inflate it (Hairer & Wanner, eq. IV.8.19).
        let gamma = RADAU.parts[0].value[0];
        for i in 0..12 {
            residual[i] = h * rate[i] + gamma * residual[i];
        }
        (next, inverses[0].solve_real(system, h, &residual))
    }

    #[inline(always)]
    fn between(&self, _: &System, memory: &mut Stages, _: &Ramp, state: &State, theta: f64) -> State {
        // The collocation polynomial through the start and the five stages.
        let nodes = &RADAU.nodes;
        let mut there = *state;
        for stage in 0..5 {
            let mut weight = theta / nodes[stage];
            for other in (0..5).filter(|&other| other != stage) {
                weight *= (theta - nodes[other]) / (nodes[stage] - nodes[other]);
            }
            for (index, (part, [re, im])) in RADAU.parts.iter().zip(&memory.parts).enumerate() {
                let count = if index == 0 { 1.0 } else { 2.0 };
                let [a, b] = part.vector[stage];
                for i in 0..12 {
                    there[i] += weight * count * (a * re[i] - b * im[i]);
                }
            }
        }
        there
    }
}

/// Matrix (by columns) times vector.
#[inline(always)]
fn times(columns: &[[f64; 6]; 6], vector: &[f64; 6]) -> [f64; 6] {
    let mut out = [0.0; 6];
    for (column, &factor) in columns.iter().zip(vector) {
        add_scaled(&mut out, column, factor);
    }
    out
}
