//! Linear scenes side by side give the same loads as single runs, in lanes of any width and beside any other scenes.

use guideload::LawParameter;
use guideload::batch::{Base, Batch, Change, Group, Measure, Motion, Quantity, Statistic, Target, Width};
use guideload::{Dof, Exact, Excitation, Free, Part, group_load};
use guideload::{evaluate, reaction};
use nalgebra::Vector3;

use crate::common::{
    ADAPTIVE, Machine, Random, cart, cart_stiff, cycle, exact_bows, mean_and_largest, noise, one_dof, paper,
    polynomial_bows, random_machine, rules,
};

/// Measures of a batch: all of two groups and of the drive.
fn all_measures() -> Vec<Measure> {
    let mut measures = Vec::new();
    for group in 0..2 {
        for quantity in Quantity::ALL {
            measures.extend(Statistic::ALL.map(|statistic| Measure::Load(group, quantity, statistic)));
        }
        measures.extend([Measure::MeanLoad(group), Measure::PeakLoad(group), Measure::ContactLost(group)]);
    }
    measures.extend(Statistic::ALL.map(Measure::Drive));
    measures
}

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
        let Machine { body, links, gravity, free } = &self.machine;
        let base = Base {
            mass: body.mass(),
            center_of_mass: body.center_of_mass(),
            inertia: body.inertia(),
            inertia_about_reference: false,
            links,
            gravity: *gravity,
            free: *free,
            base_compliance: None,
            groups: &self.groups,
            payloads: &[],
        };
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

/// The measures of one history of loads by their definitions, one after the other; and with the mean loads of a scene that runs by itself,
/// by the polynomials of [`guideload::ReferenceMotion`].
fn reduced(study: &Study, index: usize, motion: &Motion, samples: &Samples, exponent: f64) -> [Vec<f64>; 2] {
    let (machine, scale) = study.sample(index);
    let acceleration: Vec<_> = samples.acceleration.iter().map(|a| a.map(|x| x * scale)).collect();
    let excitation = Excitation::new(&samples.time, &acceleration, samples.wrench.as_deref()).expect("sound");
    let (states, _) = machine.states(&Exact::<16>, ADAPTIVE, &excitation);
    let system = machine.system();
    let mut loads: Vec<_> = study
        .groups
        .iter()
        .map(|group| group_load(&system, group.links.iter().copied(), group.center, Part::Total))
        .collect();
    let bows = [
        exact_bows(&system, &excitation, &loads, &states),
        polynomial_bows(&system, &excitation, &loads, &states),
    ];
    loads.push(reaction(&system));
    let mut flat = vec![0.0; states.len() * 18];
    evaluate(&loads, &states, |k| excitation.input(k), &mut flat);
    let weights = guideload::batch::time_weights(&motion.excitation);
    let of = |values: &[f64]| -> Vec<f64> {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let at = |x| excitation.time(values.iter().position(|y| *y == x).expect("there"));
        let mean_square: f64 = values.iter().zip(&weights).map(|(x, w)| x * x * w).sum();
        vec![low, at(low), high, at(high), mean_square.sqrt(), values[0]]
    };
    let column = |j: usize| -> Vec<f64> { flat.iter().skip(j).step_by(18).copied().collect() };
    let along_x: Vec<f64> = samples.acceleration.iter().map(|a| a[0]).collect();
    let travel = [&samples.speed[..], &along_x];
    bows.map(|bows| {
        let mut out = Vec::new();
        for (group, bows) in bows.iter().enumerate() {
            for component in 0..6 {
                out.extend(of(&column(6 * group + component)));
            }
            let (y, z) = (column(6 * group + 1), column(6 * group + 2));
            out.extend(of(&y.iter().zip(&z).map(|(y, z)| (y * y + z * z).sqrt()).collect::<Vec<_>>()));
            let loads: Vec<[f64; 6]> =
                flat.chunks_exact(18).map(|row| std::array::from_fn(|j| row[6 * group + j])).collect();
            let rules = [study.groups[group].mean_rule, study.groups[group].peak_rule];
            out.extend(mean_and_largest(rules, &motion.excitation, travel, exponent, &loads, bows));
            out.push(0.0);
        }
        if machine.free.contains(Dof::X) {
            out.extend([f64::NAN; 6])
        } else {
            out.extend(of(&column(12)))
        }
        out
    })
}

