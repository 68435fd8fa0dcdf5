//! The integrators that a batch offers.

/// Integrator of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// The exact method if the laws of a sample allow it; with preloaded links the exponential method; with clearance, sides or curves beside
    /// them rk45, or the implicit method if rk45 would be unstable.
    Auto,
    /// [`crate::Exact`].
    Exact,
    /// [`crate::Exponential`].
    Exponential,
    /// [`crate::Rk45`].
    Rk45,
    /// [`crate::Radau`].
    Implicit,
}

impl Solver {
    /// The solver of that name: `auto`, `exact`, `exponential`, `rk45` or `implicit`.
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [
            ("auto", Self::Auto),
            ("exact", Self::Exact),
            ("exponential", Self::Exponential),
            ("rk45", Self::Rk45),
            ("implicit", Self::Implicit),
        ];
        all.into_iter().find(|(known, _)| *known == name).map(|(_, solver)| solver)
    }
}
