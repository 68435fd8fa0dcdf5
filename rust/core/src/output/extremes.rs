//! Extremes of loads over the instants of a run.

/// Smallest and largest value of each component of a load, and their times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Smallest Fx Fy Fz (N), Mx My Mz (N m), y-z resultant of the force (N), magnitude of the moment (N m).
    pub smallest: [f64; 8],
    /// Largest values, in the order of `smallest`.
    pub largest: [f64; 8],
    /// Times of the smallest values, s.
    pub time_of_smallest: [f64; 8],
    /// Times of the largest values, s.
    pub time_of_largest: [f64; 8],
}

impl Extremes {
    /// Extremes before the first instant.
    pub const NONE: Self = Self {
        smallest: [f64::INFINITY; 8],
        largest: [f64::NEG_INFINITY; 8],
        time_of_smallest: [f64::NAN; 8],
        time_of_largest: [f64::NAN; 8],
    };

    /// The extremes over these instants and `later` ones.
    #[must_use]
    pub fn with(mut self, later: &Self) -> Self {
        for i in 0..8 {
            if later.smallest[i] < self.smallest[i] {
                (self.smallest[i], self.time_of_smallest[i]) = (later.smallest[i], later.time_of_smallest[i]);
            }
            if later.largest[i] > self.largest[i] {
                (self.largest[i], self.time_of_largest[i]) = (later.largest[i], later.time_of_largest[i]);
            }
        }
        self
    }

    /// Whether all values are within the range of numbers.
    pub fn is_finite(&self) -> bool {
        self.smallest.iter().chain(&self.largest).all(|x| x.is_finite())
    }
}
