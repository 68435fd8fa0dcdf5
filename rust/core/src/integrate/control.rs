//! Step-size control, in terms of the error of the link loads.

use crate::equations::Riders;
use crate::error::RunError;
use crate::excitation::Excitation;
use crate::numeric::float::{ceil, pow, sqrt};
use crate::system::{Input, State, System, eigenvalues};

/// How the steps of a run are chosen. Steps always end at samples where the slope of the excitation changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// Steps as long as the error of the link loads stays below `rtol` times the load scale.
    Adaptive {
        /// Relative to [`load_scale`].
        rtol: f64,
    },
    /// Equal steps in each interval between knots, none longer than `step` s.
    Fixed {
        /// s.
        step: f64,
    },
}

impl Control {
    /// Checks the settings, of methods without a step error too.
    pub(crate) fn check(self) -> Result<(), RunError> {
        match self {
            Self::Adaptive { rtol } if !(1e-13..=0.1).contains(&rtol) => {
                Err(RunError::Tolerance { got: rtol })
            }
            Self::Fixed { step } if !(step > 0.0 && step.is_finite()) => Err(RunError::Step { got: step }),
            _ => Ok(()),
        }
    }
}

/// The load that tolerances are relative to, N: the largest load of any link at rest plus the quasi-static load of the peaks of the
/// excitation. Zero only if neither weight nor excitation loads any link.
pub fn load_scale(system: &System, excitation: &Excitation) -> f64 {
    scale_of(system, &excitation.peak(), excitation)
}

/// [`load_scale`] from the peaks of an excitation, and with its riders.
pub(crate) fn scale_of(system: &System, peak: &Input, excitation: &Excitation) -> f64 {
    let riders = Riders::new(system, excitation);
    let mut scale: f64 = 0.0;
    for row in system.rows() {
        let load =
            |elastic: &[f64; 6]| row.elastic.iter().zip(elastic).map(|(r, e)| r * e).sum::<f64>().abs();
        let mut total = row.load.abs();
        for (component, &size) in peak.iter().enumerate().filter(|(_, size)| **size > 0.0) {
            let mut elastic = [0.0; 6];
            for mode in 0..system.mode_count() {
                elastic[mode] = size * system.influence()[component][mode] / system.frequency[mode];
            }
            total += load(&elastic);
        }
        riders.peak_forces(peak, |force| {
            let mut elastic = [0.0; 6];
            for mode in 0..system.mode_count() {
                elastic[mode] = force[mode] / system.frequency[mode];
            }
            total += load(&elastic);
        });
        // Unlike `max` this keeps a NaN.
        scale = if total <= scale { scale } else { total };
    }
    scale
}

/// Norm of an error of the state, weighted as an error of the loads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ErrorNorm {
    /// Largest load of any link per unit of each entry of the state, over the load scale.
    weight: State,
}

impl ErrorNorm {
    pub(crate) fn new(system: &System, scale: f64) -> Self {
        let mut weight = [0.0; 12];
        for row in system.rows() {
            for i in 0..6 {
                weight[i] = f64::max(weight[i], row.elastic[i].abs());
                weight[6 + i] = f64::max(weight[6 + i], row.damping[i].abs());
            }
        }
        // Without damping a velocity causes no load at once, but a quarter of a period later.
        for i in 0..6 {
            weight[6 + i] = f64::max(weight[6 + i], weight[i]);
            (weight[i], weight[6 + i]) = match scale {
                0.0 => (0.0, 0.0),
                _ => (weight[i] / scale, weight[6 + i] / scale),
            };
        }
        Self { weight }
    }

    /// Weight of each entry, 1/N times the load per unit.
    pub(super) fn weight(&self) -> &State {
        &self.weight
    }

    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn of(&self, error: &State) -> f64 {
        let mut sum = 0.0;
        for i in 0..12 {
            let load = self.weight[i] * error[i];
            sum += load * load;
        }
        sqrt(sum)
    }
}

/// Number of steps whose accumulated error stays below the tolerance if each estimate is at the tolerance: where laws are smooth, and where
/// many contact changes lie between the steps.
///
/// The error of a step lasts as long as the slowest mode rings. The run continues with the higher-order result (local extrapolation), whose
/// true error is well below the estimate; this margin covers so many steps. If errors last for more steps, each step must be more accurate
/// than the tolerance. Contact changes use up most of the margin: the time for which an error lasts is known only for the scene at rest, and
/// each change may enlarge an error. (On 2000 random mixtures of laws rk45 then stays below ten times the tolerance; with 50 steps seven of
/// 11 000 runs do not.)
const STEPS_WITHIN_MARGIN: f64 = 50.0;
const STEPS_WITHIN_MARGIN_OF_CHANGES: f64 = 10.0;

/// Factor on the error of a step without the usual margin: one that has samples inside it, because dense output is less accurate than the
/// end of the step, and one beside the edge of a preloaded law, because a load is not analytic where a row opens.
const NO_MARGIN_PENALTY: f64 = 10.0;

/// Largest and smallest factor on the step size, and the safety factor (Hairer, Nørsett & Wanner, II.4).
const MAX_GROWTH: f64 = 5.0;
const MIN_GROWTH: f64 = 0.2;
const SAFETY: f64 = 0.9;

