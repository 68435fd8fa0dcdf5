//! Damaged samples: each kind is detected, counted, and bridged within a bound or answered with a restart.

use core::ops::ControlFlow;

use guideload::EquivalentLoad;
use guideload_monitor::{Counters, Exponent, InputSettings, PrepareError, Sample, Settings, prepare};

use crate::common::{Constants, LAG, PERIOD, QUANTUM, TestMonitor, constants, counts, motion, system};

/// Samples: time stamp in microseconds, and counter.
type Samples = Vec<(u32, u32)>;

fn prepared() -> Constants<f64> {
    constants(&system(), EquivalentLoad::SUM_OF_FORCES, Exponent::Ball)
}

fn clean(periods: usize) -> Samples {
    let counts = counts(&motion(periods), 1000);
    counts.into_iter().enumerate().map(|(k, count)| (1000 * k as u32, count)).collect()
}

/// Load Fy of the last carriage by period, and the monitor.
fn pushed(samples: &Samples) -> (Vec<Option<f64>>, TestMonitor<f64>, Vec<Sample>) {
    pushed_to(&prepared(), samples)
}

/// The same with other constants.
fn pushed_to(
    prepared: &Constants<f64>,
    samples: &Samples,
) -> (Vec<Option<f64>>, TestMonitor<f64>, Vec<Sample>) {
    let mut monitor = TestMonitor::<f64>::NEW;
    let mut loads = vec![None; 100_000];
    let mut taken = Vec::new();
    for &(stamp, count) in samples {
        taken.push(monitor.push(prepared, stamp, count));
        if !monitor.is_settling() {
            loads[monitor.period() as usize] = Some(monitor.loads()[3][0]);
        }
        assert!(monitor.loads().iter().flatten().all(|load| load.is_finite()));
    }
    (loads, monitor, taken)
}

/// Largest difference of loads, N, in periods that both have; and the number of these.
fn difference(one: &[Option<f64>], other: &[Option<f64>]) -> (f64, usize) {
    let both = one.iter().zip(other).filter_map(|(a, b)| Some((a.as_ref()? - b.as_ref()?).abs()));
    both.fold((0.0, 0), |(largest, count), deviation| (f64::max(largest, deviation), count + 1))
}

/// N by which the dynamic load of the last carriage swings in the clean motion.
fn swing(loads: &[Option<f64>]) -> f64 {
    let values = || loads.iter().flatten().copied();
    values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
}

fn without_usual(counters: &Counters) -> Counters {
    Counters { samples: 0, restarts: counters.restarts - 1, ..*counters }
}

#[test]
fn clean_samples_are_all_used() {
    let (_, monitor, taken) = pushed(&clean(5000));
    assert!(taken[1..].iter().all(|&sample| sample == Sample::Used));
    assert_eq!(without_usual(&monitor.totals().counters), Counters::NONE);
    assert_eq!(monitor.period(), 4999 - u64::from(LAG));
}

#[test]
fn a_wrap_of_counter_and_stamps_changes_nothing() {
    let counts = counts(&motion(5000), (1 << 24) - 500);
    let samples = counts.into_iter().enumerate();
    let samples = samples.map(|(k, count)| ((1000 * k as u32).wrapping_sub(2_000_000), count)).collect();
    let (loads, monitor, _) = pushed(&samples);
    assert_eq!(difference(&loads, &pushed(&clean(5000)).0).0, 0.0);
    assert!(monitor.totals().counters.wraps > 0);
    let wraps = monitor.totals().counters.wraps;
    assert_eq!(without_usual(&monitor.totals().counters), Counters { wraps, ..Counters::NONE });
}

#[test]
fn up_to_five_missing_samples_cost_a_tenth_of_the_swing() {
    let (reference, ..) = pushed(&clean(5000));
    let mut worst = 0.0_f64;
    for start in (1000..3000).step_by(97) {
        let mut samples = clean(5000);
        samples.drain(start..start + 5);
        let (loads, monitor, taken) = pushed(&samples);
        assert_eq!((monitor.totals().counters.missing, monitor.totals().counters.restarts), (5, 1));
        assert_eq!(taken[start], Sample::Bridged);
        worst = worst.max(difference(&loads, &reference).0);
    }
    assert!(worst < 0.1 * swing(&reference), "{worst}");
}

