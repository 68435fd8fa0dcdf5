//! Forcing: the excitation as modal force on a system. Over one step it is a ramp.

use core::ops::Range;

use super::Excitation;
use super::riding::{Instant, MAX_RIDERS};
use crate::numeric::float::{add_scaled, fma, norm};
use crate::system::{Force, Input, NO_FORCE, System};

/// An excitation with a factor on its accelerations and one on its external loads.
#[derive(Debug, Clone, Copy)]
pub struct ScaledExcitation<'a> {
    pub excitation: &'a Excitation<'a>,
    /// Largest magnitude of each component, before the factors.
    pub peak: Input,
    /// Factor on the accelerations, and on the external loads.
    pub factors: [f64; 2],
}

impl<'a> ScaledExcitation<'a> {
    /// With factors of one.
    pub(crate) fn unscaled(excitation: &'a Excitation<'a>) -> Self {
        Self { excitation, peak: excitation.peak(), factors: [1.0; 2] }
    }

    pub(crate) fn scaled_peak(&self) -> Input {
        core::array::from_fn(|component| {
            self.peak[component] * self.factors[usize::from(component >= 3)].abs()
        })
    }
}

/// The components of an excitation that are not zero throughout, usually one of nine, and the modal force of a unit of each.
#[derive(Debug, Clone, Copy)]
pub struct Forcing {
    components: [usize; 9],
    count: usize,
    influence: [Force; 9],
    /// Norm of each influence.
    pub(crate) size: [f64; 9],
    /// Largest value of each component.
    peak: [f64; 9],
    /// Largest acceleration of each rider, m/s².
    rider_peak: [f64; MAX_RIDERS],
    /// Bound on the norm of the modal force of all riders.
    pub(crate) riders: f64,
}

/// Largest number of intervals in one step.
const MAX_MERGED_INTERVALS: usize = 64;

/// Distance of a sample from the straight line through its neighbours, relative to the peak, that counts as rounding. Over
/// [`MAX_MERGED_INTERVALS`] intervals these distances add up to some hundred roundings.
const STRAIGHTNESS: f64 = 8.0 * f64::EPSILON;

/// Values of the components of a [`Forcing`], in its order.
pub(crate) type Values = [f64; 9];

impl Forcing {
    /// No forcing.
    pub(crate) const NONE: Self = Self {
        components: [0; 9],
        count: 0,
        influence: [NO_FORCE; 9],
        size: [0.0; 9],
        peak: [0.0; 9],
        rider_peak: [0.0; MAX_RIDERS],
        riders: 0.0,
    };

    /// The forcing on a system. `peak`: of the excitation before the factors; `factors`: on its accelerations and its external loads.
    pub(crate) fn new(system: &System, peak: &Input, factors: [f64; 2]) -> Self {
        let mut forcing = Self::NONE;
        for component in (0..9).filter(|&component| peak[component] > 0.0) {
            forcing.components[forcing.count] = component;
            let mut influence = system.influence()[component];
            for force in &mut influence {
                *force *= factors[usize::from(component >= 3)];
            }
            forcing.influence[forcing.count] = influence;
            forcing.size[forcing.count] = norm(&influence);
            forcing.peak[forcing.count] = peak[component];
            forcing.count += 1;
        }
        forcing
    }

    /// The forcing of an excitation that also moves riders.
    pub(crate) fn with_riders(mut self, excitation: &Excitation) -> Self {
        for (peak, motion) in self.rider_peak.iter_mut().zip(excitation.riders()) {
            *peak = motion.peak()[2];
        }
        self
    }

    /// Modal force of a unit of each component.
    pub(crate) fn influence(&self) -> &[Force] {
        &self.influence[..self.count]
    }

