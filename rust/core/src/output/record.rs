//! What a run records: the trait, and the record of every state, in memory of the caller.

use crate::error::RunError;
use crate::excitation::Excitation;
#[cfg(feature = "std")]
use crate::numeric::watch::Watch;
use crate::system::{Input, NO_INPUT, State, StateBox};

/// Receives the instants of a run.
pub trait Record {
    /// Called with the number of instants before the first one.
    ///
    /// # Errors
    /// [`RunError::Capacity`] if they do not fit.
    fn reserve(&mut self, count: usize) -> Result<(), RunError>;

    /// Whether it uses the excitation. If not, `instant` may receive zeros.
    fn needs_input(&self) -> bool {
        true
    }

    /// Called between steps, every some hundred microseconds of work: whether the run should stop, with [`RunError::Interrupted`].
    fn stops(&mut self) -> bool {
        false
    }

    /// Called at each instant with time, state and excitation.
    fn instant(&mut self, time: f64, state: &State, input: &Input);

    /// Called with the states at consecutive samples of the excitation, from sample `first` on. Unless overridden, passes each to
    /// [`Record::instant`].
    fn samples(&mut self, excitation: &Excitation, first: usize, states: &[State]) {
        let needs_input = self.needs_input();
        let mut input = NO_INPUT;
        for (k, state) in (first..).zip(states) {
            if needs_input {
                input = excitation.input(k);
            }
            self.instant(excitation.time(k), state, &input);
        }
    }

    /// Whether it needs every instant. If not, a run by exact steps may leave some out, which it asks for with [`Record::leave_out`].
    fn needs_all(&self) -> bool {
        true
    }

    /// Asked whether the next `count` instants, whose states are in the box, may be left out. If true, they are. Asked again with the same
    /// box for the instants after them, if their states are in it too.
    fn leave_out(&mut self, _count: usize, _states: &StateBox) -> bool {
        false
    }

    /// Called after a contact change, `since` s after the last sample before it, with the state there, and the index of each nonlinear link
    /// with the segment of its law that it is on from then on.
    fn contact_change(&mut self, (_sample, _since): (usize, f64), _state: &State, _segments: &[(usize, u8)]) {
    }

    /// Called after the last instant, also where a run ends with an error.
    fn end(&mut self) {}
}

/// Stores every state in memory of the caller.
#[derive(Debug)]
pub struct History<'a> {
    states: &'a mut [State],
    filled: usize,
}

impl<'a> History<'a> {
    /// A history that fills `states` from the first entry on.
    pub fn new(states: &'a mut [State]) -> Self {
        Self { states, filled: 0 }
    }
}

impl Record for History<'_> {
    fn reserve(&mut self, count: usize) -> Result<(), RunError> {
        let got = self.states.len() - self.filled;
        if got < count { Err(RunError::Capacity { expected: count, got }) } else { Ok(()) }
    }

    fn needs_input(&self) -> bool {
        false
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, _: f64, state: &State, _: &Input) {
        self.states[self.filled] = *state;
        self.filled += 1;
    }

    fn samples(&mut self, _: &Excitation, _: usize, states: &[State]) {
        self.states[self.filled..][..states.len()].copy_from_slice(states);
        self.filled += states.len();
    }
}

/// Stores every state.
#[cfg(feature = "std")]
impl Record for Vec<State> {
    fn reserve(&mut self, count: usize) -> Result<(), RunError> {
        self.try_reserve_exact(count)
            .map_err(|_| RunError::Memory { bytes: count.saturating_mul(size_of::<State>()) })
    }

    fn needs_input(&self) -> bool {
        false
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, _: f64, state: &State, _: &Input) {
        self.push(*state);
    }

    fn samples(&mut self, _: &Excitation, _: usize, states: &[State]) {
        self.extend_from_slice(states);
    }
}

/// Another record, and a watch that may stop the run.
#[cfg(feature = "std")]
#[derive(Debug)]
pub struct Watched<'a, R> {
    /// Receives the instants.
    pub record: R,
    /// Whether the run should stop.
    pub watch: Watch<'a>,
}

#[cfg(feature = "std")]
impl<R: Record> Record for Watched<'_, R> {
    fn reserve(&mut self, count: usize) -> Result<(), RunError> {
        self.record.reserve(count)
    }

    fn needs_input(&self) -> bool {
        self.record.needs_input()
    }

    fn stops(&mut self) -> bool {
        self.watch.stops() || self.record.stops()
    }

    fn needs_all(&self) -> bool {
        self.record.needs_all()
    }

    fn leave_out(&mut self, count: usize, states: &StateBox) -> bool {
        self.record.leave_out(count, states)
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn instant(&mut self, time: f64, state: &State, input: &Input) {
        self.record.instant(time, state, input);
    }

    fn samples(&mut self, excitation: &Excitation, first: usize, states: &[State]) {
        self.record.samples(excitation, first, states);
    }

    fn contact_change(&mut self, at: (usize, f64), state: &State, segments: &[(usize, u8)]) {
        self.record.contact_change(at, state, segments);
    }

    fn end(&mut self) {
        self.record.end();
    }
}
