//! The load monitor of a controller, on a PC.

use std::ops::ControlFlow;

use guideload::Part;
use guideload_monitor::{
    Exponent, InputSettings, Judgement, Monitor, Motion, PrepareError, Prepared, Settings, prepare,
};
use numpy::{IntoPyArray, PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::convert::{List, filled, numbers, rows, zeros};
use crate::error::scene_error;
use crate::interrupt::compute;
use crate::life::{Rule, equivalent_load};
use crate::links::group_loads;
use crate::scene::PyScene;

/// Places for the state, for carriages and for second differences.
const PLACES: (usize, usize, usize) = (12, 16, 512);
type Constants = Prepared<f64, { PLACES.0 }, { PLACES.1 }, { PLACES.2 }>;
type State = Monitor<f64, { PLACES.0 }, { PLACES.1 }, { PLACES.2 }>;

/// Loads by sample, carriage and component.
type Loads<'py> = Bound<'py, PyArray3<f64>>;

/// Samples between two looks for signals.
const SAMPLES: usize = 65_536;

/// Rule, limit (N), width of a bin (N) and capacity (N^p m) of a carriage.
type Judged<'py> = (Rule<'py>, f64, f64, f64);

#[pyclass(name = "Monitor", module = "guideload._core", subclass)]
pub struct PyMonitor {
    constants: Box<Constants>,
    state: Box<State>,
    /// Number of entries of the state of the machine.
    entries: usize,
}

impl PyMonitor {
    fn carriages(&self) -> usize {
        self.constants.carriage_count as usize
    }
}

/// Ticks, tolerance, counter bits, most change, slack, still, most missing.
fn input(
    [ticks, tolerance, counter_bits, most_change, slack, still, most_missing]: [u32; 7],
) -> InputSettings {
    let [most_change, slack, still] = [most_change, slack, still].map(|x| x.min(i32::MAX as u32) as i32);
    InputSettings { ticks, tolerance, counter_bits, most_change, slack, still, most_missing }
}

#[pymethods]
impl PyMonitor {
    #[new]
    #[pyo3(signature = (scene, *, groups, centers, judged, period, quantum, input, taps, lag, roller))]
    #[allow(clippy::too_many_arguments)] // keyword-only in Python, where each has a name
    fn new(
        scene: &PyScene,
        groups: List<PyReadonlyArray1<'_, i64>>,
        centers: PyReadonlyArray2<'_, f64>,
        judged: List<Judged<'_>>,
        period: f64,
        quantum: f64,
        input: [u32; 7],
        taps: PyReadonlyArray2<'_, f64>,
        lag: u32,
        roller: bool,
    ) -> PyResult<Self> {
        let loads = group_loads(&scene.0, &groups.0, &centers, Part::Total)?;
        if judged.0.len() != loads.len() {
            return Err(PyValueError::new_err("judged: expected one entry per group"));
        }
        let mut all = Vec::with_capacity(loads.len());
        for (load, (rule, limit, bin, capacity)) in loads.into_iter().zip(&judged.0) {
            let (rule, [limit, bin, capacity]) = (equivalent_load(rule)?, [*limit, *bin, *capacity]);
            all.push((load, Judgement { rule, limit, bin, capacity }));
        }
        let exponent = if roller { Exponent::Roller } else { Exponent::Ball };
        let taps = rows::<2>(&taps, "taps")?;
        let settings = Settings { period, quantum, input: self::input(input), taps: &taps, lag, exponent };
        let constants =
            prepare(&scene.0, &all, &settings).map_err(|error: PrepareError| scene_error(error))?;
        let entries = 2 * scene.0.mode_count();
        Ok(Self { constants: Box::new(constants), state: Box::new(State::NEW), entries })
    }

