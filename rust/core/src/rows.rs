//! What the system knows of each link: where it acts, and its load in each mode.

use crate::error::SceneError;
use crate::link::Link;

/// A link and its load per unit of each entry of the state, N/√J.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub link: Link,
    /// Per unit of `ω η`: `k d·Φ / ω`.
    pub elastic: [f64; 6],
    /// Per unit of `η'`: `b d·Φ`.
    pub damping: [f64; 6],
}

/// The rows of all links: with `std` of any number, without of up to [`ROOM`].
#[cfg(feature = "std")]
#[derive(Debug, Clone)]
pub(crate) struct Rows(Vec<Row>);

/// The rows of all links: with `std` of any number, without of up to [`ROOM`].
#[cfg(not(feature = "std"))]
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    rows: [Row; ROOM],
    count: usize,
}

/// Links that a system has room for without an allocator: eight carriages.
#[cfg(not(feature = "std"))]
const ROOM: usize = 32;

impl Rows {
    /// Rows of zeros for `links`, of which there is at least one.
    #[cfg(feature = "std")]
    pub(crate) fn new(links: &[Link]) -> Result<Self, SceneError> {
        Ok(Self(links.iter().map(empty).collect()))
    }

    /// Rows of zeros for `links`, of which there is at least one.
    #[cfg(not(feature = "std"))]
    pub(crate) fn new(links: &[Link]) -> Result<Self, SceneError> {
        let count = links.len();
        if count > ROOM {
            return Err(SceneError::TooManyLinks { room: ROOM, got: count });
        }
        Ok(Self { rows: core::array::from_fn(|i| empty(&links[i % count])), count })
    }

    #[cfg(feature = "std")]
    #[inline(always)]
    pub(crate) fn all(&self) -> &[Row] {
        &self.0
    }

    #[cfg(not(feature = "std"))]
    pub(crate) fn all(&self) -> &[Row] {
        &self.rows[..self.count]
    }

    #[cfg(feature = "std")]
    pub(crate) fn all_mut(&mut self) -> &mut [Row] {
        &mut self.0
    }

    #[cfg(not(feature = "std"))]
    pub(crate) fn all_mut(&mut self) -> &mut [Row] {
        &mut self.rows[..self.count]
    }
}

fn empty(link: &Link) -> Row {
    Row { link: *link, elastic: [0.0; 6], damping: [0.0; 6] }
}
