//! Excitation: acceleration of L and external load, given by samples and linear between them (first-order hold).
//!
//! `forcing`: the modal force that an excitation makes on a system. `repeated`: lengths of intervals that recur. `riding`: the motion of riders.
//! `division`: more samples where they are too few for the vibrations of a system.

#[cfg(feature = "std")]
mod division;
mod forcing;
#[cfg(feature = "std")]
mod repeated;
mod riding;

#[cfg(feature = "std")]
pub(crate) use division::with_enough_samples;
#[cfg(feature = "std")]
pub use division::{enough_parts, limit_parts};
pub use forcing::Ramp;
pub(crate) use forcing::{Forcing, ScaledExcitation, Values};
#[cfg(feature = "std")]
pub use repeated::repeated_lengths;
pub(crate) use riding::travel_after;
pub use riding::{Instant, MAX_RIDERS, RiderMotion};

use core::ops::Range;

use nalgebra::Vector3;

use crate::error::ExcitationError;
use crate::numeric::simd::dispatch;
use crate::system::{Input, input_from};

/// Times of the samples, s.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Knots<'a> {
    Every {
        start: f64,
        step: f64,
    },
    /// Explicit times.
    At(&'a [f64], Spacing<'a>),
}

/// Distances of explicit times.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Spacing<'a> {
    /// The step of times that are uniform to within rounding.
    Uniform(f64),
    /// The lengths of the intervals, of which many are the same, see [`repeated_lengths`].
    Repeated(&'a [f64]),
    Any,
}

/// Acceleration of L and external load over time.
///
/// Two samples at one time are a jump. Steps end at every sample where the slope of the excitation changes.
#[derive(Debug, Clone, Copy)]
pub struct Excitation<'a> {
    knots: Knots<'a>,
    acceleration: &'a [[f64; 3]],
    wrench: Option<&'a [[f64; 6]]>,
    riders: &'a [RiderMotion<'a>],
}

impl<'a> Excitation<'a> {
    /// Samples at `time` s: `acceleration` of L (x y z, m/s²) and optionally an external load `wrench` on the body (force in N and moment
    /// about L in N m). Times that are uniform to within rounding are taken as exactly uniform.
    ///
    /// # Errors
    /// [`ExcitationError`] names the sample that is out of order, not finite or repeated, or the array of the wrong length.
    pub fn new(
        time: &'a [f64],
        acceleration: &'a [[f64; 3]],
        wrench: Option<&'a [[f64; 6]]>,
    ) -> Result<Self, ExcitationError> {
        if let Some(index) = first_not_finite(time) {
            return Err(ExcitationError::NotFinite { field: "time", index });
        }
        check_order(time)?;
        if acceleration.len() != time.len() {
            return Err(ExcitationError::Length {
                field: "acceleration",
                expected: time.len(),
                got: acceleration.len(),
            });
        }
        Self { knots: knots(time), acceleration, wrench, riders: &[] }.checked()
    }

    /// If the times are uneven, with the lengths of the intervals, from [`repeated_lengths`] of these times or of more; as it is if that gives
    /// none, or if they are not the lengths of its intervals.
    #[cfg(feature = "std")]
    pub fn with_repeated_lengths(self, lengths: impl FnOnce() -> &'a [f64]) -> Self {
        let Knots::At(time, Spacing::Any) = self.knots else { return self };
        let lengths = lengths();
        if !repeated::are_lengths_of(lengths, time) {
            return self;
        }
        Self { knots: Knots::At(time, Spacing::Repeated(lengths)), ..self }
    }

    /// Samples every `step` s from `start` s on; only the accelerations need to be stored.
    ///
    /// # Errors
    /// As [`Excitation::new`]; a step that is not positive gives [`ExcitationError::Order`].
    pub fn uniform(start: f64, step: f64, acceleration: &'a [[f64; 3]]) -> Result<Self, ExcitationError> {
        if !start.is_finite() || !step.is_finite() {
            return Err(ExcitationError::NotFinite { field: "time", index: 0 });
        }
        if step <= 0.0 {
            return Err(ExcitationError::Order { index: 1, before: start, got: start + step });
        }
        let knots = Knots::Every { start, step };
        Self { knots, acceleration, wrench: None, riders: &[] }.checked()
    }

