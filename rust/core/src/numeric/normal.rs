//! Standard normal random numbers, eight streams side by side; the same for a seed on every processor.
//!
//! xoshiro256++ (Blackman and Vigna 2021) makes uniform bits, one generator per lane. The method of Box and Muller (1958) makes pairs of
//! normal numbers of them, with polynomials for logarithm, sine and cosine, so that all of it is vector code.

use super::float::{fma, sqrt};
use super::simd::{Aligned, LANES, Lanes};

/// One stream of standard normal numbers per lane.
#[derive(Debug, Clone)]
pub(crate) struct NormalStreams {
    state: Aligned<[[u64; LANES]; 4]>,
    /// The second number of each pair, if it has not been used.
    spare: Option<Lanes>,
}

impl NormalStreams {
    /// Streams number `first`, `first + 1`, … of a seed.
    pub(crate) fn new(seed: u64, first: usize) -> Self {
        Self::numbered(seed, core::array::from_fn(|lane| (first + lane) as u64))
    }

    /// The streams of a seed with these numbers.
    pub(crate) fn numbered(seed: u64, numbers: [u64; LANES]) -> Self {
        let mut state = [[0; LANES]; 4];
        for (lane, &number) in numbers.iter().enumerate() {
            // A seed of its own for each stream (splitmix64, Steele, Lea and Flood 2014).
            let mut at = mixed(seed).wrapping_add(mixed(!number));
            for word in &mut state {
                at = at.wrapping_add(GOLDEN);
                word[lane] = mixed(at);
            }
        }
        Self { state: Aligned(state), spare: None }
    }

    /// The next number of each stream.
    #[inline(always)]
    pub(crate) fn next(&mut self) -> Lanes {
        match self.spare.take() {
            Some(spare) => spare,
            None => {
                let (first, second) = self.pair();
                self.spare = Some(second);
                first
            }
        }
    }

    #[inline(always)]
    fn pair(&mut self) -> (Lanes, Lanes) {
        let (radius, turn) = (self.bits(), self.bits());
        let (mut first, mut second) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            // In (0, 1], so that the logarithm is finite.
            let size = sqrt(-2.0 * ln(2.0 - unit(radius[i])));
            let (sine, cosine) = sin_cos((unit(turn[i]) - 1.5) * core::f64::consts::FRAC_PI_2);
            // Sine and cosine of -45 to 45 degrees; two more bits choose the quarter of the circle.
            let swap = turn[i] & 1 == 1;
            let size = if turn[i] & 2 == 2 { -size } else { size };
            first[i] = size * if swap { sine } else { cosine };
            second[i] = size * if swap { cosine } else { sine };
        }
        (first, second)
    }

    #[inline(always)]
    fn bits(&mut self) -> [u64; LANES] {
        // Of local arrays the compiler makes vectors; updating the state in place it mixed widths, and waited for its own stores.
        let [mut a, mut b, mut c, mut d] = self.state.0;
        let mut out = [0; LANES];
        for i in 0..LANES {
            out[i] = a[i].wrapping_add(d[i]).rotate_left(23).wrapping_add(a[i]);
            let shifted = b[i] << 17;
            c[i] ^= a[i];
            d[i] ^= b[i];
            b[i] ^= c[i];
            a[i] ^= d[i];
            c[i] ^= shifted;
            d[i] = d[i].rotate_left(45);
        }
        self.state.0 = [a, b, c, d];
        out
    }
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

fn mixed(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Uniform in [1, 2), from the upper 52 bits.
#[inline(always)]
fn unit(bits: u64) -> f64 {
    f64::from_bits(bits >> 12 | 1.0_f64.to_bits())
}

/// Natural logarithm of a positive normal number, to a few roundings.
#[inline(always)]
fn ln(x: f64) -> f64 {
    // x = 2^e m with m from 0.71 to 1.41; e becomes a number through the bits of 2^52 + e.
    const TWO_52: f64 = 4_503_599_627_370_496.0;
    const LEAST: u64 = core::f64::consts::FRAC_1_SQRT_2.to_bits();
    let shifted = x.to_bits().wrapping_sub(LEAST).wrapping_add(1023 << 52);
    let exponent = f64::from_bits(shifted >> 52 | TWO_52.to_bits()) - (TWO_52 + 1023.0);
    let m = f64::from_bits((shifted & 0x000f_ffff_ffff_ffff).wrapping_add(LEAST));
    // ln m = 2 artanh t
    let t = (m - 1.0) / (m + 1.0);
    let square = t * t;
    let mut sum = 1.0 / 19.0;
    for power in [17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        sum = fma(sum, square, 1.0 / power);
    }
    fma(exponent, core::f64::consts::LN_2, 2.0 * fma(t * square, sum, t))
}

/// Sine and cosine of an angle between -pi/4 and pi/4, by power series.
#[inline(always)]
fn sin_cos(angle: f64) -> (f64, f64) {
    let square = angle * angle;
    let (mut sine, mut cosine) = (1.0, 1.0);
    for n in [16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 4.0, 2.0] {
        sine = fma(sine * square, -1.0 / (n * (n + 1.0)), 1.0);
        cosine = fma(cosine * square, -1.0 / (n * (n - 1.0)), 1.0);
    }
    (angle * sine, cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elementary_functions_are_right_to_some_roundings() {
        for k in 1..2000 {
            let x = f64::from(k) / 1999.0;
            assert!((ln(x) - x.ln()).abs() <= 1e-15 * (1.0 + x.ln().abs()), "{x}");
            let angle = (2.0 * x - 1.0) * core::f64::consts::FRAC_PI_4;
            let (sine, cosine) = sin_cos(angle);
            assert!((sine - angle.sin()).abs() < 4e-16 && (cosine - angle.cos()).abs() < 4e-16);
        }
        assert!((ln(f64::EPSILON) - f64::EPSILON.ln()).abs() < 1e-14);
    }

    #[test]
    fn numbers_are_standard_normal_and_streams_independent() {
        let count = 100_000;
        let mut streams = NormalStreams::new(7, 0);
        let rows: Vec<Lanes> = (0..count).map(|_| streams.next()).collect();
        let mean = |of: &dyn Fn(&Lanes) -> f64| rows.iter().map(of).sum::<f64>() / f64::from(count);
        // Each within 5 standard deviations of such a mean.
        let near = |got: f64, want: f64, variance: f64| {
            assert!((got - want).abs() < 5.0 * (variance / f64::from(count)).sqrt(), "{got} for {want}");
        };
        for lane in 0..LANES {
            near(mean(&|x| x[lane]), 0.0, 1.0);
            near(mean(&|x| x[lane].powi(2)), 1.0, 2.0);
            near(mean(&|x| x[lane].powi(3)), 0.0, 15.0);
            near(mean(&|x| x[lane].powi(4)), 3.0, 96.0);
            near(mean(&|x| f64::from(u8::from(x[lane].abs() > 2.575_829_303_548_9))), 0.01, 0.0099);
            near(mean(&|x| x[lane] * x[(lane + 1) % LANES]), 0.0, 1.0);
        }
        for lag in 1..4 {
            let sum: f64 = rows.windows(lag + 1).map(|pair| pair[0][0] * pair[lag][0]).sum();
            near(sum / f64::from(count), 0.0, 1.0);
        }
    }

    #[test]
    fn a_stream_depends_on_seed_and_number_alone() {
        let (mut early, mut late) = (NormalStreams::new(1, 0), NormalStreams::new(1, 3));
        let (a, b) = (early.next(), late.next());
        assert_eq!(a[3..], b[..5]);
        assert_ne!(NormalStreams::new(2, 0).next(), a);
    }
}
