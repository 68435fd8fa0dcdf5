//! Memory of the lane integrator: what one step of a block writes for the next.

use super::aligned_buffer::AlignedBuffer;
use super::waiting::Waiting;

/// Number of statistics of a signal, of [`Memory::found`]; for a resultant, statistics of its square.
pub(super) const STATISTICS: usize = 6;

/// Places of the extremes among the statistics, and of the instants: the sample before, and the share of the interval after it.
pub(super) const LOW: usize = 0;
pub(super) const HIGH: usize = 1;
pub(super) const LOW_AT: usize = 2;
pub(super) const HIGH_AT: usize = 3;

/// Memory of one thread, and the results of a run.
#[derive(Debug, Default)]
pub(super) struct Memory {
    /// v at the samples of a block, and before it.
    pub states: AlignedBuffer,
    pub before: AlignedBuffer,
    /// Values of the rows in the block and their extremes there; of tiles that are not evaluated bounds on these.
    pub values: AlignedBuffer,
    pub extremes: AlignedBuffer,
    /// Last values of the rows before the block.
    pub last: AlignedBuffer,
    /// Means of v and of the rows over the intervals before the samples of a block; see `means`.
    pub mean_states: AlignedBuffer,
    pub means: AlignedBuffer,
    /// Whether a tile of rows has means.
    pub has_means: Vec<bool>,
    /// Whether the block counts for a signal: it needs all samples, or may have a new extreme in it.
    pub counts: Vec<bool>,
    /// Whether a tile of rows is evaluated at the block, and whether it was at the block before.
    pub evaluated: Vec<bool>,
    pub were_evaluated: Vec<bool>,
    pub steps: AlignedBuffer,
    /// The block of drawn motions; see `drawn`.
    pub drawn: AlignedBuffer,
    pub waiting: Waiting,
    /// [`STATISTICS`] numbers for each signal.
    pub found: AlignedBuffer,
    /// v at the end.
    pub end: AlignedBuffer,
}
