//! Requirements of the measures of a batch: loads, signals computed from them, and the statistics of each signal.

use core::ops::Range;

use super::equivalent::EquivalentRows;
use super::error::BatchError;
use super::load_extremes::ExtremeLoads;
use super::measure::{Measure, Quantity, Statistic, time_weights};
pub(super) use super::signals::{LoadRow, Signal, SignalRequest};
use super::time_statistics::RunningStatistics;
use super::travel::{Motion, Travel};
use crate::error::RunError;
use crate::life::{COMPONENTS, EquivalentLoad};
use crate::numeric::float::{pow, sqrt};
use crate::variation::Base;

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
    /// Equivalent loads of groups.
    pub equivalents: Vec<EquivalentRows>,
    /// The loads whose extremes are needed.
    pub extremes: ExtremeLoads,
    /// Whether something needs the loads at all samples: more than their extremes.
    pub needs_blocks: bool,
    /// Whether extremes are those at the samples, or those at any time.
    pub at_samples: bool,
    /// Weights of the samples in time.
    pub time: Vec<f64>,
    /// None for a motion without speed, or that never moves.
    pub travel: Option<Travel>,
}

/// Checks that all groups and links that are named exist.
pub(super) fn check(base: &Base, measures: &[Measure]) -> Result<(), BatchError> {
    let count = base.links.len();
    for (group, links) in base.groups.iter().map(|group| &group.links).enumerate() {
        if let Some(&link) = links.iter().find(|link| **link >= count) {
            return Err(BatchError::Group { group, link, count });
        }
    }
    if let Some(&measure) = measures.iter().find(|m| m.group().is_some_and(|g| g >= base.groups.len())) {
        return Err(BatchError::Measure { measure });
    }
    Ok(())
}

impl Requirements {
    pub(super) fn new(measures: &[Measure], drive_is_held: bool, base: &Base, motion: &Motion) -> Self {
        let has_mean = measures.iter().any(|measure| matches!(measure, Measure::MeanLoad(_)));
        let has_only_extremes = measures.iter().all(|measure| match measure {
            Measure::Load(_, _, statistic) | Measure::Drive(statistic) => match statistic {
                Statistic::Min | Statistic::TimeOfMin | Statistic::Max | Statistic::TimeOfMax => true,
                Statistic::Rms | Statistic::Start => false,
            },
            Measure::PeakLoad(_) => true,
            Measure::MeanLoad(_) | Measure::ContactLost(_) => false,
        });
        let travel = motion.speed.filter(|_| has_mean);
        let mut requirements = Self {
            rows: Vec::new(),
            contacts: Vec::new(),
            signals: Vec::new(),
            sources: Vec::new(),
            equivalents: Vec::new(),
            extremes: ExtremeLoads::default(),
            needs_blocks: !has_only_extremes,
            at_samples: false,
            time: time_weights(&motion.excitation),
            travel: travel.and_then(|speed| Travel::new(&motion.excitation, speed, motion.exponent)),
        };
        // The first pass finds the rows. Those of one component come side by side, because their extremes fall into the same blocks of
        // samples. The second pass finds their indices.
        requirements.add_measures(measures, drive_is_held, base);
        requirements.rows.sort();
        (requirements.signals, requirements.sources, requirements.equivalents) = Default::default();
        requirements.add_measures(measures, drive_is_held, base);
        let Self { rows, signals, equivalents, .. } = &requirements;
        requirements.extremes = ExtremeLoads::new(rows, signals, equivalents);
        requirements
    }

