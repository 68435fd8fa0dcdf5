//! A scene from bytes, its rest position, its modes, and a run by each method: refused, or finite throughout.
#![no_main]

use guideload::{
    Control, Excitation, NamedMethod, Output, Part, Scene, Start, State, System, eigenvalues, evaluate,
    link_load, modes,
};
use guideload_fuzz::Source;
use libfuzzer_sys::fuzz_target;
use nalgebra::Vector3;

fuzz_target!(|bytes: &[u8]| {
    let mut source = Source(bytes);
    let (Ok(body), Ok(links)) = (source.sound_body(), source.links()) else { return };
    let gravity = Vector3::new(0.0, -source.number(9.8), 0.0);
    let Ok(scene) = Scene::new(body, &links, gravity, source.free()) else { return };
    let Ok(system) = System::new(&scene) else { return };
    let loads: Vec<_> = (0..links.len()).map(|link| link_load(&system, link, Part::Total)).collect();
    finite(system.static_position().as_slice(), "position at rest");
    for load in &loads {
        finite(&load.at_rest(), "link load at rest");
    }
    let _ = (modes(&system).count(), eigenvalues(&system));
    let samples = source.motion();
    let Ok(excitation) = Excitation::new(&samples.time, &samples.acceleration, samples.wrench.as_deref())
    else {
        return;
    };
    let method = NamedMethod::ALL[source.below(NamedMethod::ALL.len())];
    let control = Control::Adaptive { rtol: [1e-3, 1e-6, 1e-9, source.number(1e-6)][source.below(4)] };
    let start = [Start::AtRest, Start::QuasiStatic][source.below(2)];
    let mut states: Vec<State> = Vec::new();
    if method.run(&system, control, start, &excitation, Output::Samples, &mut states).is_err() {
        return;
    }
    let mut out = vec![0.0; states.len() * loads.len()];
    evaluate(&loads, &states, |k| excitation.input(k), &mut out);
    finite(&out, "link load");
});

fn finite(numbers: &[f64], what: &str) {
    assert!(numbers.iter().all(|x| x.is_finite()), "{what}: {numbers:?}");
}
