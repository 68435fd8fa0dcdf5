"""`study.json`: which study a folder holds. Written before any sample; resuming goes by it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.errors import ArgumentError, shown
from guideload.study.whole import whole

if TYPE_CHECKING:
    from guideload.motion import Motion
    from guideload.study.plan import Plan

MANIFEST = "study.json"
TITLE = "samples of a guideload study"
VERSIONS = ("guideload", "numpy", "scipy")


def described(plan: Plan) -> dict[str, Any]:
    """What the manifest tells of a plan.

    fingerprint   of all that decides the results; the rest is there to be read, and to tell what differs
    studied       what statistics, report and pictures need, see `Studied`
    factors       what varies and how, in words
    motion        digest of its arrays
    versions      that the samples were run with
    """
    from guideload.study.studied import Studied

    return {
        "content": TITLE,
        "fingerprint": plan.fingerprint(),
        "studied": Studied.of(plan).as_json(),
        "factors": [str(factor) for factor in plan.factors],
        "motion": _digest(plan.motion),
        "versions": {name: version(name) for name in VERSIONS},
    }


def _digest(motion: Motion) -> str:
    digest = sha256()
    for history in (motion.time, motion.acceleration, motion.velocity, motion.wrench):
        digest.update(b"-" if history is None else np.ascontiguousarray(history).tobytes())
    return digest.hexdigest()


def write(folder: Path, plan: Plan) -> None:
    """The manifest of a plan's folder, whole."""
    with whole(folder / MANIFEST) as draft:
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
    keys = [key for key in here if key != "fingerprint"]
    found = [text for key in keys for text in _different(key, there.get(key), here[key])]
    told = "; ".join(found[:3]) or "how it is drawn"
    more = f"; and {len(found) - 3} more" if len(found) > 3 else ""
    raise ArgumentError(
        f"{folder} holds another study, which cannot go on as this one. There, and here: {told}{more}. "
        "Give this study another folder, or make it what it was"
    )


def _different(key: str, there: Any, here: Any) -> Iterator[str]:
    """Each place where two descriptions differ, in words."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in [*here, *(name for name in there if name not in here)]:
            yield from _different(f"{key}.{name}", there.get(name), here.get(name))
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for i, (one, other) in enumerate(zip(there, here, strict=True)):
            yield from _different(f"{key}[{i}]", one, other)
    elif there != here:
        yield f"{key.removeprefix('studied.')} {shown(there)}, and {shown(here)}"
