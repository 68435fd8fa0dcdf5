//! Python binding: converts arrays and errors, releases the interpreter, and computes nothing itself.
#![allow(missing_docs)] // the documentation is in `_core.pyi`

mod bands;
mod batch;
mod chain;
mod convert;
mod interrupt;
mod law;
mod life;
mod links;
mod monitor;
#[cfg(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64"))]
mod old_glibc;
mod riders;
mod scene;
mod smoother;
mod solution;
mod stretches;
mod variation;
mod varied_system;

use pyo3::prelude::*;

#[pymodule]
mod _core {
    #[pymodule_export]
    use super::bands::{PyMotionDraws, draw_motion, draw_peaks, load_spread};
    #[pymodule_export]
    use super::batch::PyBatch;
    #[pymodule_export]
    use super::interrupt::PyCancellation;
    #[pymodule_export]
    use super::law::PyLaw;
    #[pymodule_export]
    use super::life::{equivalent_load_integrals, equivalent_load_weights, largest_equivalent_load};
    #[pymodule_export]
    use super::monitor::PyMonitor;
    #[pymodule_export]
    use super::scene::PyScene;
    #[pymodule_export]
    use super::smoother::{adapt_motion, motion_likelihood, smooth_motion};
    #[pymodule_export]
    use super::solution::PySolution;
    #[pymodule_export]
    use super::stretches::{peaks_of_stretches, solve_stretches};
    #[pymodule_export]
    use super::variation::PyVariedScene;
    #[pymodule_export]
    use super::varied_system::{PyVariedInstants, PyVariedRun, PyVariedSystem};
}