    fn checked(self) -> Result<Self, ExcitationError> {
        if self.acceleration.is_empty() {
            return Err(ExcitationError::Empty);
        }
        let duration = self.duration();
        if !duration.is_finite() {
            return Err(ExcitationError::Duration { got: duration });
        }
        if let Some(entry) = first_not_finite(self.acceleration.as_flattened()) {
            return Err(ExcitationError::NotFinite { field: "acceleration", index: entry / 3 });
        }
        if let Some(wrench) = self.wrench {
            if wrench.len() != self.acceleration.len() {
                let (expected, got) = (self.acceleration.len(), wrench.len());
                return Err(ExcitationError::Length { field: "wrench", expected, got });
            }
            if let Some(entry) = first_not_finite(wrench.as_flattened()) {
                return Err(ExcitationError::NotFinite { field: "wrench", index: entry / 6 });
            }
        }
        Ok(self)
    }

    /// Some of its samples, at least one; without riders, which studies refuse.
    pub(crate) fn part(&self, samples: Range<usize>) -> Self {
        let knots = match self.knots {
            _ if samples.len() == self.count() => self.knots,
            Knots::Every { start, step } => Knots::Every { start: start + step * samples.start as f64, step },
            Knots::At(time, spacing) => match (knots(&time[samples.clone()]), spacing) {
                (Knots::At(part, Spacing::Any), Spacing::Repeated(lengths)) => {
                    Knots::At(part, Spacing::Repeated(&lengths[samples.start..samples.end - 1]))
                }
                (part, _) => part,
            },
        };
        let wrench = self.wrench.map(|wrench| &wrench[samples.clone()]);
        Self { knots, acceleration: &self.acceleration[samples], wrench, riders: &[] }
    }

    /// With other accelerations, as many as it has samples.
    pub(crate) fn with_acceleration<'b>(&self, acceleration: &'b [[f64; 3]]) -> Excitation<'b>
    where
        'a: 'b,
    {
        Excitation { acceleration, ..*self }
    }

    /// Number of samples, at least one.
    pub fn count(&self) -> usize {
        self.acceleration.len()
    }

    /// Time of sample `k`, s.
    ///
    /// # Panics
    /// Where times are given, if there is no sample `k`.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn time(&self, k: usize) -> f64 {
        match self.knots {
            Knots::Every { start, step } => start + step * k as f64,
            Knots::At(time, _) => time[k],
        }
    }

    /// Time from sample `k` to the next, s.
    ///
    /// # Panics
    /// Where uneven times are given, if there is no next sample.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn interval(&self, k: usize) -> f64 {
        match self.knots {
            Knots::Every { step, .. } | Knots::At(_, Spacing::Uniform(step)) => step,
            Knots::At(_, Spacing::Repeated(lengths)) => lengths[k],
            Knots::At(time, Spacing::Any) => time[k + 1] - time[k],
        }
    }

    /// Excitation at sample `k`.
    ///
    /// # Panics
    /// If there is no sample `k`.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn input(&self, k: usize) -> Input {
        input_from(self.acceleration[k], self.wrench.map_or([0.0; 6], |wrench| wrench[k]))
    }

    /// One component of the excitation at sample `k`.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn component(&self, k: usize, component: usize) -> f64 {
        match (component, self.wrench) {
            (0..3, _) => self.acceleration[k][component],
            (_, Some(wrench)) => wrench[k][component - 3],
            (_, None) => 0.0,
        }
    }

    /// Whether one component of the excitation is the same at all of these samples.
    #[inline(always)]
    pub(crate) fn is_constant(&self, samples: Range<usize>, component: usize) -> bool {
        match (component, self.wrench) {
            (0..3, _) => are_equal(&self.acceleration[samples], component),
            (_, Some(wrench)) => are_equal(&wrench[samples], component - 3),
            (_, None) => true,
        }
    }

    /// Excitation at the fraction `theta` of the way from sample `k` to the next.
    ///
    /// # Panics
    /// If there is no next sample.
    pub fn input_between(&self, k: usize, theta: f64) -> Input {
        between(&[self.input(k), self.input(k + 1)], theta)
    }

    /// Excitation at `time` s. Before the first and after the last sample it is constant; at a jump it is the value after it.
    pub fn input_at(&self, time: f64) -> Input {
        let low = self.sample_before(time);
        if low == self.count() - 1 || time <= self.time(low) {
            return self.input(low);
        }
        self.input_between(low, (time - self.time(low)) / self.interval(low))
    }

    /// The last sample at or before `time` s, by binary search; the first one before all of them.
    pub(crate) fn sample_before(&self, time: f64) -> usize {
        let (mut low, mut high) = (0, self.count() - 1);
        while low < high {
            let middle = (low + high).div_ceil(2);
            if self.time(middle) <= time { low = middle } else { high = middle - 1 }
        }
        low
    }

    /// Time from the first to the last sample, s.
    pub fn duration(&self) -> f64 {
        self.time(self.count() - 1) - self.time(0)
    }

    /// Largest magnitude of each component.
    pub(crate) fn peak(&self) -> Input {
        let largest_load = |wrench| dispatch!(largest(wrench));
        input_from(dispatch!(largest(self.acceleration)), self.wrench.map_or([0.0; 6], largest_load))
    }
}

