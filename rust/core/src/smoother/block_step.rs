//! Several steps of the chain as one.
//!
//! Draws of a derivative need no other entry of the states between. Given the state before a block of stamps, the derivative at each
//! of them and the whole state at the last one are jointly normal: linear in that state, plus a noise with one root for all of them.
//! A draw so takes one random number per stamp, and one more for each other entry of the state per block.

use super::posterior::{MAX_ORDER, MarkovStep, Square};
use super::square_root::{dot, upper_cholesky};
use super::transition::product;

/// Stamps in a block. Longer blocks take fewer random numbers, 1 + (order - 1) / BLOCK per stamp, but more multiplications by the root.
pub(crate) const BLOCK: usize = 8;

/// Most rows of a block.
const MAX_ROWS: usize = BLOCK - 1 + MAX_ORDER;

/// Step from the state d before a block to its rows: y = `transition` d + `noise_root` w, w standard normal. The rows are the derivative
/// at all stamps but the last, then the state at the last stamp.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BlockStep {
    pub transition: [[f64; MAX_ORDER]; MAX_ROWS],
    /// By columns, upper triangular.
    pub noise_root: [[f64; MAX_ROWS]; MAX_ROWS],
}

impl BlockStep {
    /// The steps of the chain to the stamps of a block, as one. Of fewer than [`BLOCK`] steps the first rows are zero.
    ///
    /// # Panics
    /// If there is no step, or more than [`BLOCK`].
    pub fn new(steps: &[MarkovStep], derivative: usize) -> Self {
        let empty = BLOCK - steps.len();
        let mut carry: Square = core::array::from_fn(|i| core::array::from_fn(|j| f64::from(i == j)));
        let mut covariance = [[0.0; MAX_ORDER]; MAX_ORDER];
        let mut all =
            Self { transition: [[0.0; MAX_ORDER]; MAX_ROWS], noise_root: [[0.0; MAX_ROWS]; MAX_ROWS] };
        // Covariance of the derivative at each stamp so far with the state at the latest one; then of all rows.
        let mut across = [[0.0; MAX_ORDER]; BLOCK];
        let mut joint = [[0.0; MAX_ROWS]; MAX_ROWS];
        for (k, step) in (empty..).zip(steps) {
            carry = product(&step.transition, &carry);
            covariance = step.covariance(&covariance);
            for row in &mut across[..k] {
                *row = step.transition.map(|of| dot(&of, row));
            }
            across[k] = covariance[derivative];
            if k + 1 < BLOCK {
                all.transition[k] = carry[derivative];
                for (i, row) in across[..=k].iter().enumerate() {
                    (joint[i][k], joint[k][i]) = (row[derivative], row[derivative]);
                }
            }
        }
        for i in 0..MAX_ORDER {
            let last = BLOCK - 1 + i;
            all.transition[last] = carry[i];
            for k in 0..BLOCK - 1 {
                (joint[k][last], joint[last][k]) = (across[k][i], across[k][i]);
            }
            joint[last][BLOCK - 1..].copy_from_slice(&covariance[i]);
        }
        all.noise_root = upper_cholesky(&joint);
        all
    }
}
