//! Derivatives of the acceleration of L and of the reaction of the held degrees of freedom, as functions of the state.

use nalgebra::{Vector3, Vector6};

use super::equations::input_rates;
use super::loads::group_load;
use super::system::VariedSystem;
use crate::equations::EquationsDerivative;
use crate::output::{Axes, Linear, Part, acceleration};

/// Derivative of the acceleration of L at a fixed state and input, by a column.
pub(super) fn acceleration_of(varied: &VariedSystem, column: usize) -> Linear<6> {
    let by = EquationsDerivative::new(varied, column);
    let shapes = varied.system.shapes();
    let spread = |modal: &[f64]| -> [f64; 6] { (shapes * Vector6::from_column_slice(&modal[..6])).into() };
    Linear {
        constant: spread(&by.constant),
        by_state: by.matrix.map(|of| spread(&of[6..])),
        by_input: by.influence.map(|of| spread(&of)),
        by_input_at_all: true,
    }
}

/// Derivative of the reaction of the held degrees of freedom at a fixed state and input, by a column.
///
/// `reaction = M q'' + M_u a - Q - E + (loads of all links)` in the held rows.
pub(super) fn reaction_of(varied: &VariedSystem, column: usize) -> Linear<6> {
    let (system, by) = (&varied.system, &varied.derivatives[column]);
    let mass = &system.matrices().mass;
    let links = 0..system.rows().len();
    let mut out = group_load(varied, column, links, ([Vector3::zeros(); 2], Axes::MACHINE), Part::Total);
    let (mut own, (_, force)) = (acceleration(system).linear, varied.stiffness_and_constant());
    own.constant = (system.shapes() * Vector6::from_column_slice(&force[..6])).into();
    out.add_product(&by.mass, &own);
    out.add_product(mass, &acceleration_of(varied, column));
    let rates = input_rates(varied, column);
    for row in 0..6 {
        out.constant[row] -= by.weight[row];
        for axis in 0..3 {
            out.by_input[axis][row] += by.mass[(row, axis)] + mass[(row, axis)] * rates[axis];
        }
        out.by_input[3 + row][row] -= rates[3 + row];
    }
    out.clear_free(system.free());
    out
}
