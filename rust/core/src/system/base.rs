//! An elastic base under all links. It gives way by `C w` under the sum w of all link loads, so the links feel only the motion of the body
//! relative to it.
//!
//! With `T = (I + C K)⁻¹` a slow motion q of the body is `T q` relative to the base, and the body feels the stiffness `K T`. Dampers enter to
//! first order: they move the base by `T C B T q'` more, and the body feels the damping `Tᵀ B T`.

use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use super::assemble::Matrices;
use super::link_row::LinkRow;
use super::undamped_modes::UndampedModes;
use crate::numeric::float::sqrt;

/// A base in series with the links of a system.
pub(super) struct ElasticBase {
    /// T.
    relative: Matrix6<f64>,
    /// `T C`: motion relative to the base per unit of a load that the feet put on it.
    given_way: Matrix6<f64>,
    /// `T C B T`: motion of the base by the dampers per unit of the velocity of the body.
    dragged: Matrix6<f64>,
}

impl ElasticBase {
    /// The base of this `compliance` under links with these `matrices`, which become those of links and base together. None if numbers leave
    /// their range.
    pub(super) fn under(compliance: &Matrix6<f64>, matrices: &mut Matrices) -> Option<Self> {
        let relative = (Matrix6::identity() + compliance * matrices.stiffness).try_inverse()?;
        let given_way = relative * compliance;
        let dragged = given_way * matrices.damping * relative;
        let symmetric = |m: Matrix6<f64>| (m + m.transpose()) * 0.5;
        matrices.stiffness = symmetric(matrices.stiffness * relative);
        matrices.damping = symmetric(relative.transpose() * matrices.damping * relative);
        let finite = relative.iter().chain(&given_way).chain(&dragged).all(|x| x.is_finite());
        finite.then_some(Self { relative, given_way, dragged })
    }

    /// The undamped modes on links and base together, with this `stiffness`, from the `n` modes on the links alone; writes the loads of all
    /// links in them to `rows`.
    pub(super) fn modes(
        &self,
        stiffness: &Matrix6<f64>,
        of_links: &UndampedModes,
        n: usize,
        rows: &mut [LinkRow],
    ) -> UndampedModes {
        let mut reduced = of_links.shapes.transpose() * stiffness * of_links.shapes;
        // Past the modes zero, which sorts first; the squares of the frequencies are positive.
        reduced.fill_lower_triangle_with_upper_triangle();
        let found = SymmetricEigen::new(reduced);
        let mut ascending = [0, 1, 2, 3, 4, 5];
        ascending.sort_unstable_by(|&a, &b| found.eigenvalues[a].total_cmp(&found.eigenvalues[b]));
        let mut modes = UndampedModes { shapes: Matrix6::zeros(), frequency: [0.0; 6] };
        // The largest n: past the modes the entries of `reduced` are zero.
        for (mode, &column) in ascending[6 - n..].iter().enumerate() {
            modes.frequency[mode] = sqrt(found.eigenvalues[column]);
            modes.shapes.set_column(mode, &(of_links.shapes * found.eigenvectors.column(column)));
        }
        for row in rows {
            let moved = modes.shapes.transpose() * (self.relative.transpose() * row.link.row());
            for mode in 0..n {
                row.rate[mode] = moved[mode];
                row.deflection[mode] = moved[mode] / modes.frequency[mode];
                row.elastic[mode] = row.stiffness * row.deflection[mode];
                row.damping[mode] = row.link.damping() * moved[mode];
            }
        }
        modes
    }

    /// Motion `(u, φ)` of the links by the loads of their offsets on the base.
    pub(super) fn moved_by_offsets(&self, rows: &[LinkRow]) -> Vector6<f64> {
        let pull = rows.iter().map(|row| row.link.row() * (row.stiffness * row.link.offset()));
        self.given_way * pull.fold(Vector6::zeros(), |sum, load| sum + load)
    }

    /// Takes from the loads of the dampers the elastic loads that the base saves by moving with them.
    pub(super) fn drag(&self, modes: &UndampedModes, rows: &mut [LinkRow]) {
        for row in rows {
            let saved = (self.dragged * modes.shapes).transpose() * row.link.row() * row.stiffness;
            for mode in 0..6 {
                row.damping[mode] -= saved[mode];
            }
        }
    }
}
