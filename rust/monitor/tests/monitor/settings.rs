//! Settings that a monitor cannot work with are refused by name.

use guideload::{EquivalentLoad, Preload};
use guideload_monitor::{Exponent, InputSettings, Judgement, PrepareError, Settings, prepare};

use crate::common::{PERIOD, QUANTUM, input, loads, system};

fn refused(change: impl FnOnce(&mut Settings<'_>, &mut Judgement)) -> Option<PrepareError> {
    let system = system();
    let rule = EquivalentLoad::SUM_OF_FORCES;
    let mut judgement = Judgement { rule, limit: f64::INFINITY, bin: 500.0, capacity: 0.0 };
    let (taps, exponent) = ([[0.1, -0.5]; 10], Exponent::Ball);
    let mut settings =
        Settings { period: PERIOD, quantum: -QUANTUM, input: input(), taps: &taps, lag: 5, exponent };
    change(&mut settings, &mut judgement);
    let loads = loads(&system).map(|load| (load, judgement));
    let prepared = prepare::<f32, 10, 4, 64>(&system, &loads, &settings);
    assert!(prepared.is_err() || prepared.is_ok_and(|prepared| prepared.is_valid()));
    prepare::<f32, 10, 4, 64>(&system, &loads, &settings).err()
}

#[test]
fn a_setting_out_of_its_range_is_refused_by_name() {
    assert_eq!(refused(|_, _| ()), None);
    assert_eq!(refused(|_, judgement| judgement.limit = 1.0), None);
    let of_input = |change: fn(&mut InputSettings, i32), name: &str, wrong: &[i32]| {
        for &value in wrong {
            let error = refused(|settings, _| change(&mut settings.input, value));
            assert!(
                matches!(error, Some(PrepareError::Setting { name: found, .. }) if found == name),
                "{error:?}"
            );
        }
    };
    of_input(|input, value| input.counter_bits = value as u32, "counter_bits", &[0, 33, 64]);
    of_input(|input, value| input.most_change = value, "most_change", &[-1, i32::MIN]);
    of_input(|input, value| input.slack = value, "slack", &[-1, i32::MIN]);
    of_input(|input, value| input.still = value, "still", &[-1, i32::MIN]);
    let of_number = |change: fn(&mut Settings<'_>, &mut Judgement, f64), name: &str, wrong: &[f64]| {
        for &value in wrong {
            let error = refused(|settings, judgement| change(settings, judgement, value));
            assert!(
                matches!(error, Some(PrepareError::Setting { name: found, .. }) if found == name),
                "{error:?}"
            );
        }
    };
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    of_number(|settings, _, value| settings.period = value, "period", &[0.0, -1e-3, nan, infinite]);
    of_number(|settings, _, value| settings.quantum = value, "quantum", &[0.0, nan, -infinite]);
    of_number(|settings, _, _| settings.taps = &[], "taps", &[0.0]);
    of_number(|_, judgement, value| judgement.limit = value, "limit", &[0.0, -5.0, nan]);
    of_number(|_, judgement, value| judgement.bin = value, "bin", &[0.0, -5.0, nan, infinite]);
    of_number(|_, judgement, value| judgement.capacity = value, "capacity", &[-5.0, nan, infinite]);
    for form in [Preload::Power, Preload::Linear, Preload::Balls, Preload::Rollers] {
        for force in [-5.0, nan, infinite] {
            let error = refused(|_, judgement| judgement.rule.preload = form(force));
            assert!(matches!(error, Some(PrepareError::Setting { name: "preload", .. })), "{error:?}");
        }
    }
    assert_eq!(refused(|_, judgement| judgement.capacity = 1e39), Some(PrepareError::OutOfRange)); // in f32
}
