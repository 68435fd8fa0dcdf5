//! Values on the heap. Without an allocator there are none, and the compiler leaves out what is done with them.

#[cfg(not(feature = "std"))]
use core::{convert::Infallible, marker::PhantomData, ops::Deref};

/// A value on the heap.
#[cfg(feature = "std")]
pub(crate) type OnHeap<T> = Box<T>;

/// A value that cannot exist.
#[cfg(not(feature = "std"))]
#[derive(Debug, Clone)]
pub(crate) struct OnHeap<T>(Infallible, PhantomData<T>);

#[cfg(not(feature = "std"))]
impl<T> Deref for OnHeap<T> {
    type Target = T;

    fn deref(&self) -> &T {
        match self.0 {}
    }
}

/// Puts a value on the heap, if there is one.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn on_heap<T>(value: T) -> Option<OnHeap<T>> {
    #[cfg(feature = "std")]
    return Some(Box::new(value));
    #[cfg(not(feature = "std"))]
    {
        drop(value);
        None
    }
}
