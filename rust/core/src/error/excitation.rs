//! Errors of excitations.

use core::fmt;

/// Why an excitation is refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ExcitationError {
    /// No sample.
    Empty,
    /// Histories of different lengths.
    Length {
        /// Which one.
        field: &'static str,
        /// Number of time stamps.
        expected: usize,
        /// Number of its samples.
        got: usize,
    },
    /// NaN or infinity.
    NotFinite {
        /// In which history.
        field: &'static str,
        /// At which sample, from 0.
        index: usize,
    },
    /// Time runs backwards.
    Order {
        /// At which sample, from 0.
        index: usize,
        /// Time of the sample before, s.
        before: f64,
        /// Its own time, s.
        got: f64,
    },
    /// A duration beyond the range of numbers.
    Duration {
        /// s.
        got: f64,
    },
    /// More riders than a body may carry.
    TooManyRiders {
        /// Most.
        max: usize,
        /// Number given.
        got: usize,
    },
    /// Three samples at one time; two are a jump.
    Repeated {
        /// The third sample, from 0.
        index: usize,
        /// Its time, s.
        time: f64,
    },
}

impl fmt::Display for ExcitationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => f.write_str("time: expected at least one sample, got none"),
            Self::Length { field, expected, got } => {
                write!(f, "{field}: expected {expected} samples, one per time, got {got}")
            }
            Self::NotFinite { field, index } => {
                write!(f, "{field}[{index}]: expected a finite number; repair or cut the trace first")
            }
            Self::Duration { got } => {
                write!(f, "time: expected a duration within the range of numbers, got {got} s: is time in s?")
            }
            Self::TooManyRiders { max, got } => write!(f, "riders: expected at most {max}, got {got}"),
            Self::Order { index, before, got } => write!(
                f,
                "time[{index}]: expected >= {before} s (the sample before), got {got} s; sort or cut the trace first"
            ),
            Self::Repeated { index, time } => write!(
                f,
                "time[{index}]: a third sample at {time} s; two at one time are a jump, more say nothing: remove them"
            ),
        }
    }
}

impl core::error::Error for ExcitationError {}
