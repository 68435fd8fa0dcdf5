//! Runs of single samples, for any scene.

use super::reduce::{Memory, Reduce};
use super::windows::Window;
use crate::error::RunError;
use crate::excitation::{Excitation, ScaledExcitation};
use crate::integrate::{Control, Exponential, Method, NamedMethod, Output, Start};
use crate::numeric::watch::Watch;
use crate::output::{Part, Record, Watched, evaluate};
use crate::system::{ModelLevel, State, System, eigenvalues, input_from};
use crate::variation::{Group, Instance, SampleError};

/// Start, motion, method and tolerance of all samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct RunSettings<'a> {
    pub start: Start,
    /// Accelerations in place of those of the excitation, where the motion of the sample is drawn.
    pub drawn: Option<&'a [[f64; 3]]>,
    pub windows: &'a [Window<'a>],
    /// Median interval between samples, s.
    pub typical_interval: f64,
    /// None: the method that suits each system.
    pub method: Option<NamedMethod>,
    pub rtol: f64,
    pub watch: Watch<'a>,
}

impl RunSettings<'_> {
    /// The system and the start of a window; `last`: system and final state of the window before.
    pub(super) fn begin(
        &self,
        window: &Window,
        sample: &Instance,
        last: Option<(System, State)>,
    ) -> Result<(System, Start), SampleError> {
        let system = System::new(&sample.scene_of(sample.carrying(&window.payloads))?)?;
        let Some((from, end)) = last else { return Ok((system, self.start)) };
        let kept = sample.carrying(&window.kept).mass_matrix();
        let start = Start::after_change_of_mass(&from, &end, &kept, &system);
        Ok((system, start))
    }

    /// The excitation of a window, and the largest magnitude of each of its components.
    pub(super) fn excitation<'b>(&'b self, window: &'b Window) -> (Excitation<'b>, [f64; 9]) {
        let Some(drawn) = self.drawn else { return (window.excitation, window.peak) };
        let samples = &drawn[window.first..][..window.excitation.count()];
        let excitation = window.excitation.with_acceleration(samples);
        (excitation, excitation.peak())
    }

    /// Runs a system through a window; returns the record and the final state.
    fn run<R: Record>(
        &self,
        (system, start): (&System, Start),
        scaled: &ScaledExcitation,
        record: R,
    ) -> Result<(R, State), RunError> {
        let (control, output) = (Control::Adaptive { rtol: self.rtol }, Output::Samples);
        let mut record = Watched { record, watch: self.watch };
        let method = self.method_for(system);
        let summary = method.method().run_compiled(system, control, start, scaled, output, &mut record)?;
        Ok((record.record, summary.end))
    }

    /// The method for a system.
    pub(super) fn method_for(&self, system: &System) -> NamedMethod {
        if let Some(method) = self.method {
            return method;
        }
        if system.model_level() != ModelLevel::SmoothNonlinear {
            return NamedMethod::Exact;
        }
        let values = eigenvalues(system);
        let [fastest, turning] = values.map_or([f64::INFINITY; 2], |values| {
            values.iter().fold([0.0; 2], |[most, turning], value| {
                [f64::max(most, f64::hypot(value.re, value.im)), f64::max(turning, value.im.abs())]
            })
        });
        let (method, speed, most) = if system.first_segmented().is_none() {
            (NamedMethod::Exponential, turning, LONGEST * EXPONENTIAL_COST)
        } else {
            (NamedMethod::Rk45, fastest, STABLE * RK45_COST)
        };
        if speed * self.typical_interval <= most { method } else { NamedMethod::Implicit }
    }
}

/// Cost of a step of the implicit method on a scene with smooth laws, in steps of the exponential method and of rk45.
const EXPONENTIAL_COST: f64 = 8.0;
const RK45_COST: f64 = 4.0;

/// Longest step of the exponential method, in radians of the fastest mode that vibrates.
const LONGEST: f64 = <Exponential as Method>::LONGEST_STEP;

/// Product of step and largest eigenvalue magnitude up to which rk45 is about stable.
const STABLE: f64 = 3.3;

/// Runs a sample and writes its measures to `out`.
pub(super) fn measure(
    runs: &RunSettings,
    groups: &[Group],
    sample: &Instance,
    memory: &mut Memory,
    out: &mut [f64],
) -> Result<(), SampleError> {
    let requirements = &runs.windows[0].requirements;
    memory.begin(requirements, sample, groups);
    let mut last = None;
    for window in runs.windows {
        let (system, start) = runs.begin(window, sample, last)?;
        let (excitation, peak) = runs.excitation(window);
        let scaled = ScaledExcitation { excitation: &excitation, peak, factors: sample.factors() };
        let loads = requirements.extremes.of(&system, sample, groups);
        let reduce = Reduce::new(window, &scaled, (&system, &loads), (sample, groups), memory);
        let (_, end) = runs.run((&system, start), &scaled, reduce)?;
        last = Some((system, end));
    }
    Ok(memory.write(requirements, out)?)
}

/// Runs a sample and writes the loads of its groups to `out`, (time, group, 6).
pub(super) fn history(
    runs: &RunSettings,
    groups: &[Group],
    sample: &Instance,
    out: &mut [f64],
) -> Result<(), SampleError> {
    let (mut last, mut rest, mut finite) = (None, out, true);
    for window in runs.windows {
        let (system, start) = runs.begin(window, sample, last)?;
        let (excitation, peak) = runs.excitation(window);
        let scaled = ScaledExcitation { excitation: &excitation, peak, factors: sample.factors() };
        let (states, end) = runs.run((&system, start), &scaled, Vec::<State>::new())?;
        let load = |(group, center): (&Group, &_)| group.load(&system, *center, Part::Total);
        let loads: Vec<_> = groups.iter().zip(sample.centers()).map(load).collect();
        let (part, after) = rest.split_at_mut(states.len() * groups.len() * 6);
        // Loads of links do not depend on the excitation directly.
        finite &= evaluate(&loads, &states, |_| input_from([0.0; 3], [0.0; 6]), part);
        (last, rest) = (Some((system, end)), after);
    }
    if finite { Ok(()) } else { Err(RunError::OutOfRange.into()) }
}
