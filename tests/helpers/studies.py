"""Studies whose distributions are known: peaks that are sums of independent normal factors, without the core."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pyarrow as pa
import xarray as xr
from scipy import stats

from guideload.machine.machine import Machine
from guideload.study.metadata import ParameterMetadata, StudyMetadata
from guideload.study.result import StudyResult


@dataclass
class Columns:
    """Samples in memory, as a sample store has them."""

    data: dict[str, np.ndarray]
    failed: dict[int, str] = field(default_factory=dict)
    stored: xr.Dataset | None = None
    done: int = 0
    read: list[str] = field(default_factory=list)  # columns that were requested

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(self.data)

    def column(self, name: str) -> np.ndarray:
        self.read.append(name)
        return self.data[name].copy()

    def reasons(self) -> dict[int, str]:
        return dict(self.failed)

    def histories(self) -> xr.Dataset | None:
        return self.stored

    def tables(self) -> Iterator[pa.Table]:
        runs = len(next(iter(self.data.values())))
        reasons = pa.array([self.failed.get(i) for i in range(runs)], pa.string())
        table = pa.table({"sample": np.arange(runs), **self.data, "reason": reasons})
        yield table.slice(0, runs // 2)
        yield table.slice(runs // 2)


# Without contact factor and moments, the life is 50 km (27.1 kN / mean load)^3.
PRODUCT = {
    "name": "20",
    "maker": "m",
    "edition": "e",
    "type": "ball",
    "dynamic": {"value": "27.1 kN", "base": "50 km"},
    "static": "36.7 kN",
}


def machine(carriages: int, **keys: Any) -> Machine:
    """A machine with this number of carriages on two rails, of a product with ratings; keys: of the carriages."""
    spring = (
        dict(length=0.12, width=0.06, stiffness_y=1.2e8, stiffness_z=1.2e8, damping_y=1e5, damping_z=1e5)
        | keys
    )
    return Machine(
        name="Gantry",
        products=[PRODUCT],
        life={"rule": "thk"},
        body=dict(mass=1250, center_of_mass=[0.1, -0.6, 0.2], inertia=np.diag([420, 310, 380]).tolist()),
        rails=[dict(name=str(i + 1), position=[0.05, z]) for i, z in enumerate((-0.35, 0.35))],
        carriages=[
            dict(
                name=f"{i % 2 + 1}{'abcdefgh'[i // 2]}",
                rail=str(i % 2 + 1),
                x=0.4 * (i // 2),
                product="20",
                **spring,
            )
            for i in range(carriages)
        ],
    )


def weights(carriages: int, factors: int) -> np.ndarray:
    """Newtons of the peak resultant per standard deviation of a factor, (carriage, factor), of either sign."""
    sizes = 400 * 0.75 ** np.arange(factors) * np.where(np.arange(factors) % 3 == 1, -1, 1)
    return sizes * (1 + 0.1 * np.arange(carriages)[:, None])


def level(carriages: int) -> np.ndarray:
    """Mean of the peak resultant of each carriage [N]."""
    return 6000 + 500.0 * np.arange(carriages)


def law(carriage: int, carriages: int, factors: int) -> stats.rv_continuous:
    """The distribution of the peak resultant of a carriage."""
    return stats.norm(level(carriages)[carriage], np.linalg.norm(weights(carriages, factors)[carriage]))


def study(
    samples: int = 300,
    carriages: int = 4,
    factors: int = 5,
    *,
    seed: int = 0,
    sensitivity: bool = False,
    failed: dict[int, str] | None = None,
    finished: int | None = None,
    limits: dict[str, float] | None = None,
    histories: int = 0,
) -> StudyResult:
    """A study with this number of samples (rows, of a Saltelli design). Loads are multiples of the peaks."""
    draws = np.random.default_rng(seed).standard_normal((samples, 2 * factors))
    values = draws[:, :factors]
    if sensitivity:
        a, b = values, draws[:, factors:]
        blocks = [a, b, *(np.where(np.arange(factors) == j, b, a) for j in range(factors))]
        values = np.stack(blocks, axis=1).reshape(-1, factors)
    peaks = level(carriages) + values @ weights(carriages, factors).T
    gantry = machine(carriages)
    shares = {("resultant", "max"): 1.0, ("Fy", "min"): -0.9, ("Fy", "max"): 0.1, ("Fz", "min"): -0.1}
    shares |= {("Fz", "max"): 0.3, ("load", "mean"): 0.8, ("load", "max"): 1.2}
    shares |= {("contact", "lost"): 1.0}
    results = {
        (load, i, statistic): (share * peaks[:, i] if load != "contact" else (peaks[:, i] < 5000) * 1.0)
        for i in range(carriages)
        for (load, statistic), share in shares.items()
    }
    results |= {("drive", 0, "min"): -0.5 * peaks.mean(axis=1), ("drive", 0, "max"): 0.2 * peaks.mean(axis=1)}
    parameters = [ParameterMetadata(name="body.mass", unit="kg", targets=("body.mass",))] + [
        ParameterMetadata(name=f"k[{i}]", unit="1", targets=(f"carriages[{i}].stiffness_y",))
        for i in range(1, factors)
    ]
    metadata = StudyMetadata(
        machine=gantry,
        motion="cycle.csv",
        duration=7.061,
        instants=7062,
        sampling="random",
        seed=seed,
        runs=len(values),
        sensitivity=sensitivity,
        parameters=parameters,
        measures=list(results),
        exponent=3.0,
        limits=limits or {},
    )
    data = {one.name: column.copy() for one, column in zip(parameters, values.T, strict=True)}
    data |= dict(zip(metadata.columns, results.values(), strict=True))
    finished = len(values) if finished is None else finished
    for name, column in data.items():
        column[finished:] = np.nan
        if name in metadata.columns:
            column[list(failed or {})] = np.nan
    labels = [carriage.name for carriage in gantry.carriages]
    stored = _histories(labels, min(histories, samples), peaks) if histories else None
    return StudyResult(Columns(data, failed or {}, stored, finished), metadata)


def _histories(labels: list[str], count: int, peaks: np.ndarray) -> xr.Dataset:
    """Loads that ring after two pushes, as high as the sample's peak."""
    time = np.linspace(0, 7.061, 1500)
    shape = 0.7 + 0.3 * np.sin(0.9 * time) * np.exp(-((time - 2) % 3)) * np.cos(20 * time)
    size = np.vstack([peaks[:count], level(len(labels))])[:, None] * shape[:, None]
    dims = ("sample", "time", "carriage")
    return xr.Dataset(
        {"resultant": (dims, size[:-1]), "nominal_resultant": (dims[1:], size[-1])},
        coords={"sample": np.arange(count), "time": time, "carriage": labels},
    )


