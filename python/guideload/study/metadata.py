"""Study metadata: the description of a study as plain data in the file `study.json` beside its samples.

Statistics, report and pictures need only the metadata and the samples. A study is resumed only if its fingerprint
equals that of the metadata in the folder.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, NonNegativeInt, PositiveInt, computed_field

from guideload.audit.plausibility import machine_warnings
from guideload.base.atomic import atomic_write
from guideload.base.errors import ArgumentError, GuideloadError, ReadError, shortened, shown
from guideload.base.finite import finite_json
from guideload.base.methods import Method
from guideload.base.number_text import counted, percent, scientific
from guideload.base.versions import version
from guideload.catalogue.life_target import Repetition
from guideload.life.criteria import Criteria, criteria_of
from guideload.machine.machine import Machine
from guideload.simulation.drive_force import has_friction
from guideload.simulation.start import StartState
from guideload.study.quantities import CONTACT, PEAK_LOAD, QUANTITIES, Measure, column_name, contact_words
from guideload.traces.format.table import listed

FILE = "study.json"
CONTENT = "samples of a guideload study"
FORMAT = 4  # of `study.json` and of the chunks; guideload 0.1.0 wrote format 1, without a number


class ParameterMetadata(BaseModel, frozen=True):
    """One column of drawn values."""

    name: str  # "body.mass", "k[1a]"
    unit: str  # of its values; "1" for factors on the machine's values
    targets: tuple[str, ...]  # paths of the parameters that it sets
    distribution: str = ""  # in words: "uniform from 1125 to 1375 kg"

    @property
    def is_draw(self) -> bool:
        """Whether its values are numbers of draws, which have no order."""
        return self.name == DRAWN_MOTION


DRAWN_MOTION = "motion (posterior)"  # the column with the number of the draw of the motion


class StudyVerification(BaseModel, frozen=True):
    """Some samples, solved a second time under a motion times 1 + `perturbation`, in numbers over their largest load.

    method, rtol   of the second solution
    explained      difference of a link load that the tolerances explain
    solved         number of samples with a second solution
    failed         number of samples without one; reason: why the first of them has none
    doubtful       number of samples in which a peak of a link load differs by more than `explained`
    unpredictable  number of samples in which the change of the motion changes a peak by more than 1e-3
    difference     largest difference of a peak; in the sample difference_in
    sensitivity    largest change of a peak by that of the motion, in the sample sensitivity_in
    """

    method: str
    rtol: float
    perturbation: float
    explained: float
    solved: NonNegativeInt
    failed: NonNegativeInt
    reason: str = ""
    doubtful: NonNegativeInt
    unpredictable: NonNegativeInt
    difference: float
    difference_in: NonNegativeInt
    sensitivity: float
    sensitivity_in: NonNegativeInt

    def doubts(self, what: str) -> tuple[str, ...]:
        """Doubts about samples in words, the gravest first. what: "sample" or "case"."""
        of, doubts = f"of {counted(self.solved, what)} solved again", []
        if self.unpredictable:
            doubts.append(
                f"Doubtful: {self.unpredictable} {of} cannot be predicted: impacts amplify small differences. A motion "
                f"times 1 + {scientific(self.perturbation)} changes loads by up to {percent(self.sensitivity)} of "
                f"the largest load ({what} {self.sensitivity_in}). Damping that always acts "
                "(damping_in_contact = false), more damping or less clearance makes the loads predictable."
            )
        if self.doubtful:
            way_out = "look for extreme values" if self.method == "exact" else "use a smaller rtol"
            doubts.append(
                f"Doubtful: {self.doubtful} {of}, by {self._method_text}, "
                f"{'differs' if self.doubtful == 1 else 'differ'} by "
                f"up to {percent(self.difference)} of the largest load ({what} {self.difference_in}); only "
                f"{scientific(self.explained)} is explained. Solve this {what} by itself, with simulate, and {way_out}."
            )
        return tuple(doubts)

    def agreement(self, what: str) -> str:
        """How well both solutions agree where there are no doubts, in words. what: "sample" or "case"."""
        missing = f"; {self.failed} could not be solved again: {self.reason}" if self.failed else ""
        return (
            f"{counted(self.solved, what)} solved again by {self._method_text}: peaks of all links agree to "
            f"{scientific(self.difference)} of the largest load{missing}"
        )

    @property
    def _method_text(self) -> str:
        if self.method == "exact":
            return self.method
        return f"{'another method' if self.method == 'auto' else self.method} at rtol {scientific(self.rtol)}"


class StudyMetadata(BaseModel, frozen=True):
    """Machine, motion, design and columns of a study.

    fingerprint     SHA-256 of everything that the result of a run depends on
    versions        of guideload, NumPy and SciPy
    motion          source of the motion; motion_digest: SHA-256 of its arrays; motion_exact: it has no uncertainty
    duration        of the motion [s]; instants: its samples; travel: of the cart [m], where there is a life
    sampling        "sobol", "latin hypercube" or "random"; "cases" for given cases, without a seed
    runs            all runs of the study, those of a Saltelli design included
    replicates      independent scrambles that take turns: sample (or row) i is of i % replicates; 1 for random numbers
    sensitivity     run i is row i // (d + 2) of matrix i % (d + 2): A, B, A with column j of B
    parameters      the d columns of drawn values, in their order; the last may be the number of the draw of the motion
    correlations    of normal scores, by the names of both parameters: "body.mass and k[1a]"
    measures        recorded load, carriage and statistic of each column of results
    start           of all runs: rest or quasi-static
    exponent        p of the mean load
    limits          by quantity, in its unit: {"peak_resultant_N": 7000.0}
    life_notes      on life and static safety, or why they are not computed, in sentences
    motion_warnings of the motion, and of what it may hide from the machine
    verification    samples solved again when all were done; text if none had to be; None in an unfinished study
    """

    content: str = CONTENT
    format: int = FORMAT
    fingerprint: str = ""
    versions: dict[str, str] = Field(
        default_factory=lambda: {name: version(name) for name in ("guideload", "numpy", "scipy")}
    )
    machine: Machine
    motion: str
    motion_digest: str = ""
    motion_exact: bool = False
    duration: float
    instants: int
    travel: float | None = None
    method: Method = "auto"
    rtol: float = 1e-6
    start: StartState = "rest"
    sampling: str
    seed: int | None = None
    runs: NonNegativeInt
    replicates: PositiveInt = 1
    sensitivity: bool
    parameters: tuple[ParameterMetadata, ...]
    correlations: dict[str, float] = {}
    measures: tuple[Measure, ...]
    exponent: float
    limits: dict[str, float]
    life_notes: tuple[str, ...] = ()
    motion_warnings: tuple[str, ...] = ()
    verification: StudyVerification | str | None = None

    @computed_field  # type: ignore[prop-decorator]
    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of results: "max_Fy_N[1a]", "contact_lost[1a]", "max_drive_N"."""
        return tuple(
            column_name(load, statistic) + ("" if load == "drive" else f"[{self.carriages[i]}]")
            for load, i, statistic in self.measures
        )

    @property
    def repetition(self) -> Repetition | None:
        """The repetition of the motion in operation, which converts lives; None where there is no life."""
        return None if self.travel is None else self.machine.life.repetition(self.travel, self.duration)

    @property
    def warnings(self) -> list[str]:
        """The warnings of motion and machine."""
        return [*self.motion_warnings, *machine_warnings(self.machine)]

    @property
    def matrices(self) -> int:
        """Runs for each row of the design: those of the Saltelli design, or 1."""
        return len(self.parameters) + 2 if self.sensitivity else 1

    @property
    def draws_motion(self) -> bool:
        """Whether each sample has a motion of its own, drawn from the posterior of the trace."""
        return any(one.is_draw for one in self.parameters)

    @property
    def chosen(self) -> bool:
        """Whether cases were given: as they are no random sample, they have no statistics."""
        return self.sampling == "cases"

    @property
    def carriages(self) -> tuple[str, ...]:
        """Names of the carriages, in their order."""
        return tuple(carriage.name for carriage in self.machine.carriages)

    def title(self, name: str) -> str:
        """The title of a column, such as "peak resultant"; a column that is no quantity has its name."""
        stem = name.partition("[")[0]
        if stem == CONTACT:
            return contact_words(self.machine)
        if stem not in QUANTITIES:
            return name
        without = " without friction" if QUANTITIES[stem].of_machine and has_friction(self.machine) else ""
        return QUANTITIES[stem].title + without

    def title_with_unit(self, name: str) -> str:
        """The title of a column and its unit: "peak resultant [N]"."""
        quantity = QUANTITIES.get(name.partition("[")[0])
        return self.title(name) + (f" [{quantity.unit}]" if quantity is not None and quantity.unit else "")

    def title_with_owner(self, name: str) -> str:
        """The title of a column with its carriage: "the peak resultant of 1a", or "... of the machine"."""
        stem, _, carriage = name.partition("[")
        if stem not in QUANTITIES:
            return name
        return f"the {self.title(stem)} of {carriage.removesuffix(']') or 'the machine'}"

    def rated(self) -> tuple[Criteria, ...]:
        """How life and static safety follow from the columns, of each carriage that has them; empty if none has."""
        if not any((load, statistic) == PEAK_LOAD for load, _, statistic in self.measures):
            return ()
        return criteria_of(self.machine, self.machine.life)

    def as_json(self) -> dict[str, Any]:
        """The metadata as dicts, lists, numbers and text, without None."""
        return self.model_dump(mode="json", exclude_none=True)

    def write(self, folder: Path) -> None:
        """Write `study.json` atomically."""
        with atomic_write(folder / FILE, durable=True) as draft:
            text = finite_json(self.as_json(), indent=1, ascii_only=False)
            draft.write_text(f"{text}\n", encoding="utf-8")

    @classmethod
    def read(cls, folder: Path) -> StudyMetadata:
        """The metadata in a folder. Raises ReadError if there is no study, or one of another format."""
        path, values = folder / FILE, read_json(folder)
        if values is None:
            raise ReadError(f"{folder} holds no study: there is no {path}")
        if (found := values.get("format", 1)) != FORMAT:
            raise ReadError(
                f"{path}: expected format {FORMAT}, got {found}: another version of guideload wrote this study. "
                "Read it with that version, give another folder, or replace it (--overwrite)"
            )
        try:
            metadata = cls.model_validate(values)
            of_all_carriages = {
                (load, i, statistic)
                for load, _, statistic in metadata.measures
                for i in range(1 if load == "drive" else len(metadata.carriages))
            }
            if list(metadata.columns) != values.get("columns") or set(metadata.measures) != of_all_carriages:
                raise ValueError("measures that do not belong to its columns")
        except (ValueError, GuideloadError, KeyError, IndexError) as error:  # the last two: unknown measures
            got = shortened(str(error))
            raise ReadError(f"{path}: expected the metadata of a study, got {got}") from error
        return metadata

    def require_resumable(self, folder: Path) -> None:
        """Raise ArgumentError with the differences if the folder holds another study, or one with more runs."""
        there = StudyMetadata.read(folder)
        if there.fingerprint == self.fingerprint:
            if there.runs > self.runs:
                raise ArgumentError(
                    f"{folder} holds a study of {there.runs} runs: resume it with at least as many, "
                    f"got {self.runs}"
                )
            return
        one, other = there.as_json(), self.as_json()
        differences = list(_different("", _decisive(one, other), _decisive(other, one)))
        first = "; ".join(differences[:3]) or "values of the given cases or of a sample"
        more = f"; and {len(differences) - 3} more" if len(differences) > 3 else ""
        raise ArgumentError(
            f"{folder} holds another study, which cannot be resumed as this one. What differs: {first}{more}. "
            "Give this study another folder, replace the one there (--overwrite), or undo the change"
        )


