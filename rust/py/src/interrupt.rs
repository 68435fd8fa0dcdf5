//! Calls of the core with the interpreter released, which Ctrl-C ends.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{ThreadId, current};
use std::time::Instant;

use crate::error::CoreError;
use guideload::Watch;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// Time between two looks for signals, µs. A look waits for the interpreter, which another thread may hold for 5 ms.
const BETWEEN: u64 = 50_000;

thread_local! {
    /// The cancellation under which this thread runs, if any.
    static CANCELLATION: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// Ends calls of the core on other threads, which receive no signals themselves.
#[pyclass(name = "Cancellation", module = "guideload._core", frozen)]
pub struct PyCancellation(Arc<AtomicBool>);

#[pymethods]
impl PyCancellation {
    #[new]
    fn new() -> Self {
        Self(Arc::new(AtomicBool::new(false)))
    }

    /// From now on every call of the core within `run` ends with KeyboardInterrupt.
    fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// `function(argument)`.
    fn run<'py>(
        &self,
        function: &Bound<'py, PyAny>,
        argument: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let before = CANCELLATION.replace(Some(Arc::clone(&self.0)));
        let result = function.call1((argument,));
        CANCELLATION.set(before);
        result
    }
}

/// Whether a call should end; only its own thread may ask Python.
struct Signals {
    thread: ThreadId,
    cancellation: Option<Arc<AtomicBool>>,
    start: Instant,
    /// Time of the next look, µs after the start.
    next: AtomicU64,
    stopped: AtomicBool,
    error: Mutex<Option<PyErr>>,
}

impl Signals {
    fn new() -> Self {
        Self {
            thread: current().id(),
            cancellation: CANCELLATION.with_borrow(Clone::clone),
            start: Instant::now(),
            next: AtomicU64::new(BETWEEN),
            stopped: AtomicBool::new(false),
            error: Mutex::new(None),
        }
    }

    fn stops(&self) -> bool {
        if self.stopped.load(Ordering::Relaxed) {
            return true;
        }
        if let Some(cancellation) = &self.cancellation {
            return cancellation.load(Ordering::Relaxed) && self.stop(PyKeyboardInterrupt::new_err(()));
        }
        let now = self.start.elapsed().as_micros() as u64;
        if now < self.next.load(Ordering::Relaxed) || current().id() != self.thread {
            return false;
        }
        let looked = Python::attach(|py| py.check_signals());
        self.next.store(self.start.elapsed().as_micros() as u64 + BETWEEN, Ordering::Relaxed);
        looked.is_err_and(|error| self.stop(error))
    }

    fn stop(&self, error: PyErr) -> bool {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        self.stopped.store(true, Ordering::Relaxed);
        true
    }
}

/// [`compute`] for work that may fail.
pub fn try_compute<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(Watch) -> Result<T, CoreError> + Send,
) -> PyResult<T> {
    Ok(compute(py, work)??)
}

/// Does `work` with the interpreter released. Its watch stops it when a signal handler raises, such as that of Ctrl-C.
pub fn compute<T: Send>(py: Python<'_>, work: impl FnOnce(Watch) -> T + Send) -> PyResult<T> {
    let signals = Signals::new();
    let result = py.detach(|| work(Watch::new(&|| signals.stops())));
    match signals.error.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(error) => Err(error),
        None => Ok(result),
    }
}
