//! The yardstick scenes, the motion `cycle`, and helpers of all tests.

use guideload::{
    Axial, Body, Control, EquivalentLoad, Exact, Excitation, Free, Interval, Law, Link, Method, Output, Part,
    Preload, ReferenceMotion, RunError, Scene, State, Summary, System, Wrench, acceleration, carriage_links,
    evaluate, group_load, link_load, position, run, velocity,
};
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3, Vector6};

pub const GRAVITY: Vector3<f64> = Vector3::new(0.0, -9.80665, 0.0);

/// A scene that owns its links.
#[derive(Clone)]
pub struct Machine {
    pub body: Body,
    pub links: Vec<Link>,
    pub gravity: Vector3<f64>,
    pub free: Free,
}

impl Machine {
    pub fn scene(&self) -> Scene<'_> {
        Scene::new(self.body, &self.links, self.gravity, self.free).expect("a sound scene")
    }

    pub fn system(&self) -> System {
        System::new(&self.scene()).expect("a supported body")
    }

    /// The machine with the damping of every link times `factor`, and the same laws.
    pub fn with_damping(mut self, factor: f64) -> Self {
        for link in &mut self.links {
            *link = remade(link, link.point(), link.direction(), *link.law(), link.damping() * factor);
        }
        self
    }

    /// The machine with dampers of `factor` s times the stiffness of their links.
    pub fn with_proportional_damping(mut self, factor: f64) -> Self {
        for link in &mut self.links {
            *link = remade(link, link.point(), link.direction(), *link.law(), factor * link.stiffness());
        }
        self
    }

    /// The machine with other laws, without offsets, and with dampers that always act; `law` receives the index and the stiffness of each
    /// link.
    pub fn with_laws(mut self, mut law: impl FnMut(usize, f64) -> Law) -> Self {
        for (i, link) in self.links.iter_mut().enumerate() {
            let law = law(i, link.stiffness());
            *link =
                Link::with_law(link.point(), link.direction(), law, link.damping()).expect("a sound link");
        }
        self
    }

    /// The machine with dampers that act only outside of the clearances.
    pub fn damped_in_contact(mut self) -> Self {
        for link in &mut self.links {
            *link = link.damped_in_contact().expect("a clearance");
        }
        self
    }

    /// The machine with its body and its links moved by `by` m from L.
    pub fn moved(mut self, by: Vector3<f64>) -> Self {
        let body = &self.body;
        self.body = Body::new(body.mass(), body.center_of_mass() + by, body.inertia()).expect("a body");
        for link in &mut self.links {
            *link = remade(link, link.point() + by, link.direction(), *link.law(), link.damping());
        }
        self
    }

    pub fn with_free(mut self, free: Free) -> Self {
        self.free = free;
        self
    }

    /// Load of each link as rows of a state.
    pub fn link_loads<'a>(&self, system: &'a System) -> Vec<Axial<'a>> {
        (0..self.links.len()).map(|link| link_load(system, link, Part::Total)).collect()
    }

    /// Force and moment about the origin of all links.
    pub fn guide_load<'a>(&self, system: &'a System) -> Wrench<'a> {
        group_load(system, 0..self.links.len(), Vector3::zeros(), Part::Total)
    }

    /// Runs and stores every state; returns the summary or the error.
    pub fn run<M: Method>(
        &self,
        method: &M,
        control: Control,
        excitation: &Excitation,
        output: Output,
    ) -> (Vec<State>, Result<Summary, RunError>) {
        let mut states: Vec<State> = Vec::new();
        let outcome = run(&self.system(), method, control, excitation, output, &mut states);
        (states, outcome)
    }

    /// As [`Machine::run`], for a run that must succeed at the samples.
    pub fn states<M: Method>(
        &self,
        method: &M,
        control: Control,
        excitation: &Excitation,
    ) -> (Vec<State>, Summary) {
        let (states, outcome) = self.run(method, control, excitation, Output::Samples);
        (states, outcome.expect("a run that succeeds"))
    }

    /// Link loads at the samples by the exact method, instant after instant, N.
    pub fn exact_loads(&self, excitation: &Excitation) -> Vec<f64> {
        let (states, _) = self.states(&Exact, ADAPTIVE, excitation);
        self.loads_of(&states)
    }

    /// Link loads of given states, instant after instant, N.
    pub fn loads_of(&self, states: &[State]) -> Vec<f64> {
        let system = self.system();
        let loads = self.link_loads(&system);
        let mut out = vec![0.0; states.len() * loads.len()];
        evaluate(&loads, states, |_| [0.0; 9], &mut out);
        out
    }
}

