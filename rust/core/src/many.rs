//! As many as a scene has: with `std` any number, without, and so without an allocator, up to a fixed one.

use crate::error::SceneError;

/// Links that a system has room for without an allocator: eight carriages.
pub(crate) const ROOM: usize = 32;

/// Values of a number that is fixed when they are made: with `std` any, without up to `N`.
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Many<T, const N: usize = ROOM>(Vec<T>);

/// Values of a number that is fixed when they are made: with `std` any, without up to `N`.
#[cfg(not(feature = "std"))]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Many<T, const N: usize = ROOM> {
    values: [T; N],
    count: usize,
}

impl<T: Copy, const N: usize> Many<T, N> {
    /// `count` copies of a value.
    ///
    /// # Errors
    /// [`SceneError::TooManyLinks`] if there is no room for them.
    #[cfg(feature = "std")]
    pub(crate) fn new(value: T, count: usize) -> Result<Self, SceneError> {
        Ok(Self(vec![value; count]))
    }

    /// `count` copies of a value.
    ///
    /// # Errors
    /// [`SceneError::TooManyLinks`] if there is no room for them.
    #[cfg(not(feature = "std"))]
    pub(crate) fn new(value: T, count: usize) -> Result<Self, SceneError> {
        if count > N {
            return Err(SceneError::TooManyLinks { room: N, got: count });
        }
        Ok(Self { values: [value; N], count })
    }

    /// As [`Many::new`], of a number for which there is room because a system has that many links.
    pub(crate) fn like(value: T, count: usize) -> Self {
        match Self::new(value, count) {
            Ok(many) => many,
            Err(_) => unreachable!("no more than the links of a system"),
        }
    }

    /// One more; without `std` there must be room for it.
    #[cfg(feature = "std")]
    pub(crate) fn push(&mut self, value: T) {
        self.0.push(value);
    }

    /// One more; without `std` there must be room for it.
    #[cfg(not(feature = "std"))]
    pub(crate) fn push(&mut self, value: T) {
        self.values[self.count] = value;
        self.count += 1;
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn all(&self) -> &[T] {
        #[cfg(feature = "std")]
        return &self.0;
        #[cfg(not(feature = "std"))]
        return &self.values[..self.count];
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn all_mut(&mut self) -> &mut [T] {
        #[cfg(feature = "std")]
        return &mut self.0;
        #[cfg(not(feature = "std"))]
        return &mut self.values[..self.count];
    }
}