#[test]
fn many_missing_samples_restart_the_monitor_which_settles() {
    let (reference, ..) = pushed(&clean(8000));
    let mut samples = clean(8000);
    samples.drain(2000..2100);
    let (loads, monitor, taken) = pushed(&samples);
    assert_eq!(taken[2000], Sample::Restarted);
    assert_eq!((monitor.totals().counters.lost, monitor.totals().counters.restarts), (101, 2));
    let (deviation, both) = difference(&loads, &reference);
    assert!(deviation < 0.02 * swing(&reference) && both > 5000, "{deviation} {both}");
}

#[test]
fn a_narrow_counter_tells_what_a_wide_one_tells() {
    let motion = motion(5000);
    let positions: Vec<i64> = motion.iter().map(|[.., x]| (x / QUANTUM).round() as i64).collect();
    let base = prepared();
    let narrow = |counter_bits| Constants { input: InputSettings { counter_bits, ..base.input }, ..base };
    // At the fastest, ten periods are more than half of 2^10 counts; a change of speed alone is at most a third of it.
    let most = base.input.most_missing as usize;
    for start in (1000..3000).step_by(97) {
        let mut samples = clean(5000);
        samples.drain(start..start + most);
        let (reference, wide, _) = pushed(&samples);
        let masked: Samples = samples.iter().map(|&(stamp, count)| (stamp, count & 0x3FF)).collect();
        let (loads, monitor, _) = pushed_to(&narrow(10), &masked);
        assert_eq!(difference(&loads, &reference).0, 0.0);
        // With its sign in the bits above.
        let signed = |count: u32| ((count << 22).cast_signed() >> 22).cast_unsigned();
        let signed = masked.iter().map(|&(stamp, count)| (stamp, signed(count))).collect();
        assert_eq!(pushed_to(&narrow(10), &signed).1.totals(), monitor.totals());
        let used =
            samples.iter().map(|(stamp, _)| (1000 + positions[*stamp as usize / 1000]).div_euclid(1024));
        let (used, after) = (used.clone(), used.skip(1));
        let wraps = used.zip(after).map(|(one, next)| one.abs_diff(next)).sum();
        let expected = Counters { wraps, ..wide.totals().counters };
        assert_eq!((monitor.totals().counters, expected.missing), (expected, most as u64));
    }
}

#[test]
fn a_wrong_count_is_left_out_like_a_missing_sample() {
    let (mut wrong, mut missing) = (clean(5000), clean(5000));
    wrong[2000].1 += 5000;
    missing.remove(2000);
    let (of_wrong, monitor, taken) = pushed(&wrong);
    assert_eq!((taken[2000], taken[2001]), (Sample::Suspect, Sample::Bridged));
    assert_eq!(monitor.totals().counters.jumps, 1);
    assert_eq!(difference(&of_wrong, &pushed(&missing).0).0, 0.0);
}

#[test]
fn a_counter_that_is_set_costs_little_and_is_counted() {
    let (reference, ..) = pushed(&clean(5000));
    for start in (1000..3000).step_by(97) {
        let mut samples = clean(5000);
        for (_, count) in &mut samples[start..] {
            *count = (*count + 700_000) & 0xFF_FFFF;
        }
        let (loads, monitor, taken) = pushed(&samples);
        assert_eq!((taken[start], taken[start + 1]), (Sample::Suspect, Sample::CounterSet));
        assert_eq!(monitor.totals().counters.counter_set, 1);
        let deviation = difference(&loads, &reference).0;
        assert!(deviation < 0.1 * swing(&reference), "{deviation}");
    }
}

#[test]
fn a_stuck_encoder_is_told_at_speed() {
    let motion = motion(5000);
    let fast = motion.iter().position(|[_, v, _]| v.abs() > 0.5).expect("fast");
    let mut samples = clean(5000);
    for k in fast..fast + 6 {
        samples[k].1 = samples[fast - 1].1;
    }
    let (loads, monitor, _) = pushed(&samples);
    let counters = &monitor.totals().counters;
    assert_eq!((counters.stuck, counters.missing, counters.restarts), (6, 6, 1));
    let (reference, ..) = pushed(&clean(5000));
    assert!(difference(&loads, &reference).0 < 0.1 * swing(&reference));
    for k in fast..fast + 600 {
        samples[k].1 = samples[fast - 1].1;
    }
    let (_, monitor, _) = pushed(&samples);
    assert!(monitor.totals().counters.restarts > 1 && monitor.totals().counters.stuck >= 10);
}

