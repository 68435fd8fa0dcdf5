//! The mean of `L^p v` over a piece of time on which the load L is linear and the speed v is quadratic.

use crate::numeric::float::{floor, pow};

/// Largest relative change of L from the middle of a piece to its end for the series; beyond, the closed form has all its digits.
const SERIES: f64 = 1.0 / 3.0;

/// Terms of the series below this fraction of the first are rounding.
const NEGLIGIBLE: f64 = 1e-18;

/// Mean of `L^p v`; L >= 0 from `first` to `last`, `v = c0 + c1 x + c2 x²` with x from -1 to 1.
pub(super) fn mean_of_product(first: f64, last: f64, speed: [f64; 3], exponent: f64) -> f64 {
    let (middle, half) = (0.5 * (first + last), 0.5 * (last - first));
    if middle <= 0.0 {
        return 0.0;
    }
    let ratio = half / middle;
    if ratio.abs() > SERIES && exponent != floor(exponent) {
        return closed_form(first, last, speed, exponent);
    }
    // L^p = middle^p (1 + ratio x)^p, a binomial series; it ends by itself for a whole p.
    let [even, odd, bend] = speed;
    let (mut sum, mut coefficient, mut k) = (0.0, 1.0, 0);
    while f64::abs(coefficient) > NEGLIGIBLE {
        let moment = if k % 2 == 0 { even * over(k + 1) + bend * over(k + 3) } else { odd * over(k + 2) };
        sum += coefficient * moment;
        coefficient *= (exponent - k as f64) * over(k + 1) * ratio;
        k += 1;
    }
    power(middle, exponent) * sum
}

/// 1/k.
fn over(k: usize) -> f64 {
    const RECIPROCALS: [f64; 48] = {
        let mut table = [f64::INFINITY; 48];
        let mut k = 1;
        while k < 48 {
            table[k] = 1.0 / k as f64;
            k += 1;
        }
        table
    };
    RECIPROCALS.get(k).copied().unwrap_or(1.0 / k as f64)
}

/// `x^p`, by products for the usual whole exponents.
pub(super) fn power(x: f64, exponent: f64) -> f64 {
    match exponent {
        3.0 => x * x * x,
        _ => pow(x, exponent),
    }
}

/// [`mean_of_product`] from the antiderivatives of `u^p`, `u^(p + 1)` and `u^(p + 2)`, with L = large u and u from small/large to 1.
fn closed_form(first: f64, last: f64, [even, odd, bend]: [f64; 3], exponent: f64) -> f64 {
    // From the small end to the large one, s from 0 to 1, x = 2 s - 1.
    let (small, large, odd) = if first <= last { (first, last, odd) } else { (last, first, -odd) };
    let start = small / large;
    let width = 1.0 - start;
    let mut power = pow(start, exponent);
    let raised = [1.0, 2.0, 3.0].map(|k| {
        power *= start;
        (1.0 - power) / (exponent + k)
    });
    let of_s = (raised[1] - start * raised[0]) / width;
    let of_square = (raised[2] - start * (2.0 * raised[1] - start * raised[0])) / (width * width);
    let sum = (even - odd + bend) * raised[0] + 2.0 * (odd - 2.0 * bend) * of_s + 4.0 * bend * of_square;
    pow(large, exponent) * sum / width
}
