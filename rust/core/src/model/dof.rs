//! The six degrees of freedom of the reference point L, each free or held.

use core::fmt;

/// A degree of freedom of L.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dof {
    /// Translation along the rails.
    X,
    /// Translation across, y.
    Y,
    /// Translation across, z.
    Z,
    /// Rotation about x (roll).
    Rx,
    /// Rotation about y (yaw).
    Ry,
    /// Rotation about z (pitch).
    Rz,
}

impl Dof {
    /// All six in the order of the generalised coordinates `(u, φ)`.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::Rx, Self::Ry, Self::Rz];

    /// Its name: `x`, `y`, `z`, `rx`, `ry` or `rz`.
    pub const fn name(self) -> &'static str {
        ["x", "y", "z", "rx", "ry", "rz"][self as usize]
    }

    /// The degree of freedom of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|dof| dof.name() == name)
    }
}

impl fmt::Display for Dof {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The set of free degrees of freedom. The others are held, and their reactions are an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Free([bool; 6]);

impl Free {
    /// All but x, which the drive holds: y z rx ry rz. The choice for real machines.
    pub const GUIDED: Self = Self([false, true, true, true, true, true]);
    /// The choice of the paper: rx ry rz. The constraint at L then carries the weight, and the guides do not.
    pub const PAPER: Self = Self([false, false, false, true, true, true]);
    /// All six; the drive is then modelled as a link along x.
    pub const ALL: Self = Self([true; 6]);

    /// The set of these degrees of freedom.
    pub fn only(dofs: &[Dof]) -> Self {
        let mut free = [false; 6];
        for &dof in dofs {
            free[dof as usize] = true;
        }
        Self(free)
    }

    /// Whether `dof` is free.
    pub fn contains(self, dof: Dof) -> bool {
        self.0[dof as usize]
    }

    /// Number of free degrees of freedom.
    pub fn count(self) -> usize {
        self.0.iter().filter(|&&free| free).count()
    }

    /// The free degrees of freedom, in order.
    pub fn iter(self) -> impl Iterator<Item = Dof> {
        Dof::ALL.into_iter().filter(move |&dof| self.contains(dof))
    }
}
