"""Functions of arrays: check for finite numbers, read-only copies, median time step, runs of flags."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from guideload.base.errors import TraceError

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]
Integers = NDArray[np.int64]
Complex = NDArray[np.complex128]
AnyArray = TypeVar("AnyArray", bound=NDArray[Any])


@contextmanager
def errors_name(source: str) -> Iterator[None]:
    """Let every TraceError begin with the source of the numbers; an overflow becomes a TraceError as well."""
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except FloatingPointError as error:
        raise TraceError(
            f"{source}: numbers too large or too small to compute with ({error}); check the unit, or cut the trace to "
            "a sound part"
        ) from None
    except TraceError as error:
        raise error if str(error).startswith(f"{source}: ") else type(error)(f"{source}: {error}") from None


def check_finite(name: str, values: Array) -> None:
    """Raise TraceError if a number is nan or infinite; the message has the index of the first one."""
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        place, value = ", ".join(map(str, bad[0])), values[tuple(bad[0])]
        raise TraceError(f"{name}[{place}]: expected a finite number, got {value} ({len(bad)} not finite)")


def read_only(array: AnyArray) -> AnyArray:
    """A contiguous, read-only copy."""
    array = array.copy()
    array.setflags(write=False)
    return array


class ReadOnlyArrays:
    """Base of classes whose arrays are read-only: those of their copies are as well, by pickle and deepcopy too."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        self.__dict__.update(state)


def median_step(time: Array) -> float:
    """Median [s] of the positive steps between times (n,) [s]; 0 if no step is positive."""
    steps = np.diff(time)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else 0.0


def find_runs(flags: Flags) -> tuple[Indices, Indices]:
    """Runs of consecutive true flags: indices of their first entries, and of the entries after their last."""
    edges = np.flatnonzero(np.diff(np.pad(flags, 1).astype(np.int8)))
    return edges[::2], edges[1::2]
