//! Links whose loads are measured together.

use nalgebra::Vector3;

use crate::life::EquivalentLoad;
use crate::model::Link;
use crate::output::{Axes, Part, Wrench, group_load_along};
use crate::system::System;

/// Links whose loads are added up, such as those of a carriage.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Their indices in the scene.
    pub links: Vec<usize>,
    /// Reference point of the moments, m from L.
    pub center: Vector3<f64>,
    /// The axes of its load.
    pub axes: Axes,
    /// Rule of the equivalent load whose mean is measured.
    pub mean_rule: EquivalentLoad,
    /// Rule of the equivalent load whose largest value is measured, for the static safety.
    pub peak_rule: EquivalentLoad,
}

impl Group {
    /// Links whose load is along the axes of the machine, and whose equivalent loads are `|Fy| + |Fz|`.
    pub fn new(links: Vec<usize>, center: Vector3<f64>) -> Self {
        let [mean_rule, peak_rule] = [EquivalentLoad::SUM_OF_FORCES; 2];
        Self { links, center, axes: Axes::MACHINE, mean_rule, peak_rule }
    }

    /// Their load in a system, along the axes of the group and about `center`.
    pub(crate) fn load<'a>(&self, system: &'a System, center: Vector3<f64>, part: Part) -> Wrench<'a> {
        group_load_along(system, self.links.iter().copied(), center, self.axes, part)
    }

    /// The preload of its links together, N: the larger one of those along y and along z.
    pub(crate) fn preload(&self, links: &[Link]) -> f64 {
        let mut along = [0.0; 2];
        for link in self.links.iter().map(|&link| &links[link]) {
            let direction = self.axes.components(link.direction());
            along[0] += link.law().preload() * f64::abs(direction.y);
            along[1] += link.law().preload() * f64::abs(direction.z);
        }
        f64::max(along[0], along[1])
    }
}
