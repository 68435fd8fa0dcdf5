//! Blocks of samples.

/// Number of samples of a block, so small that their states and loads stay in the first-level cache.
pub(super) const BLOCK: usize = 16;
