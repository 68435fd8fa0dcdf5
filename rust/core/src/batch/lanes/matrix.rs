//! Small square matrices with a scene in each lane.

/// Most modes of a scene.
pub(super) const MAX_MODES: usize = 6;

/// A square matrix, of which the first rows and columns count.
pub(super) type Square<T> = [[T; MAX_MODES]; MAX_MODES];
