//! Undamped modes from the link rows, without forming K, which would square the spread of stiffness.
//!
//! With `M_ff = L Lᵀ` the rows `√k d L⁻ᵀ` of all links form a matrix A with `L⁻¹ K_ff L⁻ᵀ = Aᵀ A`. The singular values of A are the
//! natural frequencies, its right singular vectors the modes, and its left ones, U, give the loads of the links in the modes: `√k U = k
//! d·Φ / ω`. Rows sorted by norm, QR with column pivoting (Cox & Higham 1998) and one-sided Jacobi on the triangle (Drmač & Veselić 2008)
//! keep the digits of all three for any spread of stiffness. `k d·Φ` would lose them where a stiff link hardly moves in a soft mode.

use nalgebra::{Matrix6, SymmetricEigen, Vector3, Vector6};

use super::link_row::LinkRow;
use crate::error::SceneError;
use crate::model::{Body, Scene};
use crate::numeric::float::{copysign, hypot, sqrt};

/// Undamped modes of a scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UndampedModes {
    /// Shapes in the first columns, mass-normalised.
    pub shapes: Matrix6<f64>,
    /// Angular frequencies, ascending.
    pub frequency: [f64; 6],
}

impl UndampedModes {
    /// `(u, φ)` of the elastic half of a state.
    pub(crate) fn position(&self, elastic: &[f64; 6]) -> Vector6<f64> {
        let mut q = Vector6::zeros();
        for (mode, frequency) in self.frequency.iter().enumerate().filter(|(_, frequency)| **frequency > 0.0)
        {
            q += self.shapes.column(mode) * (elastic[mode] / frequency);
        }
        q
    }
}

/// A mode with a frequency below this fraction of the highest counts as unsupported. Rounding errors are about 1e-15; the frequencies of
/// real machines differ by factors up to 1e6.
const UNSUPPORTED: f64 = 1e-12;

/// Finds the undamped modes, and writes the loads of all links in them to `rows`.
///
/// # Errors
/// [`SceneError::Unsupported`].
pub(crate) fn undamped_modes(scene: &Scene, rows: &mut [LinkRow]) -> Result<UndampedModes, SceneError> {
    let n = scene.free().count();
    let mut dofs = [0; 6];
    for (slot, dof) in dofs.iter_mut().zip(scene.free().iter()) {
        *slot = dof as usize;
    }
    let dofs = &dofs[..n];
    let lower = mass_factor(scene.body(), dofs);
    set_rows(rows, &lower, dofs);
    let (triangle, order) = pivoted_qr(rows, n);

    // Rᵀ = W Σ Vᵀ, so A P = Q R = (Q V) Σ Wᵀ.
    let mut right = triangle.transpose();
    let mut left = Matrix6::identity();
    one_sided_jacobi(&mut right, &mut left, n);
    let length: [f64; 6] = core::array::from_fn(|j| if j < n { right.column(j).norm() } else { 0.0 });
    let mut ascending = [0, 1, 2, 3, 4, 5];
    ascending[..n].sort_unstable_by(|&a, &b| length[a].total_cmp(&length[b]));
    let highest = length[ascending[n - 1]];
    let loose = ascending[..n].iter().filter(|&&j| length[j] <= UNSUPPORTED * highest).count();
    if loose > 0 {
        return Err(unsupported(&triangle, &order, loose, &lower, dofs));
    }
    let mut modes = UndampedModes { shapes: Matrix6::zeros(), frequency: [0.0; 6] };
    for mode in 0..n {
        let column = ascending[mode];
        modes.frequency[mode] = length[column];
        let v = unpivoted(&order[..n], &right, column, length[column]);
        set_shape(&mut modes.shapes, mode, v, &lower, dofs);
    }
    rows.sort_unstable_by(|a, b| a.damping[1].total_cmp(&b.damping[1]));
    for row in rows {
        load_in_modes(row, &modes, &left, &ascending[..n]);
    }
    Ok(modes)
}

