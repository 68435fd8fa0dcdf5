//! Derivatives of the histories of a run: loads of links and groups, motion of L, reactions.

use std::ops::Range;
use std::sync::OnceLock;

use super::adjoint::through_states;
use super::contacts::{ContactChanges, Recorded};
use super::error::SensitivityError;
use super::loads::{group_load, link_load};
use super::motions::{acceleration_of, reaction_of};
use super::quantity::Quantity;
use super::smooth::SmoothSystem;
use super::system::VariedSystem;
use super::tangents::{LinearRun, Prepared, tangent_states};
use crate::error::Stopped;
use crate::excitation::Excitation;
use crate::integrate::{Control, Exact, Output, Start, run_from};
use crate::numeric::float::add_scaled;
use crate::numeric::simd::{Kernel, LANES, dispatch};
use crate::numeric::watch::{Watch, check_memory};
use crate::output::{
    Linear, Watched, acceleration, link_load as own_link_load, position, reaction, velocity,
};
use crate::system::{ModelLevel, State};
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
pub struct Tangents(Vec<State>);

impl History {
    /// Runs a system. `excitation`: with the factors on the motion.
    ///
    /// # Errors
    /// [`SensitivityError::ContactDamper`]; [`SensitivityError::AtSample`]; [`SensitivityError::Factor`] for a derivative by a factor on the motion that is zero; and those of a
    /// run.
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
        run_from(system, &Exact::<8>, control, start, excitation, Output::Samples, &mut record)?;
        if system.model_level() == ModelLevel::Linear {
            let (states, tangents) = (record.record.states, OnceLock::new());
            return Ok(Self { states, contacts: None, smooth: None, quasi_static, tangents });
        }
        let (contacts, states) = ContactChanges::new(varied, excitation, record.record)?;
        let (contacts, tangents) = (Some(contacts), OnceLock::new());
        Ok(Self { states, contacts, smooth: None, quasi_static, tangents })
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
        check_memory(count.saturating_mul(size_of::<State>()))?;
        let mut tangents = vec![[0.0; 12]; count];
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
        let linear = self.contacts.is_none() && self.smooth.is_none();
        let Some(prepared) = linear.then(|| Prepared::backwards(varied, excitation)).flatten() else {
            let tangents = self.tangents(varied, excitation, watch)?;
            let mut all = vec![0.0; columns * count * width];
            let of = |sample: usize| weights[sample * width..(sample + 1) * width].iter().any(|w| *w != 0.0);
            self.derivatives_where(of, tangents, (varied, groups), excitation, quantity, &mut all);
            let figure = |of: &[f64]| of.iter().zip(weights).map(|(by, weight)| by * weight).sum();
            return Ok(all.chunks_exact(usize::max(count * width, 1)).map(figure).collect());
        };
        let rows: Vec<Vec<Row>> = (0..columns).map(|column| quantity.rows(varied, groups, column)).collect();
        let Some(own) = rows.first() else { return Ok(Vec::new()) };
        let by_state = dispatch(StateWeights { rows: own, weights });
        let kinds = (&prepared.intervals[..], &prepared.recurring[..]);
        let mut out = through_states(self.run(varied, excitation), &prepared.columns, kinds, &by_state);
        // Directly, at fixed states: the weighted sums of states and inputs are those of every column.
        for row in 0..width {
            let (mut state, mut input, mut sum) = ([0.0; 12], [0.0; 9], 0.0);
            for (k, weights) in weights.chunks_exact(width).enumerate().filter(|(_, w)| w[row] != 0.0) {
                add_scaled(&mut state, &self.states[k], weights[row]);
                add_scaled(&mut input, &excitation.input(k), weights[row]);
                sum += weights[row];
            }
            for (out, rows) in out.iter_mut().zip(&rows) {
                let Row { constant, by_state, by_input, .. } = &rows[row];
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                *out += constant * sum + dot(by_state, &state) + dot(by_input, &input);
            }
        }
        Ok(out)
    }

    /// Derivatives of a quantity by each column, (column, sample, width of the quantity), in the order of its links, groups or degrees of
    /// freedom.
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
    ) {
        self.derivatives_where(|_| true, tangents, varied, excitation, quantity, out);
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
    ) {
        let count = self.states.len();
        let width = quantity.width(varied, groups);
        assert_eq!(out.len(), varied.derivatives.len() * count * width, "room for every derivative");
        let whole = varied;
        let linear = self.smooth.as_ref().map_or(varied, |smooth| &smooth.linear);
        for (varied, samples) in ContactChanges::samples(self.contacts.as_ref(), linear, count, &wanted) {
            for column in 0..varied.derivatives.len() {
                let rows = quantity.rows(varied, groups, column);
                let tangents = &tangents[column * count..(column + 1) * count];
                let out = &mut out[column * count * width..(column + 1) * count * width];
                for (block, rows) in rows.chunks(LANES).enumerate() {
                    let (rows, states, samples) = (RowBlock::new(rows), &self.states[..], &samples[..]);
                    let from = block * LANES;
                    dispatch(Rows { rows, samples, states, tangents, excitation, from, width, out });
                }
            }
        }
        if let Some(smooth) = &self.smooth {
            let runs = (&self.states[..], &tangents[..]);
            smooth.add_bends((whole, groups), runs, quantity, wanted, out);
        }
    }
}

impl Quantity {
    /// Numbers per instant.
    pub fn width(self, varied: &VariedSystem, groups: &[Group]) -> usize {
        match self {
            Self::LinkLoads(_) => varied.system.rows().len(),
            Self::GroupLoads(_) => 6 * groups.len(),
            _ => 6,
        }
    }

