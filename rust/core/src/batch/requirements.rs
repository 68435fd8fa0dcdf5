//! Requirements of the measures of a batch: loads, signals computed from them, and the statistics of each signal.

use super::measure::{Measure, Quantity, Statistic, time_weights, travel_weights};
use super::time_statistics::RunningStatistics;
use crate::error::RunError;
use crate::excitation::Excitation;
use crate::numeric::float::sqrt;
use crate::numeric::power::Power;

/// A signal: a history from which statistics are computed, by the indices of its load rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Signal {
    Row(usize),
    /// `√(y² + z²)` of two rows.
    Resultant(usize, usize),
    /// `|y| + |z|` of two rows, to be raised to the exponent of the mean load.
    SumOfSizes(usize, usize),
}

/// One load: a component of a group's load, or the drive force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum LoadRow {
    Group(usize, usize),
    Drive,
}

/// Source of the value of a measure.
#[derive(Debug, Clone, Copy)]
enum Source {
    Statistic(usize, Statistic),
    Mean(usize),
    Contact(usize),
    Nothing,
}

/// Requirements of all measures, without duplicates.
#[derive(Debug, Clone)]
pub(super) struct Requirements {
    pub rows: Vec<LoadRow>,
    /// Groups whose contacts are monitored.
    pub contacts: Vec<usize>,
    pub signals: Vec<SignalRequest>,
    sources: Vec<Source>,
    /// Weights of the samples in time and in distance; empty for a motion without speed, or that never moves.
    pub time: Vec<f64>,
    pub travel: Vec<f64>,
    pub power: Power,
}

/// A signal and the statistics that it is needed for.
#[derive(Debug, Clone, Copy)]
pub(super) struct SignalRequest {
    pub signal: Signal,
    pub extremes: bool,
    /// Times of the extremes.
    pub times: bool,
    pub squares: bool,
}

impl Requirements {
    pub(super) fn new(
        measures: &[Measure],
        drive_is_held: bool,
        excitation: &Excitation,
        speed: Option<&[f64]>,
        exponent: f64,
    ) -> Self {
        let travel = speed.and_then(|speed| travel_weights(excitation, speed));
        let mut requirements = Self {
            rows: Vec::new(),
            contacts: Vec::new(),
            signals: Vec::new(),
            sources: Vec::new(),
            time: time_weights(excitation),
            travel: travel.unwrap_or_default(),
            power: Power::new(exponent),
        };
        for &measure in measures {
            let source = match measure {
                Measure::Load(group, quantity, statistic) => {
                    let signal = match quantity {
                        Quantity::Resultant => Signal::Resultant(
                            requirements.row(LoadRow::Group(group, 1)),
                            requirements.row(LoadRow::Group(group, 2)),
                        ),
                        component => Signal::Row(requirements.row(LoadRow::Group(group, component as usize))),
                    };
                    Source::Statistic(requirements.signal(signal, Some(statistic)), statistic)
                }
                Measure::Drive(statistic) if drive_is_held => {
                    let signal = Signal::Row(requirements.row(LoadRow::Drive));
                    Source::Statistic(requirements.signal(signal, Some(statistic)), statistic)
                }
                Measure::MeanLoad(group) if !requirements.travel.is_empty() => {
                    let signal = Signal::SumOfSizes(
                        requirements.row(LoadRow::Group(group, 1)),
                        requirements.row(LoadRow::Group(group, 2)),
                    );
                    Source::Mean(requirements.signal(signal, None))
                }
                Measure::Drive(_) | Measure::MeanLoad(_) => Source::Nothing,
                Measure::ContactLost(group) => Source::Contact(index_of(&mut requirements.contacts, group)),
            };
            requirements.sources.push(source);
        }
        requirements
    }

    fn row(&mut self, row: LoadRow) -> usize {
        index_of(&mut self.rows, row)
    }

    fn signal(&mut self, signal: Signal, statistic: Option<Statistic>) -> usize {
        let index = match self.signals.iter().position(|wanted| wanted.signal == signal) {
            Some(index) => index,
            None => {
                self.signals.push(SignalRequest { signal, extremes: false, times: false, squares: false });
                self.signals.len() - 1
            }
        };
        let wanted = &mut self.signals[index];
        match statistic {
            Some(Statistic::Start) | None => {}
            Some(Statistic::Rms) => wanted.squares = true,
            Some(Statistic::Min | Statistic::Max) => wanted.extremes = true,
            Some(Statistic::TimeOfMin | Statistic::TimeOfMax) => {
                (wanted.extremes, wanted.times) = (true, true);
            }
        }
        index
    }

    /// Writes one number per measure to `out`, from the statistics of each signal and whether each monitored group lost contact. An error if
    /// one is beyond the range of numbers.
    pub(super) fn write_measures(
        &self,
        excitation: &Excitation,
        statistics: &[RunningStatistics],
        lost: &[bool],
        out: &mut [f64],
    ) -> Result<(), RunError> {
        let mut finite = true;
        for (to, source) in out.iter_mut().zip(&self.sources) {
            *to = match *source {
                Source::Statistic(signal, statistic) => {
                    let statistics = &statistics[signal];
                    match statistic {
                        Statistic::Min => statistics.smallest,
                        Statistic::TimeOfMin => excitation.time(statistics.at_smallest),
                        Statistic::Max => statistics.largest,
                        Statistic::TimeOfMax => excitation.time(statistics.at_largest),
                        Statistic::Rms => sqrt(statistics.sum),
                        Statistic::Start => statistics.start,
                    }
                }
                Source::Mean(signal) => self.power.root(statistics[signal].sum),
                Source::Contact(index) => f64::from(u8::from(lost[index])),
                Source::Nothing => f64::NAN,
            };
            finite &= to.is_finite() || matches!(source, Source::Nothing);
        }
        if finite { Ok(()) } else { Err(RunError::OutOfRange) }
    }

    /// Whether the drive force is needed, into which the excitation enters directly.
    pub(super) fn needs_drive(&self) -> bool {
        self.rows.contains(&LoadRow::Drive)
    }
}

/// The index of an item, which is appended if it is new.
fn index_of<T: PartialEq + Copy>(items: &mut Vec<T>, item: T) -> usize {
    items.iter().position(|known| *known == item).unwrap_or_else(|| {
        items.push(item);
        items.len() - 1
    })
}
