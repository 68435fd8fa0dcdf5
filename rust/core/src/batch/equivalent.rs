//! Equivalent loads from the load rows of a batch.

use super::travel::Travel;
use crate::life::{COMPONENTS, EquivalentLoad, Preload};
use crate::variation::{Group, Instance};

/// An equivalent load, by the load rows of its components.
#[derive(Debug, Clone)]
pub(super) struct EquivalentRows {
    pub rule: EquivalentLoad,
    /// The group, and the preload of its links in the base, N.
    group: usize,
    preload: f64,
    pub rows: [Option<usize>; COMPONENTS],
    /// Per group of the rule: rows x and factors c, d; the group is `Σ c |x| + d x`. One group if the rule adds both.
    pub groups: Vec<Vec<(usize, f64, f64)>>,
}

impl EquivalentRows {
    /// The equivalent load of a group with this preload of its links in the base, by the rows of the components that the rule counts.
    pub(super) fn new(
        rule: EquivalentLoad,
        group: usize,
        preload: f64,
        rows: [Option<usize>; COMPONENTS],
    ) -> Self {
        let terms = |weights: [[f64; 2]; COMPONENTS]| {
            let terms = rows.iter().zip(weights).filter_map(|(row, [above, below])| {
                row.filter(|_| [above, below] != [0.0; 2])
                    .map(|row| (row, 0.5 * (above + below), 0.5 * (above - below)))
            });
            terms.collect::<Vec<_>>()
        };
        let mut groups: Vec<_> = rule.weights.into_iter().map(terms).collect();
        if rule.minor == 1.0
            && let Some(second) = groups.pop()
        {
            groups[0].extend(second);
        }
        Self { rule, group, preload, rows, groups }
    }

    /// The components of the load, from the values of the rows.
    pub(super) fn components(&self, row: impl Fn(usize) -> f64) -> [f64; COMPONENTS] {
        self.rows.map(|index| index.map_or(0.0, &row))
    }

    /// The preload of a sample: where its links vary, that of the rule varies with them.
    pub(super) fn preload(&self, sample: &Instance, groups: &[Group]) -> Preload {
        if self.preload == 0.0 || !self.is_preloaded() {
            return self.rule.preload;
        }
        let preload = groups[self.group].preload(sample.links());
        if preload == self.preload {
            self.rule.preload
        } else {
            self.rule.preload.scaled(preload / self.preload)
        }
    }

    /// Whether the preload may raise the load.
    pub(super) fn is_preloaded(&self) -> bool {
        self.rule.preload != Preload::None
    }

    /// `∫ P^p |v| dt` over the interval that ends at a sample, 0 for the first one, between the components at both ends.
    pub(super) fn power(
        &self,
        preload: Preload,
        travel: &Travel,
        sample: usize,
        ends: [&[f64; COMPONENTS]; 2],
    ) -> f64 {
        let rule = EquivalentLoad { preload, ..self.rule };
        let interval = sample.checked_sub(1).and_then(|interval| travel.intervals.get(interval));
        interval.map_or(0.0, |interval| rule.integrals(travel.exponent, interval, ends).power)
    }
}