    fn rows(self, varied: &VariedSystem, groups: &[Group], column: usize) -> Vec<Row> {
        let system = &varied.system;
        match self {
            Self::LinkLoads(part) => (0..system.rows().len())
                .flat_map(|link| {
                    let own = own_link_load(system, link, part).linear;
                    rows(&own, &link_load(varied, column, link, part))
                })
                .collect(),
            Self::GroupLoads(part) => groups
                .iter()
                .enumerate()
                .flat_map(|(index, group)| {
                    let place = varied.place(column, index, group);
                    let by = group_load(varied, column, group.links.iter().copied(), place, part);
                    rows(&varied.group_load(index, group, part).linear, &by)
                })
                .collect(),
            Self::Position => {
                let mut by = Linear::NOTHING;
                by.constant = varied.derivatives[column].static_position.into();
                rows(&position(system).linear, &by)
            }
            Self::Velocity => rows(&velocity(system).linear, &Linear::NOTHING),
            Self::Acceleration => rows(&acceleration(system).linear, &acceleration_of(varied, column)),
            Self::Reaction => rows(&reaction(system).linear, &reaction_of(varied, column)),
        }
    }
}

/// The derivative of one number: `by_tangent · s' + by_state · s + by_input · u + constant`.
#[derive(Clone, Copy)]
struct Row {
    constant: f64,
    by_tangent: [f64; 12],
    by_state: [f64; 12],
    by_input: [f64; 9],
}

/// The rows of a quantity from itself and its derivative at a fixed state and input.
fn rows<const ROWS: usize>(own: &Linear<ROWS>, by: &Linear<ROWS>) -> Vec<Row> {
    let row = |row: usize| Row {
        constant: by.constant[row],
        by_tangent: own.by_state.map(|column| column[row]),
        by_state: by.by_state.map(|column| column[row]),
        by_input: by.by_input.map(|column| column[row]),
    };
    (0..ROWS).map(row).collect()
}

/// Derivatives of a figure by the state at each sample, through the rows of a quantity.
struct StateWeights<'a> {
    rows: &'a [Row],
    weights: &'a [f64],
}

impl Kernel for StateWeights<'_> {
    type Output = Vec<State>;

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) -> Vec<State> {
        let Self { rows, weights } = self;
        let mut out = Vec::with_capacity(weights.len() / rows.len());
        for weights in weights.chunks_exact(rows.len()) {
            let mut sum = [0.0; 12];
            for (row, &weight) in rows.iter().zip(weights) {
                if weight != 0.0 {
                    add_scaled(&mut sum, &row.by_tangent, weight);
                }
            }
            out.push(sum);
        }
        out
    }
}

/// Some rows side by side.
struct RowBlock {
    count: usize,
    constant: [f64; LANES],
    by_tangent: [[f64; LANES]; 12],
    by_state: [[f64; LANES]; 12],
    by_input: [[f64; LANES]; 9],
    has_state: bool,
    has_input: bool,
}

impl RowBlock {
    fn new(rows: &[Row]) -> Self {
        let mut block = Self {
            count: rows.len(),
            constant: [0.0; LANES],
            by_tangent: [[0.0; LANES]; 12],
            by_state: [[0.0; LANES]; 12],
            by_input: [[0.0; LANES]; 9],
            has_state: rows.iter().any(|row| row.by_state != [0.0; 12]),
            has_input: rows.iter().any(|row| row.by_input != [0.0; 9]),
        };
        for (lane, row) in rows.iter().enumerate() {
            block.constant[lane] = row.constant;
            for j in 0..12 {
                (block.by_tangent[j][lane], block.by_state[j][lane]) = (row.by_tangent[j], row.by_state[j]);
            }
            for j in 0..9 {
                block.by_input[j][lane] = row.by_input[j];
            }
        }
        block
    }
}

/// Writes some rows at these samples to `out[instant * width + from..]`.
struct Rows<'a> {
    rows: RowBlock,
    samples: &'a [Range<usize>],
    states: &'a [State],
    tangents: &'a [State],
    excitation: &'a Excitation<'a>,
    from: usize,
    width: usize,
    out: &'a mut [f64],
}

impl Kernel for Rows<'_> {
    type Output = ();

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) {
        let Self { rows, samples, states, tangents, excitation, from, width, out } = self;
        for of in samples {
            let runs = tangents[of.clone()]
                .iter()
                .zip(out[of.start * width..of.end * width].chunks_exact_mut(width));
            for (k, (tangent, out)) in of.clone().zip(runs) {
                let (mut sum, mut second) = (rows.constant, [0.0; LANES]);
                for j in 0..6 {
                    add_scaled(&mut sum, &rows.by_tangent[j], tangent[j]);
                    add_scaled(&mut second, &rows.by_tangent[6 + j], tangent[6 + j]);
                }
                if rows.has_state {
                    for j in 0..6 {
                        add_scaled(&mut sum, &rows.by_state[j], states[k][j]);
                        add_scaled(&mut second, &rows.by_state[6 + j], states[k][6 + j]);
                    }
                }
                if rows.has_input {
                    for (column, value) in rows.by_input.iter().zip(excitation.input(k)) {
                        add_scaled(&mut sum, column, value);
                    }
                }
                for i in 0..LANES {
                    sum[i] += second[i];
                }
                out[from..from + rows.count].copy_from_slice(&sum[..rows.count]);
            }
        }
    }
}