/// A motion as its samples.
struct Samples {
    time: Vec<f64>,
    acceleration: Vec<[f64; 3]>,
    wrench: Option<Vec<[f64; 6]>>,
    speed: Vec<f64>,
}

impl Samples {
    fn new(time: Vec<f64>, random: &mut Random) -> Self {
        let acceleration = noise(random, time.len());
        let speed = time.iter().map(|t| f64::sin(3.0 * t)).collect();
        Self { time, acceleration, wrench: None, speed }
    }
}

#[track_caller]
fn agree(study: &Study, samples: &Samples, exponent: f64) {
    let measures = all_measures();
    let excitation =
        Excitation::new(&samples.time, &samples.acceleration, samples.wrench.as_deref()).expect("sound");
    let motion = Motion { excitation, speed: Some(&samples.speed), exponent };
    let batch = study.batch(motion, &measures).at_samples();
    let table = study.table(batch.clone(), Width::Widest, 1);
    for width in [Width::Four, Width::One] {
        let other = study.table(batch.clone(), width, 2);
        assert!(table.iter().zip(&other).all(|(a, b)| a.to_bits() == b.to_bits()), "{width:?}");
    }
    for (index, row) in table.chunks_exact(measures.len()).enumerate() {
        let [want, by_itself] = reduced(study, index, &motion, samples, exponent);
        // Of the largest force, or moment, that there is.
        let forces =
            want.iter().copied().filter(|x| x.is_finite()).fold(0.0, |most: f64, x| f64::max(most, x.abs()));
        for (((measure, got), want), other) in measures.iter().zip(row).zip(&want).zip(&by_itself) {
            let time = matches!(
                measure,
                Measure::Load(_, _, Statistic::TimeOfMin | Statistic::TimeOfMax)
                    | Measure::Drive(Statistic::TimeOfMin | Statistic::TimeOfMax)
            );
            // The times of two extremes that are equal up to rounding may be exchanged, for instance if a load is always zero.
            let same = |want: &f64| {
                (got - want).abs() <= 1e-12 * forces || got == want || (got.is_nan() && want.is_nan())
            };
            assert!(same(want) || same(other) || time, "sample {index}, {measure:?}: got {got}, want {want}");
        }
    }
}

fn ticks(count: usize, step: f64) -> Vec<f64> {
    (0..count).map(|k| k as f64 * step).collect()
}