/// The link with another place, law and damping; its offset stays, and its damper acts in contact only if it did before.
pub fn remade(link: &Link, point: Vector3<f64>, direction: Vector3<f64>, law: Law, damping: f64) -> Link {
    let made =
        Link::with_law(point, direction, law, damping).and_then(|made| made.with_offset(link.offset()));
    let in_contact = link.is_damped_in_contact();
    made.and_then(|made| if in_contact { made.damped_in_contact() } else { Ok(made) }).expect("a sound link")
}

/// A control for the exact method, which ignores it.
pub const ADAPTIVE: Control = Control::Adaptive { rtol: 1e-6 };

/// Control of the steps by a tolerance.
pub const fn adaptive(rtol: f64) -> Control {
    Control::Adaptive { rtol }
}

/// Exponents of the laws of preloaded balls and rollers.
pub const BALL: f64 = 1.5;
pub const ROLLER: f64 = 10.0 / 9.0;

pub fn linear(stiffness: f64) -> Law {
    Law::linear(stiffness).expect("a law")
}

pub fn sided(positive: f64, negative: f64, clearance: f64) -> Law {
    Law::sided(positive, negative, clearance).expect("a law")
}

pub fn preloaded(stiffness: f64, preload: f64, exponent: f64) -> Law {
    Law::preloaded(stiffness, preload, exponent).expect("a law")
}

pub fn curve(points: &[[f64; 2]]) -> Law {
    Law::curve(points).expect("a law")
}

/// Points of a curve with a gap and harder ends, m and N.
pub const CURVE: [[f64; 2]; 5] = [[-3e-5, -2000.0], [-4e-6, 0.0], [3e-6, 0.0], [2e-5, 900.0], [4e-5, 3000.0]];

/// The body of the yardstick.
pub fn body() -> Body {
    let inertia = Matrix3::new(420.0, 15.0, -8.0, 15.0, 310.0, 22.0, -8.0, 22.0, 380.0);
    Body::new(1250.0, Vector3::new(0.12, -0.65, 0.18), inertia).expect("a body")
}

/// Centres of the carriages of `cart`.
pub const CART_CENTERS: [[f64; 3]; 4] =
    [[-0.5, 0.05, -0.35], [-0.5, 0.05, 0.35], [0.5, 0.05, -0.35], [0.5, 0.05, 0.35]];

fn guided(centers: &[[f64; 3]], length: f64, damping: f64, free: Free) -> Machine {
    let links = centers
        .iter()
        .flat_map(|&center| {
            carriage_links(Vector3::from(center), length, [1.2e8; 2], [2.0 * damping; 2]).expect("a carriage")
        })
        .collect();
    Machine { body: body(), links, gravity: GRAVITY, free }
}

/// Yardstick `cart`: 16 links, five free degrees of freedom.
pub fn cart() -> Machine {
    guided(&CART_CENTERS, 0.12, 5e4, Free::GUIDED)
}

/// Yardstick `cart-stiff`: `cart` overdamped.
pub fn cart_stiff() -> Machine {
    guided(&CART_CENTERS, 0.12, 2e6, Free::GUIDED)
}

/// `cart` with a clearance of 5 um in all links.
pub fn cart_clear() -> Machine {
    cart().with_laws(|_, k| sided(k, k, 5e-6))
}

/// `cart` on preloaded balls.
pub fn preloaded_cart() -> Machine {
    cart().with_laws(|_, k| preloaded(k, 600.0, BALL))
}

