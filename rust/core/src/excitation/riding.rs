//! The motion of riders: travel, speed and acceleration relative to the main body.

use super::Excitation;
use crate::error::ExcitationError;
use crate::model::Rider;

/// Most riders on a body.
pub const MAX_RIDERS: usize = 8;

/// A rider and its motion along its direction, at the samples of an excitation.
///
/// From each sample to the next the acceleration is linear, and travel and speed are its integrals that begin with the values of the
/// sample: so they do not drift from the samples. The body of the scene must include the rider at travel zero ([`crate::Body::plus`]).
#[derive(Debug, Clone, Copy)]
pub struct RiderMotion<'a> {
    /// The rider.
    pub rider: Rider,
    /// Travel (m), speed (m/s) and acceleration (m/s²).
    pub samples: &'a [[f64; 3]],
}

impl RiderMotion<'_> {
    /// Largest magnitudes of travel, speed and acceleration at the samples.
    pub(crate) fn peak(&self) -> [f64; 3] {
        let larger =
            |peak: [f64; 3], sample: &[f64; 3]| [0, 1, 2].map(|i| f64::max(peak[i], sample[i].abs()));
        self.samples.iter().fold([0.0; 3], larger)
    }
}

/// An instant of an excitation: seconds `since` the sample `first`, within the straight line from there to the sample `until`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    pub(crate) first: usize,
    pub(crate) until: usize,
    pub(crate) since: f64,
}

impl Instant {
    /// The first sample.
    pub(crate) const FIRST: Self = Self { first: 0, until: 0, since: 0.0 };

    /// Whether no jump lies between this instant and the `next` one, at the same time.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn meets(&self, next: &Self) -> bool {
        next.first == self.first || next.first == self.until
    }
}

impl<'a> Excitation<'a> {
    /// The excitation together with the motions of riders.
    ///
    /// # Errors
    /// [`ExcitationError`] for more than [`MAX_RIDERS`] riders, or samples that are not finite or not one per time.
    pub fn with_riders(self, riders: &'a [RiderMotion<'a>]) -> Result<Self, ExcitationError> {
        if riders.len() > MAX_RIDERS {
            return Err(ExcitationError::TooManyRiders { max: MAX_RIDERS, got: riders.len() });
        }
        for motion in riders {
            let (expected, got) = (self.count(), motion.samples.len());
            if got != expected {
                return Err(ExcitationError::Length { field: "riders", expected, got });
            }
            if let Some(index) =
                motion.samples.iter().position(|sample| !sample.iter().all(|x| x.is_finite()))
            {
                return Err(ExcitationError::NotFinite { field: "riders", index });
            }
        }
        Ok(Self { riders, ..self })
    }

    /// The motions of riders.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn riders(&self) -> &'a [RiderMotion<'a>] {
        self.riders
    }

    /// Travel, speed and acceleration of a rider at the sample before an instant, and the slope of the acceleration from there on.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn travel_terms(&self, rider: usize, at: Instant) -> [f64; 4] {
        let samples = self.riders[rider].samples;
        let [travel, speed, acceleration] = samples[at.first];
        let width = self.time(at.until) - self.time(at.first);
        let jerk = if width > 0.0 { (samples[at.until][2] - acceleration) / width } else { 0.0 };
        [travel, speed, acceleration, jerk]
    }

    /// Travel, speed and acceleration of a rider at `time` s; at a jump those after it.
    ///
    /// # Panics
    /// If there is no such rider.
    pub fn travel_at(&self, rider: usize, time: f64) -> [f64; 3] {
        let (first, last) = (self.sample_before(time), self.count() - 1);
        let since = if first == last { 0.0 } else { f64::max(time - self.time(first), 0.0) };
        let at = Instant { first, until: usize::min(first + 1, last), since };
        travel_after(self.travel_terms(rider, at), since)
    }

    /// Acceleration of L at the sample before an instant, m/s², and its slope from there on.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn acceleration_line(&self, at: Instant) -> [[f64; 3]; 2] {
        let (value, end) = (self.acceleration[at.first], self.acceleration[at.until]);
        let width = self.time(at.until) - self.time(at.first);
        let mut slope = [0.0; 3];
        for axis in 0..3 {
            slope[axis] = if width > 0.0 { (end[axis] - value[axis]) / width } else { 0.0 };
        }
        [value, slope]
    }
}

/// Travel, speed and acceleration `t` s after a sample with these terms.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn travel_after([travel, speed, acceleration, jerk]: [f64; 4], t: f64) -> [f64; 3] {
    [
        travel + t * (speed + t * (acceleration / 2.0 + t * jerk / 6.0)),
        speed + t * (acceleration + t * jerk / 2.0),
        acceleration + t * jerk,
    ]
}
