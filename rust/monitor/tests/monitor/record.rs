//! Saving and restoring, and power that fails in between.

use std::collections::BTreeSet;

use guideload::{EquivalentLoad, Preload};
use guideload_monitor::{Exponent, InputSettings, Judgement, RecordError, Settings, prepare, record_length};

use crate::common::{
    LAG, PERIOD, QUANTUM, TestMonitor, constants, counts, full_rule, input, loads, motion, system,
};

const SUM: EquivalentLoad = EquivalentLoad::SUM_OF_FORCES;

#[test]
fn a_power_cut_at_any_byte_loses_at_most_one_record() {
    let prepared = constants::<f32>(&system(), EquivalentLoad::SUM_OF_FORCES, Exponent::Ball);
    let mut monitor = TestMonitor::<f32>::NEW;
    let length = record_length(4);
    let mut places = [vec![0xFF; length], vec![0xFF; length]];
    let (mut before, mut clock) = (None, 0);
    for (k, count) in counts(&motion(2000), 5).into_iter().enumerate() {
        monitor.push(&prepared, 1000 * k as u32, count);
        if k % 500 != 499 {
            continue;
        }
        let number = k as u64 / 500 + 1;
        let mut record = vec![0; length];
        assert_eq!(monitor.save(&prepared, number, &mut record), Ok(length));
        let place = number as usize % 2;
        for cut in 0..=length {
            let mut partly = places.clone();
            partly[place][..cut].copy_from_slice(&record[..cut]);
            let mut restored = TestMonitor::<f32>::NEW;
            let found = restored.restore(&prepared, [&partly[0], &partly[1]]);
            if cut == length {
                assert_eq!((found, restored.totals()), (Ok(number), monitor.totals()));
            } else if let Some((number, totals)) = before {
                assert_eq!((found, *restored.totals()), (Ok(number), totals));
            } else {
                assert!(found.is_err() && restored.period() == 0);
            }
        }
        places[place] = record;
        before = Some((number, *monitor.totals()));
        clock = k as u64;
    }
    // Periods are counted on from the record.
    let mut restored = TestMonitor::<f32>::NEW;
    restored.restore(&prepared, [&places[0], &places[1]]).expect("a record");
    for k in 0..200 {
        restored.push(&prepared, 1000 * k, 5);
    }
    assert_eq!(restored.period(), clock + 200 - u64::from(LAG));
    assert!(restored.totals().periods > monitor.totals().periods);
}

#[test]
fn a_record_belongs_to_all_constants_that_its_totals_depend_on() {
    let system = system();
    let [taps, more] = [&[[0.1, -0.5]; 10][..], &[[0.1, -0.5]; 10 + 1]];
    let base =
        Settings { period: PERIOD, quantum: QUANTUM, input: input(), taps, lag: 5, exponent: Exponent::Ball };
    let with = |change: fn(&mut InputSettings)| {
        let mut input = input();
        change(&mut input);
        (SUM, Settings { input, ..base })
    };
    let rows = |preload| EquivalentLoad { preload, ..SUM };
    let all = [
        (SUM, base),
        (SUM, Settings { exponent: Exponent::Roller, ..base }),
        (SUM, Settings { lag: 6, ..base }),
        (SUM, Settings { taps: more, ..base }),
        (EquivalentLoad { minor: 0.5, ..SUM }, base),
        (rows(Preload::Balls(100.0)), base),
        (rows(Preload::Linear(200.0 * core::f64::consts::SQRT_2 / 3.0)), base),
        with(|input| input.ticks += 1),
        with(|input| input.tolerance += 1),
        with(|input| input.counter_bits += 1),
        with(|input| input.most_change += 1),
        with(|input| input.slack += 1),
        with(|input| input.still += 1),
        with(|input| input.most_missing += 1),
    ];
    let ids: BTreeSet<_> = all
        .iter()
        .map(|(rule, settings)| {
            let judgement = Judgement { rule: *rule, limit: 5e3, bin: 500.0, capacity: 1e18 };
            let loads = loads(&system).map(|load| (load, judgement));
            prepare::<f64, 10, 4, 64>(&system, &loads, settings).expect("constants").id
        })
        .collect();
    assert_eq!(ids.len(), all.len());
}

#[test]
fn damaged_and_foreign_records_are_refused() {
    let prepared = constants::<f64>(&system(), EquivalentLoad::SUM_OF_FORCES, Exponent::Ball);
    let other = constants::<f64>(&system(), full_rule(), Exponent::Ball);
    let monitor = TestMonitor::<f64>::NEW;
    let length = record_length(4);
    let mut record = vec![0; length];
    assert_eq!(monitor.save(&prepared, 1, &mut record[..length - 1]), Err(RecordError::TooShort));
    monitor.save(&prepared, 1, &mut record).expect("room");
    let mut restored = TestMonitor::<f64>::NEW;
    assert_eq!(restored.restore(&other, [&record, &[]]), Err(RecordError::OtherMachine));
    assert_eq!(restored.restore(&prepared, [&record[..length - 1], &[]]), Err(RecordError::TooShort));
    assert_eq!(restored.restore(&prepared, [&[], &record]), Ok(1));
    for byte in 0..length {
        for bit in 0..8 {
            let mut damaged = record.clone();
            damaged[byte] ^= 1 << bit;
            assert!(restored.restore(&prepared, [&damaged, &[]]).is_err(), "byte {byte}, bit {bit}");
        }
    }
}
