//! Saving and restoring, and power that fails in between.

use guideload::EquivalentLoad;
use guideload_monitor::{Exponent, RecordError, record_length};

use crate::common::{LAG, TestMonitor, constants, counts, full_rule, motion, system};

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
