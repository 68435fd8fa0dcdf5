//! Derivatives of the histories of a run: loads of links and groups, motion of L, reactions.

use std::sync::OnceLock;

use super::adjoint::through_states;
use super::contacts::{ContactChanges, Recorded};
use super::error::SensitivityError;
use super::rows::{Operands, Quantity, Row, WeightedSums, apply, state_weights};
use super::smooth::SmoothSystem;
use super::system::VariedSystem;
use super::tangents::{LinearRun, Prepared, forcing, tangent_states};
use crate::error::Stopped;
use crate::excitation::Excitation;
use crate::integrate::{Control, NamedMethod, Output, Start};
use crate::numeric::simd::dispatch_wide;
use crate::numeric::watch::{Watch, filled};
use crate::output::Watched;
use crate::system::{Input, ModelLevel, State};
use crate::variation::Group;

/// The states of a run at the samples of its excitation.
#[derive(Debug, Clone)]
pub struct History {
    states: Vec<State>,
    contacts: Option<ContactChanges>,
    smooth: Option<SmoothSystem>,
    quasi_static: bool,
    /// Once computed.
    tangents: OnceLock<Tangents>,
}

/// The derivatives of the states of a run by each column of values, (column, sample).
#[derive(Debug, Clone)]
pub struct Tangents(pub(super) Vec<State>);

impl History {
    /// Runs a system. `excitation`: with the factors on the motion.
    ///
    /// # Errors
    /// [`SensitivityError::ContactDamper`]; [`SensitivityError::AtSample`]; [`SensitivityError::Factor`] for a derivative by a factor on the
    /// motion that is zero; and those of a run.
    pub fn new(
        varied: &VariedSystem,
        excitation: &Excitation,
        start: Start,
        watch: Watch,
    ) -> Result<Self, SensitivityError> {
        let system = &varied.system;
        let by_zero = |kind: usize| {
            varied.factors[kind] == 0.0 && varied.derivatives.iter().any(|by| by.factors[kind] != 0.0)
        };
        if by_zero(0) || by_zero(1) {
            return Err(SensitivityError::Factor);
        }
        let quasi_static = start == Start::QuasiStatic;
        if system.model_level() == ModelLevel::SmoothNonlinear {
            let (smooth, states, tangents) = SmoothSystem::run(varied, excitation, quasi_static, watch)?;
            let tangents = OnceLock::from(Tangents(tangents));
            return Ok(Self { states, contacts: None, smooth: Some(smooth), quasi_static, tangents });
        }
        let mut record = Watched { record: Recorded::default(), watch };
        let control = Control::Adaptive { rtol: 1e-6 };
        NamedMethod::Exact.run(system, control, start, excitation, Output::Samples, &mut record)?;
        let (contacts, states) = if system.model_level() == ModelLevel::Linear {
            (None, record.record.states)
        } else {
            let (contacts, states) = ContactChanges::new(varied, excitation, record.record)?;
            (Some(contacts), states)
        };
        Ok(Self { states, contacts, smooth: None, quasi_static, tangents: OnceLock::new() })
    }

    /// Whether all links are linear.
    pub(super) fn is_linear(&self) -> bool {
        self.contacts.is_none() && self.smooth.is_none()
    }

    /// The states.
    pub fn states(&self) -> &[State] {
        &self.states
    }

