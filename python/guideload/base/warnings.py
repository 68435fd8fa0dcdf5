"""Warnings: the limits beyond which a machine, a motion or a result is warned of, and the texts that count them."""

from __future__ import annotations

from collections.abc import Collection
from math import inf, isinf
from typing import NamedTuple

from guideload.base.number_text import counted, number


class Limit(NamedTuple):
    """The range of a figure without a warning, ends included; without ends, any occurrence is warned of."""

    figure: str
    reason: str
    least: float = -inf
    most: float = inf
    unit: str = ""

    def holds(self, value: float) -> bool:
        """Whether there is no warning; NaN is warned of."""
        return self.least <= value <= self.most

    @property
    def text(self) -> str:
        """The range in words."""
        unit = f" {self.unit}" if self.unit else ""
        if isinf(self.least) and isinf(self.most):
            return "none"
        if isinf(self.least):
            return f"up to {number(self.most)}{unit}"
        if isinf(self.most):
            return f"from {number(self.least)}{unit}"
        return f"{number(self.least)} to {number(self.most)}{unit}"


# By key of the warning, in the order of the table in docs/methods.md, which is made from these rows.
LIMITS = {
    # machine
    "distance": Limit(
        "length or distance from L in the machine file", "longer guides are joined", most=20.0, unit="m"
    ),
    "distance in lengths": Limit(
        "the same, over the length of the shortest carriage",
        "a length in mm read as m is 1000 times as long",
        most=500.0,
    ),
    "inertia": Limit(
        "largest radius of gyration, over the distance from the centre of mass to the farthest carriage or link",
        "it is about the size of the body; a moment of inertia in kg mm2 read as kg m2 is a million times as large",
        0.05,
        5.0,
    ),
    "overlap": Limit("carriages of one rail that overlap", "two bodies cannot be in one place"),
    "stacked rails": Limit(
        "rails one above the other, along y of carriages that look to one side",
        "rails stand side by side, or face each other; y and z are easily swapped",
    ),
    "load at rest": Limit(
        "load of a carriage at rest, over C0", "permanent deformation begins at C0", most=1.0
    ),
    "load ratings": Limit(
        "static load rating C0 over the dynamic one C for 100 km",
        "1.1 to 2.6 in the packaged catalogues; a mistaken unit is a factor of 10 or more",
        0.7,
        5.0,
    ),
    "rated moments": Limit(
        "rated static moment of a product over its C0",
        "2 to 54 mm in the packaged catalogues: an arm within the carriage; kN m read as N m divides it by 1000",
        5e-4,
        0.3,
        "m",
    ),
    "empty rail": Limit("rails without carriages", "a carriage may be forgotten or on another rail"),
    "sag": Limit(
        "displacement of carriages and centre of mass at rest",
        "guides give way by micrometres",
        most=1e-3,
        unit="m",
    ),
    "frequency": Limit(
        "natural frequencies",
        "N/mm read as N/m divides them by 32; models of rigid bodies end far below",
        2.0,
        5e3,
        "Hz",
    ),
    "damping": Limit(
        "damping ratio of a mode",
        "guides have 1 to 5 %, structures 0.5 % and more; more damping hides load",
        0.005,
        0.15,
    ),
    "clearance": Limit(
        "clearance of a link to either side", "clearances are micrometres", most=1e-3, unit="m"
    ),
    "gravity": Limit(
        "size of gravity", "9.78 to 9.83 m/s2 on earth; in g read as m/s2 it is 1", 9.5, 10.0, "m/s2"
    ),
    "weight on the side": Limit(
        "part of gravity across the carriages (z), over gravity", "y and z are easily swapped", most=0.95
    ),
    "weight on the constraint": Limit("weight along a held dof", "the guides do not carry it"),
    "free at rest": Limit("motions within the clearance at rest", "the place at the start is a guess"),
    "estimated stiffness": Limit("carriages with an estimated stiffness", "the catalogue prints none"),
    "own stiffness": Limit(
        "stiffness in the machine file over that of the product",
        "values of a template may have stayed",
        0.7,
        1.4,
    ),
    "open row": Limit("preloaded links with a row open", "half of the balls or rollers then carry no load"),
    # motion
    "speed": Limit("largest speed", "ball guides allow 3 to 10 m/s", most=10.0, unit="m/s"),
    "acceleration": Limit(
        "largest acceleration of what moves",
        "linear motors reach some g, 10 g is 98 m/s2; ms read as s divide it by a million",
        1e-4,
        98.0665,
        "m/s2",
    ),
    "travel": Limit(
        "distance between the ends of the motion", "longer guides are joined", most=20.0, unit="m"
    ),
    "time of a move": Limit(
        "time without a stop or a turn", "at a creep of 1 mm/s this is 0.6 m", most=600.0, unit="s"
    ),
    "no motion": Limit(
        "motions at rest throughout, without process forces and riders", "a wrong column or part"
    ),
    "velocity": Limit(
        "change of the velocity less the integral of the acceleration, over the largest change; not of records",
        "2 % is the error of 13 samples in a period of the acceleration; a wrong unit is far more",
        most=0.02,
    ),
    "position": Limit(
        "change of the position less the integral of the velocity, over the largest change; not of records",
        "as for the velocity",
        most=0.02,
    ),
    "gap": Limit("gaps of a trace that the smoothing bridged", "what happened there is unknown"),
    "other speed": Limit(
        "speed of one column over that of another of the same axis",
        "unit or scale of one is wrong",
        0.95,
        1.05,
    ),
    "other rate": Limit("given rate over that of the column of the time", "one of them is wrong", 0.95, 1.05),
    "suspect samples": Limit(
        "samples that repeat a value, or are 0, while the axis moves", "they may be damage"
    ),
    "noise": Limit("noise over the range of the samples", "encoders stay below 0.5 %", most=0.01),
    "hidden load": Limit(
        "dynamic load that the trace may hide, over what it shows",
        "simpler models have the same limit",
        most=0.1,
    ),
    # result
    "not judged": Limit("results that no second solution judges", "only gross errors are found"),
    "rotation": Limit(
        "largest rotation [rad], or neglected terms of second order over the largest load",
        "the relative error of the loads is about as large",
        most=0.01,
    ),
    "sudden start": Limit(
        "first acceleration of a run from rest, over the largest", "smoothed standstill is below", most=0.2
    ),
    "samples": Limit(
        "instants per period of the highest mode",
        "of given instants: with fewer, peaks lie between them",
        least=2.0,
    ),
    "missed vibration": Limit(
        "vibration that samples may miss, over the peak", "catalogues are no better", most=0.03
    ),
    "motor": Limit(
        "use of the motor's torque, speed or rated torque, and of the limits of screw and drive",
        "they cannot make the motion",
        most=1.0,
    ),
    "motor speed": Limit("speed of the motor", "servo motors end at 3000 to 8000 rpm", most=10e3, unit="rpm"),
    "life": Limit(
        "life at the stated duty", "shorter: worn out in a day; longer: a century of work", 10.0, 1e6, "h"
    ),
}


class WarningText(str):
    """The sentence of a warning, with the key of its row in `LIMITS`."""

    key: str

    def __new__(cls, key: str, text: str) -> WarningText:
        """Raises KeyError for a key without a limit."""
        if key not in LIMITS:
            raise KeyError(key)
        self = super().__new__(cls, text)
        self.key = key
        return self

    def __getnewargs__(self) -> tuple[str, str]:  # type: ignore[override]
        return self.key, str(self)


def verdict(warnings: Collection[str]) -> str:
    """The number of warnings, for the head of a report."""
    return f"{counted(len(warnings), 'warning')}:" if warnings else "No warnings."
