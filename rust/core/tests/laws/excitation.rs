//! Samples: changes of a trace that must not change the loads.

use guideload::{Excitation, ExcitationError, Output, Radau, Rk45};

use crate::common::{
    ADAPTIVE, Machine, Random, adaptive, alike, cart, cart_stiff, largest, noise, paper, random_machine,
};

fn machines(random: &mut Random) -> Vec<Machine> {
    let mut machines: Vec<_> = (0..3).map(|_| random_machine(random)).collect();
    machines.extend([cart(), paper(), cart_stiff(), cart().with_damping(0.0)]);
    machines
}

fn uneven(random: &mut Random, count: usize) -> Vec<f64> {
    let mut time = vec![0.3];
    for k in 1..count {
        time.push(time[k - 1] + 10f64.powf(random.between(-6.0, -2.0)));
    }
    time
}

/// Semigroup: additional samples on the straight lines do not change the loads.
#[test]
fn samples_inserted_on_the_lines_change_nothing() {
    let mut random = Random::new(41);
    for machine in machines(&mut random) {
        let time = uneven(&mut random, 60);
        let samples = noise(&mut random, 60);
        let coarse = Excitation::new(&time, &samples, None).expect("sound");
        let (mut fine_time, mut fine, mut kept) = (vec![], vec![], vec![]);
        for k in 0..60 {
            kept.push(fine_time.len());
            fine_time.push(time[k]);
            fine.push(samples[k]);
            for theta in [0.1, 0.37, 0.9].into_iter().filter(|_| k < 59) {
                fine_time.push(time[k] + theta * (time[k + 1] - time[k]));
                fine.push(coarse.input_at(fine_time[fine_time.len() - 1])[..3].try_into().expect("three"));
            }
        }
        let refined = machine.exact_loads(&Excitation::new(&fine_time, &fine, None).expect("sound"));
        let count = machine.links.len();
        let at_knots: Vec<f64> = kept.iter().flat_map(|&k| refined[k * count..][..count].to_vec()).collect();
        alike(&at_knots, &machine.exact_loads(&coarse), 1e-12); // Roundings of 240 steps instead of 60.
    }
}

#[test]
fn a_uniform_trace_is_the_same_by_step_and_by_times() {
    let mut random = Random::new(42);
    let samples = noise(&mut random, 500);
    let time: Vec<f64> = (0..500).map(|k| 0.25 + k as f64 * 1e-3).collect();
    let by_times = Excitation::new(&time, &samples, None).expect("sound");
    let by_step = Excitation::uniform(0.25, 1e-3, &samples).expect("sound");
    // The step from the times differs in its last digit, and the times by at most 500 times that.
    alike(&cart().exact_loads(&by_times), &cart().exact_loads(&by_step), 1e-12);
}

#[test]
fn a_shift_in_time_does_not_change_the_loads() {
    let mut random = Random::new(43);
    for machine in machines(&mut random) {
        let samples = noise(&mut random, 200);
        let early = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
        let late = Excitation::uniform(1.7e9, 1e-3, &samples).expect("sound"); // Unix time
        assert_eq!(machine.exact_loads(&early), machine.exact_loads(&late));

        // Times in powers of two do not round when they are shifted.
        let time: Vec<f64> = (0..200).map(|k| (3 * k + k % 3) as f64 / 2048.0).collect();
        let shifted: Vec<f64> = time.iter().map(|t| t + 4096.0).collect();
        let early = machine.exact_loads(&Excitation::new(&time, &samples, None).expect("sound"));
        let late = machine.exact_loads(&Excitation::new(&shifted, &samples, None).expect("sound"));
        assert_eq!(early, late);
    }
}

#[test]
fn responses_add_up() {
    let mut random = Random::new(44);
    for machine in machines(&mut random) {
        let (a, b) = (noise(&mut random, 200), noise(&mut random, 200));
        let sum: Vec<[f64; 3]> =
            a.iter().zip(&b).map(|(a, b)| [0, 1, 2].map(|i| a[i] + 2.0 * b[i])).collect();
        let dynamic = |samples: &[[f64; 3]]| {
            let loads = machine.exact_loads(&Excitation::uniform(0.0, 1e-3, samples).expect("sound"));
            let count = machine.links.len();
            let rest = loads[..count].to_vec();
            loads.iter().enumerate().map(|(i, x)| x - rest[i % count]).collect::<Vec<f64>>()
        };
        let (a, b) = (dynamic(&a), dynamic(&b));
        let want: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + 2.0 * b).collect();
        alike(&dynamic(&sum), &want, 1e-12); // Digits lost where the static part is taken off.
    }
}

/// Two samples at one time are the limit of two samples a nanosecond apart.
#[test]
fn a_jump_is_the_limit_of_a_nanosecond() {
    for machine in [cart(), paper(), cart_stiff()] {
        let samples = [[0.0; 3], [0.0; 3], [2.2, 0.0, 0.0], [2.2, 0.0, 0.0]];
        let [jump, ramp] = [0.01, 0.01 + 1e-9].map(|after| {
            let time = [0.0, 0.01, after, 0.05];
            machine.exact_loads(&Excitation::new(&time, &samples, None).expect("sound"))
        });
        // The damping load follows the velocity: a half nanosecond late at rates up to 3.6e4 1/s.
        alike(&jump, &ramp, 2e-5);
        let count = machine.links.len();
        assert_eq!(jump[count..2 * count], jump[2 * count..3 * count]); // No state jumps.
    }
}

