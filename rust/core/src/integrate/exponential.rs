//! Exponential: the linear part exactly, the rest by collocation, for preloaded laws.
//!
//! In `x' = A x + f + g(x)` the nonlinear loads g beyond the springs at rest are small and change slowly, so that a step may be as long as
//! the interval between samples. Over a step, g is the cubic that has its values and rates of change at both ends (Hermite collocation,
//! order 4); the solution under this cubic is exact (variation of constants; cf. Hochbruck & Ostermann 2010, section 2). Its values at the
//! end are those of the solution under the tangent of g at the start. Near an equilibrium under a constant excitation a run replaces g by its
//! tangent there (`free_vibration`).

use super::exact::CACHED_STEPS;
use super::method::Method;
use super::step_cache::{SeriesCache, StepCache};
use crate::equations::{
    CubicForce, CubicPropagator, CubicStep, Equations, Linearized, Remainder, advance_cubic,
};
use crate::excitation::{Forcing, Ramp, Values};
use crate::numeric::float::{add_scaled, fma, sqrt};
use crate::numeric::on_heap::OnHeap;
use crate::system::{Force, NO_FORCE, State};

/// Exponential collocation of order 4, without moving riders. Scenes without preloaded links are run by [`super::Exact`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Exponential;

/// How often a step length must have occurred before its propagator is computed: those that end at contact changes do not recur.
const MIN_OCCURRENCES: u32 = 2;

/// Error of the cubic in a step in which a row opens or closes, over what the cubic adds to the tangent; found by trial.
pub(super) const KINK: f64 = 0.1;

/// Memory of one run.
#[derive(Debug, Clone)]
pub struct Memory {
    /// Of whole intervals between samples, and of parts of them, which must not displace them.
    propagators: [StepCache<CubicPropagator, CACHED_STEPS>; 2],
    series: SeriesCache,
    /// The force of the last step.
    force: CubicForce,
    /// The end of the last step, with the nonlinear loads there.
    end: State,
    at_end: Remainder,
    /// The start of the last step, the rows that are open there, and how often a link has opened or closed one before.
    start: State,
    contact_signature: f64,
    changes: usize,
    /// Linearised equations, each for one excitation, and the place of the next ones.
    linearized: [Option<OnHeap<Linearized>>; LINEARIZED],
    next: usize,
}

/// Excitations whose linearised equations are cached: those of standing still, speeding up and slowing down, and one more.
const LINEARIZED: usize = 4;

impl Method for Exponential {
    type Memory = Memory;
    /// The estimate is that of the cubic against the parabola.
    const ERROR_ORDER: Option<u32> = Some(3);
    const STABLE: bool = true;
    const EXACT_IF_LINEAR: bool = true;
    /// Within a longer one, a mode may swing out and back, and open a row, while the loads at the ends show nothing of it.
    const LONGEST_STEP: f64 = 2.0;

    fn memory(&self) -> Self::Memory {
        Memory {
            propagators: [StepCache::new(), StepCache::new()],
            series: SeriesCache::default(),
            force: CubicForce([NO_FORCE; 4]),
            end: [f64::NAN; 12],
            at_end: Remainder::NONE,
            start: [0.0; 12],
            contact_signature: f64::NAN,
            changes: 0,
            linearized: [const { None }; LINEARIZED],
            next: 0,
        }
    }

    #[inline(always)]
    fn linearized<'m, E: Equations>(
        &self,
        memory: &'m mut Self::Memory,
        equations: &E,
        (forcing, values): (&Forcing, &Values),
        h: f64,
        state: &State,
        prepares: bool,
    ) -> Option<&'m Linearized> {
        let Memory { linearized, next, .. } = memory;
        for place in 0..LINEARIZED {
            if let Some(found) = &linearized[place]
                && found.is_valid_for(values, h, equations.key())
            {
                return linearized[place].as_deref();
            }
        }
        if !prepares {
            return None;
        }
        let place = *next;
        *next = (place + 1) % LINEARIZED;
        linearized[place] = Linearized::new(equations, forcing, values, h, state);
        linearized[place].as_deref()
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn step<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
    ) -> (State, State) {
        let Memory { propagators, series, force, end, at_end, start, contact_signature, changes, .. } =
            memory;
        let (place, before) = propagators[usize::from(!ramp.spans_interval)].entry(ramp.h, equations.key());
        if place.is_none() && before >= MIN_OCCURRENCES {
            *place = Some(CubicPropagator::new(equations, ramp.h));
        }
        let linear = match place {
            Some(propagator) => CubicStep::Propagator(propagator),
            None => CubicStep::Series(series.of(equations), ramp.h),
        };
        if *end != *state {
            *at_end = equations.remainder(state);
        }
        if *contact_signature != at_end.contact_signature {
            if !contact_signature.is_nan() {
                *changes += equations.changed_rows(start, state);
            }
            *contact_signature = at_end.contact_signature;
        }
        *start = *state;
        let step = Collocation::new(equations, &linear, ramp, state, at_end);
        (*force, *end, *at_end) = (step.force, step.next, step.found);
        (step.next, step.error)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn between<E: Equations>(
        &self,
        equations: &E,
        memory: &mut Self::Memory,
        ramp: &Ramp,
        state: &State,
        theta: f64,
    ) -> State {
        if theta == 0.0 {
            return *state;
        }
        let series = memory.series.of(equations);
        advance_cubic(equations, &series, theta * ramp.h, &memory.force.part(0.0, theta), state)
    }

    fn contact_changes<E: Equations>(&self, equations: &E, memory: &Self::Memory) -> usize {
        if memory.contact_signature.is_nan() {
            return 0; // before the first step
        }
        memory.changes + equations.changed_rows(&memory.start, &memory.end)
    }
}