/// Writes the rows `√k d L⁻ᵀ` of A into `elastic`, largest row first. `damping` holds the squared norm and the place of the link until then.
fn set_rows(rows: &mut [LinkRow], lower: &Matrix6<f64>, dofs: &[usize]) {
    for (index, row) in rows.iter_mut().enumerate() {
        let d = row.link.row() * sqrt(row.stiffness);
        for j in 0..dofs.len() {
            let mut sum = d[dofs[j]];
            for k in 0..j {
                sum -= row.elastic[k] * lower[(j, k)];
            }
            row.elastic[j] = sum / lower[(j, j)];
        }
        row.damping[0] = row.elastic.iter().map(|x| x * x).sum();
        row.damping[1] = index as f64;
    }
    rows.sort_unstable_by(|a, b| {
        b.damping[0].total_cmp(&a.damping[0]).then(a.damping[1].total_cmp(&b.damping[1]))
    });
}

/// A column over `scale`, its entries in the order before pivoting.
fn unpivoted(order: &[usize], of: &Matrix6<f64>, column: usize, scale: f64) -> [f64; 6] {
    let mut v = [0.0; 6];
    for (i, &place) in order.iter().enumerate() {
        v[place] = of[(i, column)] / scale;
    }
    v
}

/// The error that names one of `loose` motions without stiffness.
///
/// They are right singular vectors of A whose lengths are lost in rounding, so they are computed as left singular vectors of the triangle.
fn unsupported(
    triangle: &Matrix6<f64>,
    order: &[usize; 6],
    loose: usize,
    lower: &Matrix6<f64>,
    dofs: &[usize],
) -> SceneError {
    let n = dofs.len();
    let (mut work, mut turned, mut shapes) = (*triangle, Matrix6::identity(), Matrix6::zeros());
    one_sided_jacobi(&mut work, &mut turned, n);
    let mut ascending = [0, 1, 2, 3, 4, 5];
    ascending[..n].sort_unstable_by(|&a, &b| work.column(a).norm().total_cmp(&work.column(b).norm()));
    for mode in 0..loose {
        set_shape(&mut shapes, mode, unpivoted(&order[..n], &turned, ascending[mode], 1.0), lower, dofs);
    }
    SceneError::Unsupported { motion: sparsest_motion(&shapes, loose), count: loose }
}

/// Turns a row of Q into the loads of its link in the modes.
fn load_in_modes(row: &mut LinkRow, modes: &UndampedModes, left: &Matrix6<f64>, ascending: &[usize]) {
    let (q, root) = (row.elastic, sqrt(row.stiffness));
    let moved = modes.shapes.transpose() * row.link.row();
    (row.elastic, row.damping) = ([0.0; 6], [0.0; 6]);
    for (mode, &column) in ascending.iter().enumerate() {
        let u: f64 = (0..ascending.len()).map(|i| q[i] * left[(i, column)]).sum();
        row.elastic[mode] = root * u;
        // d·Φ = u ω / √k, except for a link that is only a damper.
        row.rate[mode] = if root > 0.0 { u * modes.frequency[mode] / root } else { moved[mode] };
        row.deflection[mode] = if root > 0.0 { u / root } else { moved[mode] / modes.frequency[mode] };
        row.damping[mode] = row.link.damping() * row.rate[mode];
    }
}

/// Writes `L⁻ᵀ v` to a column of `shapes`.
fn set_shape(shapes: &mut Matrix6<f64>, mode: usize, mut v: [f64; 6], lower: &Matrix6<f64>, dofs: &[usize]) {
    let n = dofs.len();
    for i in (0..n).rev() {
        for k in i + 1..n {
            v[i] -= lower[(k, i)] * v[k];
        }
        v[i] /= lower[(i, i)];
        shapes[(dofs[i], mode)] = v[i];
    }
}

/// L with `M_ff = L Lᵀ`, the identity past the free degrees of freedom.
///
/// Twice the kinetic energy is a sum of six squares, of the velocities of the centre of mass and of the rotation about the principal
/// axes, and L is the triangle of their rows. A body that is nearly a point mass on an arm has a mass matrix that is singular to
/// rounding; these rows keep their digits.
fn mass_factor(body: &Body, dofs: &[usize]) -> Matrix6<f64> {
    let principal = SymmetricEigen::new(body.inertia());
    let mut lower = Matrix6::identity();
    lower.view_mut((0, 0), (dofs.len(), dofs.len())).fill(0.0);
    for axis in 0..3 {
        let along = Vector3::ith(axis, sqrt(body.mass()));
        let arm = body.center_of_mass().cross(&along);
        fold(&mut lower, dofs, &Vector6::new(along.x, along.y, along.z, arm.x, arm.y, arm.z));
        let turn = principal.eigenvectors.column(axis) * sqrt(principal.eigenvalues[axis]);
        fold(&mut lower, dofs, &Vector6::new(0.0, 0.0, 0.0, turn.x, turn.y, turn.z));
    }
    lower
}

