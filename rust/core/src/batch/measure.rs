//! Measures: the numbers that a batch returns for each sample, computed from its loads.

use crate::excitation::Excitation;

/// A load of a group of links: force and moment about the group's centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Force along x, N.
    Fx,
    /// Force along y, N.
    Fy,
    /// Force along z, N.
    Fz,
    /// Moment about x, N m.
    Mx,
    /// Moment about y, N m.
    My,
    /// Moment about z, N m.
    Mz,
    /// `√(Fy² + Fz²)`, N.
    Resultant,
}

impl Quantity {
    /// All quantities: the components in the order of a wrench, then the resultant.
    pub const ALL: [Self; 7] = [Self::Fx, Self::Fy, Self::Fz, Self::Mx, Self::My, Self::Mz, Self::Resultant];

    /// Its name: `Fx`, …, `Mz` or `resultant`.
    pub const fn name(self) -> &'static str {
        ["Fx", "Fy", "Fz", "Mx", "My", "Mz", "resultant"][self as usize]
    }

    /// The quantity of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| quantity.name() == name)
    }
}

/// Statistic of the history of a quantity. The time of an extreme is that of its first occurrence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Statistic {
    /// Smallest value.
    Min,
    /// Time of the smallest value, s.
    TimeOfMin,
    /// Largest value.
    Max,
    /// Time of the largest value, s.
    TimeOfMax,
    /// Root of the time-weighted mean square, by [`time_weights`].
    Rms,
    /// Value at the first sample, the static load.
    Start,
}

impl Statistic {
    /// All statistics.
    pub const ALL: [Self; 6] =
        [Self::Min, Self::TimeOfMin, Self::Max, Self::TimeOfMax, Self::Rms, Self::Start];

    /// Its name, such as `time_of_min`.
    pub const fn name(self) -> &'static str {
        ["min", "time_of_min", "max", "time_of_max", "rms", "start"][self as usize]
    }

    /// The statistic of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|statistic| statistic.name() == name)
    }
}

/// One number returned for each sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Statistic of a load of a group, by the index of the group.
    Load(usize, Quantity, Statistic),
    /// Statistic of the drive force, the reaction of a held x, N; NaN where x is free.
    Drive(Statistic),
    /// Mean load of a group over the distance, `(∫ P^p |v| dt / ∫ |v| dt)^(1/p)`, with P by the group's rule: an exact integral, with loads
    /// linear in time between the samples. N; NaN if the speed of the motion is not known or always zero.
    MeanLoad(usize),
    /// Largest equivalent load of a group, by the group's rule for static safety, N.
    PeakLoad(usize),
    /// 1 if at some sample of the motion a link of the group has neither force nor stiffness or, if preloaded, an open row; otherwise 0.
    ContactLost(usize),
}

impl Measure {
    /// A measure by names: a [`Quantity`] or `drive` with a [`Statistic`], `load` with `mean` or `max`, `contact` with `lost`.
    pub fn from_names(quantity: &str, group: usize, statistic: &str) -> Option<Self> {
        match (quantity, statistic) {
            ("load", "mean") => Some(Self::MeanLoad(group)),
            ("load", "max") => Some(Self::PeakLoad(group)),
            ("contact", "lost") => Some(Self::ContactLost(group)),
            ("drive", _) => Some(Self::Drive(Statistic::from_name(statistic)?)),
            _ => Some(Self::Load(group, Quantity::from_name(quantity)?, Statistic::from_name(statistic)?)),
        }
    }

    /// Index of its group, if it has one.
    pub fn group(self) -> Option<usize> {
        match self {
            Self::Load(group, ..)
            | Self::MeanLoad(group)
            | Self::PeakLoad(group)
            | Self::ContactLost(group) => Some(group),
            Self::Drive(_) => None,
        }
    }
}

/// Weight of each sample in means over time: its fraction of the duration by the trapezoidal rule; equal weights for a motion without
/// duration. Their sum is 1.
pub fn time_weights(excitation: &Excitation) -> Vec<f64> {
    let (count, duration) = (excitation.count(), excitation.duration());
    if duration == 0.0 {
        return vec![1.0 / count as f64; count];
    }
    let mut weights = vec![0.0; count];
    for k in 0..count - 1 {
        let half = 0.5 * (excitation.interval(k) / duration);
        weights[k] += half;
        weights[k + 1] += half;
    }
    weights
}
