//! The extremes of the loads of groups, of the same loads less constant ones, and the largest equivalent loads of groups.

use guideload::{Combinations, Extremes, Wrench, combinations, largest_of};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::convert::{Array2, List};
use crate::error::require_finite;
use crate::life::{self, equivalent_load};
use crate::scene::table;

/// Rules of groups in Python, None for groups without one.
pub type Rules<'py> = List<Option<life::Rule<'py>>>;

/// What is sought of the loads of groups.
pub struct Sought {
    groups: usize,
    less: Vec<[f64; 6]>,
    /// Of groups, by their index.
    rules: Vec<(usize, Vec<Combinations>)>,
}

impl Sought {
    /// The extremes of so many groups; with `less` (groups, 6), those of the loads less these constants: of them only the largest
    /// magnitudes. With `rules`, of each group with a rule the largest equivalent load.
    pub fn new(
        groups: usize,
        less: Option<&PyReadonlyArray2<'_, f64>>,
        rules: Option<Rules<'_>>,
    ) -> PyResult<Self> {
        if let Some(less) = less
            && less.shape() != [groups, 6]
        {
            let got = less.shape();
            return Err(PyValueError::new_err(format!("less: expected shape ({groups}, 6), got {got:?}")));
        }
        let rules = rules.map_or(Vec::new(), |rules| rules.0);
        if !rules.is_empty() && rules.len() != groups {
            let got = rules.len();
            return Err(PyValueError::new_err(format!("rules: expected one per group, {groups}, got {got}")));
        }
        let less =
            less.map(|less| less.as_slice().map(|flat| flat.as_chunks::<6>().0.to_vec())).transpose()?;
        let of_group = |(group, rule): (usize, &Option<life::Rule<'_>>)| {
            let rule = rule.as_ref()?;
            Some(equivalent_load(rule).map(|found| (group, combinations(&found.rule()))))
        };
        let rules = rules.iter().enumerate().filter_map(of_group).collect::<PyResult<_>>()?;
        Ok(Self { groups, less: less.unwrap_or_default(), rules })
    }

    /// The loads to record, from those of the groups.
    pub fn loads<'a>(&self, mut loads: Vec<Wrench<'a>>) -> Vec<Wrench<'a>> {
        let beyond: Vec<_> =
            loads.iter().zip(&self.less).map(|(load, less)| load.clone().less(less)).collect();
        let combined = self.rules.iter().flat_map(|(group, some)| {
            let load = loads[*group].clone();
            some.iter().map(move |some| some.of(&load))
        });
        let combined: Vec<_> = combined.collect();
        loads.extend(beyond);
        loads.extend(combined);
        loads
    }

    /// Their extremes before the first instant.
    pub fn begin(&self) -> Vec<Extremes> {
        let mut begin = vec![Extremes::NONE; self.groups];
        begin.resize(self.groups + self.less.len(), Extremes::ONLY_MAGNITUDES);
        begin.extend(self.rules.iter().flat_map(|(_, some)| some).map(Combinations::begin));
        begin
    }

    /// Smallest, largest, time of smallest, time of largest, each (loads, 8), and the largest equivalent loads without the effect of
    /// their preload and their times (rules, 2). An error if one is beyond the range of numbers.
    pub fn arrays<'py>(&self, py: Python<'py>, extremes: &[Extremes]) -> PyResult<[Array2<'py>; 5]> {
        let (of_groups, others) = extremes.split_at(self.groups);
        let (beyond, mut combined) = others.split_at(self.less.len());
        let mut equivalent: Vec<[f64; 2]> = Vec::with_capacity(self.rules.len());
        for (_, some) in &self.rules {
            let (these, later) = combined.split_at(some.len());
            equivalent.push(largest_of(some.iter().zip(these)).into());
            combined = later;
        }
        let magnitudes = beyond.iter().flat_map(|extremes| &extremes.largest[6..]);
        let known = magnitudes.chain(equivalent.as_flattened());
        require_finite(of_groups.iter().all(Extremes::is_finite) && known.copied().all(f64::is_finite))?;
        let shown = &extremes[..self.groups + self.less.len()];
        let each = |pick: fn(&Extremes) -> [f64; 8]| table(py, shown.iter().map(pick));
        Ok([
            each(|e| e.smallest)?,
            each(|e| e.largest)?,
            each(|e| e.time_of_smallest)?,
            each(|e| e.time_of_largest)?,
            table(py, equivalent.into_iter())?,
        ])
    }
}
