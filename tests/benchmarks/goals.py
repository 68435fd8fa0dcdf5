"""What issue 3 asks of the figures, and what was found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from measure import Job, Measured

USEFUL = 1e-3  # error of the load that a designer can still use


@dataclass(frozen=True)
class Goal:
    """One line."""

    what: str
    asked: str
    found: str
    met: bool

    def __str__(self) -> str:
        return f"{self.what:66} asked {self.asked:22} found {self.found:34} {'' if self.met else 'MISSED'}"


def goals(scenes: list[Measured]) -> list[Goal]:
    """All of them, for the scenes in the order of `cases()`."""
    plain, _, clear, clear_noisy, overdamped, preloaded = scenes
    return [
        *_linear(plain),
        *_clear(clear, clear_noisy),
        *_overdamped(plain, overdamped),
        _at_least("preloaded, error 1e-6: quicker than the best peer", 3.0, preloaded, 1e-6, ""),
    ]


def _linear(scene: Measured) -> list[Goal]:
    exact = _exact(scene)
    above = [
        job
        for job in scene.valid
        if not job.ours and exact is not None and job.median < exact.median and job.rank <= exact.rank
    ]
    found = ", ".join(job.name for job in above) if exact else "no exact run"
    none = exact is not None and not above
    return [
        Goal("linear: peers quicker than exact and no less accurate", "none", found or "none", none),
        _at_least("linear, error 1e-6: quicker than solve_ivp's best", 50.0, scene, 1e-6, "solve_ivp"),
        _at_least("linear, error 1e-6: quicker than pydiffsol's best", 5.0, scene, 1e-6, "pydiffsol"),
    ]


def _clear(scene: Measured, noisy: Measured) -> list[Goal]:
    exact, on_noise = _exact(scene), _exact(noisy)
    name = "clearance, exact"
    if exact is None or on_noise is None:
        return [Goal(name, "<= 0.8 ms at <= 1e-9", "no exact run", False)]
    ratio = on_noise.median / exact.median
    return [
        Goal(f"{name}: time", "<= 0.8 ms", f"{exact.median * 1e3:.2f} ms", exact.median <= 0.8e-3),
        Goal(f"{name}: error of the load", "<= 1e-9", f"{exact.error:.0e}", exact.error <= 1e-9),
        _at_least("clearance, error 1e-3: quicker than the best peer", 5.0, scene, USEFUL, ""),
        _at_least("clearance, error 1e-6: quicker than the best peer", 5.0, scene, 1e-6, ""),
        Goal(f"{name}: noisy to clean", "<= 1.5", f"{ratio:.2f}", ratio <= 1.5),
        _at_least("clearance, noisy, error 1e-3: quicker than the best peer", 5.0, noisy, USEFUL, ""),
        _at_least("clearance, noisy, error 1e-6: quicker than the best peer", 5.0, noisy, 1e-6, ""),
    ]


def _overdamped(plain: Measured, scene: Measured) -> list[Goal]:
    found = []
    for name in ("guideload exact", "guideload implicit"):
        pair = [_setting(of, name) for of in (scene, plain)]
        if None in pair:
            found.append(Goal(f"overdamped to plain, {name}", "<= 1.5", "not run", False))
            continue
        ratio = pair[0].median / pair[1].median  # type: ignore[union-attr]
        found.append(Goal(f"overdamped to plain, {name}", "<= 1.5", f"{ratio:.2f}", ratio <= 1.5))
    return found


def _exact(scene: Measured) -> Job | None:
    return _setting(scene, "guideload exact")


def _setting(scene: Measured, name: str) -> Job | None:
    """The job of that name at rtol 1e-6, or without any setting."""
    return next((job for job in scene.valid if job.name == name and job.setting in ("", "rtol 1e-06")), None)


def quickest(jobs: list[Job], error: float) -> Job | None:
    """The quickest that is at least that accurate."""
    enough = [job for job in jobs if job.error <= error]
    return min(enough, key=lambda job: job.median, default=None)


def _at_least(what: str, times: float, scene: Measured, error: float, peers: str) -> Goal:
    """guideload's quickest at that error against the quickest peer whose name begins with `peers`."""
    ours = quickest([job for job in scene.valid if job.ours], error)
    peer = quickest([job for job in scene.valid if not job.ours and job.name.startswith(peers)], error)
    asked = f">= {times:g} x"
    if ours is None or peer is None:
        return Goal(what, asked, "not run" if ours is None else "no peer is that accurate", ours is not None)
    ratio = peer.median / ours.median
    found = (
        f"{ratio:.1f} x ({ours.median * 1e3:.2f} ms; {peer.median * 1e3:.2f} ms, {peer.name} {peer.setting})"
    )
    return Goal(what, asked, found, bool(np.isfinite(ratio)) and ratio >= times)
