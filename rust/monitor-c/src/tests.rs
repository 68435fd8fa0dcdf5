//! Laws of the C interface, and attacks on it: any bytes in the memory and in the constants.
//!
//! Everything here calls the interface as C does, with pointers. With fewer cases, Miri runs it too:
//! `cargo +nightly miri test -p guideload-monitor --features prepare,plain --test c_interface`.

use core::ptr::{null, null_mut};
use std::boxed::Box;
use std::vec::Vec;

use guideload::EquivalentLoad;
use guideload_monitor::{Exponent, Monitor, record_length};

use super::memory::{DIFFERENCES, LAYOUT, STATES};
use super::*;

#[path = "../../monitor/tests/monitor/common.rs"]
#[allow(dead_code)] // shared with the tests of the monitor
mod common;

/// Random cases of each attack.
const CASES: u64 = if cfg!(miri) { 8 } else { 4000 };
/// Samples of a motion.
const SAMPLES: usize = if cfg!(miri) { 60 } else { 3000 };

/// Deterministic bits (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.bits() % end as u64) as usize
    }
}

/// The words of a value: constants have four-byte numbers only, a memory is words.
fn words<T>(of: &mut T) -> &mut [u32] {
    // SAFETY: `Constants` and `Memory` have no padding, any word is a value of theirs, and both are aligned to a word.
    unsafe { core::slice::from_raw_parts_mut((&raw mut *of).cast(), size_of::<T>() / 4) }
}

fn constants_of(rule: EquivalentLoad, exponent: Exponent) -> Box<Constants> {
    let prepared = common::constants_in_places(&common::system(), rule, exponent);
    let mut constants = Box::new(Constants { layout: LAYOUT, prepared, check: 0 });
    constants.check = constants.checksum();
    constants
}

fn constants() -> Box<Constants> {
    constants_of(common::full_rule(), Exponent::Roller)
}

fn started(constants: &Constants) -> Box<Memory> {
    let mut memory = Box::new(Memory { words: [0; 560] });
    // SAFETY: memory and constants of this test.
    assert_eq!(unsafe { guideload_start(&mut *memory, constants) }, 0);
    memory
}

fn pushed(memory: &mut Memory, constants: &Constants, samples: &[(u32, u32)]) -> Vec<i32> {
    // SAFETY: memory and constants of this test.
    samples.iter().map(|&(stamp, count)| unsafe { guideload_push(memory, constants, stamp, count) }).collect()
}

fn samples(count: usize) -> Vec<(u32, u32)> {
    let counts = common::counts(&common::motion(count), 5).into_iter();
    counts.enumerate().map(|(k, count)| (1000 * k as u32, count)).collect()
}

const NO_REPORT: CarriageReport = CarriageReport {
    smallest: [0.0; QUANTITIES],
    largest: [0.0; QUANTITIES],
    period_of_smallest: [0; QUANTITIES],
    period_of_largest: [0; QUANTITIES],
    power: 0.0,
    life_used: 0.0,
    histogram: [0; BINS],
    above_limit: 0,
    limit_exceeded: 0,
};

/// Calls everything; each answer is an error or finite. Returns the number of errors.
fn everything_is_an_error_or_finite(
    memory: &mut Memory,
    constants: &Constants,
    random: &mut Random,
    samples: &[(u32, u32)],
) -> usize {
    let answers = pushed(memory, constants, samples);
    assert!(answers.iter().all(|&answer| (-7..=5).contains(&answer)));
    let mut errors = answers.iter().filter(|&&answer| answer < 0).count();
    let mut told = |answer: i32| {
        errors += usize::from(answer < 0);
        answer >= 0
    };
    let (mut place, mut found, mut period) = ([0xA5; 4096], 0, 0);
    for carriage in [0, 3, 7, 8, u32::MAX] {
        let (mut loads, mut report) = ([0.0; COMPONENTS], NO_REPORT);
        // SAFETY: memory, constants and results of this test.
        let [of_loads, of_totals] = unsafe {
            [
                guideload_loads(memory, carriage, &mut loads),
                guideload_totals(memory, constants, carriage, &mut report),
            ]
        };
        assert!(!told(of_loads) || loads.iter().all(|load| load.is_finite()));
        let extremes = report.smallest.iter().chain(&report.largest);
        let sums = [report.power, report.life_used];
        assert!(
            !told(of_totals) || extremes.copied().all(f32::is_finite) && sums.into_iter().all(f64::is_finite)
        );
    }
    let length = random.below(4097) as u32;
    // SAFETY: memory, constants and results of this test; the places have the lengths.
    unsafe {
        told(guideload_period(memory, &mut period));
        told(guideload_save(memory, constants, random.bits(), place.as_mut_ptr(), length));
        let second = place;
        told(guideload_restore(memory, constants, place.as_ptr(), second.as_ptr(), 4096, &mut found));
        assert!(guideload_record_length(constants) as usize <= record_length(CARRIAGES));
    }
    errors
}

