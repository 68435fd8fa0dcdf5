"""Studies whose distributions are known: peaks that are sums of independent normal factors, without any core."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pyarrow as pa
import xarray as xr
from scipy import stats

from guideload.machine.machine import Machine
from guideload.study.metadata import StudyMetadata, Varied
from guideload.study.result import StudyResult


@dataclass
class Columns:
    """Samples in memory, as a study's parts give them."""

    data: dict[str, np.ndarray]
    failed: dict[int, str] = field(default_factory=dict)
    kept: xr.Dataset | None = None
    done: int = 0
    read: list[str] = field(default_factory=list)  # columns that were asked for

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(self.data)

    def column(self, name: str) -> np.ndarray:
        self.read.append(name)
        return self.data[name].copy()

    def reasons(self) -> dict[int, str]:
        return dict(self.failed)

    def histories(self) -> xr.Dataset | None:
        return self.kept

    def tables(self) -> Iterator[pa.Table]:
        runs = len(next(iter(self.data.values())))
        reasons = pa.array([self.failed.get(i) for i in range(runs)], pa.string())
        whole = pa.table({"sample": np.arange(runs), **self.data, "reason": reasons})
        yield whole.slice(0, runs // 2)
        yield whole.slice(runs // 2)


def machine(carriages: int) -> Machine:
    """A machine with so many carriages on two rails."""
    spring = dict(length=0.12, stiffness_y=1.2e8, stiffness_z=1.2e8, damping_y=1e5, damping_z=1e5)
    return Machine(
        name="Gantry",
        body=dict(mass=1250, center_of_mass=[0.1, -0.6, 0.2], inertia=np.diag([420, 310, 380]).tolist()),
        rails=[dict(name=str(i + 1), position=[0.05, z]) for i, z in enumerate((-0.35, 0.35))],
        carriages=[
            dict(name=f"{i % 2 + 1}{'abcdefgh'[i // 2]}", rail=str(i % 2 + 1), x=0.4 * (i // 2), **spring)
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
    spread = np.linalg.norm(weights(carriages, factors)[carriage])
    return stats.norm(level(carriages)[carriage], spread)


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
    rating: float | None = 27.1e3,
    histories: int = 0,
) -> StudyResult:
    """A study of so many samples (rows, of a Saltelli design)."""
    draws = np.random.default_rng(seed).standard_normal((samples, 2 * factors))
    values = draws[:, :factors]
    if sensitivity:
        blocks = [values, draws[:, factors:]]
        for j in range(factors):
            blocks.append(values.copy())
            blocks[-1][:, j] = draws[:, factors + j]
        values = np.stack(blocks, axis=1).reshape(-1, factors)
    runs = len(values)
    peaks = level(carriages) + values @ weights(carriages, factors).T
    described, columns, results = [], [], []
    labels = [carriage.name for carriage in machine(carriages).carriages]
    for i, label in enumerate(labels):
        of_one = {
            ("resultant", "max"): peaks[:, i],
            ("Fy", "min"): -0.9 * peaks[:, i],
            ("Fy", "max"): 0.1 * peaks[:, i],
            ("Fz", "min"): -0.1 * peaks[:, i],
            ("Fz", "max"): 0.3 * peaks[:, i],
            ("load", "mean"): 0.8 * peaks[:, i],
            ("contact", "lost"): (peaks[:, i] < 5000).astype(float),
        }
        for (quantity, statistic), column in of_one.items():
            described.append((quantity, i, statistic))
            name = {"load": "mean_load_N", "contact": "contact_lost"}.get(
                quantity, f"{statistic}_{quantity}_N"
            )
            columns.append(f"{name}[{label}]")
            results.append(column)
    for statistic, factor in (("min", -0.5), ("max", 0.2)):
        described.append(("drive", 0, statistic))
        columns.append(f"{statistic}_drive_N")
        results.append(factor * peaks.mean(axis=1))
    varied = [Varied("body.mass", "kg", ("body.mass",))]
    varied += [Varied(f"k[{i}]", "1", (f"carriages[{i}].stiffness_y",)) for i in range(1, factors)]
    table = np.array(results).T
    table[list(failed or {})] = np.nan
    data = {one.name: column.copy() for one, column in zip(varied, values.T, strict=True)}
    data |= dict(zip(columns, table.T.copy(), strict=True))
    finished = runs if finished is None else finished
    for column in data.values():
        column[finished:] = np.nan
    studied = StudyMetadata(
        machine=machine(carriages),
        motion="cycle.csv",
        duration=7.061,
        instants=7062,
        sampling="random",
        seed=seed,
        runs=runs,
        sensitivity=sensitivity,
        varied=tuple(varied),
        measures=tuple(described),
        columns=tuple(columns),
        exponent=3.0,
        limits={} if limits is None else limits,
        rating=rating,
        life_base=None if rating is None else 50e3,
    )
    kept = _histories(labels, min(histories, samples), peaks) if histories else None
    return StudyResult(Columns(data, failed or {}, kept, finished), studied)


def _histories(labels: list[str], count: int, peaks: np.ndarray) -> xr.Dataset:
    """Loads that ring after two pushes, as high as the sample's peak."""
    time = np.linspace(0, 7.061, 1500)
    shape = 0.7 + 0.3 * np.sin(0.9 * time) * np.exp(-((time - 2) % 3)) * np.cos(20 * time)
    size = np.zeros((count + 1, len(labels), 6))
    size[:, :, 1] = -0.9 * np.vstack([peaks[:count], level(len(labels))])
    size[:, :, 2] = 0.3 * np.vstack([peaks[:count], level(len(labels))])
    load = size[:, None] * shape[:, None, None]
    resultant = np.hypot(load[..., 1], load[..., 2])
    dims = ("sample", "time", "carriage")
    return xr.Dataset(
        {
            "force": ((*dims, "axis"), load[:-1, ..., :3]),
            "resultant": (dims, resultant[:-1]),
            "nominal_resultant": (dims[1:], resultant[-1]),
        },
        coords={"sample": np.arange(count), "time": time, "carriage": labels, "axis": list("xyz")},
    )


def keeping(result: StudyResult, kept: Iterable[tuple[str, str]]) -> StudyResult:
    """The study as if it had kept only these quantities and statistics."""
    pairs = zip(result.studied.measures, result.studied.columns, strict=True)
    measures, columns = zip(*((m, column) for m, column in pairs if (m[0], m[2]) in kept), strict=True)
    return StudyResult(result.parts, replace(result.studied, measures=measures, columns=columns))


def chosen(result: StudyResult) -> StudyResult:
    """The study as if its cases had been given."""
    return StudyResult(result.parts, replace(result.studied, sampling="cases", seed=None))


def preloaded(result: StudyResult) -> StudyResult:
    """The study as if all carriages of its machine were preloaded."""
    machine = result.studied.machine
    keys = dict(preload_y=5e3, preload_z=5e3, rolling="ball")
    carriages = [{**one.model_dump(exclude_none=True), **keys} for one in machine.carriages]
    described = Machine(**{**machine.model_dump(exclude_none=True), "carriages": carriages})
    return StudyResult(result.parts, replace(result.studied, machine=described))
