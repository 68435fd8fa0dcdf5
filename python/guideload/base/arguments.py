"""Arguments of public functions: a wrong type raises ArgumentTypeError, everywhere with the same words.

The type hints of a function are what is checked, so that they cannot differ from it. What a value may be is checked
where it is used.
"""

from __future__ import annotations

import functools
import inspect
import os
import types
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from decimal import Decimal
from numbers import Real
from typing import Annotated, Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, ArgumentTypeError, shown

P = ParamSpec("P")
R = TypeVar("R")
LONGEST_TEXT = 80  # characters of a value in a message
SOURCES = {
    "Machine": "as from Machine.from_toml(file)",
    "Motion": "as from motion_from_trace(read_trace(file), machine.drive) or Moves.from_toml(file).motion()",
    "Trace": "as from read_trace(file)",
    "Result": "as from simulate(machine, motion)",
    "Study": "as from Study.from_toml(file)",
    "StudyResult": "as from run_study(study)",
    "Drive": "as machine.drive",
    "Modes": "as result.modes",
    "Axes": "of Matplotlib",
    "Axes3D": "of Matplotlib",
}
LISTS = (Sequence, Iterable, tuple, list)  # each stands for the others
MOST_COUNTED = 2**32  # threads, samples, runs
WORDS: dict[Any, str] = {
    types.NoneType: "None",
    float: "a number",
    int: "a whole number",
    str: "text",
    bool: "True or False",
    os.PathLike: "a path",
    Mapping: "a mapping",
    np.ndarray: "an array",
}


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """A function that raises ArgumentTypeError, with the argument's name, for an argument of a type that is not hinted.

    Numbers of NumPy count as numbers, True and False do not; a number must fit a double. Hints that name no type of
    their own (Any, an unresolved name) accept everything.
    """
    signature = inspect.signature(function)
    hints: dict[str, Any] = {}

    @functools.wraps(function)
    def called(*arguments: P.args, **named: P.kwargs) -> R:
        if not hints:  # at the first call, because a hint may name a class that is defined later
            hints.update({name: _hint(function, one) for name, one in signature.parameters.items()})
        try:
            given = signature.bind(*arguments, **named)
        except TypeError as error:
            raise ArgumentTypeError(f"{function.__qualname__}: {error}") from None
        for name, value in given.arguments.items():
            require_type(name, value, hints[name])
        return function(*arguments, **named)

    return called


def require_type(name: str, value: object, hint: Any) -> None:
    """Raise ArgumentTypeError unless a value is of a hinted type, and ArgumentError for a number beyond a double."""
    if type(value) is hint:  # most often, and much faster
        return
    if not _fits(value, hint):
        raise ArgumentTypeError(f"{name}: expected {_in_words(hint)}, got {_shown(value)}")
    if isinstance(value, int) and not isinstance(value, bool) and float in _alternatives(hint):
        try:
            float(value)
        except OverflowError:
            raise ArgumentError(
                f"{name}: expected a number that fits a double, got {_shown(value)}"
            ) from None


def whole_number(name: str, value: int, least: int = 1) -> int:
    """A count as an int. Raises ArgumentError unless it is from `least` to 2^32, ArgumentTypeError for other types."""
    require_type(name, value, int)
    if not least <= value <= MOST_COUNTED:
        raise ArgumentError(
            f"{name}: expected a whole number from {least} to {MOST_COUNTED}, got {_shown(value)}"
        )
    return int(value)


def real_array(name: str, values: ArrayLike) -> Array:
    """A new float64 array of real numbers, C-contiguous.

    Raises ArgumentTypeError for texts, dates, complex and other objects, ArgumentError for rows of different lengths,
    for masked values and for numbers beyond a double.
    """
    require_unmasked(name, values)
    try:
        found = np.asarray(values)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"{name}: expected an array of numbers, got {error}") from None
    if found.dtype.kind not in "iufO" and not (found.dtype.kind == "b" and found.size == 0):
        what = {"c": "complex numbers", "U": "texts", "S": "bytes", "b": "True and False"}
        raise ArgumentTypeError(
            f"{name}: expected an array of real numbers, got {what.get(found.dtype.kind, str(found.dtype))}"
        )
    if found.dtype.kind == "O":  # None would become nan, texts and True would become numbers
        for one in found.flat:
            if isinstance(one, bool) or not isinstance(one, Real | Decimal):
                raise ArgumentTypeError(f"{name}: expected an array of real numbers, got {_shown(one)}")
    try:
        real = np.asarray(found, dtype=np.float64, order="C")
        return real.copy() if real is values or not real.flags.owndata else real
    except OverflowError:
        raise ArgumentError(f"{name}: expected numbers that fit a double, got larger ones") from None
    except (TypeError, ValueError) as error:
        raise ArgumentTypeError(f"{name}: expected an array of real numbers, got {error}") from None