    fn run<'a>(&'a self, varied: &'a VariedSystem, excitation: &'a Excitation) -> LinearRun<'a> {
        let (states, contacts) = (&self.states[..], self.contacts.as_ref());
        LinearRun { varied, excitation, states, contacts, quasi_static: self.quasi_static }
    }

    /// The derivatives of the states by each column.
    ///
    /// # Errors
    /// [`SensitivityError::Stopped`].
    pub fn tangents(
        &self,
        varied: &VariedSystem,
        excitation: &Excitation,
        watch: Watch,
    ) -> Result<&Tangents, SensitivityError> {
        if let Some(known) = self.tangents.get() {
            return Ok(known);
        }
        let count = varied.derivatives.len().saturating_mul(self.states.len());
        let mut tangents = filled([0.0; 12], count)?;
        if !tangent_states(self.run(varied, excitation), watch, &mut tangents) {
            return Err(Stopped::Interrupted.into());
        }
        Ok(self.tangents.get_or_init(|| Tangents(tangents)))
    }

    /// The derivative of a figure by each column, from its derivatives `weights` by a quantity at each sample, (sample, width).
    ///
    /// # Errors
    /// As [`History::tangents`], which are computed if hardly a length of interval recurs.
    ///
    /// # Panics
    /// If the length of `weights` is not that of the quantity at all samples.
    pub fn gradient(
        &self,
        (varied, groups): (&VariedSystem, &[Group]),
        excitation: &Excitation,
        (quantity, weights): (Quantity, &[f64]),
        watch: Watch,
    ) -> Result<Vec<f64>, SensitivityError> {
        let (count, width) = (self.states.len(), quantity.width(varied, groups));
        assert_eq!(weights.len(), count * width, "a weight for every number");
        let columns = varied.derivatives.len();
        if width == 0 {
            return Ok(vec![0.0; columns]);
        }
        let Some(prepared) = self.is_linear().then(|| Prepared::backwards(varied, excitation)).flatten()
        else {
            let tangents = self.tangents(varied, excitation, watch)?;
            let mut all = vec![0.0; columns * count * width];
            let of = |sample: usize| weights[sample * width..(sample + 1) * width].iter().any(|w| *w != 0.0);
            self.derivatives_where(of, tangents, (varied, groups), excitation, quantity, &mut all);
            let figure = |of: &[f64]| of.iter().zip(weights).map(|(by, weight)| by * weight).sum();
            return Ok(all.chunks_exact(usize::max(count * width, 1)).map(figure).collect());
        };
        let rows: Vec<Vec<Row>> =
            (0..columns).map(|column| quantity.rows(varied, groups, Some(column))).collect();
        let Some(own) = rows.first() else { return Ok(Vec::new()) };
        let by_state = dispatch_wide!(state_weights(own, weights));
        let mut out = through_states(self.run(varied, excitation), &prepared, &by_state);
        // Directly, at fixed states: the weighted sums of states and inputs are those of every column.
        let (inputs, components) = (inputs(excitation), prepared.forcing.components());
        let at = Operands { states: &self.states, tangents: &[], inputs: &inputs, components };
        let sums = dispatch_wide!(WeightedSums::new(at, weights, width));
        for (out, rows) in out.iter_mut().zip(&rows) {
            *out += sums.with(rows);
        }
        Ok(out)
    }

    /// Derivatives of a quantity by each column, (column, sample, width of the quantity), in the order of its links, groups or degrees of
    /// freedom. Returns whether all of them are finite.
    ///
    /// # Panics
    /// If the length of `out` is not that of the derivatives.
    pub fn derivatives(
        &self,
        tangents: &Tangents,
        varied: (&VariedSystem, &[Group]),
        excitation: &Excitation,
        quantity: Quantity,
        out: &mut [f64],
    ) -> bool {
        self.derivatives_where(|_| true, tangents, varied, excitation, quantity, out)
    }

    /// [`History::derivatives`] at some samples; the others are left as they are.
    fn derivatives_where(
        &self,
        wanted: impl Fn(usize) -> bool,
        Tangents(tangents): &Tangents,
        (varied, groups): (&VariedSystem, &[Group]),
        excitation: &Excitation,
        quantity: Quantity,
        out: &mut [f64],
    ) -> bool {
        let count = self.states.len();
        let width = quantity.width(varied, groups);
        assert_eq!(out.len(), varied.derivatives.len() * count * width, "room for every derivative");
        let (inputs, forcing) = (inputs(excitation), forcing(varied, excitation));
        let components = forcing.components();
        let (mut finite, states) = (true, &self.states[..]);
        let whole = varied;
        let linear = self.smooth.as_ref().map_or(varied, |smooth| &smooth.linear);
        for (varied, samples) in ContactChanges::samples(self.contacts.as_ref(), linear, count, &wanted) {
            for column in 0..varied.derivatives.len() {
                let rows = quantity.rows(varied, groups, Some(column));
                let tangents = &tangents[column * count..(column + 1) * count];
                let out = &mut out[column * count * width..(column + 1) * count * width];
                finite &=
                    apply(&rows, Operands { states, tangents, inputs: &inputs, components }, &samples, out);
            }
        }
        if let Some(smooth) = &self.smooth {
            let runs = (states, &tangents[..]);
            smooth.add_bends((whole, groups), runs, quantity, wanted, out);
            finite &= out.iter().all(|number| number.is_finite());
        }
        finite
    }
}

/// The inputs at the samples.
fn inputs(excitation: &Excitation) -> Vec<Input> {
    (0..excitation.count()).map(|k| excitation.input(k)).collect()
}
