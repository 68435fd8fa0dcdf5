//! Lengths that recur among the intervals between uneven times.

/// Most lengths that recur; there are more where a clock jitters.
const MOST: usize = 64;

/// Roundings of the largest time by which the sum of lengths may move a time.
const MOST_MOVED: f64 = 8.0;

/// Roundings of the largest time up to which a length has too few digits to be compared.
const NEAR_ROUNDING: f64 = 16.0;

/// Lengths that agree to within the rounding of the times, and so count as one: their mean.
struct Length {
    first: f64,
    sum: f64,
    count: f64,
}

/// The lengths of the intervals between ascending, uneven times (s), of which all that are equal but for the rounding of the times are the
/// same number.
///
/// So a record with gaps, or one whose intervals are divided, takes as long as a uniform one: what is prepared for a length serves for all
/// intervals that have it. None where there are more than 64 lengths,
/// where a length is near the rounding of the times, where a time would move by more than eight roundings, or where memory is missing.
pub fn repeated_lengths(time: &[f64]) -> Option<Vec<f64>> {
    let rounding = f64::EPSILON * f64::max(time.first()?.abs(), time.last()?.abs());
    let (mut lengths, mut of, mut result, mut last) = (Vec::<Length>::new(), Vec::<u8>::new(), Vec::new(), 0);
    of.try_reserve_exact(time.len()).ok()?;
    result.try_reserve_exact(time.len()).ok()?;
    for pair in time.windows(2) {
        let length = pair[1] - pair[0];
        if 0.0 < length && length <= NEAR_ROUNDING * rounding {
            return None;
        }
        // A jump is exactly zero.
        let is_near = |other: &Length| {
            (other.first - length).abs() <= 2.0 * rounding && (other.first == 0.0) == (length == 0.0)
        };
        if !lengths.get(last).is_some_and(is_near) {
            last = lengths.iter().position(is_near).unwrap_or(lengths.len());
            if last == MOST {
                return None;
            }
            if last == lengths.len() {
                lengths.push(Length { first: length, sum: 0.0, count: 0.0 });
            }
        }
        // From the first, so that the mean has all digits.
        lengths[last].sum += length - lengths[last].first;
        lengths[last].count += 1.0;
        of.push(last as u8);
    }
    let means: Vec<f64> = lengths.iter().map(|each| each.first + each.sum / each.count).collect();
    let mut moved = 0.0_f64;
    for (pair, &index) in time.windows(2).zip(&of) {
        moved += means[usize::from(index)] - (pair[1] - pair[0]);
        if moved.is_nan() || moved.abs() > MOST_MOVED * rounding {
            return None;
        }
        result.push(means[usize::from(index)]);
    }
    Some(result)
}

/// Whether these are the lengths of the intervals between times, which no time moves by as much as the shortest of them. (Those of
/// [`repeated_lengths`] move the times of a part by 16 roundings at most, and are longer.)
pub(super) fn are_lengths_of(lengths: &[f64], time: &[f64]) -> bool {
    let shortest =
        lengths.iter().filter(|&&length| length != 0.0).fold(f64::INFINITY, |a, &b| f64::min(a, b));
    let mut moved = 0.0_f64;
    let agrees = |(pair, &length): (&[f64], &f64)| {
        let exact = pair[1] - pair[0];
        moved += length - exact;
        (length == 0.0) == (exact == 0.0) && moved.abs() < shortest
    };
    lengths.len() + 1 == time.len() && time.windows(2).zip(lengths).all(agrees)
}

#[cfg(test)]
mod tests {
    use super::{are_lengths_of, repeated_lengths};

    #[test]
    fn lengths_that_differ_by_rounding_are_one() {
        // A uniform record of which some intervals are divided, and two stamps are missing.
        let mut time = Vec::new();
        for k in 0..1000 {
            let parts = [1, 8, 1, 2][k % 4];
            if k != 500 && k != 501 {
                time.extend((0..parts).map(|j| 0.01 * k as f64 + 0.01 * (f64::from(j) / f64::from(parts))));
            }
        }
        let lengths = repeated_lengths(&time).expect("few lengths");
        let mut different = lengths.clone();
        different.sort_unstable_by(f64::total_cmp);
        different.dedup();
        assert_eq!(different.len(), 4, "{different:?}");
        assert!(are_lengths_of(&lengths, &time) && are_lengths_of(&lengths[90..200], &time[90..=200]));
        let mut at = time[0];
        for (length, expected) in lengths.iter().zip(&time[1..]) {
            at += length;
            assert!((at - expected).abs() < 1e-12, "{at} {expected}");
        }
    }

    #[test]
    fn other_lengths_are_not_believed() {
        let time = [0.0, 1.0, 1.0, 3.0];
        assert!(are_lengths_of(&[1.0, 0.0, 2.0], &time));
        for lengths in [
            &[1.0, 0.0][..],
            &[f64::NAN; 3],
            &[-1.0; 3],
            &[1.0, 0.0, 3.0],
            &[0.5, 0.5, 2.0],
            &[2.0, 0.0, 1.0],
        ] {
            assert!(!are_lengths_of(lengths, &time), "{lengths:?}");
        }
    }

    #[test]
    fn jumps_stay_jumps_and_jitter_is_left_alone() {
        let lengths = repeated_lengths(&[0.0, 1.0, 1.0, 2.0, 2.0, 3.0]).expect("two lengths");
        assert_eq!(lengths, [1.0, 0.0, 1.0, 0.0, 1.0]);
        let jitter: Vec<f64> = (0..200).map(|k| f64::from(k) + 0.01 * f64::from(k * k % 97)).collect();
        assert!(repeated_lengths(&jitter).is_none());
        assert!(repeated_lengths(&[]).is_none());
    }
}
