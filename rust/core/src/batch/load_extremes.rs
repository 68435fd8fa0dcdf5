//! The loads of single runs whose extremes the measures need, and where the extremes of each signal are found.

use super::equivalent::EquivalentRows;
use super::signals::{LoadRow, Signal, SignalRequest};
use super::time_statistics::RunningStatistics;
use crate::life::{Combinations, Rule, combinations, largest_of};
use crate::output::{Extremes, Part, Wrench, reaction};
use crate::system::System;
use crate::variation::{Group, Instance};

/// A load whose extremes are sought.
#[derive(Debug, Clone, PartialEq)]
enum Load {
    Group(usize),
    Drive,
    /// Linear combinations of the components of the load of a group.
    Combinations(usize, Combinations),
}

/// Where the extremes of a signal are found.
#[derive(Debug, Clone)]
enum Place {
    /// Load and value.
    Value(usize, usize),
    /// The largest value of these loads, which are linear combinations.
    Largest(Vec<usize>),
}

/// The loads, without duplicates.
#[derive(Debug, Clone, Default)]
pub(super) struct ExtremeLoads {
    loads: Vec<Load>,
    /// Before the first instant; values that are not wanted have infinite extremes.
    begin: Vec<Extremes>,
    /// Of each signal.
    places: Vec<Option<Place>>,
}

impl ExtremeLoads {
    /// The loads of some signals, by the rows and equivalent loads that these name.
    pub(super) fn new(rows: &[LoadRow], signals: &[SignalRequest], equivalents: &[EquivalentRows]) -> Self {
        let mut all = Self::default();
        for wanted in signals {
            let place = wanted.extremes.then(|| match wanted.signal {
                Signal::Row(row) => match rows[row] {
                    LoadRow::Group { component, group } => all.value(Load::Group(group), component),
                    LoadRow::Drive => all.value(Load::Drive, 0),
                },
                Signal::Resultant(y, _) => match rows[y] {
                    LoadRow::Group { group, .. } => all.value(Load::Group(group), 6),
                    LoadRow::Drive => all.value(Load::Drive, 6),
                },
                Signal::Equivalent(index) | Signal::Power(index) => {
                    let equivalent = &equivalents[index];
                    all.largest(equivalent.group, &equivalent.rule)
                }
            });
            all.places.push(place);
        }
        all
    }

    /// Both extremes of a value of a load.
    fn value(&mut self, load: Load, value: usize) -> Place {
        let index = self.index_of(load);
        let begin = &mut self.begin[index];
        (begin.smallest[value], begin.largest[value]) = (f64::INFINITY, f64::NEG_INFINITY);
        Place::Value(index, value)
    }

    /// The largest equivalent load of a group.
    fn largest(&mut self, group: usize, rule: &Rule<f64>) -> Place {
        let mut loads = Vec::new();
        for some in combinations(rule) {
            let begin = some.begin();
            let index = self.index_of(Load::Combinations(group, some));
            self.begin[index] = begin;
            loads.push(index);
        }
        Place::Largest(loads)
    }

    fn index_of(&mut self, load: Load) -> usize {
        self.loads.iter().position(|known| *known == load).unwrap_or_else(|| {
            self.loads.push(load);
            self.begin.push(Extremes::UNWANTED);
            self.loads.len() - 1
        })
    }

    /// The extremes before the first instant.
    pub(super) fn begin(&self) -> &[Extremes] {
        &self.begin
    }

    /// The loads of a sample.
    pub(super) fn of<'a>(&self, system: &'a System, sample: &Instance, groups: &[Group]) -> Vec<Wrench<'a>> {
        let group_load = |group: usize| groups[group].load(system, sample.centers()[group], Part::Total);
        let mut loads = Vec::with_capacity(self.loads.len());
        for load in &self.loads {
            loads.push(match load {
                Load::Group(group) => group_load(*group),
                Load::Drive => reaction(system).scaled(sample.factors()),
                Load::Combinations(group, some) => some.of(&group_load(*group)),
            });
        }
        loads
    }

    /// Takes the extremes of the signals.
    pub(super) fn write(&self, extremes: &[Extremes], statistics: &mut [RunningStatistics]) {
        for (place, statistics) in self.places.iter().zip(statistics) {
            match place {
                Some(Place::Value(load, value)) => {
                    let found = &extremes[*load];
                    (statistics.smallest, statistics.largest) =
                        (found.smallest[*value], found.largest[*value]);
                    statistics.time_of_smallest = found.time_of_smallest[*value];
                    statistics.time_of_largest = found.time_of_largest[*value];
                }
                Some(Place::Largest(loads)) => {
                    let some = loads.iter().filter_map(|&load| match &self.loads[load] {
                        Load::Combinations(_, some) => Some((some, &extremes[load])),
                        _ => None,
                    });
                    (statistics.largest, statistics.time_of_largest) = largest_of(some);
                }
                None => {}
            }
        }
    }
}