    /// The components.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn components(&self) -> &[usize] {
        &self.components[..self.count]
    }

    /// The components, with the modal force of a unit of each.
    pub(crate) fn influences(&self) -> impl Iterator<Item = (usize, &Force)> {
        self.components.iter().copied().zip(self.influence())
    }

    /// The values of the components in an input.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn values_of(&self, input: &Input) -> Values {
        let mut values = [0.0; 9];
        for (value, &component) in values.iter_mut().zip(self.components()) {
            *value = input[component];
        }
        values
    }

    /// The last sample up to which the excitation from sample `k` on is a straight line to within rounding; at least sample `k + 1`.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn straight_until(&self, excitation: &Excitation, k: usize) -> usize {
        let farthest = usize::min(k + MAX_MERGED_INTERVALS, excitation.count() - 1);
        let mut until = k + 1;
        while until < farthest && self.is_straight(excitation, k, until) {
            until += 1;
        }
        until
    }

    /// Whether sample `middle` is on the line from sample `k` to the one after it.
    #[cfg_attr(feature = "std", inline(always))]
    fn is_straight(&self, excitation: &Excitation, k: usize, middle: usize) -> bool {
        let (before, after) = (excitation.time(middle) - excitation.time(k), excitation.interval(middle));
        let theta = before / (before + after);
        // There is no line across a jump.
        let mut straight = before > 0.0 && after > 0.0;
        for i in 0..self.count {
            let at = |k: usize| excitation.component(k, self.components[i]);
            let line = (1.0 - theta) * at(k) + theta * at(middle + 1);
            straight &= (at(middle) - line).abs() <= STRAIGHTNESS * self.peak[i];
        }
        for (rider, motion) in excitation.riders().iter().enumerate() {
            let at = |k: usize| motion.samples[k][2];
            let line = (1.0 - theta) * at(k) + theta * at(middle + 1);
            straight &= (at(middle) - line).abs() <= STRAIGHTNESS * self.rider_peak[rider];
        }
        straight
    }

    /// Whether the excitation is the same at all of these samples, apart from riders.
    #[inline(always)]
    pub(crate) fn is_constant(&self, excitation: &Excitation, samples: Range<usize>) -> bool {
        let mut constant = true;
        for &component in self.components() {
            constant &= excitation.is_constant(samples.clone(), component);
        }
        constant
    }

    /// Bound on the change of the slope of the modal force from the previous ramp to the one of `h` s from `start` to `end`; infinite after
    /// a jump. `slopes` and `values` hold the slopes and the last values of the previous ramp, and receive those of this one.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn slope_change(
        &self,
        h: f64,
        [start, end]: [&Values; 2],
        slopes: &mut Values,
        values: &mut Values,
    ) -> f64 {
        let mut turn = 0.0;
        for i in 0..self.count {
            let slope = (end[i] - start[i]) / h;
            let jump = if start[i] == values[i] { 0.0 } else { f64::INFINITY };
            turn = fma(self.size[i], (slope - slopes[i]).abs(), turn + jump);
            (slopes[i], values[i]) = (slope, end[i]);
        }
        turn
    }

    /// Writes N samples of each component from sample `k` on to `samples`.
    #[inline(always)]
    pub(crate) fn samples<const N: usize>(
        &self,
        excitation: &Excitation,
        k: usize,
        samples: &mut [[f64; N]; 9],
    ) {
        for (samples, &component) in samples.iter_mut().zip(self.components()) {
            for (index, sample) in samples.iter_mut().enumerate() {
                *sample = excitation.component(k + index, component);
            }
        }
    }

    /// Writes the values at sample `k` to `values`.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn sample(&self, excitation: &Excitation, k: usize, values: &mut Values) {
        for (value, &component) in values.iter_mut().zip(self.components()) {
            *value = excitation.component(k, component);
        }
    }
}

/// The excitation over one step, linear in time.
#[derive(Debug, Clone, Copy)]
pub struct Ramp<'a> {
    /// Length of the step, s.
    pub(crate) h: f64,
    /// Values at its start.
    pub(crate) start: &'a Values,
    /// Values at its end.
    pub(crate) end: &'a Values,
    pub(crate) forcing: &'a Forcing,
    /// Whether it spans a whole interval between samples, whose length may recur.
    pub(crate) spans_interval: bool,
    /// The instant at its start.
    pub(crate) begin: Instant,
}

impl<'a> Ramp<'a> {
    /// The ramp over a whole interval of `h` s.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn whole(h: f64, [start, end]: [&'a Values; 2], forcing: &'a Forcing, begin: Instant) -> Self {
        Self { h, start, end, forcing, spans_interval: true, begin }
    }

    /// The ramp with its start `since` s after that of its interval.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn later(&self, since: f64) -> Self {
        Self { begin: Instant { since, ..self.begin }, ..*self }
    }

    /// The instant at the fraction `theta` of the step.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn instant(&self, theta: f64) -> Instant {
        Instant { since: fma(theta, self.h, self.begin.since), ..self.begin }
    }

    /// Values at the fraction `theta` of the step.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn values(&self, theta: f64) -> Values {
        // Not start + theta (end - start), which misses the end by a rounding.
        let mut values = [0.0; 9];
        for i in 0..self.forcing.count {
            values[i] = (1.0 - theta) * self.start[i] + theta * self.end[i];
        }
        values
    }

    /// Rise of the modal force over the step.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn rise(&self) -> Force {
        let (first, mut rise) = (self.force(0.0), self.force(1.0));
        for (rise, first) in rise.iter_mut().zip(first) {
            *rise -= first;
        }
        rise
    }

    /// Bound on the growth of the norm of a state by the force over the step.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn impulse(&self) -> f64 {
        self.h * (f64::max(norm(&self.force(0.0)), norm(&self.force(1.0))) + self.forcing.riders)
    }

    /// Modal force at the fraction `theta` of the step.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn force(&self, theta: f64) -> Force {
        let mut force = NO_FORCE;
        for (i, column) in self.forcing.influence().iter().enumerate() {
            add_scaled(&mut force, column, (1.0 - theta) * self.start[i] + theta * self.end[i]);
        }
        force
    }
}