/// Adds `row rowᵀ` to `L Lᵀ` by one Givens rotation per entry.
fn fold(lower: &mut Matrix6<f64>, dofs: &[usize], row: &Vector6<f64>) {
    let mut row = *row;
    for (i, &pivot) in dofs.iter().enumerate() {
        let length = hypot(lower[(i, i)], row[pivot]);
        if length == 0.0 {
            continue;
        }
        let (cos, sin) = (lower[(i, i)] / length, row[pivot] / length);
        for (j, &dof) in dofs.iter().enumerate().skip(i) {
            let (first, second) = (lower[(j, i)], row[dof]);
            lower[(j, i)] = cos * first + sin * second;
            row[dof] = cos * second - sin * first;
        }
    }
}

/// Householder QR with column pivoting of the rows' n columns: leaves Q in the rows, returns R and the order of the columns.
fn pivoted_qr(rows: &mut [LinkRow], n: usize) -> (Matrix6<f64>, [usize; 6]) {
    let steps = usize::min(n, rows.len());
    let mut order = [0, 1, 2, 3, 4, 5];
    let mut tau = [0.0; 6];
    for j in 0..steps {
        let remaining = |c: usize| rows[j..].iter().map(|row| row.elastic[c] * row.elastic[c]).sum::<f64>();
        let pivot = (j..n).max_by(|&a, &b| remaining(a).total_cmp(&remaining(b))).unwrap_or(j);
        let norm = sqrt(remaining(pivot));
        order.swap(j, pivot);
        for row in rows.iter_mut() {
            row.elastic.swap(j, pivot);
        }
        if norm == 0.0 {
            continue;
        }
        let first = rows[j].elastic[j];
        let diagonal = -copysign(norm, first);
        tau[j] = (diagonal - first) / diagonal;
        rows[j].elastic[j] = diagonal;
        for row in &mut rows[j + 1..] {
            row.elastic[j] /= first - diagonal;
        }
        reflect(rows, j, n, tau[j]);
    }
    let triangle =
        Matrix6::from_fn(|i, j| if i <= j && i < steps && j < n { rows[i].elastic[j] } else { 0.0 });

    // The reflections applied to the columns of the identity, from the last on.
    for j in (0..n).rev() {
        for row in &mut rows[..usize::min(j, steps)] {
            row.elastic[j] = 0.0;
        }
        if j >= steps {
            for row in rows.iter_mut() {
                row.elastic[j] = 0.0;
            }
            continue;
        }
        reflect(rows, j, n, tau[j]);
        rows[j].elastic[j] = 1.0 - tau[j];
        for row in &mut rows[j + 1..] {
            row.elastic[j] *= -tau[j];
        }
    }
    (triangle, order)
}

/// Reflects the columns after j by `I - τ v vᵀ`, v being 1 in row j and column j of the rows below.
fn reflect(rows: &mut [LinkRow], j: usize, n: usize, tau: f64) {
    for c in j + 1..n {
        let below: f64 = rows[j + 1..].iter().map(|row| row.elastic[j] * row.elastic[c]).sum();
        let share = tau * (rows[j].elastic[c] + below);
        rows[j].elastic[c] -= share;
        for row in &mut rows[j + 1..] {
            row.elastic[c] -= share * row.elastic[j];
        }
    }
}

/// Makes the first n columns of `work` orthogonal by plane rotations, which `turned` accumulates.
fn one_sided_jacobi(work: &mut Matrix6<f64>, turned: &mut Matrix6<f64>, n: usize) {
    // Quadratic convergence: five or six sweeps suffice for a 6 x 6 matrix; the bound is for a matrix of rounding errors.
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
                let tan = copysign(1.0, zeta) / (zeta.abs() + hypot(1.0, zeta));
                let cos = 1.0 / hypot(1.0, tan);
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

/// The motion with the fewest components among those spanned by the first `count` shapes, largest entry 1.
fn sparsest_motion(shapes: &Matrix6<f64>, count: usize) -> Vector6<f64> {
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