/// Step-size controller of one run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Controller {
    rtol: f64,
    /// Time for which an error lasts, s, and the steps in it that the margin of the estimate covers.
    memory: f64,
    steps: f64,
    exponent: f64,
    /// Longest step, s.
    longest: f64,
    /// The step from which the next step size follows, s, and its error over the tolerance.
    reference_step: f64,
    error_ratio: f64,
}

impl Controller {
    /// `order`: that of the error estimate, which falls as `h^(order + 1)`; `changes`: whether contacts may change;
    /// `angle`: longest step in radians of the fastest mode that vibrates.
    pub(crate) fn new(
        rtol: f64,
        system: &System,
        excitation: &Excitation,
        order: u32,
        changes: bool,
        angle: f64,
    ) -> Self {
        // From the eigenvalues, not the modal damping ratios, because modes that are coupled by damping ring longer than each alone.
        let values = eigenvalues(system);
        let values = values.as_ref().map_or(&[][..], |values| &values[..2 * system.mode_count()]);
        let fastest = values.iter().fold(0.0, |most, value| f64::max(most, value.im.abs()));
        let slowest = values.iter().fold(f64::INFINITY, |least, value| f64::min(least, value.re.abs()));
        let slowest = if values.is_empty() { 0.0 } else { slowest };
        let memory = f64::min(excitation.duration(), 1.0 / slowest);
        let steps = if changes { STEPS_WITHIN_MARGIN_OF_CHANGES } else { STEPS_WITHIN_MARGIN };
        Self {
            rtol,
            memory,
            steps,
            exponent: -1.0 / f64::from(order + 1),
            longest: angle / fastest,
            reference_step: f64::INFINITY,
            error_ratio: 0.0,
        }
    }

    /// Whether a step of length `h` is not longer than the longest.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn allows(&self, h: f64) -> bool {
        h <= self.longest
    }

    /// Number of equal steps for the remaining time `rest` of an interval.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn split(&mut self, rest: f64) -> f64 {
        if rest <= self.reference_step && self.error_ratio <= SAME_STEP_RATIO && rest <= self.longest {
            return 1.0;
        }
        let allowed = f64::min(self.allowed(self.reference_step, self.error_ratio), self.longest);
        // Up to a few ulp more is the same step, not one step and a tiny one.
        if rest <= allowed { 1.0 } else { ceil(rest / allowed * (1.0 - 1e-12)) }
    }

    /// Registers the `error` of a step of length `h`, relative to the load scale; true if the step is accepted. `no_margin`: whether it
    /// has samples inside, which need dense output, or lies beside an edge. `rounding`: an error that no shorter step would reduce.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn accept(
        &mut self,
        h: f64,
        error: f64,
        no_margin: bool,
        rounding: impl FnOnce() -> f64,
    ) -> bool {
        let penalty = if no_margin { NO_MARGIN_PENALTY } else { 1.0 };
        let mut error_ratio = penalty * error / self.most_error(h);
        if error == 0.0 || error_ratio > 1.0 && error <= rounding() {
            error_ratio = 0.0; // however small the share
        } else if error_ratio.is_nan() {
            error_ratio = f64::INFINITY; // NaN rejects the step
        }
        // A step shortened to end at a sample determines the next step size poorly, a very short one not at all.
        let short = MAX_GROWTH * h <= self.reference_step && self.error_ratio <= SAME_STEP_RATIO;
        if h >= self.reference_step
            || error_ratio > SAME_STEP_RATIO
            || !short && self.allowed(h, error_ratio) > self.allowed(self.reference_step, self.error_ratio)
        {
            (self.reference_step, self.error_ratio) = (h, error_ratio);
        }
        error_ratio <= 1.0
    }

    /// Largest error of a step of length `h` that is accepted.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn most_error(&self, h: f64) -> f64 {
        self.rtol * f64::min(1.0, self.steps * h / self.memory)
    }

    /// Largest impulse of the linearisation error over `h` s, as a load over the load scale: rtol in the time for which an error lasts.
    #[inline(always)]
    pub(crate) fn most_linearization_error(&self, h: f64) -> f64 {
        self.rtol * f64::min(1.0, h / self.memory)
    }

    /// Whether thousands of steps with such an `error` would not matter.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn is_negligible(&self, error: f64) -> bool {
        error <= NEGLIGIBLE_ERROR * self.rtol
    }

    /// The step size that the error of a step of length `h` allows.
    #[cfg_attr(feature = "std", inline(always))]
    fn allowed(&self, h: f64, error_ratio: f64) -> f64 {
        let factor = SAFETY * pow(f64::max(error_ratio, 1e-30), self.exponent);
        h * factor.clamp(MIN_GROWTH, MAX_GROWTH)
    }

    /// Error over the tolerance of the step from which the next step size follows; after a rejection, of the rejected step.
    #[cfg_attr(feature = "std", inline(always))]
    pub(crate) fn error_ratio(&self) -> f64 {
        self.error_ratio
    }
}

/// Error of the shortest step that is accepted beside an edge, over rtol, although it exceeds the share of its length: a run has far fewer
/// than ten thousand such steps.
const NEGLIGIBLE_ERROR: f64 = 1e-4;

/// Error over the tolerance up to which the step size is not reduced: below `SAFETY^5` and `SAFETY^6`.
const SAME_STEP_RATIO: f64 = 0.5;
