//! Derivatives of the linear equations in the modes of the system, which stay as they are.
//!
//! With `q = q₀ + Φ η` and Φ fixed, the derivative of q by a value is `q₀' + Φ η'`, so that no derivative of a mode is needed and repeated
//! modes are nothing special. From `M̂ η'' = f - Ĉ η̇ - K̂ η` follows `(η'')' = f' - Ĉ' η̇ - K̂' η - M̂' η''`, where `M̂ = I` at the value.

use nalgebra::{Matrix6, Vector6};

use super::system::VariedSystem;
use crate::equations::EquationsDerivative;
use crate::system::{Force, NO_FORCE};

/// Derivatives of the equations of a linear system by a column.
#[derive(Debug, Clone, Copy)]
pub(super) struct ModalDerivative {
    /// Those of `s' = A s + B u`.
    pub equations: EquationsDerivative,
    /// Of K̂, columns.
    pub stiffness: [Force; 6],
    /// Of the modal force of a unit of each component of an input.
    pub force: [Force; 9],
}

impl ModalDerivative {
    /// The derivatives by a column.
    pub(super) fn new(varied: &VariedSystem, column: usize) -> Self {
        let (system, by) = (&varied.system, &varied.derivatives[column]);
        let (shapes, n) = (system.shapes(), system.mode_count());
        let mass = shapes.transpose() * by.mass * shapes;
        let (mut stiffness, mut damping) = ([NO_FORCE; 6], [NO_FORCE; 6]);
        for (row, link) in system.rows().iter().zip(&by.links) {
            let turned: [f64; 6] = (shapes.transpose() * link.row).into();
            let b = row.link.damping();
            for j in 0..n {
                for i in 0..n {
                    let (square, mixed) =
                        (row.rate[i] * row.rate[j], turned[i] * row.rate[j] + row.rate[i] * turned[j]);
                    stiffness[j][i] += link.stiffness * square + row.stiffness * mixed;
                    damping[j][i] += link.damping * square + b * mixed;
                }
            }
        }
        let mut matrix = [[0.0; 12]; 12];
        let own = system.modal_damping();
        let (pull, constant) = varied.stiffness_and_constant();
        for j in 0..n {
            let (pull, drag) = (mass * Vector6::from(pull[j]), mass * own.column(j));
            let frequency = system.frequencies()[j];
            for i in 0..n {
                matrix[j][6 + i] = pull[i] - stiffness[j][i] / frequency;
                matrix[6 + j][6 + i] = drag[i] - damping[j][i];
            }
        }
        let resisted = mass * Vector6::from_column_slice(&constant[..6]);
        let mut constant = varied.constant_derivative(column);
        for i in 0..n {
            constant[i] -= resisted[i];
        }
        let force = forces(varied, column);
        let mut influence = force;
        for (to, own) in influence.iter_mut().zip(system.influence()) {
            let taken = mass * Vector6::from_column_slice(&own[..6]);
            for i in 0..n {
                to[i] -= taken[i];
            }
        }
        let equations = EquationsDerivative { matrix, influence, constant };
        Self { equations, stiffness, force }
    }

    /// Derivative of the quasi-static state under an input: `Ω² η = f`.
    pub(super) fn quasi_static(
        &self,
        varied: &VariedSystem,
        state: &[f64; 12],
        input: &[f64; 9],
    ) -> [f64; 12] {
        let (frequency, n) = (varied.system.frequencies(), varied.system.mode_count());
        let mut out = [0.0; 12];
        for i in 0..n {
            let mut force: f64 = self.force.iter().zip(input).map(|(force, u)| force[i] * u).sum();
            for j in 0..n {
                force -= self.stiffness[j][i] * state[j] / frequency[j];
            }
            out[i] = force / frequency[i];
        }
        out
    }
}

/// Derivatives of the modal force of a unit of each component of an input that contains the factors on the motion.
fn forces(varied: &VariedSystem, column: usize) -> [Force; 9] {
    let (system, by) = (&varied.system, &varied.derivatives[column]);
    let rates = input_rates(varied, column);
    let carried: Matrix6<f64> = system.shapes().transpose() * by.mass;
    let mut out = [NO_FORCE; 9];
    for (component, to) in out.iter_mut().enumerate() {
        for (i, entry) in to.iter_mut().enumerate().take(6) {
            *entry = rates[component] * system.influence()[component][i];
            if component < 3 {
                *entry -= carried[(i, component)];
            }
        }
    }
    out
}

/// Relative derivatives of the components of an input by a column.
pub(super) fn input_rates(varied: &VariedSystem, column: usize) -> [f64; 9] {
    let by = &varied.derivatives[column].factors;
    let rate = |kind: usize| if by[kind] == 0.0 { 0.0 } else { by[kind] / varied.factors[kind] };
    core::array::from_fn(|component| rate(usize::from(component >= 3)))
}