    /// Takes samples. Returns what became of each (n,), the number of the period of the loads after it, -1 before the first (n,), and the
    /// loads (n, carriages, 5). `until_limit`: stops after the sample at which a carriage rises above its limit; the first two then end there.
    #[allow(clippy::type_complexity)] // a tuple in Python
    #[pyo3(signature = (stamps, counts, until_limit = false))]
    fn push<'py>(
        &mut self,
        py: Python<'py>,
        stamps: PyReadonlyArray1<'py, i64>,
        counts: PyReadonlyArray1<'py, u32>,
        until_limit: bool,
    ) -> PyResult<(Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<i64>>, Loads<'py>)> {
        let (stamps, counts) = (stamps.to_vec()?, counts.to_vec()?);
        if stamps.len() != counts.len() {
            return Err(PyValueError::new_err("stamps, counts: lengths do not agree"));
        }
        let carriages = self.carriages();
        let loads: Loads<'py> = zeros(py, &[stamps.len(), carriages, 5])?;
        let (mut taken, mut periods) = (Vec::with_capacity(stamps.len()), Vec::with_capacity(stamps.len()));
        {
            let mut to = loads.readwrite();
            let mut to = to.as_slice_mut()?.chunks_exact_mut(carriages * 5);
            let (constants, state) = (&self.constants, &mut self.state);
            let exceeded =
                |state: &State| state.totals().carriages.iter().map(|one| one.limit_exceeded).sum::<u64>();
            let before = exceeded(state);
            compute(py, |watch| {
                for (stamps, counts) in stamps.chunks(SAMPLES).zip(counts.chunks(SAMPLES)) {
                    if watch.stops() {
                        return;
                    }
                    let samples = stamps.iter().copied().zip(counts.iter().copied());
                    let end = state.push_many(constants, samples, |state, sample| {
                        taken.push(sample as u32);
                        periods.push(if state.motion().is_some() { state.period() as i64 } else { -1 });
                        if let Some(to) = to.next() {
                            to.copy_from_slice(&state.loads().as_flattened()[..carriages * 5]);
                        }
                        if until_limit && exceeded(state) > before {
                            return ControlFlow::Break(());
                        }
                        ControlFlow::Continue(())
                    });
                    if end.is_break() {
                        return;
                    }
                }
            })?;
        }
        Ok((taken.into_pyarray(py), periods.into_pyarray(py), loads))
    }

    /// Goes on to known velocities and accelerations, in place of samples; loads (n, carriages, 5).
    fn push_motion<'py>(
        &mut self,
        py: Python<'py>,
        velocity: PyReadonlyArray1<'py, f64>,
        acceleration: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Loads<'py>> {
        let (velocity, acceleration) =
            (numbers(&velocity, "velocity")?, numbers(&acceleration, "acceleration")?);
        let carriages = self.carriages();
        filled(py, &[velocity.len(), carriages, 5], |to| {
            let to = to.chunks_exact_mut(carriages * 5);
            for ((to, velocity), acceleration) in to.zip(velocity).zip(acceleration) {
                self.state.push_motion(&self.constants, Motion { velocity, acceleration });
                to.copy_from_slice(&self.state.loads().as_flattened()[..carriages * 5]);
            }
            Ok(())
        })
    }

    /// Whether the loads still depend on the state at the last restart.
    #[getter]
    fn is_settling(&self) -> bool {
        self.state.is_settling()
    }

    /// Estimated velocity (m/s) and acceleration (m/s²) at the instant of the loads; None before the first period.
    #[getter]
    fn motion(&self) -> Option<(f64, f64)> {
        self.state.motion().map(|motion| (motion.velocity, motion.acceleration))
    }

    /// Extremes, sums, histograms and counts, by name; lists have an entry per carriage.
    fn totals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (totals, of) = (self.state.totals(), PyDict::new(py));
        let carriages = &totals.carriages[..self.carriages()];
        let counters = &totals.counters;
        for (name, count) in [
            ("periods", totals.periods),
            ("settling", totals.settling),
            ("samples", counters.samples),
            ("missing", counters.missing),
            ("early", counters.early),
            ("jittering", counters.jittering),
            ("stuck", counters.stuck),
            ("jumps", counters.jumps),
            ("wraps", counters.wraps),
            ("counter_set", counters.counter_set),
            ("restarts", counters.restarts),
            ("lost", counters.lost),
        ] {
            of.set_item(name, count)?;
        }
        of.set_item("distance", totals.distance.value())?;
        of.set_item("smallest", carriages.iter().map(|one| one.smallest).collect::<Vec<_>>())?;
        of.set_item("largest", carriages.iter().map(|one| one.largest).collect::<Vec<_>>())?;
        let periods = carriages.iter().map(|one| one.period_of_smallest);
        of.set_item("period_of_smallest", periods.collect::<Vec<_>>())?;
        let periods = carriages.iter().map(|one| one.period_of_largest);
        of.set_item("period_of_largest", periods.collect::<Vec<_>>())?;
        of.set_item("power", carriages.iter().map(|one| one.power.value()).collect::<Vec<_>>())?;
        of.set_item("histogram", carriages.iter().map(|one| one.histogram).collect::<Vec<_>>())?;
        of.set_item("above_limit", carriages.iter().map(|one| one.above_limit).collect::<Vec<_>>())?;
        of.set_item("limit_exceeded", carriages.iter().map(|one| one.limit_exceeded).collect::<Vec<_>>())?;
        let life = (0..carriages.len()).map(|k| totals.life_used(&self.constants, k));
        of.set_item("life_used", life.collect::<Vec<_>>())?;
        Ok(of)
    }

    /// The totals as record `number`.
    fn save<'py>(&self, py: Python<'py>, number: u64) -> PyResult<Bound<'py, PyBytes>> {
        let mut record = vec![0; guideload_monitor::record_length(self.carriages())];
        self.state
            .save(&self.constants, number, &mut record)
            .map_err(|error| PyValueError::new_err(error.text()))?;
        Ok(PyBytes::new(py, &record))
    }

    /// Goes on with the newer of two records, and returns its number.
    fn restore(&mut self, first: &[u8], second: &[u8]) -> PyResult<u64> {
        self.state
            .restore(&self.constants, [first, second])
            .map_err(|error| PyValueError::new_err(error.text()))
    }

    /// The constants, by name, without unused places.
    fn constants<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (of, from, entries) = (PyDict::new(py), &*self.constants, self.entries);
        for (name, count) in [
            ("id", from.id),
            ("carriage_count", from.carriage_count),
            ("tap_count", from.tap_count),
            ("lag", from.lag),
            ("settling", from.settling),
            ("exponent", from.exponent),
        ] {
            of.set_item(name, count)?;
        }
        let InputSettings { ticks, tolerance, counter_bits, most_change, slack, still, most_missing } =
            from.input;
        let input = PyDict::new(py);
        for (name, value) in [
            ("ticks", i64::from(ticks)),
            ("tolerance", tolerance.into()),
            ("counter_bits", counter_bits.into()),
            ("most_change", most_change.into()),
            ("slack", slack.into()),
            ("still", still.into()),
            ("most_missing", most_missing.into()),
        ] {
            input.set_item(name, value)?;
        }
        of.set_item("input", input)?;
        of.set_item("period", from.period)?;
        of.set_item("speed_of_step", from.speed_of_step)?;
        let taps = from.taps.each_ref().map(|weights| weights[..from.tap_count as usize].to_vec());
        of.set_item("taps", taps)?;
        let change = from.change[..entries].iter().map(|column| column[..entries].to_vec());
        of.set_item("change", change.collect::<Vec<_>>())?;
        of.set_item("from_start", from.from_start[..entries].to_vec())?;
        of.set_item("from_end", from.from_end[..entries].to_vec())?;
        let mut carriages = Vec::new();
        for carriage in &from.carriages[..self.carriages()] {
            let one = PyDict::new(py);
            one.set_item("rest", carriage.rest)?;
            one.set_item("by_state", carriage.by_state[..entries].to_vec())?;
            let rule = PyDict::new(py);
            rule.set_item("weights", carriage.rule.weights)?;
            rule.set_item("minor", carriage.rule.minor)?;
            rule.set_item("preload", carriage.rule.preload)?;
            rule.set_item("opening", carriage.rule.opening)?;
            rule.set_item("counted", carriage.rule.counted)?;
            rule.set_item("plain", carriage.rule.plain)?;
            rule.set_item("preload_form", carriage.rule.preload_form)?;
            one.set_item("rule", rule)?;
            one.set_item("limit", carriage.limit)?;
            one.set_item("bins_per_load", carriage.bins_per_load)?;
            one.set_item("capacity", carriage.capacity)?;
            carriages.push(one);
        }
        of.set_item("carriages", carriages)?;
        Ok(of)
    }
}
