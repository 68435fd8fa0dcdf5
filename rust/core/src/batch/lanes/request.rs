//! The part of a batch that is the same for all scenes.

use crate::batch::requirements::LoadRow;
use crate::variation::Group;

/// Degrees of freedom, groups, excitation and wanted loads, the same for all scenes of a batch.
#[derive(Debug, Clone)]
pub(super) struct ModalRequest<'a> {
    /// Free degrees of freedom, ascending.
    pub dofs: Vec<usize>,
    /// Links of each group.
    pub groups: &'a [Group],
    /// Components of the excitation that are not zero throughout.
    pub components: Vec<usize>,
    pub rows: Vec<LoadRow>,
    /// Whether the scenes start in the quasi-static state of the first sample instead of at rest.
    pub quasi_static: bool,
    /// Values of these components at the first sample.
    pub first: Vec<f64>,
    /// Duration of the motion, s.
    pub duration: f64,
}