/// Yardstick `paper`: the two carriages and the three rotations of the paper's section 4.1.
pub fn paper() -> Machine {
    guided(&[[0.0, 0.05, -0.35], [0.0, 0.05, 0.35]], 0.6, 5e4, Free::PAPER)
}

/// One vertical link under a body that moves along y only: x'' + (b/m) x' + (k/m) x = -a_y, 100 kg.
pub fn one_dof(frequency: f64, damping_ratio: f64) -> Machine {
    let mass = 100.0;
    let body = Body::new(mass, Vector3::zeros(), Matrix3::identity()).expect("a body");
    let (k, b) = (mass * frequency * frequency, 2.0 * damping_ratio * mass * frequency);
    let links = vec![Link::new(Vector3::zeros(), Vector3::y(), k, b).expect("a link")];
    Machine { body, links, gravity: GRAVITY, free: Free::only(&[guideload::Dof::Y]) }
}

/// A body on twelve links at random points in random directions, with six free degrees of freedom.
pub fn random_machine(random: &mut Random) -> Machine {
    let skewed = Matrix3::from_fn(|_, _| random.between(-0.3, 0.3));
    let inertia = (Matrix3::identity() + skewed * skewed.transpose()) * random.between(50.0, 500.0);
    let body = Body::new(random.between(200.0, 2000.0), random.vector(0.5), inertia).expect("a body");
    let links = (0..12)
        .map(|_| {
            let (k, b) = (random.between(1e6, 1e8), random.between(1e3, 1e5));
            Link::new(random.vector(0.7), random.vector(1.0), k, b).expect("a link")
        })
        .collect();
    Machine { body, links, gravity: random.vector(10.0), free: Free::ALL }
}

/// [`random_machine`] on all kinds of piecewise linear laws, some without stiffness to one side, some damped only in contact.
pub fn any_machine(random: &mut Random) -> Machine {
    let machine = random_machine(random);
    let weight = machine.body.mass() * machine.gravity.norm();
    let mut machine = machine.with_laws(|i, k| {
        let sag = weight / k;
        let gap = sag * random.between(0.05, 0.5);
        match i % 6 {
            0 => sided(k, k, gap),
            1 => sided(k, 0.0, gap),
            2 => sided(0.0, k, gap),
            3 => sided(k, 0.3 * k, 0.0),
            4 => {
                let points = [[-2.0, -1.5], [-0.5, -0.6], [-0.2, 0.0], [0.1, 0.0], [0.3, 0.5], [1.0, 2.0]];
                curve(&points.map(|[d, f]| [d * sag, f * k * sag]))
            }
            _ => linear(k),
        }
    });
    for link in &mut machine.links[..3] {
        *link = link.damped_in_contact().expect("a clearance");
    }
    machine
}

/// The motion `cycle`: acceleration along x of a there-and-back jerk-limited move at 1 kHz, 7 062 samples.
pub fn cycle() -> Vec<[f64; 3]> {
    let (v, a, jerk) = (1.6, 2.2, 25.0);
    let mut knots = vec![(0.0, 0.0), (0.6, 0.0)];
    let mut now = 0.6;
    let mut add = |length: f64, end: f64| {
        now += length;
        knots.push((now, end));
    };
    for forth in [a, -a] {
        for (change, rest) in [(forth, 1.0), (-forth, 0.6)] {
            add(a / jerk, change);
            add(v / a - a / jerk, change);
            add(a / jerk, 0.0);
            add(rest, 0.0);
        }
    }
    let count = (now * 1000.0 + 1e-6) as usize + 1;
    let mut segment = 0;
    (0..count)
        .map(|k| {
            let t = k as f64 / 1000.0;
            while segment + 2 < knots.len() && t > knots[segment + 1].0 {
                segment += 1;
            }
            let ((t0, a0), (t1, a1)) = (knots[segment], knots[segment + 1]);
            [a0 + (a1 - a0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0), 0.0, 0.0]
        })
        .collect()
}