#[test]
fn any_number_of_degrees_of_freedom() {
    let mut random = Random::new(1);
    let all = Dof::ALL;
    for count in 1..=6 {
        for start in 0..7 - count {
            let machine = random_machine(&mut random).with_free(Free::only(&all[start..start + count]));
            let study = Study::new(machine, &mut random, 11);
            let samples = Samples::new(ticks(150, 1e-3), &mut random);
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
        let samples = Samples { time, speed: speed.collect(), acceleration, wrench: None };
        agree(&study, &samples, exponent);
    }
}

#[test]
fn jitter_ticks_jumps_and_process_forces() {
    let mut random = Random::new(3);
    let study = Study::new(cart(), &mut random, 5);
    let jitter = ticks(400, 1e-3).iter().map(|t| t + random.between(-4e-4, 4e-4)).collect();
    agree(&study, &Samples::new(jitter, &mut random), 3.0);
    // A device clock that counts in tenths, with long and with no intervals.
    let mut clock = 0.0;
    let mut last = 1.0;
    let steps = (0..300).map(|_| {
        last = if last == 0.0 { 1.0 } else { random.between(0.0, 6.0).floor() };
        clock += 1e-4 * last * if random.between(0.0, 1.0) < 0.05 { 1000.0 } else { 1.0 };
        clock
    });
    let mut samples = Samples::new(steps.collect(), &mut random);
    agree(&study, &samples, 3.0);
    samples.wrench = Some((0..300).map(|_| std::array::from_fn(|_| random.between(-2e3, 2e3))).collect());
    agree(&study, &samples, 3.0);
}

#[test]
fn scenes_that_are_not_accurate_in_lanes_run_one_by_one() {
    let mut random = Random::new(4);
    let samples = Samples::new(ticks(200, 1e-3), &mut random);
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
    let extremes: Vec<Measure> = all_measures().into_iter().filter(is_extreme).collect();
    for measures in [all_measures(), extremes] {
        let mut study = Study::new(cart(), &mut random, 20);
        let samples = Samples::new(ticks(1000, 1e-3), &mut random);
        let excitation = Excitation::new(&samples.time, &samples.acceleration, None).expect("sound");
        let motion = Motion { excitation, speed: Some(&samples.speed), exponent: 3.0 };
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

/// Whether it is an extreme of a component, for which blocks may be skipped.
fn is_extreme(measure: &Measure) -> bool {
    matches!(measure, Measure::Load(_, quantity, Statistic::Min | Statistic::Max) if *quantity != Quantity::Resultant)
}

/// If only extremes are requested, blocks without a new extreme are skipped. This does not change a bit of the results.
#[test]
fn skipped_blocks_contain_no_new_extreme() {
    let mut random = Random::new(6);
    let quiet = |k: usize| [0.0, 40.0, 400.0].contains(&(k as f64 / 10.0).floor());
    for machine in [cart(), random_machine(&mut random), cart().with_damping(0.02)] {
        let study = Study::new(machine, &mut random, 13);
        let mut all = vec![Samples::new(ticks(900, 1e-3), &mut random)];
        let acceleration = cycle();
        let time = ticks(acceleration.len(), 1e-3);
        let speed = vec![1.0; time.len()];
        all.push(Samples { time, speed, acceleration, wrench: None });
        // Long rests between short jerks, some of them later and smaller than the first.
        let mut jerks = Samples::new(ticks(2000, 1e-3), &mut random);
        for (k, sample) in jerks.acceleration.iter_mut().enumerate() {
            *sample = sample.map(|x| if quiet(k) { x } else { 0.0 });
        }
        all.push(jerks);
        for samples in &all {
            let excitation = Excitation::new(&samples.time, &samples.acceleration, None).expect("sound");
            let motion = Motion { excitation, speed: Some(&samples.speed), exponent: 3.0 };
            let measures = all_measures();
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
        let mut machine = random_machine(&mut random);
        let away = Vector3::new(0.6, -0.48, 0.64) * distance;
        let body = &machine.body;
        machine.body =
            guideload::Body::new(body.mass(), body.center_of_mass() + away, body.inertia()).expect("a body");
        for link in &mut machine.links {
            *link = guideload::Link::new(
                link.point() + away,
                link.direction(),
                link.stiffness(),
                1e-4 * link.stiffness(),
            )
            .expect("a link");
        }
        let mut study = Study::new(machine, &mut random, 30);
        for group in &mut study.groups {
            group.center += away;
        }
        agree(&study, &Samples::new(ticks(200, 1e-3), &mut random), 3.0);
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
        agree(&study, &Samples::new(ticks(count, step), &mut random), 3.0);
    }
}

/// Stiffness and mass of extreme size, with an ordinary ratio.
#[test]
fn any_size_of_numbers() {
    let mut random = Random::new(9);
    // The cube of a load, for the mean load, stays within the range of numbers.
    for size in [1e-90, 1e-60, 1e60, 1e90] {
        let mut machine = random_machine(&mut random);
        let body = &machine.body;
        machine.body = guideload::Body::new(size * body.mass(), body.center_of_mass(), size * body.inertia())
            .expect("a body");
        for link in &mut machine.links {
            *link = guideload::Link::new(
                link.point(),
                link.direction(),
                size * link.stiffness(),
                size * link.damping(),
            )
            .expect("a link");
        }
        let study = Study::new(machine, &mut random, 9);
        agree(&study, &Samples::new(ticks(200, 1e-3), &mut random), 3.0);
    }
}
