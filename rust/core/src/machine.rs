//! The short way: a machine by named values, its loads by carriage, and the method chosen for it.
//!
//! A [`Machine`] is described and assembled to a [`Simulation`], which gives the loads of its carriages at rest, their extremes under an
//! excitation, or at every sample, and a [`Live`] step for a controller. It adds nothing to the functions below it but names:
//! [`Simulation::system`] leads to all of them.

use core::ops::Index;

use nalgebra::{Matrix3, Vector3};

use crate::error::{RunError, SceneError};
use crate::excitation::{Excitation, with_enough_samples};
use crate::integrate::{Control, NamedMethod, Output, Start};
use crate::model::{Body, Free, Law, Link, Scene, carriage_ends};
use crate::numeric::bounded_vec::{BoundedVec, MAX_LINKS};
use crate::numeric::float::sqrt;
use crate::output::{Extremes, Part, Peaks, Record, Wrench, group_load};
use crate::system::{Input, ModelLevel, NO_INPUT, State, System};

/// Links of a carriage.
const LINKS: usize = 4;

/// Most carriages without an allocator.
const MAX_CARRIAGES: usize = MAX_LINKS / LINKS;

/// Default of [`Simulation::with_tolerance`].
const TOLERANCE: f64 = 1e-6;

/// Mass properties of the body that the carriages bear, about the point L at which the drive acts and motion is given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MassProperties {
    /// kg.
    pub mass: f64,
    /// Centre of mass from L: x along the rails, y and z across, m.
    pub center_of_mass: [f64; 3],
    /// Inertia tensor about the centre of mass, kg m² (eq. 10 of the paper).
    pub inertia: [[f64; 3]; 3],
}

/// A carriage: a spring and a damper along y and along z at each of its two ends, with half of the values of the carriage.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Carriage {
    /// Centre from L, m. Loads are about it.
    pub center: [f64; 3],
    /// Distance of its two ends along the rail, m: with it the carriage resists moments about y and z.
    pub length: f64,
    /// Stiffness along y, N/m, unless there is a `law_y`.
    pub stiffness_y: f64,
    /// Stiffness along z, N/m, unless there is a `law_z`.
    pub stiffness_z: f64,
    /// Damping along y, N s/m.
    pub damping_y: f64,
    /// Damping along z, N s/m.
    pub damping_z: f64,
    /// Elastic law along y, if it is no straight line: clearance, preload, a curve.
    pub law_y: Option<Law>,
    /// Elastic law along z, if it is no straight line.
    pub law_z: Option<Law>,
}

impl Carriage {
    /// The same carriage at another centre, m from L.
    #[must_use]
    pub fn at(self, center: [f64; 3]) -> Self {
        Self { center, ..self }
    }
}

/// A carriage of a machine, given by [`Machine::add`]: the index of what there is [`PerCarriage`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CarriageId(usize);

/// A value for each carriage of a machine, in the order in which they were added.
#[derive(Debug, Clone)]
pub struct PerCarriage<T>(BoundedVec<T, MAX_CARRIAGES>);

impl<T> PerCarriage<T> {
    /// The value of each of the `count` carriages of a machine.
    pub(crate) fn new(count: usize, value: impl Fn(usize) -> T) -> Self {
        match BoundedVec::from_fn(count, value) {
            Ok(places) => Self(places),
            Err(_) => unreachable!("no more than the carriages of a machine"),
        }
    }

    /// The values, in the order of the carriages.
    pub fn as_slice(&self) -> &[T] {
        self.0.as_slice()
    }

    /// The values, in the order of the carriages.
    pub(crate) fn as_mut_slice(&mut self) -> &mut [T] {
        self.0.as_mut_slice()
    }

    /// The values, in the order of the carriages.
    pub fn iter(&self) -> core::slice::Iter<'_, T> {
        self.as_slice().iter()
    }
}

/// # Panics
/// If the carriage is one of another machine, with more carriages.
impl<T> Index<CarriageId> for PerCarriage<T> {
    type Output = T;

    fn index(&self, carriage: CarriageId) -> &T {
        &self.as_slice()[carriage.0]
    }
}

/// Load of the body on a carriage about its centre, with its damping part, in the axes of the machine (section 3.6 of the paper).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Load<T = f64> {
    /// Force along y, N.
    pub fy: T,
    /// Force along z, N.
    pub fz: T,
    /// Moment about x (roll), N m.
    pub mx: T,
    /// Moment about y (yaw), N m.
    pub my: T,
    /// Moment about z (pitch), N m.
    pub mz: T,
}

impl<T: Copy + Into<f64>> Load<T> {
    pub(crate) fn of([fy, fz, mx, my, mz]: [T; 5]) -> Self {
        Self { fy, fz, mx, my, mz }
    }

    pub(crate) fn is_finite(&self) -> bool {
        [self.fy, self.fz, self.mx, self.my, self.mz].into_iter().all(|entry| entry.into().is_finite())
    }