#[test]
fn the_interface_gives_the_bits_of_the_monitor() {
    for rule in [EquivalentLoad::SUM_OF_FORCES, common::full_rule()] {
        let (constants, samples) = (constants_of(rule, Exponent::Ball), samples(SAMPLES));
        let mut memory = started(&constants);
        let mut monitor = Monitor::<f32, STATES, CARRIAGES, DIFFERENCES>::NEW;
        for (answer, &(stamp, count)) in pushed(&mut memory, &constants, &samples).into_iter().zip(&samples) {
            assert_eq!(answer, monitor.push(&constants.prepared, stamp, count) as i32);
        }
        let (mut loads, mut report, mut period) = ([0.0; COMPONENTS], NO_REPORT, 0);
        for carriage in 0..4 {
            // SAFETY: memory, constants and results of this test.
            let answers = unsafe {
                [
                    guideload_loads(&*memory, carriage as u32, &mut loads),
                    guideload_totals(&*memory, &*constants, carriage as u32, &mut report),
                    guideload_period(&*memory, &mut period),
                ]
            };
            let (of, settling) = (&monitor.totals().carriages[carriage], i32::from(monitor.is_settling()));
            assert_eq!(answers, [settling, i32::from(!of.has_extremes()), 0]);
            assert_eq!((loads, period), (monitor.loads()[carriage], monitor.period()));
            let largest = if of.has_extremes() { of.largest } else { [0.0; QUANTITIES] };
            assert_eq!((report.largest, report.power), (largest, of.power.value()));
        }
        // A record, and what was restored from it.
        let (mut place, mut again, mut number) = ([0; 4096], started(&constants), 0);
        // SAFETY: memory, constants and places of this test.
        unsafe {
            let length = guideload_save(&*memory, &*constants, 7, place.as_mut_ptr(), 4096);
            assert_eq!(length as u32, guideload_record_length(&*constants));
            let first = place.as_ptr();
            assert_eq!(guideload_restore(&mut *again, &*constants, first, first, 4096, &mut number), 0);
            let mut restored = NO_REPORT;
            guideload_totals(&*again, &*constants, 3, &mut restored);
            assert_eq!((number, restored.largest, restored.power), (7, report.largest, report.power));
        }
    }
}

