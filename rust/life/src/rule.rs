//! The equivalent load of a carriage, and its powers.

use crate::real::Real;
use crate::rows::{Number, Rows};
use crate::travel::{Integrals, Interval, Power, Travel};

/// Number of components of a carriage's load: Fy, Fz, Mx, My, Mz, N and N m about the carriage centre.
pub const COMPONENTS: usize = 5;

/// Rule of the equivalent load P of the groups A and B of weighted magnitudes: `max(A, B) + minor min(A, B)`. A preload raises small P.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(C)]
pub struct Rule<T> {
    /// Weights of the groups A and B: of the magnitudes of the components, and of their values, which are not 0 if the two signs weigh
    /// differently; 1 for forces, 1/m for moments.
    pub weights: [[[T; COMPONENTS]; 2]; 2],
    /// Factor on the smaller group; 1 for a plain sum.
    pub minor: T,
    /// Preload, N; 0: none.
    pub preload: T,
    /// Load below which the preload acts, N: 2.8 or 3 times the preload, or that at which a row opens; 0: none.
    pub opening: T,
    /// Components with a weight: bit 0 for Fy.
    pub counted: u32,
    /// 1 if all weights are in group A and P is their plain sum, else 0.
    pub plain: u32,
    /// How the preload acts: 0 as `F (P / opening + 1)^1.5`, 1 as `F + 2/3 P`, 2 and 3 as the load of the loaded one of two rows of balls, of
    /// rollers.
    pub preload_form: u32,
}

/// What a rule makes of a load.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
pub struct Weighed<T> {
    /// The groups A and B, N.
    pub groups: [T; 2],
    /// Components that are negative: bit 0 for Fy.
    pub signs: u32,
}

