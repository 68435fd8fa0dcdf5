//! What is computed from the states of a run, as rows: numbers that are linear in state, input and the derivative of the state.

use std::ops::Range;

use super::loads::{group_load, link_load};
use super::motions::{acceleration_of, reaction_of};
use super::system::VariedSystem;
use crate::numeric::float::add_scaled;
use crate::numeric::simd::{LANES, Lanes, dispatch_wide};
use crate::output::{Linear, Part, acceleration, link_load as own_link_load, position, reaction, velocity};
use crate::system::{Input, State};
use crate::variation::Group;

/// What is computed from the states of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity {
    /// A part of the load of each link along its direction, N.
    LinkLoads(Part),
    /// A part of the load of each group about its centre, N and N m.
    GroupLoads(Part),
    /// Position of L in the travelling frame, sag included.
    Position,
    /// Its velocity.
    Velocity,
    /// Its acceleration.
    Acceleration,
    /// Reaction of the held degrees of freedom.
    Reaction,
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

    /// Its derivatives by a column; without one, itself, whose state then stands for the derivative of the state.
    pub(super) fn rows(self, varied: &VariedSystem, groups: &[Group], column: Option<usize>) -> Vec<Row> {
        let system = &varied.system;
        match self {
            Self::LinkLoads(part) => (0..system.rows().len())
                .flat_map(|link| {
                    let own = own_link_load(system, link, part).linear;
                    rows(&own, column.map(|column| link_load(varied, column, link, part)))
                })
                .collect(),
            Self::GroupLoads(part) => groups
                .iter()
                .enumerate()
                .flat_map(|(index, group)| {
                    let own = varied.group_load(index, group, part).linear;
                    let links = group.links.iter().copied();
                    let place = |column| varied.place(column, index, group);
                    rows(&own, column.map(|column| group_load(varied, column, links, place(column), part)))
                })
                .collect(),
            Self::Position => {
                let moved = |column: usize| varied.derivatives[column].static_position.into();
                let by = column.map(|column| Linear { constant: moved(column), ..Linear::NOTHING });
                rows(&position(system).linear, by)
            }
            Self::Velocity => rows(&velocity(system).linear, column.map(|_| Linear::NOTHING)),
            Self::Acceleration => {
                rows(&acceleration(system).linear, column.map(|column| acceleration_of(varied, column)))
            }
            Self::Reaction => {
                rows(&reaction(system).linear, column.map(|column| reaction_of(varied, column)))
            }
        }
    }
}

/// The derivative of one number: `by_tangent · s' + by_state · s + by_input · u + constant`.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub constant: f64,
    pub by_tangent: [f64; 12],
    pub by_state: [f64; 12],
    pub by_input: [f64; 9],
}

/// The rows of a quantity from itself and its derivative at a fixed state and input; without one, those of itself.
fn rows<const ROWS: usize>(own: &Linear<ROWS>, by: Option<Linear<ROWS>>) -> Vec<Row> {
    let by = by.unwrap_or(Linear { by_state: [[0.0; ROWS]; 12], ..*own });
    let row = |row: usize| Row {
        constant: by.constant[row],
        by_tangent: own.by_state.map(|column| column[row]),
        by_state: by.by_state.map(|column| column[row]),
        by_input: by.by_input.map(|column| column[row]),
    };
    (0..ROWS).map(row).collect()
}

/// Sums of rows with factors `along` (sum, row).
pub(super) fn combined(rows: &[Row], along: &[f64], width: usize) -> Vec<Row> {
    let sum = |factors: &[f64]| {
        let mut sum = Row { constant: 0.0, by_tangent: [0.0; 12], by_state: [0.0; 12], by_input: [0.0; 9] };
        for (row, &factor) in rows.iter().zip(factors).filter(|(_, factor)| **factor != 0.0) {
            sum.constant += factor * row.constant;
            add_scaled(&mut sum.by_tangent, &row.by_tangent, factor);
            add_scaled(&mut sum.by_state, &row.by_state, factor);
            add_scaled(&mut sum.by_input, &row.by_input, factor);
        }
        sum
    };
    along.chunks_exact(usize::max(width, 1)).map(sum).collect()
}

/// What rows are applied to, at some instants.
#[derive(Clone, Copy)]
pub(super) struct Operands<'a> {
    pub states: &'a [State],
    pub tangents: &'a [State],
    pub inputs: &'a [Input],
    /// Components of the input that are not zero throughout.
    pub components: &'a [usize],
}

/// Writes rows at some instants to `out`, (instant, row). Returns whether all numbers are finite.
pub(super) fn apply(rows: &[Row], at: Operands, instants: &[Range<usize>], out: &mut [f64]) -> bool {
    let blocks: Vec<RowBlock> = rows.chunks(LANES).map(|rows| RowBlock::new(rows, at.components)).collect();
    dispatch_wide!(apply_blocks(&blocks, rows.len(), at, instants, out))
}

/// Some rows side by side.
struct RowBlock {
    count: usize,
    constant: Lanes,
    by_tangent: [Lanes; 12],
    by_state: [Lanes; 12],
    by_input: Vec<(usize, Lanes)>,
    has_state: bool,
}

