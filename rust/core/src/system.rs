//! The equations of motion in energy coordinates, in which every method integrates.
//!
//! With the undamped modes Φ (`Φᵀ M Φ = I`, `Φᵀ K Φ = ω²`) and `q = q_static + Φ η` the state is `s = (ω η, η')`:
//!
//! ```text
//! d/dt (ω η) =                 ω η'
//! d/dt  η'   = -ω (ω η) - Ĉ η' + f(t),      f = Φᵀ (E(t) - M_u a(t))
//! ```
//!
//! `|s|² / 2` is the energy of the motion, so without damping the system matrix is skew and with damping it only
//! dissipates: nothing in it depends on whether lengths are metres or millimetres, and small motion is not lost beside
//! the sag. Modes come from the link rows by one-sided Jacobi (Demmel & Veselić 1992), without squaring them into K, so that
//! soft directions keep their digits beside stiff ones.

use nalgebra::{Matrix6, Vector6};

use crate::assemble::{Matrices, assemble};
use crate::dof::Free;
use crate::error::SceneError;
use crate::float::{add_scaled, fma, sqrt};
use crate::link::Link;
use crate::scene::Scene;

/// Deviation from the static position in energy coordinates: `ω η` (six), then `η'` (six), both in √J. Entries past the number
/// of free degrees of freedom stay zero.
pub type State = [f64; 12];

/// Excitation at one instant: acceleration of L (3, m/s²), then external force (3, N) and moment about L (3, N m).
pub type Input = [f64; 9];

/// Modal force f: six entries, and two zeros that make a copy of it two whole registers.
pub(crate) type Force = [f64; 8];

/// No force.
pub(crate) const NO_FORCE: Force = [0.0; 8];

/// An [`Input`] of its parts.
#[inline(always)]
pub fn joined([x, y, z]: [f64; 3], [a, b, c, d, e, f]: [f64; 6]) -> Input {
    [x, y, z, a, b, c, d, e, f]
}

/// A frequency below this fraction of the highest counts as no support: rounding leaves 1e-15, real machines span 1e6.
const UNSUPPORTED: f64 = 1e-12;

/// A linear scene, ready to integrate.
#[derive(Debug, Clone, Copy)]
pub struct System {
    matrices: Matrices,
    free: Free,
    shapes: Matrix6<f64>,
    pub(crate) frequency: [f64; 6],
    /// Columns of `Ĉ = Φᵀ C Φ`.
    pub(crate) damping: [[f64; 6]; 6],
    /// Columns of the influence of an [`Input`] on f.
    influence: [Force; 9],
    rest: [f64; 6],
}

