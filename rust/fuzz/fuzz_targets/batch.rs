//! A batch from bytes: refused, or finite but for samples that are told as failed, and the same bits at any width.
#![no_main]

use guideload::batch::{Base, Batch, Change, Group, Measure, Motion, NominalBody, Target, Width};
use guideload::{Excitation, LawParameter, NamedMethod};
use guideload_fuzz::Source;
use libfuzzer_sys::fuzz_target;
use nalgebra::Vector3;

const PARAMETERS: [&str; 6] =
    ["stiffness", "positive_stiffness", "negative_stiffness", "clearance", "preload", "scale"];
const MEASURES: [(&str, &str); 5] =
    [("Fx", "min"), ("Mz", "rms"), ("resultant", "max"), ("resultant", "time_of_max"), ("contact", "lost")];

fuzz_target!(|bytes: &[u8]| {
    let mut source = Source(bytes);
    let (mass, center_of_mass, inertia) = source.body();
    let Ok(links) = source.links() else { return };
    let half = links.len() / 2;
    let groups =
        [(0..half).collect(), (half..links.len()).collect()].map(|links| Group::new(links, source.point()));
    let inertia_about_reference = source.chance(32);
    let base = Base {
        body: NominalBody { mass, center_of_mass, inertia, inertia_about_reference },
        links: &links,
        gravity: Vector3::new(0.0, -source.number(9.8), 0.0),
        free: source.free(),
        base_compliance: None,
        groups: &groups,
        payloads: &[],
    };
    let samples = source.motion();
    let Ok(excitation) = Excitation::new(&samples.time, &samples.acceleration, samples.wrench.as_deref())
    else {
        return;
    };
    let motion = Motion { excitation, speed: None, exponent: 3.0 };
    let changes: Vec<Change> = (0..source.below(3)).map(|_| change(&mut source, links.len())).collect();
    let measures: Vec<Measure> = (0..1 + source.below(3))
        .filter_map(|_| {
            let (quantity, statistic) = MEASURES[source.below(MEASURES.len())];
            Measure::from_names(quantity, source.below(2), statistic)
        })
        .collect();
    let method = NamedMethod::ALL.get(source.below(1 + NamedMethod::ALL.len())).copied();
    let Ok(batch) = Batch::new(base, motion, &changes, &measures, method, 1e-6) else { return };
    let count = 1 + source.below(5);
    let values: Vec<f64> = (0..count * batch.columns()).map(|_| source.number(1.0)).collect();
    let found = [Width::Widest, Width::One].map(|width| {
        let mut out = vec![0.0; count * measures.len()];
        let failed = batch.clone().with_width(width).run(count, &values, 1, &mut out).expect("lengths agree");
        (out, failed.into_iter().map(|(sample, _)| sample).collect::<Vec<_>>())
    });
    let [(out, failed), (other, other_failed)] = &found;
    assert_eq!(failed, other_failed, "failed samples by width");
    for (sample, (row, same)) in out.chunks(measures.len()).zip(other.chunks(measures.len())).enumerate() {
        if !failed.contains(&sample) {
            assert!(row.iter().all(|x| x.is_finite()), "sample {sample}: {row:?}");
            assert_eq!(row, same, "bits by width, sample {sample}");
        }
    }
});

fn change(source: &mut Source, links: usize) -> Change {
    let (link, axis) = (source.below(links + 1), source.below(4));
    let (target, typical) = match source.below(9) {
        0 => (Target::Mass, 1e3),
        1 => (Target::CenterOfMass(axis), 0.1),
        2 => (Target::Inertia(axis, source.below(3)), 100.0),
        3 => (Target::Gravity(axis), 9.8),
        4 => (Target::Point { link, axis }, 1.0),
        5 => (Target::Damping(link), 1e4),
        6 => (Target::Center { group: source.below(3), axis }, 0.1),
        7 => (Target::Acceleration, 1.0),
        _ => {
            let name = PARAMETERS[source.below(PARAMETERS.len())];
            let parameter = LawParameter::from_name(name).expect("a parameter of a law");
            (Target::Law { link, parameter }, if name == "scale" { 1.0 } else { 1e6 })
        }
    };
    let terms = (0..source.below(3)).map(|_| (source.below(3), source.number(0.1 * typical))).collect();
    Change { target, constant: source.number(typical), terms }
}