#[test]
fn wrong_pointers_memories_and_constants_are_told() {
    let (constants, other) = (constants(), constants_of(EquivalentLoad::SUM_OF_FORCES, Exponent::Ball));
    let mut memory = started(&constants);
    let (mut loads, mut report, mut never) = ([0.0; COMPONENTS], NO_REPORT, Memory { words: [0; 560] });
    let mut bytes = [0_u64; 600];
    // SAFETY: null and misaligned pointers are told; the others are of this test.
    unsafe {
        assert_eq!(guideload_start(null_mut(), &*constants), -1);
        assert_eq!(guideload_start(&mut *memory, null()), -1);
        assert_eq!(guideload_push(null_mut(), &*constants, 0, 0), -1);
        assert_eq!(guideload_loads(&*memory, 0, null_mut()), -1);
        assert_eq!(guideload_record_length(null()), 0);
        let odd = bytes.as_mut_ptr().cast::<u8>().add(2);
        assert_eq!(guideload_start(odd.cast(), &*constants), -3);
        assert_eq!(guideload_start(&mut *memory, odd.cast()), -3);
        assert_eq!(guideload_push(odd.cast(), &*constants, 0, 0), -3);
        assert_eq!(guideload_loads(&*memory, 0, odd.cast()), -3);
        assert_eq!(guideload_period(&*memory, odd.cast()), -3);
        assert_eq!(guideload_push(&mut never, &*constants, 0, 0), -4);
        assert_eq!(guideload_loads(&never, 0, &mut loads), -4);
        assert_eq!(guideload_push(&mut *memory, &*other, 0, 0), -6);
        for carriage in [4, 7, 8, u32::MAX] {
            assert_eq!(guideload_loads(&*memory, carriage, &mut loads), -2);
            assert_eq!(guideload_totals(&*memory, &*constants, carriage, &mut report), -2);
        }
        assert_eq!(guideload_save(&*memory, &*constants, 1, null_mut(), 4096), -1);
        assert_eq!(guideload_save(&*memory, &*constants, 1, odd, 10), -11);
        for error in -20..10 {
            let text = core::ffi::CStr::from_ptr(guideload_error_text(error)).to_str().expect("text");
            assert_eq!(text == "unknown error", !matches!(error, -14..=-11 | -7..));
        }
    }
}

#[test]
fn constants_with_any_bit_flipped_do_not_start() {
    let (good, mut random) = (constants(), Random(1));
    let mut memory = Memory { words: [0; 560] };
    for case in 0..CASES {
        let mut damaged = good.clone();
        let words = words(&mut *damaged);
        let flips = if case % 2 == 0 { 1 } else { 1 + random.below(20) };
        for _ in 0..flips {
            let at = random.below(words.len());
            words[at] ^= 1 << random.below(32);
        }
        let is_same = *words == *self::words(&mut *good.clone());
        // SAFETY: memory and constants of this test.
        let answer = unsafe { guideload_start(&mut memory, &*damaged) };
        assert_eq!(answer, if is_same { 0 } else { -5 });
    }
}

#[test]
fn constants_that_a_monitor_cannot_use_do_not_start_though_their_checksum_is_right() {
    let change: [fn(&mut Constants); 12] = [
        |of| of.layout += 1,
        |of| of.prepared.carriage_count = 9,
        |of| of.prepared.tap_count = 0,
        |of| of.prepared.tap_count = u32::MAX,
        |of| of.prepared.input.most_missing = u32::MAX,
        |of| of.prepared.input.ticks = 0,
        |of| of.prepared.input.counter_bits = 33,
        |of| of.prepared.exponent = 2,
        |of| of.prepared.period = f32::NAN,
        |of| of.prepared.change[11][11] = f32::INFINITY,
        |of| of.prepared.carriages[7].by_state[11][4] = f32::NAN,
        |of| of.prepared.carriages[0].limit = f32::NAN,
    ];
    let mut memory = Memory { words: [0; 560] };
    for change in change {
        let mut constants = constants();
        change(&mut constants);
        constants.check = constants.checksum();
        // SAFETY: memory and constants of this test.
        assert_eq!(unsafe { guideload_start(&mut memory, &*constants) }, -5);
    }
}

#[test]
fn random_bytes_are_refused_or_give_finite_results() {
    let (good, samples, mut random) = (constants(), samples(200), Random(2));
    let header = started(&good).words[..2].to_vec();
    let mut errors = 0;
    for case in 0..CASES {
        let (mut memory, mut constants) = (Memory { words: [0; 560] }, good.clone());
        memory.words.fill_with(|| random.bits());
        if case % 2 == 0 {
            words(&mut *constants).fill_with(|| random.bits() as u32);
        }
        // SAFETY: memory and constants of this test.
        let answer = unsafe { guideload_push(&mut memory, &*constants, 0, 0) };
        assert!(matches!(answer, -4 | -6), "{answer}");
        // As if it were a started monitor of these constants: the words that tell it are right.
        memory.words[..2].copy_from_slice(&header);
        (constants.layout, constants.check) = (good.layout, good.check);
        errors += everything_is_an_error_or_finite(&mut memory, &constants, &mut random, &samples[..8]);
    }
    assert!(errors > CASES as usize, "{errors}"); // random numbers are rarely finite in f32 to the end
}

