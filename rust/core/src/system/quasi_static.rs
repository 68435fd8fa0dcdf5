//! States by other descriptions: of a given motion of L, and of equilibrium under a constant force; motions by their mass matrix.

use nalgebra::{Matrix6, Vector6};

use super::statics::equilibrium;
use super::{Force, ModelLevel, State, System};
use crate::model::Dof;

impl System {
    /// The state with this position `(u, φ)` of L (sag included; m, rad) and this velocity (m/s, rad/s), both zero in held degrees of
    /// freedom.
    pub fn state_of(&self, position: &Vector6<f64>, velocity: &Vector6<f64>) -> State {
        let momenta = self.shapes.transpose() * self.matrices.mass;
        let [away, rates] = [position - self.equilibrium.position, *velocity].map(|motion| momenta * motion);
        core::array::from_fn(|i| if i < 6 { self.frequency[i] * away[i] } else { rates[i - 6] })
    }

    /// Solves `M x = f` in the free degrees of freedom; zero in the held ones. Not finite where numbers leave their range.
    pub(crate) fn solved(&self, mut mass: Matrix6<f64>, mut force: Vector6<f64>) -> Vector6<f64> {
        for dof in Dof::ALL.into_iter().filter(|&dof| !self.free.contains(dof)) {
            let held = dof as usize;
            mass.row_mut(held).fill(0.0);
            mass.column_mut(held).fill(0.0);
            (mass[(held, held)], force[held]) = (1.0, 0.0);
        }
        mass.cholesky().map_or(Vector6::repeat(f64::NAN), |factors| factors.solve(&force))
    }

    /// The state of static equilibrium under the weight and a constant modal force.
    ///
    /// # Errors
    /// The motion `(u, φ)` in which the force drives the body out of its links, largest entry 1.
    pub(crate) fn quasi_static(&self, force: &Force) -> Result<State, Vector6<f64>> {
        let mut state = [0.0; 12];
        let elastic =
            |i: usize, force: f64| if self.frequency[i] > 0.0 { force / self.frequency[i] } else { 0.0 };
        if self.model_level == ModelLevel::Linear || force.iter().all(|force| *force == 0.0) {
            for i in 0..6 {
                state[i] = elastic(i, force[i]);
            }
            return Ok(state);
        }
        let weight = self.shapes.transpose() * self.matrices.weight;
        let rest = self.shapes.transpose() * self.matrices.mass * self.equilibrium.position;
        let whole: [f64; 6] = core::array::from_fn(|i| elastic(i, weight[i] + force[i]));
        let springs = self.rows().iter().map(|row| (row.link.law(), row.deflection, row.link.offset()));
        let found = equilibrium(springs, &whole, self.mode_count()).map_err(|direction| {
            let motion = self.position_of(&direction);
            motion / f64::max(motion.amax(), f64::MIN_POSITIVE)
        })?;
        for i in 0..6 {
            state[i] = found.position[i] - self.frequency[i] * rest[i];
        }
        Ok(state)
    }
}