impl System {
    /// Assembles a scene, finds its modes and its static equilibrium `K q = Q` (section 3.5).
    ///
    /// # Errors
    /// [`SceneError::Unsupported`] names the motion that no link resists.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let matrices = assemble(scene);
        let n = scene.free().count();
        let (shapes, frequency) = modes(scene, &matrices);
        let highest = frequency[..n].iter().copied().fold(0.0, f64::max);
        let loose = frequency[..n].iter().filter(|&&w| w <= UNSUPPORTED * highest).count();
        if loose > 0 {
            return Err(SceneError::Unsupported { motion: plainest_motion(&shapes, loose), count: loose });
        }
        let mut damping = [[0.0; 6]; 6];
        for link in scene.links() {
            let d = shapes.transpose() * link.row();
            for (j, column) in damping.iter_mut().enumerate() {
                for (i, entry) in column.iter_mut().enumerate() {
                    *entry += link.damping() * d[i] * d[j];
                }
            }
        }
        let mut influence = [NO_FORCE; 9];
        for axis in 0..3 {
            let column = shapes.transpose() * -matrices.mass.column(axis);
            influence[axis][..6].copy_from_slice(column.as_slice());
        }
        for axis in 0..6 {
            influence[3 + axis][..6].copy_from_slice(shapes.row(axis).transpose().as_slice());
        }
        let weight = shapes.transpose() * matrices.weight;
        let mut rest = [0.0; 6];
        for mode in 0..n {
            rest[mode] = weight[mode] / frequency[mode];
        }
        Ok(Self { matrices, free: scene.free(), shapes, frequency, damping, influence, rest })
    }

    /// The matrices of all six degrees of freedom.
    pub fn matrices(&self) -> &Matrices {
        &self.matrices
    }

    /// The free degrees of freedom.
    pub fn free(&self) -> Free {
        self.free
    }

    /// Number of modes: of free degrees of freedom.
    pub fn mode_count(&self) -> usize {
        self.free.count()
    }

    /// Undamped angular natural frequencies ω, ascending, rad/s; zeros past the number of modes.
    pub fn frequencies(&self) -> &[f64; 6] {
        &self.frequency
    }

    /// Undamped mode shapes in columns, `(u, φ)` of L, mass-normalised (`Φᵀ M Φ = I`).
    pub fn shapes(&self) -> &Matrix6<f64> {
        &self.shapes
    }

    /// Modal damping `Ĉ = Φᵀ C Φ`, 1/s; diagonal where damping is proportional.
    pub fn modal_damping(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.damping[j][i])
    }

    /// Static position `(u, φ)` under the weight: m, rad.
    pub fn static_position(&self) -> Vector6<f64> {
        self.position(&self.rest)
    }

    /// Static part of the state: what `ω η` would be, had it been counted from the unloaded position.
    pub(crate) fn rest(&self) -> &[f64; 6] {
        &self.rest
    }

    /// `(u, φ)` of the elastic half of a state (or of [`System::rest`]).
    fn position(&self, elastic: &[f64; 6]) -> Vector6<f64> {
        let mut q = Vector6::zeros();
        for mode in 0..self.mode_count() {
            q += self.shapes.column(mode) * (elastic[mode] / self.frequency[mode]);
        }
        q
    }

    /// Modal force of a unit of each component of an [`Input`].
    pub(crate) fn influence(&self) -> &[Force; 9] {
        &self.influence
    }

    /// Elastic load of a link per unit of each `ω η`, N/√J: `k d·Φ / ω`.
    pub(crate) fn elastic_row(&self, link: &Link) -> [f64; 6] {
        let d = self.shapes.transpose() * link.row();
        let mut row = [0.0; 6];
        for mode in 0..self.mode_count() {
            row[mode] = link.stiffness() * d[mode] / self.frequency[mode];
        }
        row
    }

    /// Damping load of a link per unit of each `η'`, N/√J: `b d·Φ`.
    pub(crate) fn damping_row(&self, link: &Link) -> [f64; 6] {
        (self.shapes.transpose() * link.row() * link.damping()).into()
    }

    /// Rate of change of a state under the modal force `force`.
    #[inline(always)]
    pub(crate) fn rate(&self, state: &State, force: &Force) -> State {
        let mut fast = [0.0; 6];
        let mut slow: [f64; 6] = core::array::from_fn(|i| force[i]);
        for i in 0..6 {
            fast[i] = self.frequency[i] * state[6 + i];
            slow[i] = fma(-self.frequency[i], state[i], slow[i]);
        }
        for (j, column) in self.damping.iter().enumerate() {
            add_scaled(&mut slow, column, -state[6 + j]);
        }
        let mut rate = [0.0; 12];
        rate[..6].copy_from_slice(&fast);
        rate[6..].copy_from_slice(&slow);
        rate
    }
}

