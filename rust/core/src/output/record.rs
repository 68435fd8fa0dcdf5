//! What a run records: every state, or only running extremes, in memory of the caller.

use super::loads::Wrench;
use crate::error::RunError;
use crate::numeric::float::{fma, sqrt};
use crate::numeric::simd::{Kernel, dispatch};
#[cfg(feature = "std")]
use crate::numeric::watch::Watch;
use crate::system::{Input, State};

/// Receives the instants of a run.
pub trait Record {
    /// Called with the number of instants before the first one.
    ///
    /// # Errors
    /// [`RunError::Capacity`] if they do not fit.
    fn reserve(&mut self, count: usize) -> Result<(), RunError>;

    /// Whether it uses the excitation. If not, `instant` may receive zeros.
    fn needs_input(&self) -> bool {
        true
    }

    /// Called between steps, every some hundred microseconds of work: whether the run should stop, with [`RunError::Interrupted`].
    fn stops(&mut self) -> bool {
        false
    }

    /// Called at each instant with time, state and excitation.
    fn instant(&mut self, time: f64, state: &State, input: &Input);
}

/// Stores every state in memory of the caller.
#[derive(Debug)]
pub struct History<'a> {
    states: &'a mut [State],
    filled: usize,
}

impl<'a> History<'a> {
    /// A history that fills `states` from the first entry on.
    pub fn new(states: &'a mut [State]) -> Self {
        Self { states, filled: 0 }
    }
}

impl Record for History<'_> {
    fn reserve(&mut self, count: usize) -> Result<(), RunError> {
        let got = self.states.len();
        if got < count { Err(RunError::Capacity { expected: count, got }) } else { Ok(()) }
    }

    fn needs_input(&self) -> bool {
        false
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, _: f64, state: &State, _: &Input) {
        self.states[self.filled] = *state;
        self.filled += 1;
    }
}

/// Stores every state.
#[cfg(feature = "std")]
impl Record for Vec<State> {
    fn reserve(&mut self, count: usize) -> Result<(), RunError> {
        self.try_reserve_exact(count)
            .map_err(|_| RunError::Memory { bytes: count.saturating_mul(size_of::<State>()) })
    }

    fn needs_input(&self) -> bool {
        false
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, _: f64, state: &State, _: &Input) {
        self.push(*state);
    }
}

/// Another record, and a watch that may stop the run.
#[cfg(feature = "std")]
#[derive(Debug)]
pub struct Watched<'a, R> {
    /// Receives the instants.
    pub record: R,
    /// Whether the run should stop.
    pub watch: Watch<'a>,
}

#[cfg(feature = "std")]
impl<R: Record> Record for Watched<'_, R> {
    fn reserve(&mut self, count: usize) -> Result<(), RunError> {
        self.record.reserve(count)
    }

    fn needs_input(&self) -> bool {
        self.record.needs_input()
    }

    fn stops(&mut self) -> bool {
        self.watch.stops() || self.record.stops()
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, time: f64, state: &State, input: &Input) {
        self.record.instant(time, state, input);
    }
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

    #[cfg_attr(feature = "std", inline(always))]
    fn update(&mut self, time: f64, [x, y, z, mx, my, mz]: [f64; 6]) {
        // Without branches: new peaks are rare, but a rising load is a new largest value at every sample.
        let across = sqrt(fma(y, y, z * z));
        let values = [x, y, z, mx, my, mz, across, sqrt(fma(mx, mx, fma(my, my, mz * mz)))];
        for (i, value) in values.into_iter().enumerate() {
            let (below, above) = (value < self.smallest[i], value > self.largest[i]);
            self.smallest[i] = if below { value } else { self.smallest[i] };
            self.time_of_smallest[i] = if below { time } else { self.time_of_smallest[i] };
            self.largest[i] = if above { value } else { self.largest[i] };
            self.time_of_largest[i] = if above { time } else { self.time_of_largest[i] };
        }
    }
}

/// Stores only the running extremes of loads.
#[derive(Debug)]
pub struct Peaks<'a> {
    loads: &'a [Wrench<'a>],
    extremes: &'a mut [Extremes],
}

impl<'a> Peaks<'a> {
    /// Writes the extremes of each of `loads` to the entry of `extremes` at the same index.
    pub fn new(loads: &'a [Wrench<'a>], extremes: &'a mut [Extremes]) -> Self {
        extremes.fill(Extremes::NONE);
        Self { loads, extremes }
    }
}

impl Record for Peaks<'_> {
    fn reserve(&mut self, _: usize) -> Result<(), RunError> {
        let (expected, got) = (self.loads.len(), self.extremes.len());
        if got < expected { Err(RunError::Capacity { expected, got }) } else { Ok(()) }
    }

    fn instant(&mut self, time: f64, state: &State, input: &Input) {
        dispatch(PeaksKernel { peaks: self, time, state, input });
    }
}

/// [`Peaks::instant`] as a kernel of its own, because a run calls its record through a table and cannot inline it into its vector code.
struct PeaksKernel<'a, 'b> {
    peaks: &'a mut Peaks<'b>,
    time: f64,
    state: &'a State,
    input: &'a Input,
}

impl Kernel for PeaksKernel<'_, '_> {
    type Output = ();

    #[cfg_attr(feature = "std", inline(always))]
    fn run(self) {
        let Self { peaks, time, state, input } = self;
        for (load, extremes) in peaks.loads.iter().zip(peaks.extremes.iter_mut()) {
            extremes.update(time, load.at(state, input));
        }
    }
}
