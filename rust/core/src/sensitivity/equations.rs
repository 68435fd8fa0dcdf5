//! Derivatives of the linear equations in the modes of the system, which stay as they are.
//!
//! With `q = q₀ + Φ η` and Φ fixed, the derivative of q by a value is `q₀' + Φ η'`, so that no derivative of a mode is needed and repeated
//! modes are nothing special. From `M̂ η'' = f - Ĉ η̇ - K̂ η` follows `(η'')' = f' - Ĉ' η̇ - K̂' η - M̂' η''`, where `M̂ = I` at the value.

use nalgebra::{Matrix6, Vector6};

use super::system::VariedSystem;
use crate::equations::EquationsDerivative;
use crate::numeric::float::{add_columns, times};
use crate::system::{Force, Input, NO_FORCE, Square, State};

impl EquationsDerivative {
    /// The derivatives of the equations of a linear system by all columns.
    pub(super) fn all(varied: &VariedSystem) -> Vec<Self> {
        (0..varied.derivatives.len()).map(|column| Self::new(varied, column)).collect()
    }

    /// The derivatives of the equations of a linear system by a column.
    pub(super) fn new(varied: &VariedSystem, column: usize) -> Self {
        let (system, by) = (&varied.system, &varied.derivatives[column]);
        let (shapes, n) = (system.shapes(), system.mode_count());
        let mass = shapes.transpose() * by.mass * shapes;
        let (mut stiffness, mut damping) = ([NO_FORCE; 6], [NO_FORCE; 6]);
        for (row, link) in system.rows().iter().zip(&by.links) {
            let turned = link.rate(system);
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
        let mut influence = forces(varied, column);
        for (to, own) in influence.iter_mut().zip(system.influence()) {
            let taken = mass * Vector6::from_column_slice(&own[..6]);
            for i in 0..n {
                to[i] -= taken[i];
            }
        }
        Self { matrix, influence, constant }
    }

    /// Derivative of the quasi-static state under an input: at rest there is no acceleration.
    pub(super) fn quasi_static(&self, varied: &VariedSystem, state: &State, input: &Input) -> State {
        let mut force = self.constant;
        add_columns(&mut force, &self.influence, input);
        let by_state = times(&self.matrix, state);
        let rate: [f64; 6] = core::array::from_fn(|i| force[i] + by_state[6 + i]);
        let (stiffness, _) = varied.stiffness_and_constant();
        balanced(&stiffness, varied.system.mode_count(), &rate)
    }
}

/// Solves `S x = f` for a state of equilibrium, S by columns and of n modes.
pub(super) fn balanced(stiffness: &Square, n: usize, force: &[f64]) -> State {
    let mut matrix = Matrix6::from_fn(|i, j| stiffness[j][i]);
    for mode in n..6 {
        matrix[(mode, mode)] = 1.0;
    }
    let solved = matrix.lu().solve(&Vector6::from_column_slice(force)).unwrap_or(Vector6::repeat(f64::NAN));
    core::array::from_fn(|i| if i < 6 { solved[i] } else { 0.0 })
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