def changed(result: StudyResult, **changes: Any) -> StudyResult:
    """The study with other metadata."""
    return StudyResult(result.store, result.metadata.model_copy(update=changes))


def recording(result: StudyResult, recorded: Sequence[tuple[str, str]], **changes: Any) -> StudyResult:
    """The study as if it had recorded these loads and statistics only; the values are those of the peak resultant."""
    carriages = result.metadata.carriages
    places = {load: range(1 if load == "drive" else len(carriages)) for load, _ in recorded}
    measures = [(load, i, statistic) for load, statistic in recorded for i in places[load]]
    found, known = changed(result, measures=measures, **changes), result.store.data
    peak = known[f"max_resultant_N[{carriages[0]}]"]
    data = {column: known.get(column, peak) for column in found.metadata.columns}
    return StudyResult(replace(result.store, data={**known, **data}), found.metadata)


def chosen(result: StudyResult) -> StudyResult:
    """The study as if its cases had been given."""
    return changed(result, sampling="cases", seed=None)


def preloaded(result: StudyResult) -> StudyResult:
    """The study as if all carriages of its machine were preloaded."""
    keys = dict(preload_y=5e3, preload_z=5e3, rolling="ball")
    return changed(result, machine=machine(len(result.metadata.carriages), **keys))


def without_result() -> StudyResult:
    """A study all of whose samples failed."""
    return study(5, failed=dict.fromkeys(range(5), "no equilibrium"), limits={"peak_resultant_N": 1.0})