    /// Magnitude of the force, N.
    pub fn resultant(&self) -> f64 {
        let (y, z) = (self.fy.into(), self.fz.into());
        sqrt(y * y + z * z)
    }
}

/// A value and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// N or N m.
    pub value: f64,
    /// s.
    pub time: f64,
}

/// Smallest and largest value of a quantity over a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The smallest value.
    pub smallest: Peak,
    /// The largest value.
    pub largest: Peak,
}

/// Extremes of the load of a carriage over a run, between samples too, but for the smallest resultant and the smallest moment; the quantities
/// are those of [`Load`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadExtremes {
    /// Force along y, N.
    pub fy: Range,
    /// Force along z, N.
    pub fz: Range,
    /// Moment about x (roll), N m.
    pub mx: Range,
    /// Moment about y (yaw), N m.
    pub my: Range,
    /// Moment about z (pitch), N m.
    pub mz: Range,
    /// Magnitude of the force, N.
    pub resultant: Range,
    /// Magnitude of the moment, N m.
    pub moment: Range,
}

impl From<&Extremes> for LoadExtremes {
    fn from(of: &Extremes) -> Self {
        let range = |k: usize| Range {
            smallest: Peak { value: of.smallest[k], time: of.time_of_smallest[k] },
            largest: Peak { value: of.largest[k], time: of.time_of_largest[k] },
        };
        let [fy, fz, mx, my, mz, resultant, moment] = [1, 2, 3, 4, 5, 6, 7].map(range);
        Self { fy, fz, mx, my, mz, resultant, moment }
    }
}

/// A machine: a body on carriages under gravity, free but along x, where its drive holds it.
#[derive(Debug, Clone)]
pub struct Machine {
    body: Body,
    gravity: Vector3<f64>,
    free: Free,
    links: BoundedVec<Link>,
    centers: BoundedVec<Vector3<f64>, MAX_CARRIAGES>,
}

impl Machine {
    /// A body without carriages, under standard gravity of 9.80665 m/s² against y.
    ///
    /// # Errors
    /// As [`Body::new`].
    pub fn new(body: MassProperties) -> Result<Self, SceneError> {
        let MassProperties { mass, center_of_mass, inertia } = body;
        // Rows or columns: an asymmetric tensor is refused.
        let inertia = Matrix3::from_fn(|row, column| inertia[row][column]);
        let body = Body::new(mass, center_of_mass.into(), inertia)?;
        let gravity = Vector3::new(0.0, -9.80665, 0.0);
        let links = BoundedVec::new(Link::new(Vector3::zeros(), Vector3::y(), 1.0, 0.0)?, 0)?;
        Ok(Self { body, gravity, free: Free::GUIDED, links, centers: BoundedVec::new(gravity, 0)? })
    }

    /// The machine under another gravity: x y z, m/s², pointing down.
    #[must_use]
    pub fn with_gravity(self, gravity: [f64; 3]) -> Self {
        Self { gravity: gravity.into(), ..self }
    }

    /// The machine with other degrees of freedom of L.
    #[must_use]
    pub fn with_free(self, free: Free) -> Self {
        Self { free, ..self }
    }

    /// Adds a carriage.
    ///
    /// # Errors
    /// [`SceneError::Carriage`] for a negative or non-finite number; as [`Link::with_law`]; without `std` [`SceneError::TooManyLinks`] for
    /// the ninth carriage.
    pub fn add(&mut self, carriage: Carriage) -> Result<CarriageId, SceneError> {
        let index = self.centers.as_slice().len();
        if !cfg!(feature = "std") && index == MAX_CARRIAGES {
            return Err(SceneError::TooManyLinks { max: MAX_LINKS, got: MAX_LINKS + LINKS });
        }
        let Carriage { center, length, stiffness_y, stiffness_z, damping_y, damping_z, law_y, law_z } =
            carriage;
        for (field, unit, got) in [
            ("length", "m", length),
            ("stiffness_y", "N/m", stiffness_y),
            ("stiffness_z", "N/m", stiffness_z),
            ("damping_y", "N s/m", damping_y),
            ("damping_z", "N s/m", damping_z),
        ] {
            if !(got >= 0.0 && got.is_finite()) {
                return Err(SceneError::Carriage { index, field, unit, got });
            }
        }
        let half = |law: Option<Law>, stiffness| {
            law.map_or_else(|| Law::linear(stiffness / 2.0), |law| law.scaled(0.5))
        };
        let (laws, damping) =
            ([half(law_y, stiffness_y)?, half(law_z, stiffness_z)?], [damping_y, damping_z]);
        let ends = carriage_ends(center.into(), length);
        let link = |k: usize| Link::with_law(ends[k].0, ends[k].1, laws[k % 2], damping[k % 2] / 2.0);
        for link in [link(0)?, link(1)?, link(2)?, link(3)?] {
            self.links.push(link);
        }
        self.centers.push(center.into());
        Ok(CarriageId(index))
    }

