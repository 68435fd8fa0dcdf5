//! Evaluation of quantities at all instants of a run, several at a time in vector loops.

use super::block_values::{BLOCK, Values, evaluate_block, transpose};
use super::loads::{Linear, Recovery};
use crate::numeric::float::add_scaled;
use crate::numeric::simd::{LANES, dispatch, dispatch_wide};
use crate::system::{Input, NO_INPUT, State};

/// Evaluates quantities at all instants: `out[(k * quantities + q) * ROWS + row]`. `input` gives the excitation of instant k. Returns whether
/// all values are finite.
///
/// # Panics
/// If the length of `out` is not `states * quantities * ROWS`.
pub fn evaluate<const ROWS: usize>(
    quantities: &[Recovery<ROWS>],
    states: &[State],
    input: impl Fn(usize) -> Input,
    out: &mut [f64],
) -> bool {
    let (width, mut finite) = (quantities.len() * ROWS, true);
    assert_eq!(out.len(), states.len() * width, "room for every quantity at every state");
    if quantities.iter().all(|quantity| quantity.nonlinear.as_slice().is_empty()) {
        for from in (0..width).step_by(LANES) {
            let mut lanes = Linear::<LANES>::NOTHING;
            for (lane, row) in (from..usize::min(from + LANES, width)).enumerate() {
                lanes.copy_row(lane, &quantities[row / ROWS].linear, row % ROWS);
            }
            finite &= dispatch_wide!(write_linear(&lanes, states, &input, out, from, width));
        }
        return finite;
    }
    // The roots in the laws of preloaded contacts take longer with AVX-512.
    let mut links = quantities.iter().flat_map(|quantity| quantity.nonlinear.as_slice());
    if links.all(|link| link.row.link.law().is_piecewise_linear()) {
        dispatch_wide!(write_blocks(quantities, states, &input, out))
    } else {
        dispatch!(write_blocks(quantities, states, &input, out))
    }
}

impl Linear<LANES> {
    fn copy_row<const ROWS: usize>(&mut self, lane: usize, from: &Linear<ROWS>, row: usize) {
        self.constant[lane] = from.constant[row];
        for (to, from) in self.by_state.iter_mut().zip(&from.by_state) {
            to[lane] = from[row];
        }
        for (to, from) in self.by_input.iter_mut().zip(&from.by_input) {
            to[lane] = from[row];
        }
        self.by_input_at_all |= from.by_input_at_all;
    }
}

/// Writes eight rows of linear quantities to `out[k * width + from..]`, fewer at the end of a row. `check`, a sum of all values times zero, is
/// zero while they are finite, NaN after the first that is not: one vector instruction per instant.
#[cfg_attr(feature = "std", inline(always))]
fn write_linear<I: Fn(usize) -> Input>(
    lanes: &Linear<LANES>,
    states: &[State],
    input: &I,
    out: &mut [f64],
    from: usize,
    width: usize,
) -> bool {
    let (count, mut check) = (usize::min(LANES, width - from), [0.0; LANES]);
    if lanes.by_input_at_all || count < LANES {
        for (k, (state, out)) in states.iter().zip(out.chunks_exact_mut(width)).enumerate() {
            let values = lanes.at(state, &input(k));
            add_scaled(&mut check, &values, 0.0);
            for (out, value) in out[from..].iter_mut().zip(&values) {
                *out = *value;
            }
        }
    } else {
        // Two instants at a time share each column while it is in a register.
        let (pairs, last) = states.as_chunks::<2>();
        let mut rows = out.chunks_exact_mut(width);
        for [a, b] in pairs {
            let (Some(row_a), Some(row_b)) = (rows.next(), rows.next()) else { break };
            let (mut sum_a, mut sum_b) = (lanes.constant, lanes.constant);
            for j in 0..12 {
                add_scaled(&mut sum_a, &lanes.by_state[j], a[j]);
                add_scaled(&mut sum_b, &lanes.by_state[j], b[j]);
            }
            add_scaled(&mut check, &sum_a, 0.0);
            add_scaled(&mut check, &sum_b, 0.0);
            row_a[from..from + LANES].copy_from_slice(&sum_a);
            row_b[from..from + LANES].copy_from_slice(&sum_b);
        }
        for (state, row) in last.iter().zip(rows) {
            let values = lanes.at(state, &NO_INPUT);
            add_scaled(&mut check, &values, 0.0);
            row[from..from + LANES].copy_from_slice(&values);
        }
    }
    check == [0.0; LANES]
}

/// Writes quantities of which some are nonlinear, block by block.
#[cfg_attr(feature = "std", inline(always))]
fn write_blocks<I: Fn(usize) -> Input, const ROWS: usize>(
    quantities: &[Recovery<ROWS>],
    states: &[State],
    input: &I,
    out: &mut [f64],
) -> bool {
    let width = quantities.len() * ROWS;
    let (mut block, mut inputs) = ([[0.0; 12]; BLOCK], [[0.0; 9]; BLOCK]);
    let (mut entries, mut components) = ([[0.0; BLOCK]; 12], [[0.0; BLOCK]; 9]);
    let (mut values, mut check): ([Values; 8], Values) = ([[0.0; BLOCK]; 8], [0.0; BLOCK]);
    let needs_input = quantities.iter().any(|quantity| quantity.linear.by_input_at_all);
    for ((part, states), out) in states.chunks(BLOCK).enumerate().zip(out.chunks_mut(BLOCK * width)) {
        // Of an incomplete block, the rest is left as it was.
        block[..states.len()].copy_from_slice(states);
        transpose(&block, &mut entries);
        if needs_input {
            for k in 0..states.len() {
                inputs[k] = input(part * BLOCK + k);
            }
            transpose(&inputs, &mut components);
        }
        for (index, quantity) in quantities.iter().enumerate() {
            evaluate_block(quantity, &[true; ROWS], (&entries, &components), &block, &mut values);
            for values in &values[..ROWS] {
                add_scaled(&mut check, values, 0.0);
            }
            for (k, out) in (0..BLOCK).zip(out.chunks_exact_mut(width)) {
                if let Some(out) = out[index * ROWS..].first_chunk_mut::<ROWS>() {
                    for row in 0..ROWS {
                        out[row] = values[row][k];
                    }
                }
            }
        }
    }
    check == [0.0; BLOCK]
}
