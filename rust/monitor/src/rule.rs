//! The equivalent load of a carriage, and its powers.

use crate::real::Real;

/// Number of components of a carriage's load: Fy, Fz, Mx, My, Mz, N and N m about the carriage centre.
pub const COMPONENTS: usize = 5;

/// Rule of the equivalent load P of the groups A and B of weighted magnitudes: `max(A, B) + minor min(A, B)`. A preload raises small P.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Rule<T> {
    /// Weights of the groups A and B, of each component, for positive and negative values; 1 for forces, 1/m for moments.
    pub weights: [[[T; 2]; COMPONENTS]; 2],
    /// Factor on the smaller group; 1 for a plain sum.
    pub minor: T,
    /// Preload, N; 0: none.
    pub preload: T,
    /// Load below which the preload acts, N: 2.8 or 3 times the preload; 0: none.
    pub opening: T,
    /// Components with a weight: bit 0 for Fy.
    pub counted: u32,
    /// 1 if all weights are in group A and P is their plain sum, else 0.
    pub plain: u32,
    /// How the preload acts: 0 as `F (P / opening + 1)^1.5`, 1 as `F + 2/3 P`.
    pub linear_preload: u32,
}

/// Exponent of the life: 3 for balls, 10/3 for rollers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Exponent {
    /// 3.
    Ball = 0,
    /// 10/3.
    Roller = 1,
}

impl<T: Real> Rule<T> {
    /// No component counts.
    pub const NONE: Self = Self {
        weights: [[[T::ZERO; 2]; COMPONENTS]; 2],
        minor: T::ONE,
        preload: T::ZERO,
        opening: T::ZERO,
        counted: 0,
        plain: 1,
        linear_preload: 0,
    };

    /// Whether each component has a weight.
    pub(crate) fn counted(&self) -> impl Iterator<Item = bool> {
        let counted = self.counted;
        (0..COMPONENTS).map(move |component| counted >> component & 1 != 0)
    }

    /// The groups A and B, N.
    pub(crate) fn groups(&self, load: &[T; COMPONENTS]) -> [T; 2] {
        let [first, second] = &self.weights;
        let mut groups = [T::ZERO; 2];
        for ((&value, &[above, below]), counted) in load.iter().zip(first).zip(self.counted()) {
            if counted {
                groups[0] += if value >= T::ZERO { above * value } else { below * -value };
            }
        }
        if self.plain == 0 {
            for (&value, &[above, below]) in load.iter().zip(second) {
                groups[1] += if value >= T::ZERO { above * value } else { below * -value };
            }
        }
        groups
    }

    /// P of the groups, without the effect of the preload, N.
    pub(crate) fn combined(&self, [first, second]: [T; 2]) -> T {
        if self.plain != 0 {
            return first;
        }
        let (larger, smaller) = if first >= second { (first, second) } else { (second, first) };
        larger + self.minor * smaller
    }

    /// P with the effect of the preload, from P without it, N.
    pub(crate) fn raised(&self, load: T) -> T {
        if load >= self.opening {
            load
        } else if self.linear_preload != 0 {
            self.preload + T::from_f64(2.0 / 3.0) * load
        } else {
            let ratio = load / self.opening + T::ONE;
            self.preload * ratio * ratio.sqrt()
        }
    }
}

impl Exponent {
    /// The exponent.
    pub fn value(self) -> f64 {
        match self {
            Self::Ball => 3.0,
            Self::Roller => 10.0 / 3.0,
        }
    }

    /// `load^p`, for a load from 0 on.
    pub(crate) fn power<T: Real>(self, load: T) -> T {
        let cube = load * load * load;
        match self {
            Self::Ball => cube,
            Self::Roller => cube * load.cbrt(),
        }
    }
}
