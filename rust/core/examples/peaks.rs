//! Peak loads of two guides while a body accelerates: `cargo run --example peaks`.

use guideload::{Carriage, Error, Excitation, Machine, MassProperties, modes};

fn main() -> Result<(), Error> {
    // Describe: a body of 1250 kg on two guides, 0.7 m apart; the drive holds x.
    let mut machine = Machine::new(MassProperties {
        mass: 1250.0,
        center_of_mass: [0.12, -0.65, 0.18],
        inertia: [[420.0, 15.0, -8.0], [15.0, 310.0, 22.0], [-8.0, 22.0, 380.0]],
    })?;
    let guide = Carriage {
        length: 0.6,
        stiffness_y: 120e6,
        stiffness_z: 120e6,
        damping_y: 100e3,
        damping_z: 100e3,
        ..Carriage::default()
    };
    let left = machine.add(guide.at([0.0, 0.05, -0.35]))?;
    let right = machine.add(guide.at([0.0, 0.05, 0.35]))?;
    let simulation = machine.assemble()?;

    // The motion: acceleration along x every millisecond, to 2.2 m/s² in 88 ms.
    let motion: Vec<[f64; 3]> = (0..1000).map(|k| [f64::min(k as f64 / 88.0, 1.0) * 2.2, 0.0, 0.0]).collect();
    let extremes = simulation.extremes(&Excitation::uniform(0.0, 1e-3, &motion)?)?;

    // Print the modes and the peaks.
    for mode in modes(simulation.system()) {
        let hertz = mode.frequency / std::f64::consts::TAU;
        println!("mode {hertz:6.1} Hz, damping ratio {:.3}", mode.damping_ratio);
    }
    for (name, guide) in [("left", left), ("right", right)] {
        let peak = extremes[guide].resultant.largest;
        println!("{name} guide: largest y-z load {:.0} N at {:.3} s", peak.value, peak.time);
    }
    Ok(())
}
