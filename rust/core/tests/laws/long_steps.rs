//! Long steps over samples that a record does not need: all states of a long step are within its bounds, and no contact change is missed.

use guideload::{
    Control, Dof, Exact, Excitation, Free, Input, Link, Method, Output, Record, RunError, State, StateBox,
    run,
};

use crate::batch::cart_on;
use crate::common::{
    ADAPTIVE, CURVE, Machine, Random, cart, cart_stiff, curve, cycle, noise, one_dof, random_machine, sided,
};

/// Needs no instant: stores the boxes of all long steps, each with the number of instants before it, and the other instants.
#[derive(Default)]
pub struct Needless {
    /// Whether it refuses every other long step.
    refuses: bool,
    asked: usize,
    instants: Vec<(usize, State)>,
    long_steps: Vec<(usize, usize, StateBox)>,
    next: usize,
}

impl Needless {
    /// A record that refuses every other long step, or none.
    pub fn refusing(refuses: bool) -> Self {
        Self { refuses, ..Self::default() }
    }
}

impl Record for Needless {
    fn reserve(&mut self, _: usize) -> Result<(), RunError> {
        Ok(())
    }

    fn needs_all(&self) -> bool {
        false
    }

    fn leave_out(&mut self, count: usize, states: &StateBox) -> bool {
        self.asked += 1;
        if self.refuses && self.asked % 2 == 1 {
            return false;
        }
        self.long_steps.push((self.next, count, *states));
        self.next += count;
        true
    }

    fn instant(&mut self, _: f64, state: &State, _: &Input) {
        self.instants.push((self.next, *state));
        self.next += 1;
    }
}

/// Runs a machine sample by sample and with long steps, and compares; returns the part of the samples that was left out.
fn compare(machine: &Machine, excitation: &Excitation, tolerance: f64) -> f64 {
    compare_with(&mut Needless::default(), machine, (&Exact, ADAPTIVE), excitation, tolerance)
}

/// The same with this record, by this method.
pub fn compare_with<M: Method>(
    record: &mut Needless,
    machine: &Machine,
    (method, control): (&M, Control),
    excitation: &Excitation,
    tolerance: f64,
) -> f64 {
    let (states, every) = machine.states(method, control, excitation);
    let system = machine.system();
    let summary = run(&system, method, control, excitation, Output::Samples, record).expect("a run");
    assert_eq!((summary.recorded, summary.contact_changes), (states.len(), every.contact_changes));
    let scale = states.iter().flatten().fold(0.0, |most, x: &f64| f64::max(most, x.abs()));
    let mut left_out = 0;
    for (first, count, states_of_step) in &record.long_steps {
        left_out += count;
        for (k, state) in states.iter().enumerate().skip(*first).take(*count) {
            assert!(states_of_step.contains(state), "sample {k}: {state:?} outside of {states_of_step:?}");
        }
    }
    assert_eq!(left_out + record.instants.len(), states.len());
    for (k, state) in &record.instants {
        for (got, want) in state.iter().zip(&states[*k]) {
            assert!(
                (got - want).abs() <= tolerance * scale,
                "sample {k}: {got:e}, want {want:e} of {scale:e}"
            );
        }
    }
    left_out as f64 / states.len() as f64
}

/// A planned motion, a smooth one along all axes, and noise.
fn motions(random: &mut Random) -> [Vec<[f64; 3]>; 3] {
    let phases: [[f64; 2]; 3] =
        std::array::from_fn(|_| [random.between(1.0, 20.0), random.between(0.0, 6.0)]);
    let smooth = |k: usize| phases.map(|[speed, phase]| 2.0 * (1e-3 * k as f64 * speed + phase).sin());
    [cycle()[..2500].to_vec(), (0..1500).map(smooth).collect(), noise(random, 1500)]
}

#[test]
fn bounds_of_leaps_contain_the_states_of_linear_machines() {
    let mut random = Random::new(71);
    let mut machines = vec![
        cart(),
        cart().with_damping(0.02),
        cart_stiff(),
        one_dof(80.0, 0.0),
        one_dof(80.0, 3.0),
        cart().with_free(Free::only(&[Dof::Ry])),
    ];
    machines.extend((0..6).map(|_| random_machine(&mut random)));
    for machine in machines {
        for samples in motions(&mut random) {
            let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
            let part = compare(&machine, &excitation, 1e-12);
            assert!(part > 0.8, "{part}");
        }
    }
}

#[test]
fn leaps_miss_no_contact_change() {
    let mut random = Random::new(72);
    let laws = [sided(6e7, 6e7, 5e-6), sided(6e7, 2e7, 1e-6), curve(&CURVE), sided(6e7, 6e7, 2e-4)];
    let mut parts = Vec::new();
    for law in laws {
        let (mut machine, _) = cart_on(law);
        for idle in [false, true] {
            if idle {
                for link in &mut machine.links {
                    *link = link.damped_in_contact().unwrap_or(*link);
                }
            }
            for samples in motions(&mut random) {
                let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
                parts.push(compare(&machine, &excitation, 1e-11));
            }
        }
    }
    // Planned motions; noise changes contacts all the time.
    for part in parts.iter().step_by(3) {
        assert!(*part > 0.2, "{parts:?}");
    }
}