/// Deterministic noise from -1 to 1.
fn noise(k: usize) -> f64 {
    let mut x = (k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    2.0 * ((x >> 40) as f64 / f64::from(1 << 24)) - 1.0
}

#[test]
fn stamps_that_jitter_are_counted_and_corrected() {
    let (reference, ..) = pushed(&clean(5000));
    let motion = motion(5000);
    let mut samples: Samples = Vec::new();
    for (k, [acceleration, velocity, position]) in motion.iter().enumerate() {
        let late = (200.0 * noise(k)).round();
        let by = late * 1e-6;
        let count = (position + by * (velocity + 0.5 * by * acceleration)) / QUANTUM;
        samples.push(((1000 * k as i64 + late as i64 + 1000) as u32, (1000.0 + count).round() as u32));
    }
    let (corrected, monitor, _) = pushed(&samples);
    assert!(monitor.totals().counters.jittering > 3000);
    assert_eq!(monitor.totals().counters.restarts, 1);
    for (k, sample) in samples.iter_mut().enumerate() {
        sample.0 = 1000 * k as u32;
    }
    let (uncorrected, ..) = pushed(&samples);
    let deviations = [corrected, uncorrected].map(|loads| difference(&loads, &reference).0);
    assert!(deviations[0] < 0.1 * swing(&reference), "{deviations:?}");
    assert!(deviations[0] < 0.5 * deviations[1], "{deviations:?}");
}

#[test]
fn early_samples_are_ignored_and_a_clock_that_runs_fast_is_followed() {
    let mut samples = clean(5000);
    samples.insert(2000, (samples[1999].0 + 100, 77));
    let (loads, monitor, taken) = pushed(&samples);
    assert_eq!((taken[2000], monitor.totals().counters.early), (Sample::Early, 1));
    assert_eq!(difference(&loads, &pushed(&clean(5000)).0).0, 0.0);
    let mut samples = clean(90_000);
    for (k, sample) in samples.iter_mut().enumerate() {
        sample.0 = (1000.1 * k as f64) as u32; // 100 ppm
    }
    let (_, monitor, taken) = pushed(&samples);
    assert!(taken[1..].iter().all(|&sample| sample == Sample::Used));
    assert_eq!(monitor.totals().counters.jittering, 0);
}

#[test]
fn noise_at_standstill_is_no_travel() {
    let samples = (0..50_000).map(|k| (1000 * k, 1000 + u32::from(noise(k as usize) > 0.0))).collect();
    let (_, monitor, _) = pushed(&samples);
    assert_eq!(monitor.totals().distance.value(), 0.0);
}

#[test]
fn the_travel_is_that_of_the_motion() {
    let motion = motion(5000);
    let (_, monitor, _) = pushed(&clean(5000));
    let known = &motion[..=monitor.period() as usize];
    let travel: f64 = known.iter().map(|[_, v, _]| v.abs() * PERIOD).sum();
    let ratio = monitor.totals().distance.value() / travel;
    assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
}

#[test]
fn no_samples_make_a_load_that_is_not_finite() {
    // Counts and stamps of any bits, in bursts between clean samples; `pushed` looks at the loads.
    let mut samples = clean(5000);
    for (k, sample) in samples.iter_mut().enumerate() {
        if k / 37 % 3 == 1 {
            let bits = |seed| (noise(seed) * f64::from(i32::MAX)) as i32 as u32;
            *sample = (if k % 2 == 0 { bits(k) } else { sample.0 }, bits(2 * k + 1));
        }
    }
    let (prepared, mut monitor) = (prepared(), TestMonitor::<f64>::NEW);
    for (stamp, count) in samples {
        monitor.push(&prepared, stamp, count);
        assert!(monitor.loads().iter().flatten().all(|load| load.is_finite()));
    }
}

#[test]
fn many_samples_in_one_call_give_the_same_bits() {
    let mut samples = clean(3000);
    samples.drain(1200..1204);
    let (_, one_by_one, taken) = pushed(&samples);
    let (prepared, mut many) = (prepared(), TestMonitor::<f64>::NEW);
    let mut found = Vec::new();
    let wide = || samples.iter().map(|&(stamp, count)| (stamp.into(), count));
    let all = many.push_many(&prepared, wide(), |_, sample| {
        found.push(sample);
        ControlFlow::Continue(())
    });
    assert!(all.is_continue());
    assert_eq!(found, taken);
    assert_eq!(many.totals(), one_by_one.totals());
    assert_eq!(many.loads(), one_by_one.loads());

    let mut first = TestMonitor::<f64>::NEW;
    let ended = first.push_many(&prepared, wide(), |_, _| ControlFlow::Break(()));
    assert!(ended.is_break());
    assert_eq!(first.period(), 0);
}

#[test]
fn a_clock_that_is_set_back_costs_one_period_and_a_restart() {
    let mut samples = clean(3000);
    for (k, sample) in samples[1500..].iter_mut().enumerate() {
        sample.0 = 1000 * k as u32; // as after a start of the controller
    }
    let (_, monitor, taken) = pushed(&samples);
    assert_eq!(taken[1500], Sample::Restarted);
    assert!(taken[1501..].iter().all(|sample| *sample == Sample::Used));
    let counters = monitor.totals().counters;
    assert_eq!((counters.restarts, counters.lost), (2, 1));
    assert!(monitor.period() < 3000);
}

#[test]
fn a_pause_of_any_length_costs_its_periods() {
    let (prepared, samples) = (prepared(), clean(3000));
    for pause in [20, 4_294_968, 3_600_000_000_000] {
        for start in [0, 1_700_000_000_000_000_000, i64::MIN + 5] {
            let stamps = (0..3000).map(|k| start + 1000 * (k + if k < 1500 { 0 } else { pause - 1 }));
            let mut monitor = TestMonitor::<f64>::NEW;
            let samples = stamps.zip(samples.iter().map(|(_, count)| *count));
            let _ = monitor.push_many(&prepared, samples, |_, _| ControlFlow::Continue(()));
            let counters = monitor.totals().counters;
            assert_eq!((counters.restarts, counters.lost), (2, pause as u64));
            assert_eq!(monitor.period(), 2998 + pause as u64 - u64::from(LAG));
        }
    }
}

#[test]
fn a_clock_of_32_bits_may_wrap_where_stamps_have_64() {
    let (reference, all, _) = pushed(&clean(5000));
    for lowest in [0, -(1 << 31)] {
        let stamps = (0..5000).map(|k| (1000 * k - 2_000_000_i64).rem_euclid(1 << 32) + lowest);
        let mut monitor = TestMonitor::<f64>::NEW;
        let samples = stamps.zip(clean(5000).into_iter().map(|(_, count)| count));
        let _ = monitor.push_many(&prepared(), samples, |_, _| ControlFlow::Continue(()));
        assert_eq!(monitor.totals(), all.totals());
        assert_eq!(Some(monitor.loads()[3][0]), reference[monitor.period() as usize]);
    }
}

#[test]
fn stamps_hold_more_periods_than_count_as_early() {
    let most = u32::MAX / 18;
    let (base, system) = (prepared(), system());
    let with = |ticks: u32| Constants::<f64> { input: InputSettings { ticks, ..base.input }, ..base };
    assert!(
        with(most).is_valid()
            && !with(most + 1).is_valid()
            && !with(u32::MAX).is_valid()
            && !with(0).is_valid()
    );
    let mut monitor = TestMonitor::<f64>::NEW;
    let longest = with(most);
    for k in 1..100_u32 {
        let sample = monitor.push(&longest, k.wrapping_mul(most), 1000);
        assert_eq!(sample, if k == 1 { Sample::Restarted } else { Sample::Used });
    }
    for ticks in [0, most + 1] {
        let input = InputSettings { ticks, ..base.input };
        let settings =
            Settings { period: PERIOD, quantum: QUANTUM, input, taps: &[], lag: 0, exponent: Exponent::Ball };
        let refused = prepare::<f64, 10, 4, 64>(&system, &[], &settings);
        assert_eq!(refused.err(), Some(PrepareError::Ticks { got: ticks }));
    }
}
