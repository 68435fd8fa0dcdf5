//! The tangent of the equations at a state, and the linear systems of the stages that it makes.

use nalgebra::{Complex, Matrix6};

use crate::equations::Equations;
use crate::excitation::Ramp;
use crate::integrate::tableau::{Eigenpart, RADAU};
use crate::numeric::float::{add_scaled, times};
use crate::system::{Force, Square, State};

/// The stages of a step along each eigenvector: real and imaginary parts.
pub(super) type Parts = [[State; 2]; 3];

/// Multiplicity of each part: one for the real eigenvalue, two for a conjugate pair.
pub(super) const COUNTS: [f64; 3] = [1.0, 2.0, 2.0];

/// The tangent at a state for one step length, with the inverses that solve for the stages.
#[derive(Debug, Clone)]
pub(super) struct Tangent {
    pub h: f64,
    pub inverses: [Inverse; 3],
    /// Columns of `h S`.
    pub step_stiffness: Square,
    /// Columns of Ĉ.
    pub damping: Square,
}

/// Columns of `(λ² + λ h Ĉ + h² S ω)⁻¹`, real and imaginary parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inverse {
    pub re: Square,
    pub im: Square,
}

impl Inverse {
    fn new(
        frequency: &[f64; 6],
        step_stiffness: &Square,
        damping: &Square,
        h: f64,
        part: &Eigenpart,
    ) -> Self {
        let lambda = Complex::new(part.value[0], part.value[1]);
        let mut matrix = Matrix6::from_fn(|i, j| lambda * (h * damping[j][i]));
        for i in 0..6 {
            for j in 0..6 {
                let elastic = Complex::from(step_stiffness[j][i] * (h * frequency[j]));
                matrix[(i, j)] += if i == j { lambda * lambda + elastic } else { elastic };
            }
        }
        // The eigenvalues of A lie in the left half plane and λ in the right, so the matrix is singular only where numbers leave their
        // range; the run then ends with that error.
        let inverse =
            matrix.try_inverse().unwrap_or_else(|| Matrix6::repeat(Complex::new(f64::NAN, f64::NAN)));
        let columns = |pick: fn(Complex<f64>) -> f64| {
            core::array::from_fn(|j| core::array::from_fn(|i| pick(inverse[(i, j)])))
        };
        Self { re: columns(|z| z.re), im: columns(|z| z.im) }
    }

    /// The inverse times a complex vector.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn apply(&self, [re, im]: &[[f64; 6]; 2]) -> [[f64; 6]; 2] {
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
    /// The tangent at `state`, where the step begins, for steps of its length.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn new<E: Equations>(equations: &E, state: &State, ramp: &Ramp) -> Self {
        let (stiffness, damping) = equations.tangent(state, ramp.instant(0.0));
        Self::inverted(equations.frequency(), stiffness, damping, ramp.h)
    }

    #[inline(never)]
    fn inverted(frequency: &[f64; 6], stiffness: Square, damping: Square, h: f64) -> Self {
        let step_stiffness = stiffness.map(|column| column.map(|entry| h * entry));
        let inverses =
            RADAU.parts.each_ref().map(|part| Inverse::new(frequency, &step_stiffness, &damping, h, part));
        Self { h, inverses, step_stiffness, damping }
    }

    /// `h S s` of the elastic half s of a vector.
    #[cfg_attr(feature = "std", inline(always))]
    fn stiffness_product<E: Equations>(&self, equations: &E, vector: &State) -> [f64; 6] {
        if E::PIECEWISE || !E::LINEAR {
            return times(&self.step_stiffness, &upper(vector));
        }
        // Linear throughout: the coordinates are the modes of these equations, and S = ω.
        let frequency = equations.frequency();
        let mut out = [0.0; 6];
        for i in 0..6 {
            out[i] = self.h * frequency[i] * vector[i];
        }
        out
    }

    /// Solves `(γ - h A) x = r` for the real eigenvalue γ.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn solve_real<E: Equations>(&self, equations: &E, r: &State) -> State {
        let (h, frequency, gamma) = (self.h, equations.frequency(), RADAU.parts[0].value[0]);
        let elastic = self.stiffness_product(equations, r);
        let mut moved = [0.0; 6];
        for i in 0..6 {
            moved[i] = gamma * r[6 + i] - elastic[i];
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
        let (elastic_re, elastic_im) =
            (self.stiffness_product(equations, re), self.stiffness_product(equations, im));
        let mut moved = [[0.0; 6]; 2];
        for i in 0..6 {
            moved[0][i] = a * re[6 + i] - b * im[6 + i] - elastic_re[i];
            moved[1][i] = a * im[6 + i] + b * re[6 + i] - elastic_im[i];
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

    /// Solves for the parts of a step whose right-hand sides are those of the tangent: `rate` at the start, `rise` of the modal force,
    /// and, for equations that are not linear, the force `extra` on the velocities.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn begin<E: Equations>(
        &self,
        equations: &E,
        rate: &State,
        rise: &Force,
        extra: &StageForces,
        parts: &mut Parts,
    ) {
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
                        r[half][6 + i] += extra[index][half][i];
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
    pub(super) fn error<E: Equations>(&self, equations: &E, rate: &State, parts: &Parts) -> State {
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

/// Differences of the stages from the start of the step.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn stages(parts: &Parts) -> [State; 5] {
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

/// Additional right-hand sides of the velocities, by part.
pub(super) type StageForces = [[[f64; 6]; 2]; 3];

pub(super) const NO_STAGE_FORCES: StageForces = [[[0.0; 6]; 2]; 3];

/// The state at the end of a step.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn end(state: &State, parts: &Parts) -> State {
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
pub(super) fn upper(state: &State) -> [f64; 6] {
    core::array::from_fn(|i| state[i])
}
