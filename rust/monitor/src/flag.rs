//! Yes or no, in memory that a C program can write.

/// A `bool` of which any bytes are a value: all but 0 mean yes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(transparent)]
pub struct Flag(u32);

impl Flag {
    /// No.
    pub const CLEAR: Self = Self(0);
    /// Yes.
    pub const SET: Self = Self(1);

    /// A flag of a value.
    pub const fn new(is_set: bool) -> Self {
        if is_set { Self::SET } else { Self::CLEAR }
    }

    /// Its value.
    pub const fn is_set(self) -> bool {
        self.0 != 0
    }
}
