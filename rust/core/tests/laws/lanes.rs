//! Linear scenes side by side give the same loads as single runs, in lanes of any width and beside any other scenes.

use guideload::batch::{Batch, Change, Group, Measure, Motion, Quantity, Statistic, Target, Width};
use guideload::{Dof, Exact, Free, LawParameter};
use nalgebra::Vector3;

use crate::batch::{BowsBy, Trace, all_measures, base, is_time, measures_of};
use crate::common::{
    ADAPTIVE, Machine, Random, cart, cart_stiff, cycle, exact_bows, noise, one_dof, paper, polynomial_bows,
    random_machine, rules, ticks, wrenches,
};
use crate::invariance::scaled;

/// A scene, a motion, and samples of factors on mass, stiffness and damping.
struct Study {
    machine: Machine,
    groups: Vec<Group>,
    changes: Vec<Change>,
    values: Vec<f64>,
    count: usize,
}

impl Study {
    /// Mass, a coordinate of the centre of mass, stiffness and damping of every link, and the motion's scale vary by about a tenth.
    fn new(machine: Machine, random: &mut Random, count: usize) -> Self {
        let half = machine.links.len() / 2;
        let mut groups = vec![
            Group::new((0..half).collect(), Vector3::new(0.1, -0.2, 0.3)),
            Group::new((half..machine.links.len()).collect(), Vector3::new(-0.3, 0.1, 0.2)),
        ];
        [groups[1].peak_rule, groups[1].mean_rule, ..] = rules();
        let mut nominal = vec![machine.body.mass(), machine.body.center_of_mass().y + 0.01, 1.0];
        let to = |target, column| Change { target, constant: 0.0, terms: vec![(column, 1.0)] };
        let mut changes =
            vec![to(Target::Mass, 0), to(Target::CenterOfMass(1), 1), to(Target::Acceleration, 2)];
        for (link, of) in machine.links.iter().enumerate() {
            let parameter = LawParameter::Stiffness;
            changes.push(to(Target::Law { link, parameter }, nominal.len()));
            changes.push(to(Target::Damping(link), nominal.len() + 1));
            nominal.extend([of.stiffness(), of.damping()]);
        }
        let values = (0..count)
            .flat_map(|_| nominal.iter().map(|x| x * random.between(0.9, 1.1)).collect::<Vec<_>>())
            .collect();
        Self { machine, groups, changes, values, count }
    }

    fn columns(&self) -> usize {
        self.values.len() / self.count
    }

    fn batch<'a>(&'a self, motion: Motion<'a>, measures: &[Measure]) -> Batch<'a> {
        let base = base(&self.machine, &self.groups);
        Batch::new(base, motion, &self.changes, measures, None, 1e-6).expect("sound")
    }

    fn table(&self, batch: Batch, width: Width, threads: usize) -> Vec<f64> {
        let mut table = vec![0.0; self.count * batch.measures().len()];
        let failures =
            batch.with_width(width).run(self.count, &self.values, threads, &mut table).expect("sizes");
        assert_eq!(failures, []);
        table
    }

    /// The scene of a sample, and the scale of its motion.
    fn sample(&self, index: usize) -> (Machine, f64) {
        let values = &self.values[index * self.columns()..(index + 1) * self.columns()];
        let mut machine = self.machine.clone();
        let mut center = machine.body.center_of_mass();
        center.y = values[1];
        machine.body = guideload::Body::new(values[0], center, machine.body.inertia()).expect("a body");
        for (link, own) in machine.links.iter_mut().zip(values[3..].chunks_exact(2)) {
            *link = guideload::Link::new(link.point(), link.direction(), own[0], own[1]).expect("a link");
        }
        (machine, values[2])
    }
}

/// The measures of a sample; and those with the mean loads of a scene that runs by itself, by the polynomials of
/// [`guideload::ReferenceMotion`].
fn reduced(study: &Study, index: usize, trace: &Trace, exponent: f64) -> [Vec<f64>; 2] {
    let (machine, scale) = study.sample(index);
    let scaled = trace.scaled(scale, 1.0);
    let excitation = scaled.excitation();
    let (states, _) = machine.states(&Exact, ADAPTIVE, &excitation);
    let travel = trace.motion(exponent);
    [exact_bows as BowsBy, polynomial_bows].map(|bows_by| {
        measures_of(&machine, &study.groups, &travel, &excitation, &states, bows_by, &all_measures(2))
    })
}

/// Noise along all axes without external loads.
fn noisy(time: Vec<f64>, random: &mut Random) -> Trace {
    let acceleration = noise(random, time.len());
    let speed = time.iter().map(|t| f64::sin(3.0 * t)).collect();
    Trace { time, acceleration, wrench: vec![], speed }
}