def require_unmasked(name: str, values: object) -> None:
    """Raise ArgumentError for an array of NumPy, or a list of arrays, with masked values: NumPy drops the mask."""
    parts = values if isinstance(values, list | tuple) else [values]
    if any(isinstance(one, np.ma.MaskedArray) and np.ma.is_masked(one) for one in parts):
        raise ArgumentError(
            f"{name}: expected values without a mask, got masked ones; leave these samples out, or make them missing: "
            "values.filled(np.nan)"
        )


class _ByName:
    """A class that a module imports for type checkers only; values are recognised by the name of their class."""


def _hint(function: Callable[..., Any], parameter: inspect.Parameter) -> Any:
    """The type hint of a parameter; Any where its text names something that only type checkers import, and of *args."""
    hint = parameter.annotation
    if parameter.kind in (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD):
        return Any
    if isinstance(hint, str):
        known = {name: type(name, (_ByName,), {}) for name in SOURCES}
        try:
            hint = eval(hint, {**known, **getattr(function, "__globals__", {})})
        except NameError:
            return Any
    return hint if hint is not inspect.Parameter.empty else Any


def _alternatives(hint: Any) -> tuple[Any, ...]:
    """The types of a hint: those of a union, without their annotations."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return tuple(one for each in inner for one in _alternatives(each))
    if origin is Annotated:
        return _alternatives(inner[0])
    return (types.NoneType if hint is None else hint,)


def _fits(value: object, hint: Any) -> bool:
    return any(_is_instance(value, one) for one in _alternatives(hint))


def _is_instance(value: object, hint: Any) -> bool:
    """Whether a value is of a type that is no union."""
    kind = get_origin(hint) or hint
    if kind is Literal:
        return isinstance(value, str)  # which texts are known is told where they are used
    if kind is float:
        return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    if kind is int:
        return isinstance(value, int | np.integer) and not isinstance(value, bool)
    if kind is bool:
        return isinstance(value, bool | np.bool_)
    if isinstance(kind, type) and issubclass(kind, _ByName):
        return any(one.__name__ == kind.__name__ for one in type(value).__mro__)
    if kind in LISTS:
        if not isinstance(value, Iterable) or isinstance(value, str | bytes):
            return False
        inner = _entries(hint)
        known = len(inner) == 1 and isinstance(value, Collection)  # to look at an iterator would use it up
        return not known or all(type(one) is inner[0] or _fits(one, inner[0]) for one in value)
    if kind is np.ndarray:
        return isinstance(value, np.ndarray | Sequence) and not isinstance(value, str | bytes)
    if kind is Any or not isinstance(kind, type) or getattr(kind, "_is_protocol", False):
        return True
    return isinstance(value, kind)


def _entries(hint: Any) -> list[Any]:
    """The types of the entries of a list or tuple."""
    return [one for one in get_args(hint) if one is not Ellipsis]


def _in_words(hint: Any) -> str:
    """A type hint in words: "a number or None"."""
    return " or ".join(dict.fromkeys(map(_type_in_words, _alternatives(hint))))


def _type_in_words(hint: Any) -> str:
    kind = get_origin(hint) or hint
    if kind is Literal:
        return f"one of {', '.join(map(str, get_args(hint)))}"
    if kind in WORDS:
        return WORDS[kind]
    if kind in LISTS:
        inner = _entries(hint)
        of_one_type = len(inner) == 1 and inner[0] in WORDS
        return f"a list of {WORDS[inner[0]].removeprefix('a ')}s" if of_one_type else "a list"
    name = getattr(kind, "__name__", str(kind))
    source = f", {SOURCES[name]}" if name in SOURCES else ""
    return f"{'an' if name[:1] in 'AEIOU' else 'a'} {name}{source}"


def _shown(value: object) -> str:
    """A value in a message: short, and without its representation where that may fail or compute."""
    if value is None or isinstance(value, bool | int | float | str):
        return shown(value)
    if isinstance(value, list | tuple | dict | complex):
        try:
            return f"{value!r:.{LONGEST_TEXT}}"
        except Exception:
            pass
    return f"a value of type {type(value).__name__}"
