//! The state between two windows of the motion, whose scenes have different masses and so different modes, one scene in each lane.

use pulp::Simd;

use super::aligned_buffer::AlignedBuffer;
use super::damped::Damped;
use super::dense::MAX_MODES;
use super::timeline::{BLOCK, Timeline};
use super::undamped::{RowParts, Undamped};
use super::vector::{Complex, Real};

/// Writes the rows of position and velocity of the free degrees of freedom: the value at rest, and c of each mode in `2 Re(Σ c z)`.
#[inline(always)]
pub(super) fn set_state_rows<S: Simd>(
    simd: S,
    undamped: &Undamped<S>,
    damped: &Damped<S>,
    to: &mut AlignedBuffer,
) {
    let n = undamped.n;
    let rows = to.clear::<S>(2 * n * (1 + 2 * n));
    for (index, row) in rows.chunks_exact_mut(1 + 2 * n).enumerate() {
        let (is_velocity, dof) = (index >= n, index % n);
        let mut of = RowParts::new(simd);
        for mode in 0..n {
            let shape = undamped.shapes[dof][mode];
            if is_velocity {
                of.damping[mode] = shape;
            } else {
                of.elastic[mode] = shape / undamped.frequency[mode];
                of.constant = of.elastic[mode].mul_add(undamped.rest[mode], of.constant);
            }
        }
        let (constant, coefficients) = row.split_at_mut(1);
        constant[0] = of.constant.lanes;
        for (k, to) in coefficients.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            *to = damped.coefficient(simd, &of, k, n).lanes();
        }
    }
}

/// Writes z of each mode from position and velocity before a change of mass: the position does not change, and the momentum is that of the
/// kept masses. `kept`: their mass matrix; see [`crate::integrate::Start::after_change`].
#[inline(always)]
pub(super) fn set_modal_state<S: Simd>(
    simd: S,
    undamped: &Undamped<S>,
    damped: &Damped<S>,
    dofs: &[usize],
    kept: &[[Real<S>; 6]; 6],
    [state, to]: [&mut AlignedBuffer; 2],
) {
    let n = undamped.n;
    let (position, velocity) = state.vectors::<S>().split_at(n);
    let root = Real::splat(simd, core::f64::consts::FRAC_1_SQRT_2);
    let (mut weighed, mut momentum) = ([undamped.zero; MAX_MODES], [undamped.zero; MAX_MODES]);
    for i in 0..n {
        for j in 0..n {
            let (q, v) = (Real::new(simd, position[j]), Real::new(simd, velocity[j]));
            weighed[i] = undamped.mass[dofs[i]][dofs[j]].mul_add(q, weighed[i]);
            momentum[i] = kept[dofs[i]][dofs[j]].mul_add(v, momentum[i]);
        }
    }
    let mut p = [Complex::new(undamped.zero, undamped.zero); MAX_MODES];
    for mode in 0..n {
        let (mut eta, mut rate) = (undamped.zero, undamped.zero);
        for i in 0..n {
            eta = undamped.shapes[i][mode].mul_add(weighed[i], eta);
            rate = undamped.shapes[i][mode].mul_add(momentum[i], rate);
        }
        p[mode] = Complex::new(rate * root, (undamped.frequency[mode] * eta - undamped.rest[mode]) * root);
    }
    for (k, to) in to.vectors_mut::<S>().as_chunks_mut::<2>().0.iter_mut().enumerate() {
        *to = damped.amplitude(&p, k, n).lanes();
    }
}

/// Computes position and velocity at the end of a window from v there, by the drive of each mode and the rows of position and velocity.
/// `drawn`: the last block of the drawn motions.
#[inline(always)]
pub(super) fn set_physical_state<S: Simd>(
    simd: S,
    drive: &AlignedBuffer,
    state_rows: &AlignedBuffer,
    timeline: &Timeline,
    drawn: Option<&AlignedBuffer>,
    end: &AlignedBuffer,
    to: &mut AlignedBuffer,
) {
    let end = end.vectors::<S>().as_chunks::<2>().0;
    let (n, count) = (end.len(), timeline.components.len());
    let inputs = &timeline.values[(timeline.count - 1) * count..][..count];
    let drives = drive.vectors::<S>().as_chunks::<2>().0;
    let zero = Real::splat(simd, 0.0);
    let mut z = [Complex::new(zero, zero); MAX_MODES];
    for mode in 0..n {
        z[mode] = Complex::of(simd, end[mode]);
        for (component, (drive, &input)) in drives.chunks_exact(n).zip(inputs).enumerate() {
            let input = match drawn {
                Some(drawn) if component == 0 => Real::new(simd, drawn.vectors::<S>()[BLOCK - 1]),
                _ => Real::splat(simd, input),
            };
            z[mode] = z[mode] - Complex::of(simd, drive[mode]).scale(input);
        }
    }
    let rows = state_rows.vectors::<S>();
    for (row, to) in rows.chunks_exact(1 + 2 * n).zip(to.clear::<S>(2 * n)) {
        let mut value = Real::new(simd, row[0]);
        for (mode, c) in row[1..].as_chunks::<2>().0.iter().enumerate() {
            let product = Complex::of(simd, *c) * z[mode];
            value = value + (product.re + product.re);
        }
        *to = value.lanes;
    }
}