#[test]
fn nanosecond_samples_need_no_more_work() {
    let mut random = Random::new(45);
    let time: Vec<f64> = (0..50).map(|k| if k < 49 { k as f64 * 1e-9 } else { 0.02 }).collect();
    let samples = noise(&mut random, 50);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let exact = cart().exact_loads(&excitation);
    let control = adaptive(1e-9);
    let (states, summary) = cart().states(&Rk45, control, &excitation);
    alike(&cart().loads_of(&states), &exact, 1e-8); // Ten times the tolerance.
    let (states, implicit) = cart().states(&Radau, control, &excitation);
    alike(&cart().loads_of(&states), &exact, 1e-8);
    assert!(summary.steps < 200 && implicit.steps < 100, "{summary:?} {implicit:?}");
}

#[test]
fn one_sample_is_the_static_load() {
    let excitation = Excitation::new(&[0.4], &[[2.2, 0.0, 0.0]], None).expect("sound");
    for output in [Output::Samples, Output::Times(&[0.4])] {
        let (states, outcome) = cart().run(&Rk45, adaptive(1e-6), &excitation, output);
        assert_eq!(states, [[0.0; 12]]);
        let summary = outcome.expect("a run that succeeds");
        assert_eq!((summary.steps, summary.rejected, summary.recorded), (0, 0, 1));
    }
    assert!(largest(&cart().exact_loads(&excitation)) > 100.0); // The weight is there.
}

#[test]
fn the_excitation_between_samples_is_the_straight_line() {
    let samples = [[0.0; 3], [1.0, 2.0, 3.0], [5.0, 6.0, 7.0], [5.0, 6.0, 7.0]];
    let excitation = Excitation::new(&[0.0, 1.0, 1.0, 3.0], &samples, None).expect("sound");
    assert_eq!(excitation.input_at(0.25)[..3], [0.25, 0.5, 0.75]);
    assert_eq!(excitation.input_at(1.0)[..3], [5.0, 6.0, 7.0]); // After the jump.
    assert_eq!(excitation.input_at(-1.0)[..3], [0.0; 3]);
    assert_eq!(excitation.input_at(9.0)[..3], [5.0, 6.0, 7.0]);
    assert_eq!(excitation.duration(), 3.0);
}

/// Times since 1970 in double precision resolve a quarter of a microsecond; a jump must stay a jump.
#[test]
fn a_jump_on_a_coarse_clock_stays_a_jump() {
    let ulp = 1.7e9_f64.next_up() - 1.7e9;
    let time = [1.7e9, 1.7e9 + 4.0 * ulp, 1.7e9 + 4.0 * ulp, 1.7e9 + 8.0 * ulp];
    let excitation = Excitation::new(&time, &[[0.0; 3]; 4], None).expect("sound");
    assert_eq!([0, 1, 2].map(|k| excitation.interval(k)), [4.0 * ulp, 0.0, 4.0 * ulp]);
}

#[test]
fn invalid_excitations_are_refused_with_their_sample() {
    let zeros = [[0.0; 3]; 4];
    let time = |time: &[f64; 4]| Excitation::new(time, &zeros, None).expect_err("no trace");
    assert_eq!(time(&[0.0, 1.0, 0.5, 2.0]), ExcitationError::Order { index: 2, before: 1.0, got: 0.5 });
    assert_eq!(time(&[0.0, 1.0, 1.0, 1.0]), ExcitationError::Repeated { index: 3, time: 1.0 });
    assert_eq!(time(&[0.0, f64::NAN, 1.0, 2.0]), ExcitationError::NotFinite { field: "time", index: 1 });
    assert_eq!(Excitation::new(&[], &[], None).expect_err("no trace"), ExcitationError::Empty);
    let short = Excitation::new(&[0.0, 1.0], &zeros, None).expect_err("no trace");
    assert_eq!(short, ExcitationError::Length { field: "acceleration", expected: 2, got: 4 });
    let hole = [[0.0; 3], [0.0, f64::INFINITY, 0.0]];
    let hole = Excitation::uniform(0.0, 1.0, &hole).expect_err("no trace");
    assert_eq!(hole, ExcitationError::NotFinite { field: "acceleration", index: 1 });
    assert!(matches!(Excitation::uniform(0.0, 0.0, &zeros), Err(ExcitationError::Order { .. })));
}

/// At the time of a jump the excitation is that after the jump, for every kind of output.
#[test]
fn at_a_jump_the_excitation_is_that_after_it() {
    struct Inputs(Vec<(f64, f64)>);
    impl guideload::Record for Inputs {
        fn reserve(&mut self, _: usize) -> Result<(), guideload::RunError> {
            Ok(())
        }
        fn instant(&mut self, time: f64, _: &[f64; 12], input: &[f64; 9]) {
            self.0.push((time, input[0]));
        }
    }
    let time = [0.0, 0.1, 0.1, 0.3, 0.3];
    let samples = [0.0, 1.0, 2.0, 3.0, 4.0].map(|a| [a, 0.0, 0.0]);
    let excitation = Excitation::new(&time, &samples, None).expect("sound");
    let mut record = Inputs(Vec::new());
    let output = guideload::Output::Times(&[0.1, 0.2, 0.3]);
    guideload::run(&cart().system(), &guideload::Exact, ADAPTIVE, &excitation, output, &mut record)
        .expect("runs");
    assert_eq!(record.0, [(0.1, 2.0), (0.2, 2.5), (0.3, 4.0)]);
    for (time, a) in record.0 {
        assert_eq!(excitation.input_at(time)[0], a);
    }
}
