//! The description of a batch.

use super::error::BatchError;
use super::lanes::{Lanes, Width};
use super::measure::Measure;
use super::motion_draws::MotionDraws;
use super::requirements::{self, Requirements};
use super::single::RunSettings;
use super::travel::Motion;
use super::windows::{Window, windows};
use crate::integrate::{Control, NamedMethod, Start};
use crate::model::Dof;
use crate::numeric::watch::Watch;
use crate::variation::{Base, Change, Instance, Plan};

/// A batch: base scene, motion, changes and measures. Immutable and shared by all threads.
#[derive(Debug, Clone)]
pub struct Batch<'a> {
    pub(super) base: Base<'a>,
    pub(super) motion: Motion<'a>,
    pub(super) plan: Plan,
    pub(super) first: Instance,
    pub(super) start: Start,
    pub(super) measures: Vec<Measure>,
    /// Between the changes of payload; at least one.
    pub(super) windows: Vec<Window<'a>>,
    pub(super) lanes: Lanes<'a>,
    pub(super) typical_interval: f64,
    pub(super) method: Option<NamedMethod>,
    pub(super) rtol: f64,
    pub(super) watch: Watch<'a>,
    /// Draws of the motion, and the column of values with their numbers.
    pub(super) draws: Option<(&'a MotionDraws, usize)>,
}

impl<'a> Batch<'a> {
    /// A batch of `changes` of a `base` under a `motion`.
    ///
    /// `method` None: exact if the laws of a sample allow it; exponential with preloaded links; with clearance, sides or curves beside them
    /// rk45, or implicit if rk45 would be unstable. `rtol`: error of the link loads relative to [`crate::load_scale`], for methods with a
    /// step error.
    ///
    /// # Errors
    /// [`BatchError`] for a target that does not exist or is changed twice, for an argument out of range, and for a base that is not a valid
    /// scene without changes. Support and equilibrium are checked for each sample.
    pub fn new(
        base: Base<'a>,
        motion: Motion<'a>,
        changes: &[Change],
        measures: &[Measure],
        method: Option<NamedMethod>,
        rtol: f64,
    ) -> Result<Self, BatchError> {
        let excitation = &motion.excitation;
        requirements::check(&base, measures)?;
        motion.check()?;
        Control::Adaptive { rtol }.check()?;
        let drive_is_held = !base.free.contains(Dof::X);
        let mut intervals: Vec<f64> = (1..excitation.count()).map(|k| excitation.interval(k - 1)).collect();
        intervals.retain(|length| *length > 0.0);
        intervals.sort_unstable_by(f64::total_cmp);
        let requirements = Requirements::new(measures, drive_is_held, &base, &motion);
        let windows = windows(excitation, base.payloads, requirements)?;
        Ok(Self {
            lanes: Lanes::new(&base, &windows, Start::AtRest, false, Width::Widest),
            plan: Plan::new(&base, changes)?,
            first: Instance::new(&base)?,
            start: Start::AtRest,
            measures: measures.to_vec(),
            windows,
            typical_interval: intervals.get(intervals.len() / 2).copied().unwrap_or(0.0),
            base,
            motion,
            method,
            rtol,
            watch: Watch::NEVER,
            draws: None,
        })
    }

    /// The batch with a watch, which may stop [`Batch::run`] and [`Batch::histories`] with [`BatchError::Stopped`].
    pub fn with_watch(mut self, watch: Watch<'a>) -> Self {
        self.watch = watch;
        self
    }

    /// The batch with another vector width for linear scenes. The width changes the speed, but no bit of the results.
    pub fn with_width(mut self, width: Width) -> Self {
        self.lanes = Lanes::new(&self.base, &self.windows, self.start, self.draws.is_some(), width);
        self
    }

    /// The batch with another start of all samples than [`Start::AtRest`].
    pub fn with_start(mut self, start: Start) -> Self {
        self.start = start;
        let width = self.lanes.width();
        self.with_width(width)
    }

    /// The batch with a draw of the motion for each sample: the one whose number, a whole one, is in this column of its values.
    ///
    /// # Panics
    /// If the draws are for another number of samples of the motion.
    pub fn with_motion_draws(mut self, draws: &'a MotionDraws, column: usize) -> Self {
        assert_eq!(draws.count(), self.motion.excitation.count(), "draws of this motion");
        self.draws = Some((draws, column));
        let width = self.lanes.width();
        self.with_width(width)
    }

    /// The batch with the extremes of loads at the samples of the motion, not at any time.
    pub fn at_samples(mut self) -> Self {
        for window in &mut self.windows {
            window.requirements.at_samples = true;
        }
        self
    }

    /// Columns of values that changes and draws need.
    pub fn columns(&self) -> usize {
        usize::max(self.plan.columns(), self.draws.map_or(0, |(_, column)| column + 1))
    }

    /// The measures, in the order of the columns of results.
    pub fn measures(&self) -> &[Measure] {
        &self.measures
    }

    /// The requirements, with the weights of the samples of the first window.
    pub(super) fn requirements(&self) -> &Requirements {
        &self.windows[0].requirements
    }

    /// `drawn`: accelerations of a drawn motion.
    pub(super) fn runs<'b>(&'b self, drawn: Option<&'b [[f64; 3]]>) -> RunSettings<'b> {
        RunSettings {
            start: self.start,
            drawn,
            windows: &self.windows,
            typical_interval: self.typical_interval,
            method: self.method,
            rtol: self.rtol,
            watch: self.watch,
        }
    }
}
