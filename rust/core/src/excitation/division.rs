//! Intervals in parts: between samples that are close enough for the fastest vibration, all extremes of a run are found.

use super::{Excitation, Instant, RiderMotion, repeated_lengths, travel_after};
use crate::system::{System, eigenvalues};

/// Of the fastest vibration from one sample to the next, rad: six samples per period.
const STEP: f64 = 1.05;

/// Parts of the shortest interval: an excitation without jumps hardly excites a vibration that is faster still.
const MOST_PARTS: usize = 25;

/// Most samples of a divided excitation, unless it has more itself.
const MOST_SAMPLES: usize = 1_000_000;

/// So many samples never take long, however few the excitation has.
const FREE_SAMPLES: usize = 100_000;

/// Rounding of a number of parts.
const ROUNDING: f64 = 1e-9;

/// Calls `run` with the excitation with six samples or more per period of the fastest vibration of a system at rest. It is the same
/// excitation, linear between its samples; riders move as they do.
pub(crate) fn with_enough_samples<T>(
    system: &System,
    excitation: &Excitation,
    run: impl FnOnce(&Excitation) -> T,
) -> T {
    let values = eigenvalues(system).unwrap_or_default();
    let fastest = values.iter().fold(0.0, |fastest, value| f64::max(fastest, value.im.abs()));
    let intervals: Vec<f64> = (0..excitation.count() - 1).map(|k| excitation.interval(k)).collect();
    let starts = excitation.input(0).iter().any(|x| *x != 0.0);
    let parts = enough_parts(&intervals, starts, fastest);
    if parts.iter().all(|parts| *parts == 1) {
        return run(excitation);
    }
    // The sample before each new one, and the share of the interval between them.
    let places = || {
        let inside = parts
            .iter()
            .enumerate()
            .flat_map(|(k, &parts)| (0..parts).map(move |part| (k, part as f64 / parts as f64)));
        inside.chain([(intervals.len(), 0.0)])
    };
    let input = |(k, share): (usize, f64)| {
        if share == 0.0 { excitation.input(k) } else { excitation.input_between(k, share) }
    };
    let since = |(k, share): (usize, f64)| if share == 0.0 { 0.0 } else { share * intervals[k] };
    let time: Vec<f64> = places().map(|place| excitation.time(place.0) + since(place)).collect();
    let acceleration: Vec<[f64; 3]> = places().map(&input).map(|[x, y, z, ..]| [x, y, z]).collect();
    let wrench: Option<Vec<[f64; 6]>> =
        excitation.wrench.map(|_| places().map(input).map(|[_, _, _, wrench @ ..]| wrench).collect());
    let travel = |rider: usize, place: (usize, f64)| {
        let at = Instant { first: place.0, until: usize::min(place.0 + 1, intervals.len()), since: 0.0 };
        travel_after(excitation.travel_terms(rider, at), since(place))
    };
    let of_riders = 0..excitation.riders.len();
    let travels: Vec<Vec<[f64; 3]>> =
        of_riders.map(|rider| places().map(|place| travel(rider, place)).collect()).collect();
    let riders: Vec<RiderMotion> = excitation
        .riders
        .iter()
        .zip(&travels)
        .map(|(motion, samples)| RiderMotion { rider: motion.rider, samples })
        .collect();
    let lengths = repeated_lengths(&time).unwrap_or_default();
    let divided = Excitation::new(&time, &acceleration, wrench.as_deref())
        .map(|divided| divided.with_repeated_lengths(|| &lengths))
        .and_then(|divided| divided.with_riders(&riders));
    // It is as given where no number is between two times, or a rider leaves the range of numbers.
    run(divided.as_ref().unwrap_or(excitation))
}

/// Numbers of parts of intervals between samples, s, so that a vibration has six samples or more per period.
///
/// Of an excitation without jumps, parts are not shorter than a 25th of the shortest interval.
///
/// `starts`: whether the excitation is not zero at its first sample; `fastest`: angular frequency of the fastest vibration, rad/s, 0 if
/// nothing vibrates.
pub fn enough_parts(intervals: &[f64], starts: bool, fastest: f64) -> Vec<usize> {
    let longest = intervals.iter().fold(0.0, |longest, interval| f64::max(longest, *interval));
    if fastest * longest <= STEP {
        return vec![1; intervals.len()];
    }
    let jumps = starts || intervals.contains(&0.0);
    let lasting = intervals.iter().filter(|interval| **interval > 0.0);
    let shortest = lasting.fold(f64::INFINITY, |shortest, interval| f64::min(shortest, *interval));
    let least = if jumps { 0.0 } else { shortest / MOST_PARTS as f64 };
    let step = f64::max(STEP / fastest, least);
    let mut parts: Vec<usize> = intervals
        .iter()
        .map(|interval| match (interval / step * (1.0 - ROUNDING)).ceil() {
            // It would be too much: an interval of rest, or of a vibration that nobody resolves.
            parts if parts > FREE_SAMPLES as f64 => MOST_PARTS,
            parts => usize::max(parts as usize, 1),
        })
        .collect();
    let room = MOST_SAMPLES.min(FREE_SAMPLES.max(MOST_PARTS * parts.len()));
    limit_parts(&mut parts, room);
    parts
}

/// Reduces the largest numbers of parts of intervals to the same one, so that all together are at most `most`, but one of each interval.
pub fn limit_parts(parts: &mut [usize], most: usize) {
    let mut room = usize::max(parts.len(), most);
    if parts.iter().sum::<usize>() <= room {
        return;
    }
    let mut ascending = parts.to_vec();
    ascending.sort_unstable();
    for (before, wanted) in ascending.iter().enumerate() {
        // If this interval and those after it have equally many.
        let each = room / (parts.len() - before);
        if each < *wanted {
            parts.iter_mut().for_each(|parts| *parts = usize::min(*parts, each));
            return;
        }
        room -= wanted;
    }
}
