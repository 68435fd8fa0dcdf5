"""Hostile calls of the compiled core: every one ends in finite numbers or in an error of the documented kinds."""

import math
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import core_batch

from guideload import GuideloadError, _core
from guideload._core import Law, Scene

TYPED = GuideloadError, ValueError, TypeError, OverflowError, MemoryError, IndexError
LINKS, SAMPLES = 8, 20

rng = np.random.default_rng(0)
directions = np.eye(3)[1 + np.arange(LINKS) % 2]
time = 1e-3 * np.arange(SAMPLES)
groups = [np.arange(4), np.arange(4, 8)]
SCENE: dict[str, Any] = {
    "mass": 1e3,
    "center_of_mass": (0.0, 0.1, 0.0),
    "inertia": np.diag([300.0, 310.0, 320.0]).tolist(),
    "gravity": (0.0, -9.8, 0.0),
    "free": ["y", "z", "rx", "ry", "rz"],
    "points": rng.normal(size=(LINKS, 3)),
    "directions": directions,
    "laws": [Law.linear(1e6)] * LINKS,
    "damping": np.full(LINKS, 1e3),
    "damping_in_contact": np.zeros(LINKS, bool),
}
MOTION: dict[str, Any] = {
    "time": time,
    "acceleration": rng.normal(size=(SAMPLES, 3)),
    "wrench": rng.normal(size=(SAMPLES, 6)),
    "rtol": 1e-6,
}
GROUPS: dict[str, Any] = {"groups": groups, "centers": np.zeros((2, 3))}
MODEL: dict[str, Any] = {
    "step": np.full(SAMPLES - 1, 1e-3),
    "value": np.zeros(SAMPLES),
    "variance": np.full(SAMPLES, 1e-8),
    "mean": np.zeros(4),
    "covariance": np.eye(4),
    "segment": np.zeros(SAMPLES - 1, np.uint32),
    "density": np.ones(1),
    "oscillator": (0.5, 0.1, 1),
}
CHAIN = {key: MODEL[key] for key in ("step", "variance", "covariance", "segment", "density", "oscillator")}
scene = Scene(**SCENE)


def made(**arguments: Any) -> list[Any]:
    made = Scene(**arguments)
    return [made.static_position(), made.static_link_loads(), *made.matrices(), *made.modes()[:3]]


def solved(**arguments: Any) -> list[Any]:
    found = scene.solve(**arguments)
    return [found.link_loads("total"), found.position(), found.acceleration(), found.reaction()]


def batch(**arguments: Any) -> Any:
    values, failed = core_batch(**arguments).run(np.ones((2, 1)), 1)
    return None if failed else values


CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Scene": (made, SCENE),
    "solve": (solved, MOTION | {"method": "exact", "step": None, "times": time[2:5].copy()}),
    "solve by rk45": (solved, MOTION | {"method": "rk45", "step": None}),
    "peaks": (scene.peaks, MOTION | GROUPS | {"method": "exact", "step": None}),
    "static_group_loads": (scene.static_group_loads, GROUPS),
    "Batch": (
        batch,
        SCENE
        | GROUPS
        | MOTION
        | {
            "inertia_about_reference": False,
            "speed": np.ones(SAMPLES),
            "exponent": 3.0,
            "changes": [(("mass", 0, 0), 1e3, [(0, 1.0)])],
            "measures": [("Fy", 0, "max"), ("resultant", 1, "rms")],
            "method": "auto",
        },
    ),
    "linear": (Law.linear, {"stiffness": 1.0}),
    "sided": (Law.sided, {"positive": 1.0, "negative": 1.0, "clearance": 0.0}),
    "preloaded": (Law.preloaded, {"stiffness": 1.0, "preload": 1.0, "exponent": 1.5}),
    "curve": (Law.curve, {"points": np.array([[0.0, 0.0], [1.0, 1.0]])}),
    "motion_likelihood": (lambda **model: _core.motion_likelihood(tuple(model.values())), MODEL),
    "smooth_motion": (lambda **model: _core.smooth_motion(tuple(model.values())), MODEL),
    "adapt_motion": (
        lambda **rest: _core.adapt_motion(tuple(MODEL.values()), **rest),
        {"rounded": np.zeros(SAMPLES), "quantum": 1e-6, "level": 1e-8, "rule": (2, 1.0, 1.0, 1e-14)},
    ),
    "draw_motion": (
        lambda derivative, count, seed, **chain: _core.draw_motion(
            tuple(chain.values()), derivative, count, seed
        ),
        CHAIN | {"derivative": 1, "count": 3, "seed": 1},
    ),
    "load_spread": (
        lambda **rest: _core.load_spread(scene, tuple(CHAIN.values()), **rest),
        GROUPS
        | {"derivative": 2, "unit": np.ones(SAMPLES), "time": time, "instants": time[2:5].copy()}
        | {"loads": np.ones((3, 2, 6))},
    ),
}


class Raises:
    """An object whose every conversion raises."""

    def refuse(self, *_: object) -> Any:
        raise ValueError("no")

    __float__ = __index__ = __len__ = __getitem__ = __iter__ = refuse


class Endless:
    """A sequence that says it has 2^62 entries."""

    def __len__(self) -> int:
        return 2**62

    def __getitem__(self, index: int) -> float:
        return 1.0


