//! Mean loads between instants, from the motion of L at them.

use nalgebra::Vector6;

use super::evaluate::evaluate;
use super::loads::Wrench;
use crate::model::Law;
use crate::numeric::simd::dispatch;
use crate::system::{LinkRow, NO_INPUT, State, System};

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
    /// another position, the motion is not smooth, and both are on the line between the ends. Where a contact changes, the rule is applied to
    /// four parts.
    ///
    /// # Panics
    /// If the lengths do not agree.
    pub fn load_bows(&self, system: &System, loads: &[Wrench<'_>], out: &mut [f64]) -> bool {
        let (count, width) = (self.time.len(), 6 * loads.len());
        let (mut states, mut middles) = (vec![[0.0; 12]; count], vec![[0.0; 12]; count.saturating_sub(1)]);
        let mut accelerations = vec![[0.0; 6]; count];
        dispatch!(self.modal_states(system, &mut states, &mut middles, &mut accelerations));
        let mut at_ends = vec![0.0; count * width];
        let are_finite = [(&states, &mut *at_ends), (&middles, &mut *out)]
            .map(|(states, values)| evaluate(loads, states, |_| NO_INPUT, values));
        for (k, bow) in out.iter_mut().enumerate() {
            *bow = simpson_bow(*bow, [at_ends[k], at_ends[k + width]]);
        }
        let (contacts, mut changed, mut inside) = (contacts(system), Vec::new(), Vec::new());
        for (k, middle) in middles.iter().enumerate() {
            let ends = [&states[k], &states[k + 1]];
            if contact_changes(&contacts, [ends[0], middle, ends[1]]) {
                let length = self.time[k + 1] - self.time[k];
                let rates = [&accelerations[k], &accelerations[k + 1]];
                inside.extend(INSIDE.map(|(at, _)| between(&system.frequency, length, ends, rates, at)));
                changed.push(k);
            }
        }
        let mut values = vec![0.0; inside.len() * width];
        evaluate(loads, &inside, |_| NO_INPUT, &mut values);
        for (k, values) in changed.into_iter().zip(values.chunks_exact(INSIDE.len() * width)) {
            for i in 0..width {
                let places = INSIDE.iter().zip(values.chunks_exact(width));
                let sum = places.map(|((_, weight), values)| weight * values[i]).sum();
                let [at, next] = [k * width + i, (k + 1) * width + i];
                out[at] = finer_bow(out[at], sum, [at_ends[at], at_ends[next]]);
            }
        }
        are_finite == [true; 2]
    }

    /// States at the instants and in the middle of the intervals, and accelerations of the modes at the instants.
    #[inline(always)]
    fn modal_states(
        &self,
        system: &System,
        states: &mut [State],
        middles: &mut [State],
        accelerations: &mut [[f64; 6]],
    ) {
        let momenta = system.shapes().transpose() * system.matrices().mass;
        let (rest, frequency) = (momenta * system.static_position(), system.frequency);
        for k in 0..self.time.len() {
            let [position, velocity, acceleration] =
                [self.position, self.velocity, self.acceleration].map(|of| momenta * Vector6::from(of[k]));
            for mode in 0..6 {
                states[k][mode] = frequency[mode] * (position[mode] - rest[mode]);
                states[k][6 + mode] = velocity[mode];
            }
            accelerations[k] = acceleration.into();
            if k > 0 {
                let (length, ends) = (self.time[k] - self.time[k - 1], [&states[k - 1], &states[k]]);
                let rates = [&accelerations[k - 1], &accelerations[k]];
                middles[k - 1] = between(&frequency, length, ends, rates, 0.5);
            }
        }
    }
}

/// The links whose loads bend where a contact changes.
pub(crate) fn contacts(system: &System) -> Vec<&LinkRow> {
    system.rows().iter().filter(|row| !row.link.law().edges().is_empty()).collect()
}

/// Whether a link is on different segments of its law in these states.
fn contact_changes(contacts: &[&LinkRow], states: [&State; 3]) -> bool {
    let mut changes = [false];
    for row in contacts {
        let [start, middle, end] = states.map(|state| [row.deflection_at(state)]);
        mark_changes(row.link.law(), [&start, &middle, &end], &mut changes);
    }
    changes[0]
}

