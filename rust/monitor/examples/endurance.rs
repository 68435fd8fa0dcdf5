//! Speed and sums over very many periods: `cargo run --release -p guideload-monitor --features prepare --example endurance -- 1e9 f32`;
//! without f32 or f64 both.
//!
//! A motion is repeated. The sums must be those of one repetition times their number; the error is printed for f32 and f64.

use std::ops::ControlFlow;
use std::time::Instant;

use guideload::{
    Body, EquivalentLoad, Free, Link, Part, Scene, SceneError, System, carriage_links, group_load,
};
use guideload_monitor::{
    Exponent, InputSettings, Judgement, Monitor, Motion, Prepared, Real, Settings, prepare,
};
use nalgebra::{Matrix3, Vector3};

const PERIOD: f64 = 1e-3;
/// Periods of one repetition.
const LENGTH: usize = 4096;
/// Second differences that are averaged.
const TAPS: usize = 39;

type Constants<T> = Prepared<T, 10, 4, 48>;

fn constants<T: Real>() -> Result<Constants<T>, Box<dyn std::error::Error>> {
    let inertia = Matrix3::from_diagonal(&Vector3::new(440.0, 420.0, 400.0));
    let body = Body::new(1250.0, Vector3::new(0.08, -0.45, 0.09), inertia)?;
    let centers =
        [[-0.6, -0.55], [0.6, -0.55], [-0.6, 0.55], [0.6, 0.55]].map(|[x, z]| Vector3::new(x, -0.05, z));
    let links = centers
        .iter()
        .map(|center| carriage_links(*center, 0.12, [55e6, 50e6], [10.4e3, 3.1e3]))
        .collect::<Result<Vec<[Link; 4]>, SceneError>>()?;
    let scene = Scene::new(body, links.as_flattened(), Vector3::new(0.0, -9.80665, 0.0), Free::GUIDED)?;
    let system = System::new(&scene)?;
    let judgement =
        Judgement { rule: EquivalentLoad::SUM_OF_FORCES, limit: f64::INFINITY, bin: 500.0, capacity: 0.0 };
    let loads: Vec<_> =
        (0..4).map(|k| (group_load(&system, 4 * k..4 * k + 4, centers[k], Part::Total), judgement)).collect();
    let input = InputSettings {
        ticks: 1,
        tolerance: 0,
        counter_bits: 32,
        most_change: 1000,
        slack: 48,
        still: 16,
        most_missing: 8,
    };
    let taps = [[1.0 / TAPS as f64, -0.5]; TAPS];
    let settings =
        Settings { period: PERIOD, quantum: 2e-5, input, taps: &taps, lag: 20, exponent: Exponent::Ball };
    Ok(prepare(&system, &loads, &settings)?)
}

/// Position in counts and motion, to and fro, of each period of a repetition.
fn motion() -> Vec<(u32, f64, f64)> {
    let rate = std::f64::consts::TAU / (LENGTH as f64 * PERIOD);
    let at = |k: usize| rate * PERIOD * k as f64;
    (0..LENGTH)
        .map(|k| {
            let (position, velocity) = (-2.0 / rate * at(k).cos(), 2.0 * at(k).sin());
            ((position / 2e-5).round() as i32 as u32, velocity, 2.0 * rate * at(k).cos())
        })
        .collect()
}

fn report<T: Real>(name: &str, periods: usize) -> Result<(), Box<dyn std::error::Error>> {
    let (prepared, motion) = (constants::<T>()?, motion());
    let mut monitor = Monitor::<T, 10, 4, 48>::NEW;
    let samples = 4_000_000.min(periods);
    let start = Instant::now();
    let counts = motion.iter().map(|(count, ..)| *count).cycle().take(samples);
    let _ = monitor.push_many(&prepared, (0..).zip(counts), |_, _| ControlFlow::Continue(()));
    println!("{name}: {:.1} million samples/s", samples as f64 / start.elapsed().as_secs_f64() / 1e6);
    let mut monitor = Monitor::<T, 10, 4, 48>::NEW;
    let power =
        |monitor: &Monitor<T, 10, 4, 48>| monitor.totals().carriages.map(|totals| totals.power.value());
    // Two repetitions, until the start is forgotten; then one, as the measure; then all others.
    let repetition = |monitor: &mut Monitor<T, 10, 4, 48>| {
        for &(_, velocity, acceleration) in &motion {
            let (velocity, acceleration) = (T::from_f64(velocity), T::from_f64(acceleration));
            monitor.push_motion(&prepared, Motion { velocity, acceleration });
        }
    };
    repetition(&mut monitor);
    repetition(&mut monitor);
    let mut precise = Monitor::<f64, 10, 4, 48>::NEW;
    let (of_precise, mut before) = (constants::<f64>()?, [0.0; 4]);
    for _ in 0..3 {
        before = precise.totals().carriages.map(|totals| totals.power.value());
        for &(_, velocity, acceleration) in &motion {
            precise.push_motion(&of_precise, Motion { velocity, acceleration });
        }
    }
    let first = power(&monitor);
    let count = periods / LENGTH;
    for _ in 0..count {
        repetition(&mut monitor);
    }
    let mut worst = 0.0_f64;
    for (carriage, (last, first)) in power(&monitor).into_iter().zip(first).enumerate() {
        let once = precise.totals().carriages[carriage].power.value() - before[carriage];
        worst = worst.max(((last - first) / (count as f64 * once) - 1.0).abs());
    }
    println!("{name}: sums over {:.2e} periods right to {worst:.1e}", (count * LENGTH) as f64);
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let periods = std::env::args().nth(1).map_or(Ok(1e7), |text| text.parse::<f64>())? as usize;
    let precision = std::env::args().nth(2);
    for (name, of) in [("f64", report::<f64> as fn(&str, usize) -> _), ("f32", report::<f32>)] {
        if precision.as_deref().is_none_or(|asked| asked == name) {
            of(name, periods)?;
        }
    }
    Ok(())
}