NUMBERS = {
    "not finite": (math.nan, math.inf, -math.inf),
    "huge": (1e308, -1e308, 1e154),
    "small": (5e-324, 0.0, -1.0),
}
PLAIN = (None, Raises(), "x", "\0", b"x", -1, 2**62, 2**64, 10**400, True, [], (), {}, [1], [[]], object())
SHAPES = (
    np.zeros(0),
    np.zeros((0, 3)),
    np.zeros((0, 0)),
    np.zeros((3, 0)),
    np.zeros((2, 2, 2)),
    np.array(1.0),
)
TYPES = (np.zeros((LINKS, 3), np.float32), np.zeros(LINKS, complex), np.array(["a"]), np.array([Raises()]))


def changed(array: np.ndarray) -> Iterator[np.ndarray]:
    """The array with another layout, length or type."""
    yield from (array[::-1], array[::2], array[:0], array[:1], array.astype(np.float32), array[None])
    yield np.asfortranarray(array)
    yield np.concatenate([array, array])
    yield np.broadcast_to(array.flat[0], array.shape)
    frozen = array.copy()
    frozen.flags.writeable = False
    yield frozen
    if array.dtype.kind == "f":
        yield array.astype(array.dtype.newbyteorder())
        odd = np.ndarray(array.shape, array.dtype, np.zeros(array.nbytes + 1, np.uint8).data, offset=1)
        odd[...] = array  # not aligned to its numbers
        yield odd


def with_number(array: np.ndarray, number: float) -> Iterator[np.ndarray]:
    """The array with one number replaced, and with all."""
    if array.dtype.kind == "f":
        one = array.copy()
        one.flat[array.size // 2] = number
        yield from (one, np.full_like(array, number))


def hostile(value: Any, kind: str) -> list[Any]:
    """What stands in place of a value."""
    if kind == "endless":
        return [Endless()]
    first = value[0] if isinstance(value, list) and value else value
    if kind == "shape or type":
        found = list(changed(first)) if isinstance(first, np.ndarray) else []
        out: list[Any] = [*PLAIN, *SHAPES, *TYPES, [Raises()] * 3]
    else:
        numbers = NUMBERS[kind]
        found = (
            [x for number in numbers for x in with_number(first, number)]
            if isinstance(first, np.ndarray)
            else []
        )
        out = [*numbers, *((number,) * 3 for number in numbers)]
    return out + ([[array, *value[1:]] for array in found] if isinstance(value, list) else found)


def finite(found: Any) -> bool:
    if isinstance(found, tuple | list):
        return all(finite(entry) for entry in found)
    return not isinstance(found, float | np.ndarray) or bool(np.isfinite(found).all())


def harm(name: str, hostile_ones: dict[str, Any]) -> str | None:
    """What a call does to its caller, if that is neither finite numbers nor an error of the documented kinds."""
    call, arguments = CALLS[name]
    try:
        found = call(**(arguments | hostile_ones))
    except TYPED:
        return None
    except BaseException as error:  # a panic is no Exception
        return f"{hostile_ones} ends in {type(error).__name__}: {error}"
    return None if finite(found) else f"{hostile_ones} gives numbers that are not finite"


KINDS = ("shape or type", "endless", *NUMBERS)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", CALLS)
def test_each_hostile_argument_is_refused_or_harmless(name, kind):
    arguments = CALLS[name][1]
    harms = [harm(name, {key: value}) for key in arguments for value in hostile(arguments[key], kind)]
    assert [text for text in harms if text] == []


@given(data=st.data())
def test_hostile_arguments_together_are_refused_or_harmless(data):
    name, kind = data.draw(st.sampled_from([(n, k) for n in CALLS for k in KINDS]))
    arguments = CALLS[name][1]
    most = min(3, len(arguments))
    keys = data.draw(st.lists(st.sampled_from(sorted(arguments)), min_size=1, max_size=most, unique=True))
    assert (
        harm(name, {key: data.draw(st.sampled_from(hostile(arguments[key], kind))) for key in keys}) is None
    )


@pytest.mark.parametrize("name", CALLS)
def test_the_calls_themselves_are_answered(name):
    call, arguments = CALLS[name]
    found = call(**arguments)
    assert found is not None and finite(found)


@pytest.mark.parametrize("name", ["solve", "peaks", "Batch", "smooth_motion", "draw_motion", "load_spread"])
def test_arrays_changed_by_another_thread_do_no_harm(name):
    """The numbers that come out are of no use, but the call ends, in a result or in an error of ours."""
    call, arguments = CALLS[name]
    own = {key: value.copy() if isinstance(value, np.ndarray) else value for key, value in arguments.items()}
    arrays = [value for value in own.values() if isinstance(value, np.ndarray) and value.dtype.kind in "fu"]
    done = threading.Event()

    def disturb() -> None:
        at = 0
        while not done.is_set():
            for array in arrays:
                old, place = array.flat[at % array.size], at % array.size
                array.flat[place] = 4_000_000_000
                array.flat[place] = old
            at += 1

    thread = threading.Thread(target=disturb)
    thread.start()
    try:
        for _ in range(500):
            try:
                call(**own)
            except TYPED:
                continue
    finally:
        done.set()
        thread.join()
