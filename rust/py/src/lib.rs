//! Python binding: converts arrays and errors, releases the interpreter, and computes nothing itself.
#![allow(missing_docs)] // the documentation is in `_core.pyi`

mod bands;
mod batch;
mod chain;
mod convert;
mod division;
mod error;
mod extremes;
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
    use std::hint::black_box;

    use numpy::{PyArray1, PyArrayMethods};
    use pyo3::exceptions::PyImportError;
    use pyo3::prelude::*;

    /// Refuse a processor that this build does not run on, and find NumPy's functions now: the `numpy` crate panics
    /// if Ctrl-C ends its first search, and a command waits with Ctrl-C until an import is over.
    #[pymodule_init]
    fn prepare(module: &Bound<'_, PyModule>) -> PyResult<()> {
        if !guideload::runs_on_this_processor() {
            return Err(PyImportError::new_err(
                "this build of guideload needs a processor with AVX2 and FMA: build it on this machine, or anywhere \
                 with MATURIN_PEP517_ARGS='--features any-processor'",
            ));
        }
        module.py().import("numpy")?;
        drop(PyArray1::<f64>::zeros(module.py(), 1, false).readonly());
        let mut block = Vec::<u8>::new();
        let _ = block.try_reserve_exact(LARGEST_BLOCK); // if this fails, runs are only slower
        drop(black_box(block));
        Ok(())
    }

    /// Bytes of a block that is allocated and freed once. The C library of Linux (glibc) takes each block above a threshold anew from the
    /// system and gives it back when it is freed, so that every run pays for new pages: up to a third of its time on a virtual machine.
    /// When such a block of up to 32 MiB is freed, glibc raises that threshold to its size, and the free memory that it keeps to twice
    /// that, for the whole process. 8 KiB less, for its header and for rounding to pages.
    const LARGEST_BLOCK: usize = (32 << 20) - (8 << 10);

    #[pymodule_export]
    use super::bands::{PyMotionDraws, draw_motion, draw_peaks, load_spread};
    #[pymodule_export]
    use super::batch::PyBatch;
    #[pymodule_export]
    use super::division::{enough_parts, limited_parts};
    #[pymodule_export]
    use super::interrupt::PyCancellation;
    #[pymodule_export]
    use super::law::PyLaw;
    #[pymodule_export]
    use super::life::{
        equivalent_load_integrals, equivalent_load_weights, largest_equivalent_load, raised_loads,
    };
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
