//! The equations of a system with preloaded links, and those of their derivatives.
//!
//! With the stiffness k of each link at rest the equations are linear but for what the law bends away from that slope,
//! `N = F(δ) - F(δ₀) - k (δ - δ₀)`. Every law is continuous, so there are no jumps; where a row opens or a link with straight segments passes an
//! edge, the slope of the derivatives changes, and the step is short.

use nalgebra::{Matrix6, Vector6};

use super::equations::balanced;
use super::system::{LinkDerivative, VariedSystem};
use crate::equations::{Equations, EquationsDerivative};
use crate::numeric::float::{add_columns, add_scaled, times};
use crate::system::{Force, Input, LinkRow, NO_FORCE, State, System};

/// A system with preloaded links, and its derivatives.
#[derive(Debug, Clone)]
pub(super) struct SmoothSystem {
    /// The system as it is, with all links on the slope at rest, and its derivatives.
    pub linear: VariedSystem,
    /// Indices of the nonlinear links.
    pub links: Vec<usize>,
    pub columns: Vec<SmoothColumn>,
}

/// What the equations of the derivatives by a column depend on.
#[derive(Debug, Clone)]
pub(super) struct SmoothColumn {
    pub linear: EquationsDerivative,
    /// M̂', columns; none if it is zero.
    pub mass: Option<[Force; 6]>,
    /// Derivatives of the modal force per unit of load of each nonlinear link; none if all are zero.
    pub turned: Option<Vec<Force>>,
}

/// What the nonlinear links do at a state.
#[derive(Debug, Clone, Default)]
pub(super) struct NonlinearResiduals {
    /// Of each link: deflection from rest, N, slope of the law, and slope less k.
    pub of_links: Vec<[f64; 4]>,
    /// Modal force of all.
    force: Force,
    /// Columns of its derivative by `ω η`.
    by_state: [Force; 6],
}

impl SmoothSystem {
    pub(super) fn new(varied: &VariedSystem) -> Self {
        let links: Vec<usize> = varied.system.nonlinear().map(|(link, _)| link).collect();
        let linear = VariedSystem { system: varied.system.linearised(), ..varied.clone() };
        let shapes = *varied.system.shapes();
        let columns = varied.derivatives.iter().enumerate().map(|(column, by)| {
            let mass: Matrix6<f64> = shapes.transpose() * by.mass * shapes;
            let turned = links.iter().map(|&link| modal(&(shapes.transpose() * by.links[link].row)));
            SmoothColumn {
                linear: EquationsDerivative::new(&linear, column),
                mass: (mass != Matrix6::zeros())
                    .then(|| core::array::from_fn(|j| modal(&mass.column(j).into_owned()))),
                turned: links
                    .iter()
                    .any(|&link| by.links[link].row != Vector6::zeros())
                    .then(|| turned.collect()),
            }
        });
        let columns = columns.collect();
        Self { linear, links, columns }
    }

    fn system(&self) -> &System {
        &self.linear.system
    }

