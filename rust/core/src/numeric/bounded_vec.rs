//! Bounded vector: any number of values with `std`, up to a fixed number without an allocator.

use crate::error::SceneError;
use places::Places;

/// Most links of a system without an allocator: eight carriages.
pub(crate) const MAX_LINKS: usize = 32;

/// A vector of at most `N` values without `std`, of any number with it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BoundedVec<T, const N: usize = MAX_LINKS>(Places<T, N>);

impl<T, const N: usize> BoundedVec<T, N> {
    /// `count` values by their index.
    ///
    /// # Errors
    /// [`SceneError::TooManyLinks`] for more than `N` without `std`.
    pub(crate) fn from_fn(count: usize, value: impl Fn(usize) -> T) -> Result<Self, SceneError> {
        if !cfg!(feature = "std") && count > N {
            return Err(SceneError::TooManyLinks { max: N, got: count });
        }
        Ok(Self(Places::new(count, value)))
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn as_slice(&self) -> &[T] {
        self.0.as_slice()
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn as_mut_slice(&mut self) -> &mut [T] {
        self.0.as_mut_slice()
    }
}

impl<T: Copy, const N: usize> BoundedVec<T, N> {
    /// `count` copies of a value.
    ///
    /// # Errors
    /// [`SceneError::TooManyLinks`] for more than `N` without `std`.
    pub(crate) fn new(value: T, count: usize) -> Result<Self, SceneError> {
        Self::from_fn(count, |_| value)
    }

    /// `count` copies of a value, where `count` is at most the number of links of a system and so fits.
    pub(crate) fn filled(value: T, count: usize) -> Self {
        match Self::new(value, count) {
            Ok(vector) => vector,
            Err(_) => unreachable!("no more than the links of a system"),
        }
    }

    /// Appends a value; panics where it does not fit.
    pub(crate) fn push(&mut self, value: T) {
        self.0.push(value);
    }
}

/// With an allocator.
#[cfg(feature = "std")]
mod places {
    #[derive(Debug, Clone, PartialEq)]
    pub(super) struct Places<T, const N: usize>(Vec<T>);

    impl<T, const N: usize> Places<T, N> {
        pub(super) fn new(count: usize, value: impl Fn(usize) -> T) -> Self {
            Self((0..count).map(value).collect())
        }

        #[inline(always)]
        pub(super) fn as_slice(&self) -> &[T] {
            &self.0
        }

        #[inline(always)]
        pub(super) fn as_mut_slice(&mut self) -> &mut [T] {
            &mut self.0
        }

        pub(super) fn push(&mut self, value: T) {
            self.0.push(value);
        }
    }
}

/// Without one: unused places repeat the last value, or the first of none.
#[cfg(not(feature = "std"))]
mod places {
    #[derive(Debug, Clone, PartialEq)]
    pub(super) struct Places<T, const N: usize> {
        values: [T; N],
        count: usize,
    }

    impl<T, const N: usize> Places<T, N> {
        pub(super) fn new(count: usize, value: impl Fn(usize) -> T) -> Self {
            Self { values: core::array::from_fn(|k| value(k.min(count.saturating_sub(1)))), count }
        }

        pub(super) fn as_slice(&self) -> &[T] {
            &self.values[..self.count]
        }

        pub(super) fn as_mut_slice(&mut self) -> &mut [T] {
            &mut self.values[..self.count]
        }

        pub(super) fn push(&mut self, value: T) {
            self.values[self.count] = value;
            self.count += 1;
        }
    }
}