/// Marks the intervals in which a link changes its segment, by its deflections at their starts, in their middles and at their ends.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn mark_changes<const COUNT: usize>(
    law: &Law,
    [start, middle, end]: [&[f64; COUNT]; 3],
    changes: &mut [bool; COUNT],
) {
    for &edge in law.edges() {
        for i in 0..COUNT {
            let past = middle[i] >= edge;
            changes[i] |= ((start[i] >= edge) != past) | ((end[i] >= edge) != past);
        }
    }
}

/// The mean of a load by its value in the middle of an interval and those at both ends, by Simpson's rule, less the mean of the ends.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn simpson_bow(middle: f64, [start, end]: [f64; 2]) -> f64 {
    2.0 / 3.0 * (middle - 0.5 * (start + end))
}

/// What [`simpson_bow`] becomes over four parts; `inside`: the weighted sum of the load at the places of [`INSIDE`].
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn finer_bow(bow: f64, inside: f64, [start, end]: [f64; 2]) -> f64 {
    inside + 0.125 * bow - 5.0 / 12.0 * (start + end)
}

/// Places inside of an interval in which a contact changes, as fractions of it, with the weights of Simpson's rule over four parts; the
/// middle is missing.
pub(crate) const INSIDE: [(f64, f64); 6] = [
    (0.125, 4.0 / 24.0),
    (0.25, 2.0 / 24.0),
    (0.375, 4.0 / 24.0),
    (0.625, 4.0 / 24.0),
    (0.75, 2.0 / 24.0),
    (0.875, 4.0 / 24.0),
];

/// The state at a fraction of an interval of `length` s, from the states and the accelerations of the modes at both ends: see
/// [`ReferenceMotion::load_bows`].
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn between(
    frequency: &[f64; 6],
    length: f64,
    [last, state]: [&State; 2],
    [before, after]: [&[f64; 6]; 2],
    share: f64,
) -> State {
    // In the middle: the distance of the quintic polynomial from the line, and from the cubic one.
    let (mut bow, mut difference) = (0.0, 0.0);
    for mode in 0..6 {
        let (gained, expected) =
            (state[6 + mode] - last[6 + mode], 0.5 * length * (before[mode] + after[mode]));
        let scale = frequency[mode] * length / 32.0;
        bow += (scale * (expected - 5.0 * gained)) * (scale * (expected - 5.0 * gained));
        difference += (scale * (gained - expected)) * (scale * (gained - expected));
    }
    let mut between = [0.0; 12];
    if difference > SMOOTH * SMOOTH * bow {
        for i in 0..12 {
            between[i] = (1.0 - share) * last[i] + share * state[i];
        }
        return between;
    }
    // Hermite's polynomials of one end, at a distance x from it and y from the other: of value, slope and curvature there.
    let quintic = |x: f64, y: f64| {
        let cube = y * y * y;
        [cube * (1.0 + x * (3.0 + 6.0 * x)), cube * x * (1.0 + 3.0 * x), 0.5 * cube * x * x]
    };
    let cubic = |x: f64, y: f64| [y * y * (1.0 + 2.0 * x), y * y * x];
    let (of_start, of_end) = (quintic(share, 1.0 - share), quintic(1.0 - share, share));
    let (rate_of_start, rate_of_end) = (cubic(share, 1.0 - share), cubic(1.0 - share, share));
    for mode in 0..6 {
        let (velocity, h) = (6 + mode, frequency[mode] * length);
        between[mode] = of_start[0] * last[mode]
            + of_end[0] * state[mode]
            + h * (of_start[1] * last[velocity] - of_end[1] * state[velocity])
            + h * length * (of_start[2] * before[mode] + of_end[2] * after[mode]);
        between[velocity] = rate_of_start[0] * last[velocity]
            + rate_of_end[0] * state[velocity]
            + length * (rate_of_start[1] * before[mode] - rate_of_end[1] * after[mode]);
    }
    between
}
