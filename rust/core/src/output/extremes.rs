//! Extremes of loads over the time of a run.

/// A value of a load whose extreme is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Goal {
    /// Index of the load.
    pub load: usize,
    /// Index of the value, in the order of [`Extremes::smallest`].
    pub value: usize,
    /// Whether its largest value is sought, or its smallest.
    pub largest: bool,
}

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

    /// Extremes that no value passes, where values are not wanted.
    pub(crate) const UNWANTED: Self =
        Self { smallest: [f64::NEG_INFINITY; 8], largest: [f64::INFINITY; 8], ..Self::NONE };

    /// Before the first instant, where only the largest y-z resultant and the largest magnitude of the moment are wanted. The others are
    /// infinite.
    pub const ONLY_MAGNITUDES: Self = {
        let mut extremes = Self::UNWANTED;
        extremes.largest[6] = f64::NEG_INFINITY;
        extremes.largest[7] = f64::NEG_INFINITY;
        extremes
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

    /// Largest magnitude so far of the force, or of the moment, to which a value belongs.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn size_of(&self, value: usize) -> f64 {
        let (components, magnitude) = if matches!(value, 0..3 | 6) { (0..3, 6) } else { (3..6, 7) };
        let mut size = if self.largest[magnitude] < f64::INFINITY { self.largest[magnitude] } else { 0.0 };
        for i in components {
            let most = f64::max(self.largest[i], -self.smallest[i]);
            // Infinite where the value is not wanted.
            size = if most < f64::INFINITY { f64::max(size, most) } else { size };
        }
        size
    }

    /// The extreme that a goal seeks; if that is a smallest value, the negative one.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn of(&self, goal: Goal) -> f64 {
        if goal.largest { self.largest[goal.value] } else { -self.smallest[goal.value] }
    }

    /// Notes a value, the negative one if the smallest is sought, at a time.
    #[cfg_attr(feature = "std", inline(always))]
    pub(super) fn note(&mut self, goal: Goal, value: f64, time: f64) {
        if value > self.of(goal) {
            let i = goal.value;
            if goal.largest {
                (self.largest[i], self.time_of_largest[i]) = (value, time);
            } else {
                (self.smallest[i], self.time_of_smallest[i]) = (-value, time);
            }
        }
    }

    /// Whether all values are within the range of numbers.
    pub fn is_finite(&self) -> bool {
        self.smallest.iter().chain(&self.largest).all(|x| x.is_finite())
    }
}