/// The input at the fraction `theta` of the way from one to another.
#[cfg_attr(feature = "std", inline(always))]
pub(crate) fn between(ends: &[Input; 2], theta: f64) -> Input {
    let mut input = ends[0];
    for i in 0..9 {
        input[i] += theta * (ends[1][i] - input[i]);
    }
    input
}

/// Calls `run` with the excitation: more samples need an allocator.
#[cfg(not(feature = "std"))]
pub(crate) fn with_enough_samples<T>(
    _: &crate::system::System,
    excitation: &Excitation,
    run: impl FnOnce(&Excitation) -> T,
) -> T {
    run(excitation)
}

/// The external load, force and moment about L, of a `force` N at `point` (m from L) and a `moment` N m.
pub fn wrench_at(point: [f64; 3], force: [f64; 3], moment: [f64; 3]) -> [f64; 6] {
    let about = Vector3::from(point).cross(&Vector3::from(force)) + Vector3::from(moment);
    [force[0], force[1], force[2], about.x, about.y, about.z]
}

/// Largest magnitude of each entry.
#[cfg_attr(feature = "std", inline(always))]
fn largest<const N: usize>(samples: &[[f64; N]]) -> [f64; N] {
    // Four samples at a time: each comparison of a single peak would wait for the one before.
    let mut peaks = [[0.0; N]; 4];
    let (fours, rest) = samples.as_chunks::<4>();
    for four in fours {
        for i in 0..4 {
            raise(&mut peaks[i], &four[i]);
        }
    }
    for sample in rest {
        raise(&mut peaks[0], sample);
    }
    let [mut largest, others @ ..] = peaks;
    for peak in &others {
        raise(&mut largest, peak);
    }
    largest
}

/// Raises peaks to the magnitudes of a sample.
#[cfg_attr(feature = "std", inline(always))]
fn raise<const N: usize>(peaks: &mut [f64; N], sample: &[f64; N]) {
    for j in 0..N {
        let size = sample[j].abs();
        peaks[j] = if size > peaks[j] { size } else { peaks[j] };
    }
}

/// Whether `test` holds for all items. Unlike `Iterator::all` it does not stop early, so it becomes vector code.
#[cfg_attr(feature = "std", inline(always))]
fn every<T>(items: impl Iterator<Item = T>, test: impl Fn(T) -> bool) -> bool {
    let mut all = true;
    for item in items {
        all &= test(item);
    }
    all
}

/// Whether an entry is the same in all samples.
#[inline(always)]
fn are_equal<const N: usize>(samples: &[[f64; N]], entry: usize) -> bool {
    let mut equal = true;
    for sample in samples {
        equal &= sample[entry] == samples[0][entry];
    }
    equal
}

fn first_not_finite(values: &[f64]) -> Option<usize> {
    if dispatch!(every(values.iter(), |x| x.abs() <= f64::MAX)) {
        return None;
    }
    values.iter().position(|x| !x.is_finite())
}

/// Checks times that are not strictly ascending; two equal ones, a jump, are allowed.
fn check_order(time: &[f64]) -> Result<(), ExcitationError> {
    if dispatch!(every(time.windows(2), |pair| pair[0] < pair[1])) {
        return Ok(());
    }
    for index in 1..time.len() {
        let (before, got) = (time[index - 1], time[index]);
        if got < before {
            return Err(ExcitationError::Order { index, before, got });
        }
        if index > 1 && got == time[index - 2] {
            return Err(ExcitationError::Repeated { index, time: got });
        }
    }
    Ok(())
}

fn knots(time: &[f64]) -> Knots<'_> {
    let count = time.len();
    if count < 2 {
        return Knots::At(time, Spacing::Any);
    }
    let (start, end) = (time[0], time[count - 1]);
    let step = (end - start) / (count - 1) as f64;
    // Rounding of k * step + start, twice.
    let rounding = 2.0 * f64::EPSILON * f64::max(start.abs(), end.abs());
    // A 32-bit index converts to a double in one vector instruction.
    let on_grid = |(k, t): (u32, &f64)| (start + step * f64::from(k) - t).abs() <= rounding;
    // With a step of two roundings or less a jump could pass for two samples apart.
    let uniform =
        step > 2.0 * rounding && u32::try_from(count).is_ok() && dispatch!(every((0..).zip(time), on_grid));
    Knots::At(time, if uniform { Spacing::Uniform(step) } else { Spacing::Any })
}
