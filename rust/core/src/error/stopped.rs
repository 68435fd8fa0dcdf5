//! Why a long computation ended early.

use core::fmt;

/// Why a computation ended before its result, although its input is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopped {
    /// Its watch said so: Ctrl-C, for instance.
    Interrupted,
    /// Not enough memory.
    Memory {
        /// Bytes that could not be had.
        bytes: usize,
    },
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Interrupted => f.write_str("interrupted"),
            Self::Memory { bytes } => write!(
                f,
                "not enough memory: {:.3} GB more are needed; use fewer samples at a time",
                *bytes as f64 * 1e-9
            ),
        }
    }
}

impl core::error::Error for Stopped {}
