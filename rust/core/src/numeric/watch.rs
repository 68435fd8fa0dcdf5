//! Whether a long computation should stop, and memory that may not be available.

use core::fmt;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::{self, Builder};
use std::time::Duration;

use crate::error::Stopped;

/// Asked by long computations, every few milliseconds of work, whether to stop: after Ctrl-C, for instance. From the first yes on, the
/// answer must stay yes; a computation on several threads asks on each of them.
#[derive(Clone, Copy)]
pub struct Watch<'a>(&'a (dyn Fn() -> bool + Sync));

impl<'a> Watch<'a> {
    /// Never stops.
    pub const NEVER: Watch<'static> = Watch(&|| false);

    /// Stops when `stops` is true.
    pub fn new(stops: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self(stops)
    }

    /// Whether to stop.
    pub fn stops(self) -> bool {
        (self.0)()
    }

    /// An error if the computation is to stop.
    pub(crate) fn check(self) -> Result<(), Stopped> {
        if self.stops() { Err(Stopped::Interrupted) } else { Ok(()) }
    }

    /// Whether to stop, asked only at each [`BETWEEN`]th `count`.
    #[inline(always)]
    pub(crate) fn stops_at(self, count: usize) -> bool {
        count.is_multiple_of(BETWEEN) && self.stops()
    }
}

/// Units of work between questions: samples, or steps, of up to some microseconds.
pub(crate) const BETWEEN: usize = 1024;

impl fmt::Debug for Watch<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Watch")
    }
}

/// Does `work` on `threads` threads, one of which is the current one, and returns the results in any order. While the current thread waits
/// for the others it asks the watch, because only the thread of the caller may be able to answer.
pub(crate) fn on_threads<T: Send>(threads: usize, watch: Watch, work: impl Fn() -> T + Sync) -> Vec<T> {
    let work = &work;
    thread::scope(|scope| {
        let (send, receive) = channel();
        for _ in 1..threads {
            let send = send.clone();
            // A thread that cannot be started leaves its work to the others; a receiver that is gone needs no result.
            drop(Builder::new().spawn_scoped(scope, move || drop(send.send(work()))));
        }
        drop(send);
        let mut all = vec![work()];
        loop {
            match receive.recv_timeout(WAIT) {
                Ok(result) => all.push(result),
                Err(RecvTimeoutError::Timeout) => {
                    watch.stops();
                }
                Err(RecvTimeoutError::Disconnected) => return all,
            }
        }
    })
}

/// Time between questions while waiting for threads.
const WAIT: Duration = Duration::from_millis(20);

/// An error unless `bytes` of memory can be had.
pub(crate) fn check_memory(bytes: usize) -> Result<(), Stopped> {
    room::<u8>(bytes).map(drop)
}

/// An empty vector with room for `count` entries.
pub(crate) fn room<T>(count: usize) -> Result<Vec<T>, Stopped> {
    let mut all = Vec::new();
    match all.try_reserve_exact(count) {
        Ok(()) => Ok(all),
        Err(_) => Err(Stopped::Memory { bytes: count.saturating_mul(size_of::<T>()) }),
    }
}

/// A vector of `count` times the same entry.
pub(crate) fn filled<T: Clone>(entry: T, count: usize) -> Result<Vec<T>, Stopped> {
    let mut all = room(count)?;
    all.resize(count, entry);
    Ok(all)
}
