//! The way of the deviations through time: intervals between samples, parts of them, and the instants that are asked for.

use std::rc::Rc;

use crate::equations::Propagator;
use crate::numeric::simd::{Kernel, dispatch};
use crate::smoother::{MarkovStep, Posterior};
use crate::system::System;

/// The deviation of the acceleration along x from its estimate, linear between the stamps of the samples.
#[derive(Clone, Copy)]
pub struct Deviation<'a> {
    /// The chain of the states at the stamps.
    pub posterior: &'a Posterior<'a>,
    /// Stamps of the samples, s, ascending.
    pub time: &'a [f64],
    /// The number of the state that is the acceleration.
    pub derivative: usize,
    /// n: m/s² per unit of it at each stamp.
    pub unit: &'a [f64],
}

/// z at the end of a part of an interval: `carry` z + `start` a(start) + `end` a(end).
#[derive(Debug, Clone)]
pub(super) struct Response {
    /// By columns.
    pub carry: [[f64; 12]; 12],
    pub start: [f64; 12],
    pub end: [f64; 12],
}

/// What comes next.
#[derive(Debug, Clone)]
pub(super) enum Move {
    /// The state of the next sample; the first time that of the first. `unit`: m/s² per unit of its acceleration.
    Sample { step: Box<MarkovStep>, unit: f64 },
    /// A part of the interval between the last two samples, from one fraction of it to another.
    Part { response: Rc<Response>, from: f64, to: f64 },
    /// The instant with this index, at this fraction of the interval.
    Instant { index: usize, at: f64 },
}

/// All moves up to the last instant.
pub(super) struct Schedule<'a> {
    system: &'a System,
    deviation: Deviation<'a>,
    instants: &'a [f64],
    steps: Box<dyn Iterator<Item = MarkovStep> + 'a>,
    /// Samples whose state is known, and the last two of their stamps.
    known: usize,
    start: f64,
    end: f64,
    /// Where we are: time, and fraction of the interval.
    here: f64,
    fraction: f64,
    next: usize,
    /// Responses to parts of some lengths; stamps are rounded, and lengths that differ by no more are one.
    cached: Vec<(f64, Rc<Response>)>,
    oldest: usize,
    rounding: f64,
}

/// Lengths whose responses are cached: device clocks tick in a handful of them.
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
        let response = Rc::new(dispatch(ResponseKernel { system: self.system, length }));
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
    type Item = Move;

    fn next(&mut self) -> Option<Move> {
        let time = self.deviation.time;
        loop {
            let &wanted = self.instants.get(self.next)?;
            let last = self.known == time.len() && self.fraction == 1.0;
            if self.known > 0 && (wanted <= self.here || last) {
                self.next += 1;
                return Some(Move::Instant { index: self.next - 1, at: self.fraction });
            }
            if self.fraction == 1.0 {
                if self.known > 0 {
                    (self.start, self.end) = (self.end, time[self.known]);
                    self.fraction = 0.0;
                }
                let unit = self.deviation.unit[self.known];
                self.known += 1;
                return self.steps.next().map(|step| Move::Sample { step: Box::new(step), unit });
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
                return Some(Move::Part { response, from, to: self.fraction });
            }
        }
    }
}

/// Makes a response.
struct ResponseKernel<'a> {
    system: &'a System,
    length: f64,
}

impl Kernel for ResponseKernel<'_> {
    type Output = Response;

    #[inline(always)]
    fn run(self) -> Response {
        let Self { system, length } = self;
        let propagator = Propagator::new(system, &system.influence()[..1], length);
        let (change, &start, &end) = propagator.parts(0);
        let mut carry = *change;
        for i in 0..12 {
            carry[i][i] += 1.0;
        }
        Response { carry, start, end }
    }
}
