//! Riders of a scene, and their motions.

use guideload::{Body, BodyWithRiders, BodyWithRidersInstant, Excitation, Rider, RiderMotion, State, System};
use numpy::{PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{matrix3, numbers};
use crate::error::{CoreError, require_finite};

/// Mass, centre of mass, inertia about it, direction.
pub type RiderTuple = (f64, [f64; 3], [[f64; 3]; 3], [f64; 3]);

pub fn rider(index: usize, (mass, center, inertia, direction): RiderTuple) -> Result<Rider, CoreError> {
    let made =
        Body::new(mass, center.into(), matrix3(inertia)).and_then(|body| Rider::new(body, direction.into()));
    made.map_err(|error| CoreError::Rider(index, error))
}

/// Travel, speed and acceleration of each rider at the samples of an excitation; none where no rider moves.
pub struct Travels {
    riders: Vec<Rider>,
    samples: Vec<Vec<[f64; 3]>>,
}

impl Travels {
    pub const NONE: Self = Self { riders: Vec::new(), samples: Vec::new() };

    /// From an array (riders, n, 3), if it is given.
    pub fn new(riders: &[Rider], travel: Option<&PyReadonlyArray3<'_, f64>>) -> PyResult<Self> {
        let Some(travel) = travel else { return Ok(Self::NONE) };
        let shape = travel.shape();
        if shape[0] != riders.len() || shape[2] != 3 || shape[1] == 0 {
            let message = format!(
                "travel: expected shape ({}, n, 3), got ({}, {}, {})",
                riders.len(),
                shape[0],
                shape[1],
                shape[2]
            );
            return Err(PyValueError::new_err(message));
        }
        let all = numbers(travel, "travel")?;
        let samples = all.as_chunks::<3>().0.chunks(shape[1]).map(<[_]>::to_vec).collect();
        Ok(Self { riders: riders.to_vec(), samples })
    }

    pub fn motions(&self) -> Vec<RiderMotion<'_>> {
        self.riders
            .iter()
            .zip(&self.samples)
            .map(|(&rider, samples)| RiderMotion { rider, samples })
            .collect()
    }

    /// The motions at other times, which are instants of the excitation.
    pub fn at(&self, excitation: &Excitation, times: &[f64]) -> Self {
        let of = |rider| times.iter().map(|&time| excitation.travel_at(rider, time)).collect();
        Self { riders: self.riders.clone(), samples: (0..self.riders.len()).map(of).collect() }
    }

    pub fn is_empty(&self) -> bool {
        self.riders.is_empty()
    }

    /// The samples of each rider.
    pub fn samples(&self) -> impl Iterator<Item = &[[f64; 3]]> {
        self.samples.iter().map(Vec::as_slice)
    }

    pub fn count(&self) -> usize {
        self.riders.len()
    }

    /// What depends on the riders, at each state.
    pub fn instants(
        &self,
        system: &System,
        states: &[State],
        input: impl Fn(usize) -> guideload::Input,
    ) -> Result<Vec<BodyWithRidersInstant>, CoreError> {
        let ridden = BodyWithRiders::new(system, &self.riders);
        let mut travel = vec![[0.0; 3]; self.riders.len()];
        let mut instants = Vec::with_capacity(states.len());
        for (k, state) in states.iter().enumerate() {
            for (to, samples) in travel.iter_mut().zip(&self.samples) {
                *to = samples[k];
            }
            let instant = ridden.at(&travel, state, &input(k));
            require_finite(instant.acceleration.iter().chain(&instant.reaction).all(|x| x.is_finite()))?;
            instants.push(instant);
        }
        Ok(instants)
    }
}
