"""The constants of a monitor as source text in Rust or C."""

from __future__ import annotations

import math
import zlib
from typing import Any

import numpy as np

from guideload.base.errors import ArgumentError
from guideload.monitor.design import Design

# Places of the C library, which is compiled once for all machines: entries of the state, carriages, second differences.
C_PLACES = (12, 8, 128)


def rust_source(design: Design) -> str:
    """A Rust file with the constant PREPARED, for places that fit the machine, in f32."""
    constants, (states, carriages, differences) = _constants(design)
    fields = [f"    {name}: {_rust(name, content)}," for name, content in _fields(constants, differences)]
    lines = [
        *(f"// {line}" for line in [*design.title, "Do not edit."]),
        f"pub const STATES: usize = {states};",
        f"pub const CARRIAGES: usize = {carriages};",
        f"pub const DIFFERENCES: usize = {differences};",
        "pub type Constants = guideload_monitor::Prepared<f32, STATES, CARRIAGES, DIFFERENCES>;",
        "pub static PREPARED: Constants = guideload_monitor::Prepared {",
        *fields,
        "};",
    ]
    return "\n".join(lines) + "\n"


def c_source(design: Design) -> str:
    """A C header with the constant guideload_machine. Raises ArgumentError if the C library has too few places."""
    constants, needed = _constants(design)
    for name, count, places in zip(
        ("states", "carriages", "second differences"), needed, C_PLACES, strict=True
    ):
        if count > places:
            raise ArgumentError(
                f"monitor: the C library has places for {places} {name}, and {count} are needed; "
                "choose a smaller lag, or write Rust (-o monitor.rs)"
            )
    fields = [f"    .{name} = {_c(name, content)}," for name, content in _fields(constants, needed[2])]
    lines = [
        *(f"/* {line} */" for line in [*design.title, "Do not edit."]),
        "#include <math.h>",
        '#include "guideload_monitor.h"',
        "",
        "static const guideload_prepared guideload_machine = {",
        "    .layout = GUIDELOAD_LAYOUT,",
        *fields,
        f"    .check = {_checksum(constants)}u,",
        "};",
    ]
    return "\n".join(lines) + "\n"


def _constants(design: Design) -> tuple[dict[str, Any], tuple[int, int, int]]:
    """The constants of a monitor, and the places that they need: states, carriages, second differences."""
    constants = design.monitor().constants()
    differences = int(constants["tap_count"]) + design.settings.most_missing + 1
    return constants, (len(constants["from_start"]), int(constants["carriage_count"]), differences)


def _fields(constants: dict[str, Any], differences: int) -> list[tuple[str, Any]]:
    """Names and contents of the fields of a `Prepared`, in their order."""
    taps = np.zeros((2, differences))
    taps[:, : int(constants["tap_count"])] = constants["taps"]
    names = (
        *("id", "carriage_count", "input", "tap_count", "lag", "settling", "exponent", "period"),
        *("speed_of_step", "taps", "change", "from_start", "from_end", "carriages"),
    )
    return [(name, taps.tolist() if name == "taps" else constants[name]) for name in names]


def _checksum(constants: dict[str, Any]) -> int:
    """CRC-32 of the constants in the memory of a C program: words of 4 bytes, low byte first, 0 in unused places."""
    states, carriages, differences = C_PLACES
    counts = ("tap_count", "lag", "settling", "exponent")
    parts = [
        _counts(constants["id"], constants["carriage_count"], *constants["input"].values()),
        _counts(*(constants[name] for name in counts)),
        _reals([constants["period"], constants["speed_of_step"]], (2,)),
        _reals(constants["taps"], (2, differences)),
        _reals(constants["change"], (states, states)),
        *(_reals(constants[name], (states,)) for name in ("from_start", "from_end")),
    ]
    for carriage in constants["carriages"]:
        rule = carriage["rule"]
        components = len(carriage["rest"])
        parts += [
            _reals(carriage["rest"], (components,)),
            _reals(carriage["by_state"], (states, components)),
            _reals(rule["weights"], (2, 2, components)),
            _reals([rule["minor"], rule["preload"], rule["opening"]], (3,)),
            _counts(rule["counted"], rule["plain"], rule["preload_form"]),
            _reals([carriage["limit"], carriage["bins_per_load"], carriage["capacity"]], (3,)),
        ]
    size = sum(map(len, parts[7:])) // len(constants["carriages"])
    return zlib.crc32(b"".join(parts) + bytes(size * (carriages - len(constants["carriages"]))))


def _counts(*counts: int) -> bytes:
    return np.array([count & 0xFFFF_FFFF for count in counts], "<u4").tobytes()


def _reals(numbers: Any, shape: tuple[int, ...]) -> bytes:
    """Numbers in single precision, in the first places of a shape."""
    part, places = np.asarray(numbers, dtype="<f4"), np.zeros(shape, "<f4")
    places[tuple(map(slice, part.shape))] = part
    return places.tobytes()


RUST_TYPES = {"input": "InputSettings", "carriages": "Carriage", "rule": "Rule"}


def _rust(name: str, content: Any) -> str:
    if isinstance(content, dict):
        inner = ", ".join(f"{key}: {_rust(key, each)}" for key, each in content.items())
        return f"guideload_monitor::{RUST_TYPES[name]} {{ {inner} }}"
    if isinstance(content, list | tuple):
        return f"[{', '.join(_rust(name, each) for each in content)}]"
    if isinstance(content, int):
        return str(content)
    return "f32::INFINITY" if math.isinf(content) else _single(content)


def _c(name: str, content: Any) -> str:
    if isinstance(content, dict):
        return f"{{ {', '.join(f'.{key} = {_c(key, each)}' for key, each in content.items())} }}"
    if isinstance(content, list | tuple):
        return f"{{ {', '.join(_c(name, each) for each in content)} }}"
    if isinstance(content, int):
        return f"{content}u" if content >= 0 else str(content)
    return "INFINITY" if math.isinf(content) else f"{_single(content)}f"


def _single(number: float) -> str:
    """The shortest text that gives the nearest number in single precision."""
    text = np.format_float_scientific(np.float32(number), trim="0")
    return str(text)
