//! Step cache: propagators or tangents by step length and equations; and the series of equations.

use crate::equations::{Equations, PowerSeries};

/// Cache for the last `N` pairs of step length and key of equations.
///
/// One entry is enough for a uniform trace, a few for a device clock that counts in ticks.
#[derive(Debug, Clone)]
pub struct StepCache<T, const N: usize> {
    places: [(f64, u32); N],
    uses: [u32; N],
    values: [Option<T>; N],
    /// Places of the last request and of the newest entry.
    last: usize,
    newest: usize,
}

impl<T, const N: usize> StepCache<T, N> {
    pub(crate) fn new() -> Self {
        const { assert!(N > 0, "at least one step length must be cached") };
        Self { places: [(f64::NAN, 0); N], uses: [0; N], values: [const { None }; N], last: 0, newest: N - 1 }
    }

    /// The entry for a step length and the `key` of equations, and the number of earlier requests for it. A new entry replaces the oldest.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn entry(&mut self, length: f64, key: u32) -> (&mut Option<T>, u32) {
        if self.places[self.last] != (length, key) {
            self.last = match self.places.iter().position(|place| *place == (length, key)) {
                Some(found) => found,
                None => {
                    // Not after the last request: scenes in lanes, which make none, would keep other entries than by themselves.
                    self.newest = (self.newest + 1) % N;
                    self.places[self.newest] = (length, key);
                    self.uses[self.newest] = 0;
                    self.values[self.newest] = None;
                    self.newest
                }
            };
        }
        let before = self.uses[self.last];
        self.uses[self.last] = before.saturating_add(1);
        (&mut self.values[self.last], before)
    }

    /// The value of an entry, if there is one.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn ready(&mut self, length: f64, key: u32) -> Option<&T> {
        let found = self.places.iter().position(|place| *place == (length, key))?;
        let value = self.values[found].as_ref()?;
        self.last = found;
        Some(value)
    }
}

/// The power series of the equations with the last key.
#[derive(Debug, Clone, Default)]
pub struct SeriesCache(Option<(u32, PowerSeries)>);

impl SeriesCache {
    /// The series of the equations.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn of<E: Equations>(&mut self, equations: &E) -> PowerSeries {
        match self.0 {
            Some((key, series)) if key == equations.key() => series,
            _ => {
                let series = PowerSeries::new(equations);
                self.0 = Some((equations.key(), series));
                series
            }
        }
    }
}