    /// Adds what measures need.
    fn add_measures(&mut self, measures: &[Measure], drive_is_held: bool, base: &Base) {
        for &measure in measures {
            let source = match measure {
                Measure::Load(group, quantity, statistic) => {
                    let signal = match quantity {
                        Quantity::Resultant => Signal::Resultant(
                            self.row(LoadRow::Group { component: 1, group }),
                            self.row(LoadRow::Group { component: 2, group }),
                        ),
                        component => {
                            Signal::Row(self.row(LoadRow::Group { component: component as usize, group }))
                        }
                    };
                    Source::Statistic(self.signal(signal, Some(statistic)), statistic)
                }
                Measure::Drive(statistic) if drive_is_held => {
                    let signal = Signal::Row(self.row(LoadRow::Drive));
                    Source::Statistic(self.signal(signal, Some(statistic)), statistic)
                }
                Measure::MeanLoad(group) if self.travel.is_some() => {
                    let signal = Signal::Power(self.equivalent(base, group, base.groups[group].mean_rule));
                    Source::Mean(self.signal(signal, None))
                }
                Measure::PeakLoad(group) => {
                    let signal =
                        Signal::Equivalent(self.equivalent(base, group, base.groups[group].peak_rule));
                    Source::Statistic(self.signal(signal, Some(Statistic::Max)), Statistic::Max)
                }
                Measure::Drive(_) | Measure::MeanLoad(_) => Source::Nothing,
                Measure::ContactLost(group) => Source::Contact(index_of(&mut self.contacts, group)),
            };
            self.sources.push(source);
        }
    }

    /// The requirements with the weights of some of the `count` samples; path and exponent are those of the whole motion.
    pub(super) fn part(&self, samples: &Range<usize>, count: usize) -> Self {
        let mut part = self.clone();
        if samples.len() < count {
            part.time = self.time[samples.clone()].to_vec();
            part.travel = self.travel.as_ref().map(|travel| travel.part(samples));
        }
        part
    }

    fn row(&mut self, row: LoadRow) -> usize {
        index_of(&mut self.rows, row)
    }

    /// The rows that a signal is computed from.
    pub(super) fn rows_of(&self, signal: Signal) -> impl Iterator<Item = usize> {
        let mut rows = [None; COMPONENTS];
        match signal {
            Signal::Row(row) => rows[0] = Some(row),
            Signal::Resultant(y, z) => (rows[0], rows[1]) = (Some(y), Some(z)),
            Signal::Equivalent(index) | Signal::Power(index) => rows = self.equivalents[index].rows,
        }
        rows.into_iter().flatten()
    }

    /// The index of the equivalent load of a group by a rule.
    fn equivalent(&mut self, base: &Base, group: usize, rule: EquivalentLoad) -> usize {
        let rows = core::array::from_fn::<_, COMPONENTS, _>(|component| {
            rule.counts(component).then(|| self.row(LoadRow::Group { component: 1 + component, group }))
        });
        let preload = base.groups[group].preload(base.links);
        self.equivalents.push(EquivalentRows::new(rule, group, preload, rows));
        self.equivalents.len() - 1
    }

    fn signal(&mut self, signal: Signal, statistic: Option<Statistic>) -> usize {
        let index = match self.signals.iter().position(|wanted| wanted.signal == signal) {
            Some(index) => index,
            None => {
                self.signals.push(SignalRequest::new(signal));
                self.signals.len() - 1
            }
        };
        if let Some(statistic) = statistic {
            self.signals[index].add(statistic);
        }
        index
    }

    /// Writes one number per measure to `out`, from the statistics of each signal and whether each monitored group lost contact. An error if
    /// one is beyond the range of numbers.
    pub(super) fn write_measures(
        &self,
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
                        Statistic::TimeOfMin => statistics.time_of_smallest,
                        Statistic::Max => statistics.largest,
                        Statistic::TimeOfMax => statistics.time_of_largest,
                        Statistic::Rms => sqrt(statistics.sum),
                        Statistic::Start => statistics.start,
                    }
                }
                Source::Mean(signal) => self.travel.as_ref().map_or(f64::NAN, |travel| {
                    let RunningStatistics { sum, rest, .. } = statistics[signal];
                    // The power may overflow, though the loads are finite.
                    let power = if sum.is_finite() { sum + rest } else { f64::INFINITY };
                    pow(power / travel.path, 1.0 / travel.exponent)
                }),
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
