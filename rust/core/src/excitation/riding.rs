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

    /// Travel, speed and acceleration of a rider at an instant.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn travel(&self, rider: usize, at: Instant) -> [f64; 3] {
        let samples = self.riders[rider].samples;
        let [travel, speed, start] = samples[at.first];
        let t = at.since;
        let jerk = if t > 0.0 {
            (samples[at.until][2] - start) / (self.time(at.until) - self.time(at.first))
        } else {
            0.0
        };
        [
            travel + t * (speed + t * (start / 2.0 + t * jerk / 6.0)),
            speed + t * (start + t * jerk / 2.0),
            start + t * jerk,
        ]
    }

    /// Travel, speed and acceleration of a rider at `time` s; at a jump those after it.
    pub fn travel_at(&self, rider: usize, time: f64) -> [f64; 3] {
        let (first, last) = (self.sample_before(time), self.count() - 1);
        let since = if first == last { 0.0 } else { f64::max(time - self.time(first), 0.0) };
        self.travel(rider, Instant { first, until: usize::min(first + 1, last), since })
    }

    /// Acceleration of L at an instant, m/s².
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn acceleration(&self, at: Instant) -> [f64; 3] {
        let mut value = self.acceleration[at.first];
        if at.since > 0.0 {
            let theta = at.since / (self.time(at.until) - self.time(at.first));
            for (value, end) in value.iter_mut().zip(self.acceleration[at.until]) {
                *value += theta * (end - *value);
            }
        }
        value
    }
}
