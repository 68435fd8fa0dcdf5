//! One sample by itself: what every scene can do.

use super::Solver;
use super::instance::{Group, Instance};
use super::reduce::{Memory, Needs, Reduce};
use crate::error::{RunError, SampleError};
use crate::excitation::Excitation;
use crate::fill::fill;
use crate::integrate::{Control, Named, Output, Scaled};
use crate::loads::{Part, group_load};
use crate::modes::eigenvalues;
use crate::record::Record;
use crate::system::{Rung, State, System, joined};

/// How samples are run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Runs<'a> {
    pub excitation: &'a Excitation<'a>,
    /// Its peaks.
    pub peak: [f64; 9],
    /// Its median interval, s.
    pub usual: f64,
    pub solver: Solver,
    pub rtol: f64,
}

impl Runs<'_> {
    fn run<R: Record>(&self, system: &System, factors: [f64; 2], record: &mut R) -> Result<(), RunError> {
        let scaled = Scaled { excitation: self.excitation, peak: self.peak, factors };
        let (control, output) = (Control::Adaptive { rtol: self.rtol }, Output::Samples);
        self.method_for(system).run_scaled(system, control, &scaled, output, record)?;
        Ok(())
    }

    /// The method, chosen where that was left open.
    fn method_for(&self, system: &System) -> Named {
        match self.solver {
            Solver::Exact => Named::Exact,
            Solver::Rk45 => Named::Rk45,
            Solver::Implicit => Named::Implicit,
            Solver::Auto if system.rung() != Rung::SmoothNonlinear => Named::Exact,
            Solver::Auto => {
                let fastest = eigenvalues(system).map_or(f64::INFINITY, |values| {
                    values.iter().fold(0.0, |most, value| f64::max(most, value.norm()))
                });
                if STEP_COST * STABLE < fastest * self.usual { Named::Implicit } else { Named::Rk45 }
            }
        }
    }
}

/// Steps of rk45 that cost as much as one of the implicit method on a scene with smooth laws, and the product of step and fastest eigenvalue
/// up to which rk45 is stable, about.
const STEP_COST: f64 = 4.0;
const STABLE: f64 = 3.3;

/// Runs a sample and puts its measures into `out`.
pub(super) fn measure(
    runs: &Runs,
    needs: &Needs,
    groups: &[Group],
    sample: &Instance,
    memory: &mut Memory,
    out: &mut [f64],
) -> Result<(), SampleError> {
    let system = System::new(&sample.scene()?)?;
    memory.rows.take_up(&system, needs, groups, sample.centers(), sample.factors());
    let mut reduce = Reduce::new(needs, runs.excitation, memory);
    runs.run(&system, sample.factors(), &mut reduce)?;
    reduce.finish(out);
    Ok(())
}

/// Runs a sample and puts the loads of its groups into `out`, as (time, group, 6).
pub(super) fn history(
    runs: &Runs,
    groups: &[Group],
    sample: &Instance,
    out: &mut [f64],
) -> Result<(), SampleError> {
    let system = System::new(&sample.scene()?)?;
    let mut states: Vec<State> = Vec::new();
    runs.run(&system, sample.factors(), &mut states)?;
    let loads: Vec<_> = groups
        .iter()
        .zip(sample.centers())
        .map(|(group, center)| group_load(&system, group.links.iter().copied(), *center, Part::Total))
        .collect();
    // No load of links asks for the excitation.
    fill(&loads, &states, |_| joined([0.0; 3], [0.0; 6]), out);
    Ok(())
}