/// Random accelerations along all three axes.
pub fn noise(random: &mut Random, count: usize) -> Vec<[f64; 3]> {
    (0..count).map(|_| random.vector(3.0).into()).collect()
}

/// Random external loads along and about all three axes.
pub fn wrenches(random: &mut Random, count: usize, size: f64) -> Vec<[f64; 6]> {
    (0..count).map(|_| core::array::from_fn(|_| random.between(-size, size))).collect()
}

/// Times at equal intervals from zero on.
pub fn ticks(count: usize, step: f64) -> Vec<f64> {
    (0..count).map(|k| k as f64 * step).collect()
}

/// Largest magnitude.
pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, x| f64::max(most, x.abs()))
}

/// Largest difference.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |most, (a, b)| {
        assert!(a.is_finite() && b.is_finite());
        f64::max(most, (a - b).abs())
    })
}

/// Fails unless `got` is within `tolerance` of `want`, both of the size `scale`.
#[track_caller]
pub fn close(got: f64, want: f64, tolerance: f64, scale: f64) {
    assert!(
        (got - want).abs() <= tolerance * scale,
        "got {got}, want {want}: off by {:e} of {scale}, allowed {tolerance:e}",
        (got - want).abs() / scale
    );
}

/// As [`close`] for histories, relative to the largest of `want`; returns the relative difference.
#[track_caller]
pub fn alike(got: &[f64], want: &[f64], tolerance: f64) -> f64 {
    let off = difference(got, want) / largest(want);
    assert!(off <= tolerance, "off by {off:e}, allowed {tolerance:e}");
    off
}

/// Rows and columns of the free degrees of freedom.
pub fn free_block(matrix: &Matrix6<f64>, free: Free) -> DMatrix<f64> {
    let dofs: Vec<usize> = free.iter().map(|dof| dof as usize).collect();
    DMatrix::from_fn(dofs.len(), dofs.len(), |i, j| matrix[(dofs[i], dofs[j])])
}

/// A wrench at one state without excitation.
pub fn at(wrench: &Wrench, state: &State) -> Vector6<f64> {
    Vector6::from(wrench.at(state, &[0.0; 9]))
}

/// Xorshift64* (Vigna 2016): the same numbers on every machine.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        low + (high - low) * bits as f64 / (1u64 << 53) as f64
    }

    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.between(-size, size))
    }
}

/// Rules of the equivalent load: the plain sum of forces; two groups with moments and a lift factor; and such ones with a preload, N.
pub fn rules() -> [EquivalentLoad; 6] {
    let mut weights = [[[0.0; 2]; 5]; 2];
    weights[0][0] = [1.3, 1.0];
    weights[1][1] = [0.9; 2];
    (weights[0][2], weights[1][3], weights[0][4]) = ([4.0; 2], [7.0; 2], [5.0; 2]);
    let two = EquivalentLoad { weights, minor: 0.6, preload: Preload::None };
    let [power, linear] = [Preload::Power(900.0), Preload::Linear(900.0)];
    let [balls, rollers] = [Preload::Balls(900.0), Preload::Rollers(900.0)];
    [
        EquivalentLoad::SUM_OF_FORCES,
        two,
        EquivalentLoad { preload: power, ..two },
        EquivalentLoad { preload: linear, minor: 1.0, ..two },
        EquivalentLoad { preload: balls, ..two },
        EquivalentLoad { preload: rollers, minor: 1.0, ..two },
    ]
}

/// Nodes and weights of Gauss and Legendre on the interval from -1 to 1, of one sign.
const GAUSS: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_3],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_5],
    [0.960_289_856_497_536_2, 0.101_228_536_290_376_3],
];