/// Undamped mode shapes (mass-normalised, in the first columns) and angular frequencies, ascending.
fn modes(scene: &Scene, matrices: &Matrices) -> (Matrix6<f64>, [f64; 6]) {
    let free = scene.free();
    let n = free.count();
    let mut dofs = [0; 6];
    for (slot, dof) in dofs.iter_mut().zip(free.iter()) {
        *slot = dof as usize;
    }
    // M_ff = L Lᵀ; what is past n is the identity.
    let mut lower = Matrix6::identity();
    for j in 0..n {
        for i in j..n {
            let mut sum = matrices.mass[(dofs[i], dofs[j])];
            for k in 0..j {
                sum -= lower[(i, k)] * lower[(j, k)];
            }
            lower[(i, j)] = if i == j { sqrt(sum) } else { sum / lower[(j, j)] };
        }
    }
    // The rows √k d folded into a triangle R with K_ff = Rᵀ R, one Givens rotation per entry.
    let mut triangle = Matrix6::<f64>::zeros();
    for link in scene.links() {
        let d = link.row() * sqrt(link.stiffness());
        let mut row = [0.0; 6];
        for i in 0..n {
            row[i] = d[dofs[i]];
        }
        for i in 0..n {
            let length = libm::hypot(triangle[(i, i)], row[i]);
            if length == 0.0 {
                continue;
            }
            let (cos, sin) = (triangle[(i, i)] / length, row[i] / length);
            for j in i..n {
                let (above, below) = (triangle[(i, j)], row[j]);
                triangle[(i, j)] = cos * above + sin * below;
                row[j] = cos * below - sin * above;
            }
        }
    }
    // R L⁻ᵀ: its right singular vectors are the modes, its singular values the frequencies.
    let mut work = triangle;
    for j in 0..n {
        for k in 0..j {
            let factor = lower[(j, k)];
            for i in 0..n {
                work[(i, j)] -= work[(i, k)] * factor;
            }
        }
        for i in 0..n {
            work[(i, j)] /= lower[(j, j)];
        }
    }
    let mut turned = Matrix6::identity();
    one_sided_jacobi(&mut work, &mut turned, n);

    let mut order = [0, 1, 2, 3, 4, 5];
    let mut length = [0.0; 6];
    for j in 0..n {
        length[j] = work.column(j).norm();
    }
    order[..n].sort_unstable_by(|&a, &b| length[a].total_cmp(&length[b]));
    let mut shapes = Matrix6::zeros();
    let mut frequency = [0.0; 6];
    for mode in 0..n {
        frequency[mode] = length[order[mode]];
        // L⁻ᵀ v by back substitution.
        let mut v = turned.column(order[mode]).into_owned();
        for i in (0..n).rev() {
            for k in i + 1..n {
                v[i] -= lower[(k, i)] * v[k];
            }
            v[i] /= lower[(i, i)];
            shapes[(dofs[i], mode)] = v[i];
        }
    }
    (shapes, frequency)
}

/// Turns the first n columns of `work` orthogonal by plane rotations, which `turned` collects.
fn one_sided_jacobi(work: &mut Matrix6<f64>, turned: &mut Matrix6<f64>, n: usize) {
    // Quadratic convergence: five or six sweeps settle a 6 x 6; the bound is for a matrix of rounding noise.
    for _ in 0..30 {
        let mut settled = true;
        for p in 0..n {
            for q in p + 1..n {
                let (a, b) = (work.column(p).norm_squared(), work.column(q).norm_squared());
                let c = work.column(p).dot(&work.column(q));
                if c.abs() <= f64::EPSILON * sqrt(a) * sqrt(b) {
                    continue;
                }
                settled = false;
                let zeta = (b - a) / (2.0 * c);
                let tan = libm::copysign(1.0, zeta) / (zeta.abs() + libm::hypot(1.0, zeta));
                let cos = 1.0 / libm::hypot(1.0, tan);
                let sin = cos * tan;
                for matrix in [&mut *work, &mut *turned] {
                    for i in 0..6 {
                        let (x, y) = (matrix[(i, p)], matrix[(i, q)]);
                        matrix[(i, p)] = cos * x - sin * y;
                        matrix[(i, q)] = sin * x + cos * y;
                    }
                }
            }
        }
        if settled {
            return;
        }
    }
}

/// Of the motions spanned by the first `count` shapes the one with the fewest components, largest entry 1.
fn plainest_motion(shapes: &Matrix6<f64>, count: usize) -> Vector6<f64> {
    let mut span = *shapes;
    // Echelon form: each pivot row is cleared in all other columns.
    let mut cleared = [false; 6];
    for column in 0..count {
        let mut pivot = 0;
        let mut largest = -1.0;
        for row in 0..6 {
            let size = span[(row, column)].abs();
            if !cleared[row] && size > largest {
                (pivot, largest) = (row, size);
            }
        }
        cleared[pivot] = true;
        let scaled = span.column(column) / span[(pivot, column)];
        span.set_column(column, &scaled);
        for other in (0..count).filter(|&other| other != column) {
            let reduced = span.column(other) - scaled * span[(pivot, other)];
            span.set_column(other, &reduced);
        }
    }
    let components = |column: usize| span.column(column).iter().filter(|x| x.abs() > 1e-9).count();
    let plainest = (0..count).min_by_key(|&column| components(column)).unwrap_or(0);
    let motion = span.column(plainest).into_owned();
    let motion = motion.map(|x| if x.abs() > 1e-9 { x } else { 0.0 });
    motion / motion.amax()
}
