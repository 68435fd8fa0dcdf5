//! Peak loads of two guides while a body accelerates: `cargo run --example peaks`.

use std::error::Error;

use guideload::{
    Body, Control, Exact, Excitation, Extremes, Free, Output, Part, Peaks, Scene, System, carriage_links,
    group_load, modes, run,
};
use nalgebra::{Matrix3, Vector3};

fn main() -> Result<(), Box<dyn Error>> {
    // Describe: a body of 1250 kg on two guides, 0.7 m apart; the drive holds x.
    let inertia = Matrix3::new(420.0, 15.0, -8.0, 15.0, 310.0, 22.0, -8.0, 22.0, 380.0); // kg m²
    let body = Body::new(1250.0, Vector3::new(0.12, -0.65, 0.18), inertia)?;
    let centers = [-0.35, 0.35].map(|z| Vector3::new(0.0, 0.05, z));
    let (stiffness, damping) = ([120e6; 2], [100e3; 2]); // N/m and N s/m of a carriage along y and z
    let guides = [
        carriage_links(centers[0], 0.6, stiffness, damping)?,
        carriage_links(centers[1], 0.6, stiffness, damping)?,
    ];
    let gravity = Vector3::new(0.0, -9.80665, 0.0);
    let scene = Scene::new(body, guides.as_flattened(), gravity, Free::GUIDED)?;

    // The motion: acceleration along x every millisecond, to 2.2 m/s² in 88 ms.
    let motion: Vec<[f64; 3]> = (0..1000).map(|k| [f64::min(k as f64 / 88.0, 1.0) * 2.2, 0.0, 0.0]).collect();
    let excitation = Excitation::uniform(0.0, 1e-3, &motion)?;

    // Solve, and store only the extremes of the load of each guide.
    let system = System::new(&scene)?;
    let loads = [0, 1].map(|guide| {
        let links = 4 * guide..4 * guide + 4;
        group_load(&system, links, centers[guide], Part::Total)
    });
    let mut extremes = [Extremes::NONE; 2];
    let control = Control::Adaptive { rtol: 1e-6 };
    let mut peaks = Peaks::new(&loads, &mut extremes);
    run(&system, &Exact::<1>, control, &excitation, Output::Samples, &mut peaks)?;

    // Print the modes and the peaks.
    for mode in modes(&system) {
        let hertz = mode.frequency / std::f64::consts::TAU;
        println!("mode {hertz:6.1} Hz, damping ratio {:.3}", mode.damping_ratio);
    }
    for (guide, extremes) in extremes.iter().enumerate() {
        let (peak, time) = (extremes.largest[6], extremes.time_of_largest[6]);
        println!("guide {guide}: largest y-z load {peak:.0} N at {time:.3} s");
    }
    Ok(())
}
