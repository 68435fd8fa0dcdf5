//! State, excitation and modal force as plain arrays.

use crate::numeric::float::{fma, norm, sqrt};

/// Deviation from the static position in energy coordinates: `ω η` (six), then `η'` (six), both in √J. Entries past the number
/// of free degrees of freedom are zero.
pub type State = [f64; 12];

/// Excitation at one instant: acceleration of L (3, m/s²), then external force (3, N) and moment about L (3, N m).
pub type Input = [f64; 9];

/// Modal force f: six entries, and two zeros that fill the second vector register.
pub(crate) type Force = [f64; 8];

/// Zero modal force.
pub(crate) const NO_FORCE: Force = [0.0; 8];

/// Zero excitation.
pub(crate) const NO_INPUT: Input = [0.0; 9];

/// Columns of a 6 x 6 matrix in the modes.
pub(crate) type Square = [[f64; 6]; 6];

/// The [`Input`] of an acceleration of L (m/s²) and an external force and moment about L (N, N m).
#[cfg_attr(feature = "std", inline(always))]
pub fn input_from([x, y, z]: [f64; 3], [a, b, c, d, e, f]: [f64; 6]) -> Input {
    [x, y, z, a, b, c, d, e, f]
}

/// Size of a state: the square root of twice its energy in the linear part of a scene.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn energy_norm(state: &State) -> f64 {
    // Four sums side by side.
    let mut sums = [0.0; 4];
    for entries in state.as_chunks::<4>().0 {
        for (sum, entry) in sums.iter_mut().zip(entries) {
            *sum = fma(*entry, *entry, *sum);
        }
    }
    sqrt(sums[0] + sums[1] + (sums[2] + sums[3]))
}

/// Square root of twice the kinetic energy.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn speed(state: &State) -> f64 {
    norm(&state[6..])
}

/// Whether no entry is infinite or NaN.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn finite(state: &State) -> bool {
    // Four sums side by side, of zeros unless an entry is not finite.
    let mut sums = [0.0; 4];
    for entries in state.as_chunks::<4>().0 {
        for (sum, entry) in sums.iter_mut().zip(entries) {
            *sum += 0.0 * entry;
        }
    }
    sums == [0.0; 4]
}