    /// The nonlinear links at a state of `varied`, the system with its laws.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn set_residuals(&self, varied: &VariedSystem, state: &State, to: &mut NonlinearResiduals) {
        (to.force, to.by_state) = (NO_FORCE, [NO_FORCE; 6]);
        to.of_links.clear();
        for &link in &self.links {
            let row = &varied.system.rows()[link];
            let mut moved = 0.0;
            for j in 0..6 {
                moved += row.deflection[j] * state[j];
            }
            let (law, at) = (row.link.law(), row.rest + moved);
            let (bend, slope) = (law.force(at) - row.load - row.stiffness * moved, law.tangent(at));
            let further = slope - row.stiffness;
            for i in 0..6 {
                to.force[i] -= row.rate[i] * bend;
            }
            for j in 0..6 {
                let factor = -further * row.deflection[j];
                for i in 0..6 {
                    to.by_state[j][i] += factor * row.rate[i];
                }
            }
            to.of_links.push([moved, bend, slope, further]);
        }
    }

    /// Whether a nonlinear link is on another segment of its law in the second state than in the first.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn passes_edge(&self, varied: &VariedSystem, from: &State, to: &State) -> bool {
        self.links.iter().any(|&link| {
            let row = &varied.system.rows()[link];
            row.segment_at(from) != row.segment_at(to)
        })
    }

    /// Rate of change of a state.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn rate(&self, residuals: &NonlinearResiduals, state: &State, input: &Input) -> State {
        let mut force = residuals.force;
        add_columns(&mut force, self.system().influence(), input);
        self.system().linear(state, &force)
    }

    /// Derivative of the rate of change at a fixed state.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn rate_derivative(
        &self,
        (varied, column): (&VariedSystem, usize),
        residuals: &NonlinearResiduals,
        state: &State,
        input: &Input,
    ) -> State {
        let (of, by) = (&self.columns[column], &varied.derivatives[column]);
        let equations = &of.linear;
        let mut force = equations.constant;
        add_columns(&mut force, &equations.influence, input);
        if let Some(mass) = &of.mass {
            for (j, column) in mass.iter().enumerate() {
                add_scaled(&mut force, column, -residuals.force[j]);
            }
        }
        for (place, &link) in self.links.iter().enumerate() {
            let (row, bend) = (&varied.system.rows()[link], &residuals.of_links[place]);
            let turned = of.turned.as_ref().map(|all| &all[place]);
            let load = fixed_load(row, &by.links[link], turned, (varied, state), bend);
            for i in 0..6 {
                force[i] -= row.rate[i] * load;
            }
            if let Some(turned) = turned {
                add_scaled(&mut force, turned, -bend[1]);
            }
        }
        let mut out = times(&equations.matrix, state);
        for i in 0..6 {
            out[6 + i] += force[i];
        }
        out
    }

    /// Rate of change of the derivative of a state, whose part at a fixed state is `fixed`.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn tangent_rate(
        &self,
        residuals: &NonlinearResiduals,
        fixed: &State,
        tangent: &State,
    ) -> State {
        let mut out = self.system().linear(tangent, &times(&residuals.by_state, tangent));
        add_scaled(&mut out, fixed, 1.0);
        out
    }

    /// Derivative of N of the nonlinear link at a place of `links`.
    pub(super) fn bend_derivative(
        &self,
        (varied, column): (&VariedSystem, usize),
        place: usize,
        residuals: &NonlinearResiduals,
        (state, tangent): (&State, &State),
    ) -> f64 {
        let (row, by) = (&varied.system.rows()[self.links[place]], &varied.derivatives[column]);
        let turned = self.columns[column].turned.as_ref().map(|all| &all[place]);
        let bend = &residuals.of_links[place];
        let mut out = fixed_load(row, &by.links[self.links[place]], turned, (varied, state), bend);
        for j in 0..6 {
            out += bend[3] * row.deflection[j] * tangent[j];
        }
        out
    }

    /// Derivatives of a state of equilibrium: `dη'' = 0`.
    pub(super) fn balanced(&self, residuals: &NonlinearResiduals, fixed: &State) -> State {
        let (mut stiffness, _) = self.linear.stiffness_and_constant();
        for j in 0..6 {
            for i in 0..6 {
                stiffness[j][i] -= residuals.by_state[j][i];
            }
        }
        balanced(&stiffness, self.system().mode_count(), &fixed[6..])
    }
}

/// Derivative of N of a link at a fixed state.
#[cfg_attr(feature = "std", inline(always))]
fn fixed_load(
    row: &LinkRow,
    by: &LinkDerivative,
    turned: Option<&Force>,
    (varied, state): (&VariedSystem, &State),
    &[moved, _, slope, further]: &[f64; 4],
) -> f64 {
    let mut load = slope * by.rest - by.load - by.stiffness * moved;
    if !by.law.is_zero() {
        load += row.link.law().force_derivative(row.rest + moved, &by.law);
    }
    if let Some(turned) = turned {
        for mode in 0..varied.system.mode_count() {
            load += further * turned[mode] / varied.system.frequencies()[mode] * state[mode];
        }
    }
    load
}

fn modal(of: &Vector6<f64>) -> Force {
    let mut out = NO_FORCE;
    out[..6].copy_from_slice(of.as_slice());
    out
}