impl Memory {
    /// The propagator of a whole interval of `h` s, if it has recurred.
    pub(super) fn propagator(&mut self, h: f64, key: u32) -> Option<&CubicPropagator> {
        self.propagators[0].ready(h, key)
    }

    /// The nonlinear loads with which a step from this state starts.
    #[inline(always)]
    pub(super) fn start<E: Equations>(&self, equations: &E, state: &State) -> Remainder {
        if self.end == *state { self.at_end } else { equations.remainder(state) }
    }

    /// Takes the end of a step that was made elsewhere, with the nonlinear loads there.
    #[inline(always)]
    pub(super) fn set_end(&mut self, state: &State, remainder: Remainder) {
        (self.end, self.at_end) = (*state, remainder);
    }
}

/// Coefficients of s² and s³ of the cubic over a step of length `h` with these values and rates of change at its start and its end.
#[cfg_attr(feature = "std", inline(always))]
fn curved(h: f64, start: &Remainder, end: &Remainder) -> (Force, Force) {
    let (mut quadratic, mut cubic) = (NO_FORCE, NO_FORCE);
    for i in 0..6 {
        // Value and slope at the end beyond the tangent at the start.
        let value = end.force[i] - fma(h, start.rate[i], start.force[i]);
        let slope = h * (end.rate[i] - start.rate[i]);
        quadratic[i] = 3.0 * value - slope;
        cubic[i] = slope - 2.0 * value;
    }
    (quadratic, cubic)
}

/// One step.
struct Collocation {
    next: State,
    error: State,
    /// The force that the linear part takes.
    force: CubicForce,
    /// The nonlinear force at the end and its rate of change.
    found: Remainder,
}

impl Collocation {
    /// The step over a ramp from `state`, where the nonlinear force and its rate of change are `start`.
    #[cfg_attr(feature = "std", inline(always))]
    fn new<E: Equations>(
        equations: &E,
        linear: &CubicStep,
        ramp: &Ramp,
        state: &State,
        start: &Remainder,
    ) -> Self {
        let (mut f0, mut f1) = (ramp.force(0.0), ramp.force(1.0));
        add_scaled(&mut f1, &f0, -1.0);
        add_scaled(&mut f0, equations.constant(), 1.0);
        add_scaled(&mut f0, &start.force, 1.0);
        add_scaled(&mut f1, &start.rate, ramp.h);
        let tangent = linear.apply(equations, state, [&f0, &f1]);

        let found = equations.remainder(&tangent);
        let (f2, f3) = curved(ramp.h, start, &found);
        let [correction, by_rate] = linear.curved(equations, [&f2, &f3]);
        let mut next = tangent;
        add_scaled(&mut next, &correction, 1.0);

        // The nonlinear force at the end is that before the correction. How much the correction changes it follows from its change over
        // the step.
        let (mut moved, mut grown) = (0.0, 0.0);
        for i in 0..6 {
            let (way, growth) = (tangent[i] - state[i], found.force[i] - start.force[i]);
            moved = fma(way, way, moved);
            grown = fma(growth, growth, grown);
        }
        // The cubic shows the kink of a row that opens or closes only in part.
        let kink = if found.contact_signature == start.contact_signature { 0.0 } else { KINK };
        let contraction = kink + if moved > 0.0 { ramp.h * sqrt(grown / moved) } else { 0.0 };
        let mut error = [0.0; 12];
        for i in 0..12 {
            error[i] = fma(contraction, correction[i].abs(), by_rate[i].abs());
        }
        Self { next, error, force: CubicForce([f0, f1, f2, f3]), found }
    }
}
