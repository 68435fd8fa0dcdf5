"""`study.json`: which study a folder holds. Written before any sample; resuming goes by it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.atomic import atomic_write
from guideload.base.errors import ArgumentError, shown
from guideload.traces.format.table import listed

if TYPE_CHECKING:
    from guideload.motion.motion import Motion
    from guideload.study.plan import Plan

MANIFEST = "study.json"
TITLE = "samples of a guideload study"
VERSIONS = ("guideload", "numpy", "scipy")


def described(plan: Plan) -> dict[str, Any]:
    """What the manifest tells of a plan.

    fingerprint   of all that decides the results; the rest is there to be read, and to tell what differs
    studied       what statistics, report and pictures need, see `StudyMetadata`
    factors       what varies and how, in words, by name
    correlations  of pairs that have one, by their names
    method, rtol  of the runs
    motion        digest of its arrays
    versions      that the samples were run with
    """
    from guideload.study.metadata import StudyMetadata

    return {
        "content": TITLE,
        "fingerprint": plan.fingerprint(),
        "studied": StudyMetadata.of(plan).as_json(),
        "factors": {factor.name: factor.words for factor in plan.factors},
        "correlations": _correlations(plan),
        "method": plan.method,
        "rtol": plan.rtol,
        "motion": _digest(plan.motion),
        "versions": {name: version(name) for name in VERSIONS},
    }


def _correlations(plan: Plan) -> dict[str, float]:
    """The correlation of each pair of factors that has one, to 9 digits: they are made of a Cholesky factor."""
    copula = None if plan.design is None else plan.design.copula
    if copula is None:
        return {}
    names = [plan.factors[column].name for column in copula.columns]
    lower = np.zeros((len(names), len(names)))
    for i, row in enumerate(copula.factor):
        lower[i, : len(row)] = row
    matrix = np.tril(np.round(lower @ lower.T, 9), -1)
    return {f"{names[j]} and {names[i]}": float(matrix[i, j]) for i, j in np.argwhere(matrix).tolist()}


def _digest(motion: Motion) -> str:
    digest = sha256()
    for history in (motion.time, motion.acceleration, motion.velocity, motion.wrench):
        digest.update(b"-" if history is None else np.ascontiguousarray(history).tobytes())
    return digest.hexdigest()


def write(folder: Path, plan: Plan) -> None:
    """The manifest of a plan's folder, whole."""
    with atomic_write(folder / MANIFEST, durable=True) as draft:
        text = json.dumps(described(plan), indent=1, ensure_ascii=False)
        draft.write_text(text + "\n", encoding="utf-8")


def read(folder: Path) -> dict[str, Any] | None:
    """What the manifest of a folder says, or None if there is none. Raises ArgumentError if it is not ours."""
    path = folder / MANIFEST
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except ValueError as error:
        raise ArgumentError(f"{path}: expected the manifest of a study, got {error}") from None
    if not isinstance(content, dict) or content.get("content") != TITLE:
        raise ArgumentError(f"{path}: expected the manifest of a study that guideload wrote")
    return content


def require_same(folder: Path, there: dict[str, Any], plan: Plan) -> None:
    """Raise ArgumentError that tells what differs, if the folder holds another study than the plan's."""
    runs = there["studied"]["runs"]
    if there["fingerprint"] == plan.fingerprint():
        if runs > plan.runs:
            raise ArgumentError(
                f"{folder} holds a study of {runs} runs: resume it with as many or with more, got {plan.runs}"
            )
        return
    here = json.loads(json.dumps(described(plan)))  # tuples and lists are the same in a file
    found = list(_differences(there, here))
    told = "; ".join(found[:3]) or "values of the given cases or of a sample"
    more = f"; and {len(found) - 3} more" if len(found) > 3 else ""
    raise ArgumentError(
        f"{folder} holds another study, which cannot go on as this one. What differs: {told}{more}. "
        "Give this study another folder, replace the one there (--overwrite), or make this one what it was"
    )


def _differences(there: dict[str, Any], here: dict[str, Any]) -> Iterator[str]:
    """What keeps one study from going on as another, in words; what may differ is left out."""
    one, other = there["studied"], here["studied"]
    for key in ("seed", "sampling", "sensitivity", "exponent"):
        yield from _different(key, one[key], other[key])
    if other["sampling"] == one["sampling"] == "latin hypercube":
        yield from _different("runs", one["runs"], other["runs"])
    yield from _different("", there.get("factors"), here["factors"])
    yield from _different("", _targets(one), _targets(other))
    correlated = (
        {f"correlation of {pair}": value for pair, value in of.items()}
        for of in (there.get("correlations", {}), here["correlations"])
    )
    yield from _different("", *correlated)
    yield from _different("machine", one["machine"], other["machine"])
    if there["motion"] != here["motion"]:
        yield f"the motion: that of {one['motion']} there, another of {other['motion']} here"
    for key in ("method", "rtol", "versions"):
        yield from _different(key, there.get(key), here[key])
    for where, columns, without in (
        ("there", one["columns"], other["columns"]),
        ("here", other["columns"], one["columns"]),
    ):
        if only := [column for column in columns if column not in without]:
            yield f"what is kept: {listed(only)} only {where}"


def _targets(studied: dict[str, Any]) -> dict[str, str]:
    """What each factor sets, but where its name tells it."""
    sets = {varied["name"]: varied["targets"] for varied in studied["varied"]}
    return {f"{name} sets": listed(targets) for name, targets in sets.items() if targets != [name]}


def _different(key: str, there: Any, here: Any) -> Iterator[str]:
    """Each place where two descriptions differ, in words."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in [*here, *(name for name in there if name not in here)]:
            yield from _different(f"{key}.{name}" if key else name, there.get(name), here.get(name))
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for i, (one, other) in enumerate(zip(there, here, strict=True)):
            yield from _different(f"{key}[{i}]", one, other)
    elif there != here:
        yield f"{key}: {_told(there)} there, {_told(here)} here"


def _told(value: Any) -> str:
    """Text as it is, all else as TOML has it."""
    return "nothing" if value is None else value if isinstance(value, str) else shown(value)