impl RowBlock {
    fn new(rows: &[Row], components: &[usize]) -> Self {
        let beside = |number: &dyn Fn(&Row) -> f64| {
            let mut lanes = [0.0; LANES];
            lanes.iter_mut().zip(rows).for_each(|(lane, row)| *lane = number(row));
            lanes
        };
        let used = components.iter().filter(|&&j| rows.iter().any(|row| row.by_input[j] != 0.0));
        Self {
            count: rows.len(),
            constant: beside(&|row| row.constant),
            by_tangent: core::array::from_fn(|j| beside(&|row| row.by_tangent[j])),
            by_state: core::array::from_fn(|j| beside(&|row| row.by_state[j])),
            by_input: used.map(|&j| (j, beside(&|row| row.by_input[j]))).collect(),
            has_state: rows.iter().any(|row| row.by_state != [0.0; 12]),
        }
    }
}

#[cfg_attr(feature = "std", inline(always))]
fn apply_blocks(
    blocks: &[RowBlock],
    width: usize,
    at: Operands,
    instants: &[Range<usize>],
    out: &mut [f64],
) -> bool {
    // Zero, and NaN from the first number on that is not finite.
    let mut check = [0.0; LANES];
    for (first, last) in instants.iter().flat_map(|of| of.clone().step_by(CHUNK).map(|first| (first, of.end)))
    {
        let end = usize::min(first + CHUNK, last);
        for (place, block) in blocks.iter().enumerate() {
            for k in first..end {
                let (mut sum, mut second) = (block.constant, [0.0; LANES]);
                for j in 0..6 {
                    add_scaled(&mut sum, &block.by_tangent[j], at.tangents[k][j]);
                    add_scaled(&mut second, &block.by_tangent[6 + j], at.tangents[k][6 + j]);
                }
                if block.has_state {
                    for j in 0..6 {
                        add_scaled(&mut sum, &block.by_state[j], at.states[k][j]);
                        add_scaled(&mut second, &block.by_state[6 + j], at.states[k][6 + j]);
                    }
                }
                for (component, column) in &block.by_input {
                    add_scaled(&mut sum, column, at.inputs[k][*component]);
                }
                for i in 0..LANES {
                    sum[i] += second[i];
                    check[i] += 0.0 * sum[i];
                }
                let to = &mut out[k * width + place * LANES..][..block.count];
                // Lengths that are known become moves of vectors.
                match block.count {
                    LANES => to[..LANES].copy_from_slice(&sum),
                    6 => to[..6].copy_from_slice(&sum[..6]),
                    count => to.copy_from_slice(&sum[..count]),
                }
            }
        }
    }
    check == [0.0; LANES]
}

/// Instants that one block passes after the other, so that states and numbers stay in the nearest cache.
const CHUNK: usize = 64;

/// Derivatives of a figure by the state at each instant, from its derivatives by rows, (instant, row).
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn state_weights(rows: &[Row], weights: &[f64]) -> Vec<State> {
    let mut out = Vec::with_capacity(weights.len() / rows.len());
    for weights in weights.chunks_exact(rows.len()) {
        let (mut sum, mut second) = ([0.0; 12], [0.0; 12]);
        for (rows, weights) in rows.chunks(2).zip(weights.chunks(2)) {
            if weights[0] != 0.0 {
                add_scaled(&mut sum, &rows[0].by_tangent, weights[0]);
            }
            if weights.len() > 1 && weights[1] != 0.0 {
                add_scaled(&mut second, &rows[1].by_tangent, weights[1]);
            }
        }
        for i in 0..12 {
            sum[i] += second[i];
        }
        out.push(sum);
    }
    out
}

/// Sums over all instants of `weight (s, u, 1)` of each row: the derivative of a figure at fixed states is the product with the row.
pub(super) struct WeightedSums {
    blocks: Vec<WeightedBlock>,
}

#[derive(Clone)]
struct WeightedBlock {
    state: [Lanes; 12],
    input: [Lanes; 9],
    one: Lanes,
}

impl WeightedSums {
    /// The sums for weights (instant, row).
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn new(at: Operands, weights: &[f64], width: usize) -> Self {
        let none = WeightedBlock { state: [[0.0; LANES]; 12], input: [[0.0; LANES]; 9], one: [0.0; LANES] };
        let mut blocks = vec![none; width.div_ceil(LANES)];
        for (place, block) in blocks.iter_mut().enumerate() {
            let (from, until) = (place * LANES, usize::min((place + 1) * LANES, width));
            for (k, weights) in weights.chunks_exact(width).enumerate() {
                let mut lanes = [0.0; LANES];
                if until - from == LANES {
                    lanes.copy_from_slice(&weights[from..from + LANES]);
                } else {
                    lanes[..until - from].copy_from_slice(&weights[from..until]);
                }
                if lanes == [0.0; LANES] {
                    continue;
                }
                for j in 0..12 {
                    add_scaled(&mut block.state[j], &lanes, at.states[k][j]);
                }
                for &component in at.components {
                    add_scaled(&mut block.input[component], &lanes, at.inputs[k][component]);
                }
                add_scaled(&mut block.one, &lanes, 1.0);
            }
        }
        Self { blocks }
    }

    /// The sum over the rows of a quantity.
    pub(super) fn with(&self, rows: &[Row]) -> f64 {
        let dot = |row: &[f64], lanes: &[Lanes], lane: usize| -> f64 {
            row.iter().zip(lanes).map(|(a, b)| a * b[lane]).sum()
        };
        let number = |(index, row): (usize, &Row)| {
            let (block, lane) = (&self.blocks[index / LANES], index % LANES);
            row.constant * block.one[lane]
                + dot(&row.by_state, &block.state, lane)
                + dot(&row.by_input, &block.input, lane)
        };
        rows.iter().enumerate().map(number).sum()
    }
}
