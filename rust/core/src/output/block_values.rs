//! The values of a load at the instants of a block, side by side.

use super::loads::{NonlinearLink, Recovery};
use crate::model::forces;
use crate::numeric::float::{add_scaled, fma, sqrt};
use crate::system::State;

/// Instants of a block: few, so that a block in which a load passes its extremes is a short part of the run, but enough that bounds pay.
pub(super) const BLOCK: usize = 32;

/// One number at each instant of a block.
pub(super) type Values = [f64; BLOCK];

/// Writes the entries of some columns, each at all instants, to `entries`.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn transpose<const N: usize, const COUNT: usize>(
    columns: &[[f64; N]; COUNT],
    entries: &mut [[f64; COUNT]; N],
) {
    for (k, column) in columns.iter().enumerate() {
        for j in 0..N {
            entries[j][k] = column[j];
        }
    }
}

/// The components that are wanted themselves, or for the y-z resultant or the magnitude of the moment.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn needed_for(wanted: &[bool; 8]) -> [bool; 6] {
    let [x, y, z, mx, my, mz, across, moment] = *wanted;
    [x, y | across, z | across, mx | moment, my | moment, mz | moment]
}

/// The needed rows of a quantity, at most eight, at all instants, to the last bit those of [`Recovery::at`].
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn evaluate_block<const ROWS: usize, const COUNT: usize>(
    load: &Recovery<ROWS>,
    needed: &[bool; ROWS],
    (entries, inputs): (&[[f64; COUNT]; 12], &[[f64; COUNT]; 9]),
    states: &[State; COUNT],
    values: &mut [[f64; COUNT]; 8],
) {
    // Two rows at a time, so that the sums of one fill the time in which those of the other wait for each other.
    for a in (0..ROWS).step_by(2) {
        let b = a + 1;
        if b == ROWS || !needed[a] || !needed[b] {
            for row in a..usize::min(b + 1, ROWS) {
                if needed[row] {
                    evaluate_row(load, row, entries, &mut values[row]);
                }
            }
            continue;
        }
        let mut sums = [[load.linear.constant[a]; COUNT], [load.linear.constant[b]; COUNT]];
        for j in 0..12 {
            let column = &load.linear.by_state[j];
            if column[a] == 0.0 && column[b] == 0.0 {
                continue;
            }
            add_scaled(&mut sums[0], &entries[j], column[a]);
            add_scaled(&mut sums[1], &entries[j], column[b]);
        }
        (values[a], values[b]) = (sums[0], sums[1]);
    }
    if load.linear.by_input_at_all {
        for (column, input) in load.linear.by_input.iter().zip(inputs) {
            for row in 0..ROWS {
                if needed[row] && column[row] != 0.0 {
                    add_scaled(&mut values[row], input, column[row]);
                }
            }
        }
    }
    for link in load.nonlinear.as_slice() {
        let NonlinearLink { row, elastic, damping } = link;
        let mut is_needed = false;
        for component in 0..ROWS {
            is_needed |= needed[component] & ((elastic[component] != 0.0) | (damping[component] != 0.0));
        }
        if !is_needed {
            continue;
        }
        let force = forces(row.link.law(), &row.deflections(entries));
        for component in 0..ROWS {
            if needed[component] && elastic[component] != 0.0 {
                add_scaled(&mut values[component], &force, elastic[component]);
            }
        }
        if row.link.is_damped_in_contact() {
            for k in 0..COUNT {
                let (_, load) = row.loads(&states[k]);
                for component in 0..ROWS {
                    if needed[component] {
                        values[component][k] = fma(damping[component], load, values[component][k]);
                    }
                }
            }
        }
    }
}

/// The part of a row that is linear in the state.
#[cfg_attr(feature = "std", inline(always))]
fn evaluate_row<const ROWS: usize, const COUNT: usize>(
    load: &Recovery<ROWS>,
    row: usize,
    entries: &[[f64; COUNT]; 12],
    values: &mut [f64; COUNT],
) {
    let mut sum = [load.linear.constant[row]; COUNT];
    for j in 0..12 {
        let factor = load.linear.by_state[j][row];
        if factor != 0.0 {
            add_scaled(&mut sum, &entries[j], factor);
        }
    }
    *values = sum;
}

/// Adds the y-z resultant of the force and the magnitude of the moment, where wanted.
#[cfg_attr(feature = "std", inline(always))]
pub(super) fn add_magnitudes(wanted: &[bool; 8], values: &mut [Values; 8]) {
    let [_, y, z, mx, my, mz, across, moment] = values;
    if wanted[6] {
        for k in 0..BLOCK {
            across[k] = sqrt(fma(y[k], y[k], z[k] * z[k]));
        }
    }
    if wanted[7] {
        for k in 0..BLOCK {
            moment[k] = sqrt(fma(mx[k], mx[k], fma(my[k], my[k], mz[k] * mz[k])));
        }
    }
}