#[track_caller]
fn agree(study: &Study, trace: &Trace, exponent: f64) {
    let measures = all_measures(2);
    let batch = study.batch(trace.motion(exponent), &measures).at_samples();
    let table = study.table(batch.clone(), Width::Widest, 1);
    for width in [Width::Four, Width::One] {
        let other = study.table(batch.clone(), width, 2);
        assert!(table.iter().zip(&other).all(|(a, b)| a.to_bits() == b.to_bits()), "{width:?}");
    }
    for (index, row) in table.chunks_exact(measures.len()).enumerate() {
        let [want, by_itself] = reduced(study, index, trace, exponent);
        // Of the largest force, or moment, that there is.
        let forces =
            want.iter().copied().filter(|x| x.is_finite()).fold(0.0, |most: f64, x| f64::max(most, x.abs()));
        for (((measure, got), want), other) in measures.iter().zip(row).zip(&want).zip(&by_itself) {
            // The times of two extremes that are equal up to rounding may be exchanged, for instance if a load is always zero.
            let same = |want: &f64| {
                (got - want).abs() <= 1e-12 * forces || got == want || (got.is_nan() && want.is_nan())
            };
            assert!(
                same(want) || same(other) || is_time(measure),
                "sample {index}, {measure:?}: got {got}, want {want}"
            );
        }
    }
}

#[test]
fn any_number_of_degrees_of_freedom() {
    let mut random = Random::new(1);
    let all = Dof::ALL;
    for count in 1..=6 {
        for start in 0..7 - count {
            let machine = random_machine(&mut random).with_free(Free::only(&all[start..start + count]));
            let study = Study::new(machine, &mut random, 11);
            let samples = noisy(ticks(150, 1e-3), &mut random);
            agree(&study, &samples, 3.0);
        }
    }
}

#[test]
fn carts_and_exponents() {
    let mut random = Random::new(2);
    for (machine, exponent) in [(cart(), 10.0 / 3.0), (paper(), 3.0), (cart(), 2.7)] {
        let study = Study::new(machine, &mut random, 9);
        let acceleration = cycle();
        let time = ticks(acceleration.len(), 1e-3);
        let mut velocity = 0.0;
        let speed = acceleration.iter().map(|a| {
            velocity += 1e-3 * a[0];
            velocity
        });
        let samples = Trace { time, speed: speed.collect(), acceleration, wrench: vec![] };
        agree(&study, &samples, exponent);
    }
}

#[test]
fn jitter_ticks_jumps_and_process_forces() {
    let mut random = Random::new(3);
    let study = Study::new(cart(), &mut random, 5);
    let jitter = ticks(400, 1e-3).iter().map(|t| t + random.between(-4e-4, 4e-4)).collect();
    agree(&study, &noisy(jitter, &mut random), 3.0);
    // A device clock that counts in tenths, with long and with no intervals.
    let mut clock = 0.0;
    let mut last = 1.0;
    let steps = (0..300).map(|_| {
        last = if last == 0.0 { 1.0 } else { random.between(0.0, 6.0).floor() };
        clock += 1e-4 * last * if random.between(0.0, 1.0) < 0.05 { 1000.0 } else { 1.0 };
        clock
    });
    let mut samples = noisy(steps.collect(), &mut random);
    agree(&study, &samples, 3.0);
    samples.wrench = wrenches(&mut random, 300, 2e3);
    agree(&study, &samples, 3.0);
}

#[test]
fn scenes_that_are_not_accurate_in_lanes_run_one_by_one() {
    let mut random = Random::new(4);
    let samples = noisy(ticks(200, 1e-3), &mut random);
    // Overdamped; two equal modes; hardly damped; a stiff link beside soft ones.
    let mut spread = random_machine(&mut random);
    let stiff = spread.links[0];
    spread.links[0] =
        guideload::Link::new(stiff.point(), stiff.direction(), 1e13, stiff.damping()).expect("a link");
    for machine in [cart_stiff(), one_dof(300.0, 1.0), cart().with_damping(1e-9), spread] {
        let study = Study::new(machine, &mut random, 9);
        agree(&study, &samples, 3.0);
    }
}