/// By how much the mean of each load in each interval between samples differs from that of its values at both ends, on the exact solution.
/// Quadrature of 1e-13 up to 400 Hz: four radians between the ends of a part.
pub fn exact_bows(
    system: &System,
    excitation: &Excitation,
    loads: &[Wrench],
    states: &[State],
) -> Vec<Vec<[f64; 6]>> {
    let parts = |k: usize| (600.0 * excitation.interval(k)).ceil() as usize;
    let intervals = 0..states.len() - 1;
    let mut times = Vec::new();
    for k in intervals.clone() {
        let half = 0.5 * excitation.interval(k) / parts(k) as f64;
        for part in 0..parts(k) {
            let middle = excitation.time(k) + (2 * part + 1) as f64 * half;
            times.extend(GAUSS.iter().rev().map(|[node, _]| middle - half * node));
            times.extend(GAUSS.iter().map(|[node, _]| middle + half * node));
        }
    }
    let mut between: Vec<State> = Vec::new();
    run(system, &Exact, ADAPTIVE, excitation, Output::Times(&times), &mut between).expect("a run");
    let bows = |load: &Wrench| {
        let at = |state: &State| load.at(state, &[0.0; 9]);
        let mut between = between.iter();
        let bow = |k: usize| {
            let (first, last) = (at(&states[k]), at(&states[k + 1]));
            let mut bow: [f64; 6] = std::array::from_fn(|i| -0.5 * (first[i] + last[i]));
            if parts(k) == 0 {
                return [0.0; 6];
            }
            for _ in 0..parts(k) {
                for [_, weight] in GAUSS.iter().rev().chain(&GAUSS) {
                    let value = at(between.next().expect("a state at each time"));
                    for i in 0..6 {
                        bow[i] += 0.5 * weight / parts(k) as f64 * value[i];
                    }
                }
            }
            bow
        };
        intervals.clone().map(bow).collect()
    };
    loads.iter().map(bows).collect()
}

/// The same by the polynomials of [`ReferenceMotion`], for any scene.
pub fn polynomial_bows(
    system: &System,
    excitation: &Excitation,
    loads: &[Wrench],
    states: &[State],
) -> Vec<Vec<[f64; 6]>> {
    let of = |quantity: &Wrench| -> Vec<[f64; 6]> {
        states.iter().enumerate().map(|(k, state)| quantity.at(state, &excitation.input(k))).collect()
    };
    let time: Vec<f64> = (0..states.len()).map(|k| excitation.time(k)).collect();
    let (position, velocity, acceleration) =
        (of(&position(system)), of(&velocity(system)), of(&acceleration(system)));
    let motion = ReferenceMotion {
        time: &time,
        position: &position,
        velocity: &velocity,
        acceleration: &acceleration,
    };
    let bows = |load| {
        let mut bows = vec![0.0; 6 * (states.len() - 1)];
        assert!(motion.load_bows(system, std::slice::from_ref(load), &mut bows));
        bows.as_chunks::<6>().0.to_vec()
    };
    loads.iter().map(bows).collect()
}

/// Mean load over the distance, interval by interval, and largest load at the samples; the mean is NaN for a motion that does not move.
/// `bows`: by how much the mean of each load in each interval differs from that of its ends.
pub fn mean_and_largest(
    [mean, largest]: [EquivalentLoad; 2],
    excitation: &Excitation,
    [velocity, acceleration]: [&[f64]; 2],
    exponent: f64,
    loads: &[[f64; 6]],
    bows: &[[f64; 6]],
) -> [f64; 2] {
    let components = |k: usize| -> [f64; 5] { std::array::from_fn(|component| loads[k][1 + component]) };
    let line = |k: usize, interval: usize| -> [f64; 5] {
        std::array::from_fn(|component| loads[k][1 + component] + bows[interval][1 + component])
    };
    let (mut power, mut path) = (0.0, 0.0);
    for k in 1..loads.len() {
        let travel = Interval {
            length: excitation.interval(k - 1),
            velocity: [velocity[k - 1], velocity[k]],
            acceleration: [acceleration[k - 1], acceleration[k]],
        };
        let found = mean.integrals(exponent, &travel, [&line(k - 1, k - 1), &line(k, k - 1)]);
        (power, path) = (power + found.power, path + found.path);
    }
    let peak = (0..loads.len()).map(|k| largest.of(&components(k))).fold(0.0, f64::max);
    [(power / path).powf(1.0 / exponent), peak]
}
