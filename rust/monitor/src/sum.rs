//! Sums of very many terms.

use guideload_life::Real;

/// A sum in two numbers: its value, and the part that is lost in rounding it. Each addition is right to the square of the unit roundoff u,
/// so n terms of one sign are right to `n u²`: 1e9 terms to 4e-6 in f32 in the worst case, and to 1e-10 if the roundings are random.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "plain", derive(zerocopy::FromBytes))]
#[repr(C)]
pub struct Sum<T> {
    value: T,
    lost: T,
}

impl<T: Real> Sum<T> {
    /// No terms.
    pub const ZERO: Self = Self { value: T::ZERO, lost: T::ZERO };

    /// The sum from its two numbers.
    pub(crate) fn of_parts([value, lost]: [T; 2]) -> Self {
        Self { value, lost }
    }

    /// The value, and the part that is lost in rounding it.
    pub fn parts(self) -> [T; 2] {
        [self.value, self.lost]
    }

    /// Adds a term (Knuth's, then Dekker's exact addition).
    #[inline(always)]
    pub fn add(&mut self, term: T) {
        let [sum, error] = self.value.plus(term);
        let lost = self.lost + error;
        self.value = sum + lost;
        self.lost = lost - (self.value - sum);
    }

    /// The sum.
    pub fn value(self) -> f64 {
        self.value.to_f64() + self.lost.to_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::Sum;

    #[test]
    fn equal_terms_add_up_to_their_multiple() {
        let (mut single, mut double) = (Sum::<f32>::ZERO, Sum::<f64>::ZERO);
        for _ in 0..20_000_000 {
            single.add(0.1);
            double.add(0.1);
        }
        assert!((single.value() / (2e7 * f64::from(0.1_f32)) - 1.0).abs() < 1e-9);
        assert!((double.value() / 2e6 - 1.0).abs() < 1e-15);
    }

    #[test]
    fn small_terms_are_kept_beside_a_large_one() {
        let mut sum = Sum::<f32>::ZERO;
        sum.add(1e9);
        for _ in 0..1000 {
            sum.add(0.25);
        }
        assert_eq!(sum.value(), 1e9 + 250.0);
    }
}