    /// Finds the equilibrium and the modes.
    ///
    /// # Errors
    /// As [`Scene::new`] and [`System::new`]: a machine without carriages, or one that they do not support.
    pub fn assemble(&self) -> Result<Simulation, SceneError> {
        let scene = Scene::new(self.body, self.links.as_slice(), self.gravity, self.free)?;
        Ok(Simulation { system: System::new(&scene)?, centers: self.centers.clone(), tolerance: TOLERANCE })
    }
}

/// A machine that is ready to run.
#[derive(Debug, Clone)]
pub struct Simulation {
    system: System,
    centers: BoundedVec<Vector3<f64>, MAX_CARRIAGES>,
    tolerance: f64,
}

impl Simulation {
    /// The simulation with another relative tolerance of the link loads than 1e-6, 1e-13 to 0.1. It counts for preloaded carriages alone:
    /// others are run without a step error.
    #[must_use]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// The system, for all that is not here.
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Loads of the carriages under the weight alone.
    pub fn loads_at_rest(&self) -> PerCarriage<Load> {
        self.loads_at(&self.recoveries(), &[0.0; 12], &NO_INPUT)
    }

    /// Extremes of the loads of the carriages, from rest through an excitation, also between its samples. Without `std` the fastest vibration
    /// must have six samples per period for this; with `std` the intervals are divided where it has fewer.
    ///
    /// # Errors
    /// [`RunError`] with time, step and error.
    pub fn extremes(&self, excitation: &Excitation) -> Result<PerCarriage<LoadExtremes>, RunError> {
        let recoveries = self.recoveries();
        let mut extremes = PerCarriage::new(self.count(), |_| Extremes::NONE);
        with_enough_samples(&self.system, excitation, |excitation| {
            let extremes = extremes.as_mut_slice();
            self.run(excitation, &mut Peaks::new(&self.system, excitation, recoveries.as_slice(), extremes))
        })?;
        if !extremes.iter().all(Extremes::is_finite) {
            return Err(RunError::OutOfRange);
        }
        Ok(PerCarriage::new(self.count(), |k| (&extremes.as_slice()[k]).into()))
    }

    /// Calls `receive` with the time, s, and the loads of the carriages at each sample of an excitation, from rest on.
    ///
    /// # Errors
    /// [`RunError`] with time, step and error, after the samples before it.
    pub fn at_samples(
        &self,
        excitation: &Excitation,
        receive: impl FnMut(f64, &PerCarriage<Load>),
    ) -> Result<(), RunError> {
        let mut samples =
            Samples { simulation: self, recoveries: self.recoveries(), receive, out_of_range: false };
        self.run(excitation, &mut samples)?;
        if samples.out_of_range { Err(RunError::OutOfRange) } else { Ok(()) }
    }

    pub(crate) fn count(&self) -> usize {
        self.centers.as_slice().len()
    }

    pub(crate) fn recoveries(&self) -> PerCarriage<Wrench<'_>> {
        let center = |k: usize| self.centers.as_slice()[k];
        PerCarriage::new(self.count(), |k| {
            group_load(&self.system, LINKS * k..LINKS * (k + 1), center(k), Part::Total)
        })
    }

    fn loads_at(
        &self,
        recoveries: &PerCarriage<Wrench<'_>>,
        state: &State,
        input: &Input,
    ) -> PerCarriage<Load> {
        PerCarriage::new(self.count(), |k| {
            let [_, load @ ..] = recoveries.as_slice()[k].at(state, input);
            Load::of(load)
        })
    }

    /// Runs by the method that suits the laws: without step error where they are straight, else by one that is stable with them.
    fn run(&self, excitation: &Excitation, record: &mut dyn Record) -> Result<(), RunError> {
        let has_riders = !excitation.riders().is_empty();
        let method = if has_riders || self.has_preload() && self.system.first_segmented().is_some() {
            NamedMethod::Implicit
        } else if self.has_preload() {
            NamedMethod::Exponential
        } else {
            NamedMethod::Exact
        };
        let control = Control::Adaptive { rtol: self.tolerance };
        method.run(&self.system, control, Start::AtRest, excitation, Output::Samples, record)?;
        Ok(())
    }

    fn has_preload(&self) -> bool {
        self.system.model_level() == ModelLevel::SmoothNonlinear
    }
}

/// Hands the loads of each sample to a function, up to the first that are not finite.
struct Samples<'a, F> {
    simulation: &'a Simulation,
    recoveries: PerCarriage<Wrench<'a>>,
    receive: F,
    out_of_range: bool,
}

impl<F: FnMut(f64, &PerCarriage<Load>)> Record for Samples<'_, F> {
    fn reserve(&mut self, _: usize) -> Result<(), RunError> {
        Ok(())
    }

    fn instant(&mut self, time: f64, state: &State, input: &Input) {
        let loads = self.simulation.loads_at(&self.recoveries, state, input);
        self.out_of_range |= !loads.iter().all(Load::is_finite);
        if !self.out_of_range {
            (self.receive)(time, &loads);
        }
    }
}
