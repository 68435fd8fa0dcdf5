//! Mean loads between instants, from the motion of L at them.

use nalgebra::Vector6;

use super::evaluate::evaluate;
use super::loads::Wrench;
use crate::numeric::simd::dispatch;
use crate::system::{State, System};

/// Difference of the cubic and the quintic polynomial in the middle of an interval, over the distance of the quintic from the line: where it
/// is larger, the motion is not that of a polynomial. It is 0.2 for a motion without acceleration at both ends, whose velocity changes between
/// them, as that of a stiff mode under noise.
const SMOOTH: f64 = 0.15;

/// The motion `(u, φ)` of L at n instants, sag included.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceMotion<'a> {
    /// s.
    pub time: &'a [f64],
    /// m, rad.
    pub position: &'a [[f64; 6]],
    /// m/s, rad/s.
    pub velocity: &'a [[f64; 6]],
    /// m/s², rad/s².
    pub acceleration: &'a [[f64; 6]],
}

impl ReferenceMotion<'_> {
    /// The mean of each load in each interval less the mean of its values at both ends, by Simpson's rule:
    /// `out[(k * loads + load) * 6 + row]`. Returns whether all values are finite.
    ///
    /// In the middle, the position is that of the quintic polynomial through position, velocity and acceleration at both ends, and the
    /// velocity that of the cubic one through velocity and acceleration. Where the cubic polynomial through position and velocity gives
    /// another position, the motion is not smooth, and both are means of the ends.
    ///
    /// # Panics
    /// If the lengths do not agree.
    pub fn load_bows(&self, system: &System, loads: &[Wrench<'_>], out: &mut [f64]) -> bool {
        let (count, width) = (self.time.len(), 6 * loads.len());
        let (mut states, mut middles) = (vec![[0.0; 12]; count], vec![[0.0; 12]; count.saturating_sub(1)]);
        dispatch!(self.modal_states(system, &mut states, &mut middles));
        let mut at_ends = vec![0.0; count * width];
        let are_finite = [(&states, &mut *at_ends), (&middles, &mut *out)]
            .map(|(states, values)| evaluate(loads, states, |_| [0.0; 9], values));
        for (k, bow) in out.iter_mut().enumerate() {
            *bow = simpson_bow(*bow, [at_ends[k], at_ends[k + width]]);
        }
        are_finite == [true; 2]
    }

    /// States at the instants, and in the middle of the intervals.
    #[inline(always)]
    fn modal_states(&self, system: &System, states: &mut [State], middles: &mut [State]) {
        let momenta = system.shapes().transpose() * system.matrices().mass;
        let (rest, frequency) = (momenta * system.static_position(), system.frequency);
        let (mut before, mut earlier) = ([0.0; 6], 0.0);
        for (k, &now) in self.time.iter().enumerate() {
            let [position, velocity, acceleration] =
                [self.position, self.velocity, self.acceleration].map(|of| momenta * Vector6::from(of[k]));
            for mode in 0..6 {
                states[k][mode] = frequency[mode] * (position[mode] - rest[mode]);
                states[k][6 + mode] = velocity[mode];
            }
            let acceleration = acceleration.into();
            if k > 0 {
                let ends = [&states[k - 1], &states[k]];
                middles[k - 1] = middle(&frequency, now - earlier, ends, [&before, &acceleration]);
            }
            (before, earlier) = (acceleration, now);
        }
    }
}

/// The mean of a load by its value in the middle of an interval and those at both ends, by Simpson's rule, less the mean of the ends.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn simpson_bow(middle: f64, [start, end]: [f64; 2]) -> f64 {
    2.0 / 3.0 * (middle - 0.5 * (start + end))
}

/// The state in the middle of an interval of `length` s, from the states and the accelerations of the modes at both ends: see
/// [`ReferenceMotion::load_bows`].
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn middle(
    frequency: &[f64; 6],
    length: f64,
    [last, state]: [&State; 2],
    [before, after]: [&[f64; 6]; 2],
) -> State {
    let (mut beyond, mut bow, mut difference) = ([0.0; 12], 0.0, 0.0);
    for mode in 0..6 {
        let (start, end) = (before[mode], after[mode]);
        let (gained, expected) = (state[6 + mode] - last[6 + mode], 0.5 * length * (start + end));
        let scale = frequency[mode] * length / 32.0;
        beyond[mode] = scale * (expected - 5.0 * gained);
        beyond[6 + mode] = 0.125 * length * (start - end);
        bow += beyond[mode] * beyond[mode];
        difference += (scale * (gained - expected)) * (scale * (gained - expected));
    }
    let share = if difference <= SMOOTH * SMOOTH * bow { 1.0 } else { 0.0 };
    let mut middle = [0.0; 12];
    for i in 0..12 {
        middle[i] = 0.5 * (last[i] + state[i]) + share * beyond[i];
    }
    middle
}
