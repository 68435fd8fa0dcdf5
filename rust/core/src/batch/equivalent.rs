//! Equivalent loads from the load rows of a batch.

use guideload_life::Number;

use super::travel::Travel;
use crate::life::{COMPONENTS, EquivalentLoad, LoadPower, Rule};
use crate::variation::{Group, Instance};

/// An equivalent load, by the load rows of its components.
#[derive(Debug, Clone)]
pub(super) struct EquivalentRows {
    pub rule: Rule<f64>,
    /// The group, and the preload of its links in the base, N.
    pub group: usize,
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
        Self { rule: rule.rule(), group, preload, rows, groups }
    }

    /// The load from the values of the rows, without the effect of a preload; `zero`: of their kind.
    #[inline(always)]
    pub(super) fn without_preload<N: Number>(&self, zero: N, row: impl Fn(usize) -> N) -> N {
        let mut groups = [zero; 2];
        for (sum, terms) in groups.iter_mut().zip(&self.groups) {
            for &(index, size, sign) in terms {
                *sum = added(*sum, row(index), size, sign);
            }
        }
        self.rule.combined(groups)
    }

    /// The components of the load, from the values of the rows.
    pub(super) fn components(&self, row: impl Fn(usize) -> f64) -> [f64; COMPONENTS] {
        self.rows.map(|index| index.map_or(0.0, &row))
    }

    /// The rule of a sample: where the preload of its links varies, that of the rule varies with it.
    pub(super) fn rule_of(&self, sample: &Instance, groups: &[Group]) -> Rule<f64> {
        if self.preload == 0.0 {
            return self.rule;
        }
        let factor = groups[self.group].preload(sample.links()) / self.preload;
        Rule { preload: factor * self.rule.preload, opening: factor * self.rule.opening, ..self.rule }
    }

    /// `∫ P^p |v| dt` by the rule of a sample over the interval that ends at a sample of the motion, 0 for the first one, between the
    /// components at both ends.
    pub(super) fn power(
        &self,
        rule: &Rule<f64>,
        travel: &Travel,
        sample: usize,
        ends: [&[f64; COMPONENTS]; 2],
    ) -> f64 {
        let interval = sample.checked_sub(1).and_then(|interval| travel.intervals.get(interval));
        let power = LoadPower::of_checked(travel.exponent);
        interval.map_or(0.0, |interval| rule.integrals(&power, interval, ends).power)
    }
}

/// Adds `size |value| + sign value` to a group of a rule.
#[inline(always)]
pub(super) fn added<N: Number>(sum: N, value: N, size: f64, sign: f64) -> N {
    let sum = if sign == 0.0 { sum } else { value.multiply_add(sum.constant(sign), sum) };
    value.abs().multiply_add(sum.constant(size), sum)
}
