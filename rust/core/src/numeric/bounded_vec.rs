//! Bounded vector: any number of values with `std`, up to a fixed number without an allocator.

use crate::error::SceneError;

/// Most links of a system without an allocator: eight carriages.
pub(crate) const MAX_LINKS: usize = 32;

/// A vector of at most `N` values without `std`, of any number with it.
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BoundedVec<T, const N: usize = MAX_LINKS>(Vec<T>);

/// A vector of at most `N` values without `std`, of any number with it.
#[cfg(not(feature = "std"))]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BoundedVec<T, const N: usize = MAX_LINKS> {
    values: [T; N],
    count: usize,
}

impl<T: Copy, const N: usize> BoundedVec<T, N> {
    /// `count` copies of a value.
    ///
    /// # Errors
    /// [`SceneError::TooManyLinks`] for more than `N` without `std`.
    #[cfg(feature = "std")]
    pub(crate) fn new(value: T, count: usize) -> Result<Self, SceneError> {
        Ok(Self(vec![value; count]))
    }

    /// `count` copies of a value.
    ///
    /// # Errors
    /// [`SceneError::TooManyLinks`] for more than `N` without `std`.
    #[cfg(not(feature = "std"))]
    pub(crate) fn new(value: T, count: usize) -> Result<Self, SceneError> {
        if count > N {
            return Err(SceneError::TooManyLinks { max: N, got: count });
        }
        Ok(Self { values: [value; N], count })
    }

    /// `count` copies of a value, where `count` is at most the number of links of a system and so fits.
    pub(crate) fn filled(value: T, count: usize) -> Self {
        match Self::new(value, count) {
            Ok(vector) => vector,
            Err(_) => unreachable!("no more than the links of a system"),
        }
    }

    /// Appends a value; panics where it does not fit.
    #[cfg(feature = "std")]
    pub(crate) fn push(&mut self, value: T) {
        self.0.push(value);
    }

    /// Appends a value; panics where it does not fit.
    #[cfg(not(feature = "std"))]
    pub(crate) fn push(&mut self, value: T) {
        self.values[self.count] = value;
        self.count += 1;
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn as_slice(&self) -> &[T] {
        #[cfg(feature = "std")]
        return &self.0;
        #[cfg(not(feature = "std"))]
        return &self.values[..self.count];
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn as_mut_slice(&mut self) -> &mut [T] {
        #[cfg(feature = "std")]
        return &mut self.0;
        #[cfg(not(feature = "std"))]
        return &mut self.values[..self.count];
    }
}