def read_json(folder: Path) -> dict[str, Any] | None:
    """The contents of `study.json` in any format; None if it is missing. Raises ReadError for another file."""
    path = folder / FILE
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (ValueError, RecursionError) as error:
        hint = "it is damaged: give another folder, or remove it and run the study anew"
        raise ReadError(f"{path}: expected the metadata of a study, got {error}; {hint}") from None
    if not isinstance(values, dict) or values.get("content") != CONTENT:
        raise ReadError(f"{path}: expected the metadata of a study that guideload wrote")
    return values


def _decisive(values: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """Values that must agree for a study to be resumed, by their name in messages."""
    keys = ["seed", "sampling", "replicates", "sensitivity", "exponent"]
    if values["sampling"] == other["sampling"] == "latin hypercube":
        keys.append("runs")
    parameters = values["parameters"]
    sets = {f"{one['name']} sets": one["targets"] for one in parameters if one["targets"] != [one["name"]]}
    only = [column for column in values["columns"] if column not in other["columns"]]
    return (
        {key: values.get(key) for key in keys}
        | {one["name"]: one["distribution"] for one in parameters}
        | {name: listed(targets) for name, targets in sets.items()}
        | {f"correlation of {pair}": value for pair, value in values["correlations"].items()}
        | {"machine": values["machine"], "motion": f"{values['motion']} ({values['motion_digest'][:8]})"}
        | {key: values[key] for key in ("method", "rtol", "start", "versions")}
        | ({"recorded columns": f"also {listed(only)}"} if only else {})
    )


def _different(key: str, there: Any, here: Any) -> Iterator[str]:
    """Text for each difference of two descriptions."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in dict.fromkeys([*here, *there]):
            yield from _different(f"{key}.{name}" if key else name, there.get(name), here.get(name))
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for i, (one, other) in enumerate(zip(there, here, strict=True)):
            yield from _different(f"{key}[{i}]", one, other)
    elif there != here:
        yield f"{key}: {_text(there)} there, {_text(here)} here"


def _text(value: Any) -> str:
    """Text unchanged, other values as in TOML."""
    return "nothing" if value is None else value if isinstance(value, str) else shown(value)