/// Under a constant excitation the bounds of one long step serve several; a change of any component, or of the intervals, ends that.
#[test]
fn bounds_that_serve_several_leaps_end_with_the_constant_excitation() {
    // Exact binary fractions, so that all intervals but one are equal.
    let time = |k: usize| (k + usize::from(k > 2900)) as f64 / 1024.0;
    let time: Vec<f64> = (0..4000).map(time).collect();
    for first in 700..732 {
        let (mut accelerations, mut loads) = (vec![[0.0; 3]; time.len()], vec![[0.0; 6]; time.len()]);
        for k in 0..time.len() {
            loads[k][1] = 400.0 * f64::from(u8::from((first..1900).contains(&k)));
            loads[k][5] = f64::from(u8::from(k == 2500 + first));
            accelerations[k][0] = 0.3 * f64::from(u8::from(k >= 2300));
        }
        let excitation = Excitation::new(&time, &accelerations, Some(&loads)).expect("sound");
        // The slow body vibrates to the end: whether its bounds hold for another long step depends on the phase.
        for machine in [cart(), one_dof(10.0, 0.0)] {
            let mut record = Needless::default();
            let part = compare_with(&mut record, &machine, (&Exact, ADAPTIVE), &excitation, 1e-12);
            assert!(part > 0.9 && part < 1.0, "{part}");
            assert!(record.long_steps.iter().any(|(_, count, _)| *count > 320), "{:?}", record.long_steps);
        }
    }
}

#[test]
fn a_record_may_refuse_any_long_step() {
    let samples = &cycle()[..2500];
    let excitation = Excitation::uniform(0.0, 1e-3, samples).expect("sound");
    let mut record = Needless::refusing(true);
    let part = compare_with(&mut record, &cart(), (&Exact, ADAPTIVE), &excitation, 1e-12);
    assert!(record.asked > 20 && part > 0.2, "{} asked, {part}", record.asked);
}

/// Uneven times: a long step needs intervals of one length.
#[test]
fn leaps_pass_over_equal_intervals_only() {
    let samples = &cycle()[..2000];
    let mut time = vec![0.0];
    for k in 1..samples.len() {
        let step = if (900..1000).contains(&k) && k % 3 == 0 { 2e-3 } else { 1e-3 };
        time.push(time[k - 1] + step);
    }
    let excitation = Excitation::new(&time, samples, None).expect("sound");
    let part = compare(&cart(), &excitation, 1e-12);
    assert!(part > 0.5 && part < 0.95, "{part}");
}

/// A body without links in contact in one direction drifts through its clearance, and meets the other side.
#[test]
fn a_leap_ends_before_a_drifting_body_meets_a_side() {
    let wide = sided(6e7, 6e7, 3e-3);
    let mut machine = cart();
    for link in &mut machine.links {
        if link.direction().z.abs() > 0.5 {
            *link = Link::with_law(link.point(), link.direction(), wide, 50.0).expect("a link");
        }
    }
    let mut samples = vec![[0.0, 0.0, 0.0]; 6000];
    samples[100..130].fill([0.0, 0.0, 1.0]);
    let excitation = Excitation::uniform(0.0, 1e-3, &samples).expect("sound");
    let (_, every) = machine.states(&Exact, ADAPTIVE, &excitation);
    assert!(every.contact_changes > 2, "{every:?}");
    let part = compare(&machine, &excitation, 1e-11);
    assert!(part > 0.5, "{part}");
}

/// Samples one period of an undamped body apart: at all of them the body is in contact, in between it may lift off.
#[test]
fn a_contact_change_between_samples_is_not_leapt_over() {
    // Exact binary fractions, so that all intervals are equal.
    let (tick, period) = (1.0 / 1024.0, 1.0 / 16.0);
    let frequency = std::f64::consts::TAU / period;
    let mut machine = one_dof(frequency, 0.0);
    let stiffness = 100.0 * frequency * frequency;
    let law = sided(stiffness, stiffness, 1e-4);
    let link = machine.links[0];
    machine.links[0] = Link::with_law(link.point(), link.direction(), law, 0.0).expect("a link");
    // A pulse swings the body with `size` times its deflection under gravity; at the end of its samples it is at rest position.
    for (size, lifts_off) in [(0.8, false), (1.5, true)] {
        let pulse = size * 9.80665 / frequency / (10.0 * tick);
        let mut samples: Vec<[f64; 3]> =
            (0..43).map(|k| [0.0, if (5..15).contains(&k) { pulse } else { 0.0 }, 0.0]).collect();
        let mut time: Vec<f64> = (0..43).map(|k| tick * f64::from(k)).collect();
        for k in 1..1500 {
            samples.push([0.0; 3]);
            time.push(42.0 * tick + period * f64::from(k));
        }
        let excitation = Excitation::new(&time, &samples, None).expect("sound");
        let (_, every) = machine.states(&Exact, ADAPTIVE, &excitation);
        assert_eq!(every.contact_changes > 100, lifts_off, "{every:?}");
        let part = compare(&machine, &excitation, 1e-11);
        assert!(!lifts_off || part == 0.0, "{part}");
    }
}