#[test]
fn neighbours_do_not_matter() {
    let mut random = Random::new(5);
    let extremes: Vec<Measure> = all_measures(2).into_iter().filter(is_extreme).collect();
    for measures in [all_measures(2), extremes] {
        let mut study = Study::new(cart(), &mut random, 20);
        let samples = noisy(ticks(1000, 1e-3), &mut random);
        let motion = samples.motion(3.0);
        let table = study.table(study.batch(motion, &measures), Width::Widest, 1);
        let (columns, width) = (study.columns(), measures.len());
        // One moved on, the last left out.
        study.values.drain(..columns);
        study.values.truncate(18 * columns);
        study.count = 18;
        let moved = study.table(study.batch(motion, &measures), Width::Widest, 1);
        let same = table[width..19 * width].iter().zip(&moved).all(|(a, b)| a.to_bits() == b.to_bits());
        assert!(same);
    }
}

/// Whether it is an extreme of a component or the largest value of a magnitude, for which blocks may be skipped.
fn is_extreme(measure: &Measure) -> bool {
    match measure {
        Measure::Load(_, Quantity::Resultant, statistic) => {
            matches!(statistic, Statistic::Max | Statistic::TimeOfMax)
        }
        Measure::Load(_, _, statistic) => {
            matches!(statistic, Statistic::Min | Statistic::Max | Statistic::TimeOfMin | Statistic::TimeOfMax)
        }
        Measure::PeakLoad(_) => true,
        _ => false,
    }
}

/// If only extremes are requested, blocks without a new extreme are skipped. This does not change a bit of the results.
#[test]
fn skipped_blocks_contain_no_new_extreme() {
    let mut random = Random::new(6);
    let quiet = |k: usize| [0.0, 40.0, 400.0].contains(&(k as f64 / 10.0).floor());
    for machine in [cart(), random_machine(&mut random), cart().with_damping(0.02)] {
        let study = Study::new(machine, &mut random, 13);
        let mut all = vec![noisy(ticks(900, 1e-3), &mut random)];
        let acceleration = cycle();
        let time = ticks(acceleration.len(), 1e-3);
        let speed = vec![1.0; time.len()];
        all.push(Trace { time, speed, acceleration, wrench: vec![] });
        // Long rests between short jerks, some of them later and smaller than the first.
        let mut jerks = noisy(ticks(2000, 1e-3), &mut random);
        for (k, sample) in jerks.acceleration.iter_mut().enumerate() {
            *sample = sample.map(|x| if quiet(k) { x } else { 0.0 });
        }
        all.push(jerks);
        for samples in &all {
            let motion = samples.motion(3.0);
            let measures = all_measures(2);
            let whole = study.table(study.batch(motion, &measures), Width::Widest, 1);
            let some: Vec<Measure> = measures.iter().copied().filter(is_extreme).collect();
            for width in [Width::Widest, Width::Four, Width::One] {
                let alone = study.table(study.batch(motion, &some), width, 1);
                let asked =
                    whole.iter().zip(measures.iter().cycle()).filter(|(_, measure)| is_extreme(measure));
                assert!(asked.zip(&alone).all(|((a, _), b)| a.to_bits() == b.to_bits()));
            }
        }
    }
}

/// If L is far from the body and the links, terms of the mass and stiffness matrices nearly cancel.
#[test]
fn any_reference_point() {
    let mut random = Random::new(7);
    for distance in [1.0, 4.0, 16.0, 64.0] {
        let away = Vector3::new(0.6, -0.48, 0.64) * distance;
        let machine = random_machine(&mut random).with_proportional_damping(1e-4).moved(away);
        let mut study = Study::new(machine, &mut random, 30);
        for group in &mut study.groups {
            group.center += away;
        }
        agree(&study, &noisy(ticks(200, 1e-3), &mut random), 3.0);
    }
}

/// In a motion far shorter than any period the loads are a tiny fraction of the quasi-static loads.
#[test]
fn motions_far_shorter_than_any_period() {
    let mut random = Random::new(8);
    let mut machine = random_machine(&mut random);
    machine.gravity = Vector3::zeros();
    let study = Study::new(machine, &mut random, 9);
    for (count, step) in [(10, 1e-3), (10, 1e-5), (10, 1e-8), (300, 1e-5), (1, 1.0), (2, 1e-6)] {
        agree(&study, &noisy(ticks(count, step), &mut random), 3.0);
    }
}

/// Stiffness and mass of extreme size, with an ordinary ratio.
#[test]
fn any_size_of_numbers() {
    let mut random = Random::new(9);
    // The cube of a load, for the mean load, stays within the range of numbers.
    for size in [1e-90, 1e-60, 1e60, 1e90] {
        let machine = scaled(&random_machine(&mut random), size, size, size, 1.0, 1.0);
        let study = Study::new(machine, &mut random, 9);
        agree(&study, &noisy(ticks(200, 1e-3), &mut random), 3.0);
    }
}