#[test]
fn flipped_bits_in_a_working_monitor_are_refused_or_give_finite_results() {
    let (good, samples, mut random) = (constants(), samples(SAMPLES), Random(3));
    let (early, late) = samples.split_at(samples.len() / 2);
    let mut working = started(&good);
    pushed(&mut working, &good, early);
    for case in 0..CASES {
        let (mut memory, mut constants) = (working.clone(), good.clone());
        let in_constants = case % 2 == 0;
        for _ in 0..=random.below(12) {
            // Not the words that tell a started monitor: those are refused at once.
            let words = if in_constants {
                let words = words(&mut *constants);
                let end = words.len() - 1;
                &mut words[1..end]
            } else {
                &mut words(&mut *memory)[4..]
            };
            let at = random.below(words.len());
            words[at] = match random.below(4) {
                0 => random.bits() as u32,
                1 => [0, u32::MAX, i32::MAX as u32, 1 << 31, f32::NAN.to_bits(), f32::MAX.to_bits()]
                    [random.below(6)],
                _ => words[at] ^ (1 << random.below(32)),
            };
        }
        let next = random.below(late.len() - 20);
        everything_is_an_error_or_finite(&mut memory, &constants, &mut random, &late[next..next + 20]);
        // Started again, it works.
        // SAFETY: memory and constants of this test.
        assert_eq!(unsafe { guideload_start(&mut *memory, &*good) }, 0);
        assert!(pushed(&mut memory, &good, &late[..3]).iter().all(|&answer| answer >= 0));
    }
}

#[test]
fn random_samples_give_finite_results() {
    let (good, mut random) = (constants(), Random(4));
    let mut memory = started(&good);
    let (mut stamp, mut count) = (0_u32, 0_u32);
    for _ in 0..CASES / 8 {
        let some: Vec<_> = (0..64)
            .map(|_| {
                let wild = random.below(8) == 0;
                let [late, step] = [random.bits(), random.bits()].map(|bits| bits as u32);
                stamp = stamp.wrapping_add(if wild { late } else { 900 + late % 200 });
                count = count.wrapping_add(if wild { step } else { step % 64 });
                (stamp, count)
            })
            .collect();
        assert!(pushed(&mut memory, &good, &some).iter().all(|&answer| answer >= 0));
        everything_is_an_error_or_finite(&mut memory, &good, &mut random, &some);
    }
}

#[test]
fn damaged_records_are_refused_or_give_finite_totals() {
    let (good, mut random, mut number) = (constants(), Random(5), 0);
    let mut memory = started(&good);
    pushed(&mut memory, &good, &samples(SAMPLES));
    let mut record = [0; 4096];
    // SAFETY: memory, constants and place of this test.
    let length = unsafe { guideload_save(&*memory, &*good, 3, record.as_mut_ptr(), 4096) } as usize;
    for case in 0..CASES {
        let mut place = record;
        for _ in 0..=random.below(4) {
            place[random.below(length)] ^= 1 << random.below(8);
        }
        let forged = case % 2 == 0 && place[..12] == record[..12];
        if forged {
            let check = guideload_monitor::crc32(0, &place[..length - 4]).to_le_bytes();
            place[length - 4..length].copy_from_slice(&check);
        }
        let mut again = started(&good);
        // SAFETY: memory, constants and places of this test.
        let answer = unsafe {
            guideload_restore(&mut *again, &*good, place.as_ptr(), place.as_ptr(), 4096, &mut number)
        };
        assert!((-14..=0).contains(&answer) && (forged || answer < 0 || place == record));
        everything_is_an_error_or_finite(&mut again, &good, &mut random, &[(0, 0), (1000, 1)]);
    }
}
