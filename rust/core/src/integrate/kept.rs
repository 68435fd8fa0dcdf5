//! What a run has computed for a step length and may need again.

/// The last `N` step lengths, and a value for each that has one.
///
/// One serves a uniform trace, a few a device clock that counts in ticks.
#[derive(Debug, Clone)]
pub struct Kept<T, const N: usize> {
    lengths: [f64; N],
    values: [Option<T>; N],
    last: usize,
}

impl<T, const N: usize> Kept<T, N> {
    pub(crate) fn new() -> Self {
        const { assert!(N > 0, "at least one step length must be kept") };
        Self { lengths: [f64::NAN; N], values: [const { None }; N], last: 0 }
    }

    /// The place for the value of a step length, and whether that length has come before. A new one takes the oldest place.
    #[inline(always)]
    pub(crate) fn place(&mut self, length: f64) -> (&mut Option<T>, bool) {
        let mut known = self.lengths[self.last] == length;
        if !known {
            let found = self.lengths.iter().position(|kept| *kept == length);
            known = found.is_some();
            self.last = found.unwrap_or((self.last + 1) % N);
            if !known {
                self.lengths[self.last] = length;
                self.values[self.last] = None;
            }
        }
        (&mut self.values[self.last], known)
    }
}
