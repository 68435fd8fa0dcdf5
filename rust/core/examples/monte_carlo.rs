//! Scatter of the peak loads of a cart: `cargo run --release --example monte_carlo -- [samples] [clearance in µm]`.
//!
//! A cart on four carriages travels forth and back. Its mass, its centre of mass, and the stiffness and damping of each carriage scatter.
//! The example prints how the peak y-z load of each carriage scatters. The caller draws the values of the samples; a few lines below do
//! this without another crate.

use std::error::Error;
use std::time::Instant;

use guideload::LawParameter;
use guideload::batch::{
    Base, Batch, Change, Group, Measure, Motion, NominalBody, Quantity, Statistic, Target,
};
use guideload::{Excitation, Free, Law, Link, carriage_ends};
use nalgebra::{Matrix3, Vector3};

/// Stiffness N/m and damping N s/m of each link.
const LINK: [f64; 2] = [6e7, 5e4];

fn main() -> Result<(), Box<dyn Error>> {
    let number =
        |index: usize, otherwise: f64| std::env::args().nth(index).map_or(Ok(otherwise), |text| text.parse());
    let (samples, clearance) = (number(1, 2000.0)? as usize, 1e-6 * number(2, 0.0)?);

    // The base scene, with the nominal values.
    let law = Law::linear(LINK[0])?.with(LawParameter::Clearance, clearance)?;
    let (mut links, mut groups) = (Vec::new(), Vec::new());
    for (x, z) in [(-0.5, -0.35), (-0.5, 0.35), (0.5, -0.35), (0.5, 0.35)] {
        let (center, first) = (Vector3::new(x, 0.05, z), links.len());
        for (point, direction) in carriage_ends(center, 0.12) {
            links.push(Link::with_law(point, direction, law, LINK[1])?);
        }
        groups.push(Group::new((first..links.len()).collect(), center));
    }
    let base = Base {
        body: NominalBody {
            mass: 1250.0,
            center_of_mass: Vector3::new(0.12, -0.65, 0.18),
            inertia: Matrix3::new(420.0, 15.0, -8.0, 15.0, 310.0, 22.0, -8.0, 22.0, 380.0),
            inertia_about_reference: false,
        },
        links: &links,
        gravity: Vector3::new(0.0, -9.80665, 0.0),
        free: Free::GUIDED,
        base_compliance: None,
        groups: &groups,
        payloads: &[],
    };
    let acceleration = there_and_back();
    let excitation = Excitation::uniform(0.0, 1e-3, &acceleration)?;
    let motion = Motion { excitation, speed: None, exponent: 3.0 };

    // The changes. Columns of the values: mass, three coordinates, and for each carriage a factor on stiffness and one on damping.
    let mut changes = vec![Change { target: Target::Mass, constant: 0.0, terms: vec![(0, 1.0)] }];
    for axis in 0..3 {
        let target = Target::CenterOfMass(axis);
        changes.push(Change { target, constant: 0.0, terms: vec![(1 + axis, 1.0)] });
    }
    for link in 0..links.len() {
        let target = Target::Law { link, parameter: LawParameter::Stiffness };
        changes.push(Change { target, constant: 0.0, terms: vec![(4 + link / 4, LINK[0])] });
        let target = Target::Damping(link);
        changes.push(Change { target, constant: 0.0, terms: vec![(8 + link / 4, LINK[1])] });
    }
    let mut random = Random(1);
    let mut values = Vec::with_capacity(12 * samples);
    for _ in 0..samples {
        values.push(base.body.mass * random.between(0.9, 1.1));
        values.extend(base.body.center_of_mass.iter().map(|x| x + random.between(-0.05, 0.05)));
        values.extend((0..8).map(|_| (0.2 * random.normal()).exp()));
    }

    // The measures, and the run.
    let components = [Quantity::Fy, Quantity::Fz];
    let measures: Vec<Measure> = (0..groups.len())
        .flat_map(|group| components.map(|quantity| (group, quantity)))
        .flat_map(|(group, quantity)| {
            [Statistic::Min, Statistic::Max].map(|statistic| Measure::Load(group, quantity, statistic))
        })
        .collect();
    let batch = Batch::new(base, motion, &changes, &measures, None, 1e-6)?;
    let mut table = vec![0.0; samples * measures.len()];
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let clock = Instant::now();
    let failures = batch.run(samples, &values, threads, &mut table)?;
    let seconds = clock.elapsed().as_secs_f64();

    println!(
        "{samples} samples on {threads} threads in {seconds:.2} s: {:.0} per second",
        samples as f64 / seconds
    );
    for (sample, reason) in &failures {
        println!("sample {sample} has no result: {reason}");
    }
    println!("peak of |Fy|, N       1 %    median      99 %");
    for group in 0..groups.len() {
        let mut peaks: Vec<f64> = table
            .chunks_exact(measures.len())
            .map(|row| f64::max(-row[4 * group], row[4 * group + 1]))
            .filter(|peak| peak.is_finite())
            .collect();
        peaks.sort_unstable_by(f64::total_cmp);
        let at = |part: f64| peaks.get((part * peaks.len() as f64) as usize).copied().unwrap_or(f64::NAN);
        println!("carriage {group}    {:9.0} {:9.0} {:9.0}", at(0.01), at(0.5), at(0.99));
    }
    Ok(())
}

/// Accelerations along x at 1 kHz: accelerate to 1.6 m/s with 2.2 m/s² and 25 m/s³, cruise for a second, decelerate; then the same backwards.
fn there_and_back() -> Vec<[f64; 3]> {
    let ramp = |t: f64, from: f64| {
        let (rise, hold) = (2.2 / 25.0, 1.6 / 2.2);
        f64::max(f64::min(f64::min((t - from) / rise, 1.0), (from + hold + rise - t) / rise), 0.0)
    };
    let at = |t: f64| 2.2 * (ramp(t, 0.6) - ramp(t, 2.415) - ramp(t, 3.831) + ramp(t, 5.646));
    (0..7062).map(|k| [at(1e-3 * k as f64), 0.0, 0.0]).collect()
}

/// Xorshift64* (Vigna 2016).
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        low + (high - low) * bits as f64 / (1u64 << 53) as f64
    }

    /// Box and Muller.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.between(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
        radius * self.between(0.0, std::f64::consts::TAU).cos()
    }
}
