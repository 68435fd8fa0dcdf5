//! Transition of the state between two samples.

use super::data::Oscillator;

/// Transition matrix Phi and noise covariance of one step: x(t + h) = Phi x(t) + w, cov(w) = density * noise.
pub(super) trait Transition<const N: usize>: Clone {
    /// Number of diagonals below the main one with entries of Phi other than zero.
    const BELOW_DIAGONAL: usize;

    /// Before the first step: Phi is zero.
    fn new(oscillator: Option<Oscillator>) -> Self;

    /// Changes the step. Without cost if it is the same as before, as with uniform time stamps.
    fn set(&mut self, step: f64);

    /// Covariance of w for a noise density of 1.
    fn noise(&self) -> &[[f64; N]; N];

    /// Entry of Phi.
    fn entry(&self, i: usize, j: usize) -> f64;

    /// Phi x
    fn propagate(&self, x: &mut [f64; N]);

    /// Phi^T r
    fn propagate_transposed(&self, r: &mut [f64; N]);

    /// Phi P Phi^T + density * noise
    fn propagate_covariance(&self, p: &mut [[f64; N]; N], density: f64);

    /// Phi^T M Phi
    fn propagate_information(&self, m: &mut [[f64; N]; N]);
}

/// The expression with the number of states N and the [`Transition`] T; None if there is none: the number of
/// states is 2 to 6, and with an oscillator 4 to 6, at least two of them after the acceleration.
macro_rules! with_transition {
    ($states:expr, $oscillator:expr, $n:ident, $t:ident => $body:expr) => {{
        use $crate::smoother::{derivatives::Derivatives, ringing::Ringing};
        macro_rules! case {
            ($number:literal, $transition:ident) => {{
                const $n: usize = $number;
                type $t = $transition<$number>;
                Some($body)
            }};
        }
        match ($states, $oscillator.map(|it| it.acceleration)) {
            (2, None) => case!(2, Derivatives),
            (3, None) => case!(3, Derivatives),
            (4, None) => case!(4, Derivatives),
            (5, None) => case!(5, Derivatives),
            (6, None) => case!(6, Derivatives),
            (4, Some(0..=1)) => case!(4, Ringing),
            (5, Some(0..=2)) => case!(5, Ringing),
            (6, Some(0..=3)) => case!(6, Ringing),
            _ => None,
        }
    }};
}
pub(super) use with_transition;

/// Product of matrices by rows.
#[inline(always)]
pub(super) fn product<const N: usize>(a: &[[f64; N]; N], b: &[[f64; N]; N]) -> [[f64; N]; N] {
    let mut c = [[0.0; N]; N];
    for i in 0..N {
        for l in 0..N {
            for j in 0..N {
                c[i][j] += a[i][l] * b[l][j];
            }
        }
    }
    c
}

/// Copies the lower triangle to the upper one.
#[inline(always)]
pub(super) fn mirror<const N: usize>(m: &mut [[f64; N]; N]) {
    for i in 0..N {
        for l in 0..i {
            m[l][i] = m[i][l];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::data::Oscillator;
    use super::super::derivatives::Derivatives;
    use super::super::ringing::Ringing;
    use super::Transition;

    fn two_steps_are_one<const N: usize, T: Transition<N>>(oscillator: Option<Oscillator>) {
        let (mut short, mut long) = (T::new(oscillator), T::new(oscillator));
        short.set(0.3);
        long.set(0.6);
        let mut twice = [[0.0; N]; N];
        short.propagate_covariance(&mut twice, 2.0);
        short.propagate_covariance(&mut twice, 2.0);
        for i in 0..N {
            for j in 0..N {
                let wanted = 2.0 * long.noise()[i][j];
                assert!((twice[i][j] - wanted).abs() < 1e-9 * wanted.abs(), "noise {i}, {j}: {oscillator:?}");
            }
        }
        let mut x = core::array::from_fn(|i| 1.0 - 0.7 * i as f64);
        let mut y = x;
        short.propagate(&mut x);
        short.propagate(&mut x);
        long.propagate(&mut y);
        assert!(x.iter().zip(y).all(|(a, b)| (a - b).abs() < 1e-13), "{oscillator:?}");
    }

    fn propagations_are_products<const N: usize, T: Transition<N>>(oscillator: Option<Oscillator>) {
        let mut transition = T::new(oscillator);
        transition.set(0.7);
        let x: [f64; N] = core::array::from_fn(|i| (1.0 + 2.0 * i as f64).sin());
        let phi = |i, j| transition.entry(i, j);
        let sum = |term: &dyn Fn(usize) -> f64| (0..N).map(term).sum::<f64>();
        let ahead: [f64; N] = core::array::from_fn(|i| sum(&|j| phi(i, j) * x[j]));
        let back: [f64; N] = core::array::from_fn(|i| sum(&|j| phi(j, i) * x[j]));
        let (mut propagated, mut transposed) = (x, x);
        transition.propagate(&mut propagated);
        transition.propagate_transposed(&mut transposed);
        let rank_one = |x: [f64; N]| x.map(|a| x.map(|b| a * b));
        let (mut covariance, mut information) = (rank_one(x), rank_one(x));
        transition.propagate_covariance(&mut covariance, 3.0);
        transition.propagate_information(&mut information);
        for i in 0..N {
            assert!((propagated[i] - ahead[i]).abs() < 1e-13);
            assert!((transposed[i] - back[i]).abs() < 1e-13);
            assert!((0..N).all(|j| phi(i, j) == 0.0 || i <= j + T::BELOW_DIAGONAL));
            for j in 0..N {
                let noise = 3.0 * transition.noise()[i][j];
                assert!((covariance[i][j] - ahead[i] * ahead[j] - noise).abs() < 1e-12);
                assert!((information[i][j] - back[i] * back[j]).abs() < 1e-12);
            }
        }
    }

    /// A law for each number of states, and each place of an oscillator.
    macro_rules! for_all {
        ($law:ident) => {{
            $law::<2, Derivatives<2>>(None);
            $law::<3, Derivatives<3>>(None);
            $law::<4, Derivatives<4>>(None);
            $law::<5, Derivatives<5>>(None);
            $law::<6, Derivatives<6>>(None);
            for (frequency, damping) in [(0.1, 0.0), (1.3, 0.1), (4.0, 0.4), (2.0, 1.0), (1.0, 3.0)] {
                let at = |acceleration| Some(Oscillator { frequency, damping, acceleration });
                (0..2).for_each(|a| $law::<4, Ringing<4>>(at(a)));
                (0..3).for_each(|a| $law::<5, Ringing<5>>(at(a)));
                (0..4).for_each(|a| $law::<6, Ringing<6>>(at(a)));
            }
        }};
    }

    #[test]
    fn two_steps_are_one_of_their_sum() {
        for_all!(two_steps_are_one);
    }

    #[test]
    fn propagations_are_products_with_the_entries() {
        for_all!(propagations_are_products);
    }
}