impl<T: Real> Weighed<T> {
    /// Of no load.
    pub const ZERO: Self = Self { groups: [T::ZERO; 2], signs: 0 };
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
        weights: [[[T::ZERO; COMPONENTS]; 2]; 2],
        minor: T::ONE,
        preload: T::ZERO,
        opening: T::ZERO,
        counted: 0,
        plain: 1,
        preload_form: 0,
    };

    /// The rule in other numbers.
    pub fn map<U: Real>(&self, mut number: impl FnMut(T) -> U) -> Rule<U> {
        Rule {
            weights: self.weights.map(|group| group.map(|weights| weights.map(&mut number))),
            minor: number(self.minor),
            preload: number(self.preload),
            opening: number(self.opening),
            counted: self.counted,
            plain: self.plain,
            preload_form: self.preload_form,
        }
    }

    /// Integrals over an interval, for the components of the load at both ends, N and N m, linear between them.
    pub fn integrals(
        &self,
        power: &impl Power<T>,
        interval: &Interval<T>,
        loads: [&[T; COMPONENTS]; 2],
    ) -> Integrals<T> {
        let travel = Travel::new(interval);
        if travel.path == T::ZERO {
            return Integrals { power: T::ZERO, path: T::ZERO };
        }
        let [first, last] = loads.map(|load| self.weigh(load));
        Integrals { power: travel.power(self, power, loads, [&first, &last]), path: travel.path }
    }

    /// Groups and signs of a load.
    #[inline(always)]
    pub fn weigh(&self, load: &[T; COMPONENTS]) -> Weighed<T> {
        let [first, second] = &self.weights;
        let groups = [group(first, load), if self.plain != 0 { T::ZERO } else { group(second, load) }];
        let mut signs = 0;
        for (component, value) in load.iter().enumerate() {
            signs |= value.sign() << component;
        }
        Weighed { groups, signs }
    }

    /// P of the groups, without the effect of the preload, N.
    #[inline(always)]
    pub fn combined<N: Number>(&self, [first, second]: [N; 2]) -> N {
        if self.plain != 0 {
            return first;
        }
        let minor = first.constant(self.minor.to_f64());
        minor.multiply_add(first.at_most(second), first.at_least(second))
    }

    /// Derivative of P, without the effect of the preload, by each component of the load; by components that are zero, that for positive ones.
    pub fn gradient(&self, load: &[T; COMPONENTS]) -> [T; COMPONENTS] {
        let Weighed { groups: [first, second], signs } = self.weigh(load);
        self.gradients(signs)[usize::from(first < second)]
    }

    /// The derivatives of P, without the effect of the preload, by each component, for these signs of the components (bit 0 for Fy, set if it
    /// is negative): where group A is the larger one, and where B is. P is the largest of such linear combinations of the components.
    pub fn gradients(&self, signs: u32) -> [[T; COMPONENTS]; 2] {
        let [first, second] = self.weights.map(|[sizes, signed]| {
            core::array::from_fn::<T, COMPONENTS, _>(|component| {
                let is_negative = signs >> component & 1 != 0;
                signed[component] + if is_negative { T::ZERO - sizes[component] } else { sizes[component] }
            })
        });
        if self.plain != 0 {
            return [first; 2];
        }
        let added = |larger: &[T; COMPONENTS], smaller: &[T; COMPONENTS]| {
            core::array::from_fn(|component| larger[component] + self.minor * smaller[component])
        };
        [added(&first, &second), added(&second, &first)]
    }

    /// P with the effect of the preload, from P without it, N.
    #[inline(always)]
    pub fn with_preload(&self, load: T) -> T {
        if load >= self.opening {
            load
        } else if self.preload_form == 1 {
            self.preload + T::from_f64(2.0 / 3.0) * load
        } else if self.preload_form == 0 {
            let ratio = load / self.opening + T::ONE;
            self.preload * ratio * ratio.sqrt()
        } else {
            self.loaded_row(load)
        }
    }

    /// Load of the loaded one of two preloaded rows, N: `F (1 + e)^n` with `P = F ((1 + e)^n - (1 - e)^n)`, n = 3/2 for balls and 10/9 for
    /// rollers.
    #[inline(never)]
    fn loaded_row(&self, load: T) -> T {
        let rows = self.rows(load);
        let e = rows.deflection(load, 3);
        self.preload * (T::ONE + e) * rows.root(T::ONE + e)
    }

    /// Derivative of P with the effect of the preload by P without it, N/N.
    pub fn slope(&self, load: T) -> T {
        if load >= self.opening {
            return T::ONE;
        }
        match self.preload_form {
            0 => T::from_f64(1.5) * self.preload * (load / self.opening + T::ONE).sqrt() / self.opening,
            1 => T::from_f64(2.0 / 3.0),
            _ => {
                let rows = self.rows(load);
                let e = rows.deflection(load, 3);
                let (above, below) = (rows.root(T::ONE + e), rows.root(T::ONE - e));
                above / (above + below)
            }
        }
    }

    /// The two preloaded rows of a rule with these, in numbers of the kind of `load`.
    #[inline(always)]
    pub fn rows<N: Number>(&self, load: N) -> Rows<N> {
        let (preload, opening) = (load.constant(self.preload.to_f64()), load.constant(self.opening.to_f64()));
        Rows { preload, opening, balls: self.preload_form == 2 }
    }
}

/// Sum of the weighted magnitudes and values.
#[inline(always)]
fn group<T: Real>([magnitudes, values]: &[[T; COMPONENTS]; 2], load: &[T; COMPONENTS]) -> T {
    let [y, z, roll, yaw, pitch]: [T; COMPONENTS] =
        core::array::from_fn(|k| magnitudes[k] * load[k].abs() + values[k] * load[k]);
    ((y + z) + (roll + yaw)) + pitch
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
    pub fn power<T: Real>(self, load: T) -> T {
        let cube = load * load * load;
        match self {
            Self::Ball => cube,
            Self::Roller => cube * load.cbrt(),
        }
    }
}
