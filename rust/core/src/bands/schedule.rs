//! Schedule of events in the order of time: samples, parts of the intervals between them, and the instants of the results.

use std::rc::Rc;

use crate::equations::Propagator;
use crate::numeric::simd::dispatch;
use crate::smoother::{MarkovStep, Posterior};
use crate::system::{State, System};

/// The deviation of the acceleration along x from its estimate, linear between the stamps of the samples.
#[derive(Clone, Copy)]
pub struct Deviation<'a> {
    /// Posterior of the state at the time stamps.
    pub posterior: &'a Posterior<'a>,
    /// Time stamps of the samples, s, ascending.
    pub time: &'a [f64],
    /// Index of the acceleration in the state.
    pub derivative: usize,
    /// n: m/s² per unit of the state's acceleration at each time stamp.
    pub unit: &'a [f64],
    /// Whether the machine starts in the quasi-static state of its first acceleration, so that its deviation displaces the start.
    pub quasi_static: bool,
}

impl Deviation<'_> {
    /// The state of the machine at the first sample per m/s² of the deviation there.
    pub(super) fn start(&self, system: &System) -> State {
        let still = if self.quasi_static { system.quasi_static(&system.influence()[0]).ok() } else { None };
        still.unwrap_or([0.0; 12])
    }
}

/// z at the end of a part of an interval: `transition` z + `start` a(start) + `end` a(end).
#[derive(Debug, Clone)]
pub(super) struct Response {
    /// By columns.
    pub transition: [[f64; 12]; 12],
    pub start: [f64; 12],
    pub end: [f64; 12],
}

/// One event of the schedule.
#[derive(Debug, Clone)]
pub(super) enum Event {
    /// The next sample, starting with the first. `unit`: m/s² per unit of its acceleration.
    Sample { step: Box<MarkovStep>, unit: f64 },
    /// A part of the interval between the last two samples, between two fractions of it.
    Part { response: Rc<Response>, from: f64, to: f64 },
    /// The instant with this index, at this fraction of the interval.
    Instant { index: usize, at: f64 },
}

/// All events up to the last instant, in order.
pub(super) struct Schedule<'a> {
    system: &'a System,
    deviation: Deviation<'a>,
    instants: &'a [f64],
    steps: Box<dyn Iterator<Item = MarkovStep> + 'a>,
    /// Number of samples passed, and the time stamps of the last two, s.
    known: usize,
    start: f64,
    end: f64,
    /// Present time, s, and fraction of the interval.
    here: f64,
    fraction: f64,
    next: usize,
    /// Cached responses by length. Lengths that differ only by the rounding of time stamps share one response.
    cached: Vec<(f64, Rc<Response>)>,
    oldest: usize,
    rounding: f64,
}

/// Cached responses: device clocks tick in a handful of interval lengths.
const CACHED_RESPONSES: usize = 16;

impl<'a> Schedule<'a> {
    /// instants: ascending, within the stamps, s.
    pub fn new(system: &'a System, deviation: Deviation<'a>, instants: &'a [f64]) -> Self {
        let (first, last) = (deviation.time[0], deviation.time[deviation.time.len() - 1]);
        Self {
            system,
            deviation,
            instants,
            steps: deviation.posterior.steps(),
            known: 0,
            start: first,
            end: first,
            here: first,
            fraction: 1.0,
            next: 0,
            cached: Vec::with_capacity(CACHED_RESPONSES),
            oldest: 0,
            rounding: 4.0 * f64::EPSILON * f64::max(first.abs(), last.abs()),
        }
    }

    fn response(&mut self, length: f64) -> Rc<Response> {
        let near = |cached: &&(f64, Rc<Response>)| (cached.0 - length).abs() <= self.rounding;
        if let Some((_, response)) = self.cached.iter().find(near) {
            return Rc::clone(response);
        }
        let response = Rc::new(dispatch!(response(self.system, length)));
        let entry = (length, Rc::clone(&response));
        if self.cached.len() < CACHED_RESPONSES {
            self.cached.push(entry);
        } else {
            self.cached[self.oldest] = entry;
            self.oldest = (self.oldest + 1) % CACHED_RESPONSES;
        }
        response
    }
}

impl Iterator for Schedule<'_> {
    type Item = Event;

    fn next(&mut self) -> Option<Event> {
        let time = self.deviation.time;
        loop {
            let &wanted = self.instants.get(self.next)?;
            let last = self.known == time.len() && self.fraction == 1.0;
            if self.known > 0 && (wanted <= self.here || last) {
                self.next += 1;
                return Some(Event::Instant { index: self.next - 1, at: self.fraction });
            }
            if self.fraction == 1.0 {
                if self.known > 0 {
                    (self.start, self.end) = (self.end, time[self.known]);
                    self.fraction = 0.0;
                }
                let unit = self.deviation.unit[self.known];
                self.known += 1;
                return self.steps.next().map(|step| Event::Sample { step: Box::new(step), unit });
            }
            let from = self.fraction;
            let length;
            if wanted < self.end {
                length = wanted - self.here;
                self.here = wanted;
                self.fraction = (wanted - self.start) / (self.end - self.start);
            } else {
                length = self.end - self.here;
                self.here = self.end;
                self.fraction = 1.0;
            }
            if length > 0.0 {
                let response = self.response(length);
                return Some(Event::Part { response, from, to: self.fraction });
            }
        }
    }
}

/// Computes a response.
#[inline(always)]
fn response(system: &System, length: f64) -> Response {
    let propagator = Propagator::new(system, &system.influence()[..1], length);
    let (exp_minus_identity, &start, &end) = propagator.parts(0);
    let mut transition = *exp_minus_identity;
    for i in 0..12 {
        transition[i][i] += 1.0;
    }
    Response { transition, start, end }
}
