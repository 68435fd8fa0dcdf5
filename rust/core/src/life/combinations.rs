//! The largest equivalent load over the time of a run: the largest of linear combinations of the components of the load.

use guideload_life::{COMPONENTS, Rule};

use crate::output::{Extremes, Wrench};

/// Up to six linear combinations of the components of a load. The equivalent load without the effect of a preload is convex: at any time it
/// is the largest of [`combinations`].
#[derive(Debug, Clone, PartialEq)]
pub struct Combinations {
    factors: Box<[[f64; 6]; 6]>,
    /// Of each, whether it counts, and whether the negative one does.
    counts: [[bool; 2]; 6],
}

/// The linear combinations of which an equivalent load is the largest.
pub fn combinations(rule: &Rule<f64>) -> Vec<Combinations> {
    // A combination and the negative one have the same extremes.
    let mut rows: Vec<([f64; COMPONENTS], bool)> = Vec::new();
    for one in (0..1 << COMPONENTS).flat_map(|signs| rule.gradients(signs)) {
        let negative = one.map(|factor| -factor);
        match rows.iter_mut().find(|(known, _)| *known == one || *known == negative) {
            Some((known, is_negative_too)) => *is_negative_too |= *known != one,
            None => rows.push((one, false)),
        }
    }
    let six = |rows: &[([f64; COMPONENTS], bool)]| {
        let (mut factors, mut counts) = (Box::new([[0.0; 6]; 6]), [[false; 2]; 6]);
        for ((row, (one, is_negative_too)), counts) in rows.iter().enumerate().zip(&mut counts) {
            factors[row][1..].copy_from_slice(one);
            *counts = [true, *is_negative_too];
        }
        Combinations { factors, counts }
    };
    rows.chunks(6).map(six).collect()
}

impl Combinations {
    /// The combinations of the components of a load.
    pub fn of<'a>(&self, load: &Wrench<'a>) -> Wrench<'a> {
        load.combined(&self.factors)
    }

    /// Their extremes before the first instant; those that do not count are infinite.
    pub fn begin(&self) -> Extremes {
        let mut begin = Extremes::UNWANTED;
        for (entry, [positive, negative]) in self.counts.into_iter().enumerate() {
            if positive {
                begin.largest[entry] = f64::NEG_INFINITY;
            }
            if negative {
                begin.smallest[entry] = f64::INFINITY;
            }
        }
        begin
    }

    /// The largest value of those that count, N, and its time, s.
    fn largest(&self, extremes: &Extremes) -> (f64, f64) {
        let mut found = NOTHING;
        for (entry, [positive, negative]) in self.counts.into_iter().enumerate() {
            if positive {
                found = larger(found, (extremes.largest[entry], extremes.time_of_largest[entry]));
            }
            if negative {
                found = larger(found, (-extremes.smallest[entry], extremes.time_of_smallest[entry]));
            }
        }
        found
    }
}

/// Before the first value and time.
const NOTHING: (f64, f64) = (f64::NEG_INFINITY, f64::NAN);

/// The one with the larger value; the first of equal ones.
fn larger(first: (f64, f64), second: (f64, f64)) -> (f64, f64) {
    if second.0 > first.0 { second } else { first }
}

/// The largest equivalent load without the effect of a preload, N, and its time, s, from the extremes of its combinations.
pub fn largest_of<'a>(all: impl IntoIterator<Item = (&'a Combinations, &'a Extremes)>) -> (f64, f64) {
    all.into_iter().map(|(some, extremes)| some.largest(extremes)).fold(NOTHING, larger)
}
