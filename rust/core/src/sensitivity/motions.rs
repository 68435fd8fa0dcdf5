//! Derivatives of the acceleration of L and of the reaction of the held degrees of freedom, as functions of the state.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::equations::input_rates;
use super::loads::group_load;
use super::system::VariedSystem;
use crate::equations::EquationsDerivative;
use crate::model::Dof;
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
    add_product(&mut out, &by.mass, &own);
    add_product(&mut out, mass, &acceleration_of(varied, column));
    let rates = input_rates(varied, column);
    for row in 0..6 {
        out.constant[row] -= by.weight[row];
        for axis in 0..3 {
            out.by_input[axis][row] += by.mass[(row, axis)] + mass[(row, axis)] * rates[axis];
        }
        out.by_input[3 + row][row] -= rates[3 + row];
    }
    for row in Dof::ALL.into_iter().filter(|&dof| system.free().contains(dof)).map(|dof| dof as usize) {
        out.constant[row] = 0.0;
        out.by_state.iter_mut().for_each(|column| column[row] = 0.0);
        out.by_input.iter_mut().for_each(|column| column[row] = 0.0);
    }
    out
}

/// Adds a matrix times a quantity.
fn add_product(to: &mut Linear<6>, matrix: &Matrix6<f64>, of: &Linear<6>) {
    let product = |column: &[f64; 6]| matrix * Vector6::from(*column);
    let add = |to: &mut [f64; 6], column: &[f64; 6]| {
        for (to, from) in to.iter_mut().zip(product(column).iter()) {
            *to += from;
        }
    };
    add(&mut to.constant, &of.constant);
    to.by_state.iter_mut().zip(&of.by_state).for_each(|(to, from)| add(to, from));
    to.by_input.iter_mut().zip(&of.by_input).for_each(|(to, from)| add(to, from));
    to.by_input_at_all |= of.by_input_at_all;
}
