"""Ranges of quantities: so wide that every real thing is inside, and what makes arithmetic fail is outside."""

from __future__ import annotations

from dataclasses import dataclass

from guideload.base.errors import ValueRefused

UNITS_HINT = "no machine has this value: is the unit right? A number without a unit is in"


@dataclass(frozen=True)
class Range:
    """Magnitudes that a quantity can have; 0 is not refused here."""

    name: str  # "a mass"
    unit: str
    least: float  # smallest magnitude other than 0, in SI `unit`; 0 if there is none
    most: float  # largest magnitude
    reason: str  # for the documentation

    def holds(self, value: float) -> bool:
        """Whether a value is inside, or 0."""
        return value == 0.0 or self.least <= abs(value) <= self.most

    def require(self, value: float, written: object) -> None:
        """Raise ValueRefused unless `value`, in SI, is inside. written: as the user gave it."""
        if not self.holds(value):
            unit = "" if self.unit == "1" else f" {self.unit}"
            hint = f"{UNITS_HINT} {self.unit}" if unit else ""
            raise ValueRefused(f"{self.words}{unit}", written, hint)

    @property
    def words(self) -> str:
        """The range in words, without the unit: "a mass from 1e-06 to 1e+09"."""
        least = f"from {self.least:g} to" if self.least else "up to"
        return f"{self.name} {least} {self.most:g}"


MASS = Range("a mass", "kg", 1e-6, 1e9, "from a micromechanical stage to more than the largest ship")
INERTIA = Range("a moment of inertia", "kg m^2", 0.0, 1e17, "largest mass at the largest position")
SMALLEST_MOMENT = 1e-24  # kg m^2: smallest mass at the smallest length; products of inertia may be smaller
POSITION = Range("a position", "m", 0.0, 1e4, "ten kilometres from L")
LENGTH = Range("a length", "m", 1e-9, 1e4, "from a nanometre to ten kilometres")
ACCELERATION = Range(
    "an acceleration", "m/s^2", 0.0, 1e8, "ten million g: more than a projectile in its barrel"
)
JERK = Range("a jerk", "m/s^3", 0.0, 1e12, "the largest acceleration within a tenth of a millisecond")
STIFFNESS = Range("a stiffness", "N/m", 1e-3, 1e15, "1 N on 1 km, to a million times a rail's 1 kN/um")
TILTING = Range(
    "a rotational stiffness", "N m/rad", 1e-9, 1e18, "a soft flexure, to a thousand times a bridge bearing"
)
COMPLIANCE = Range("a compliance", "m/N", 1e-15, 1e3, "the inverse of a stiffness")
DAMPING = Range("a damping", "N s/m", 0.0, 1e12, "a million times the damper of a bridge")
RATE = Range("a sampling rate", "1/s", 1e-9, 1e9, "from a sample in thirty years to one per nanosecond")
CLEARANCE = Range("a clearance", "m", 1e-12, 10.0, "from a hundredth of an atom to ten metres")
DEFLECTION = Range("a deflection", "m", 1e-12, 1e3, "from a hundredth of an atom to a kilometre")
FORCE = Range("a force", "N", 0.0, 1e12, "a hundred thousand times the load of the largest carriage")
PRELOAD = Range("a preload", "N", 1e-9, 1e9, "from the weight of a dust grain to a hundred thousand tonnes")
RATIO = Range("a ratio", "1", 1e-6, 1e6, "a million turns per turn")
DIRECTION = Range("a component of a direction", "1", 0.0, 1e9, "vectors in any unit, as from CAD")
MOMENT = Range("a moment", "N m", 0.0, 1e16, "largest force at the largest position")
SPEED = Range("a speed", "m/s", 0.0, 1e8, "a third of the speed of light")
TRAVEL = Range("a position of the cart", "m", 0.0, 1e7, "a quarter of the earth's circumference")
TIME = Range("a time", "s", 0.0, 1e11, "three thousand years, so stamps since 1970 in seconds are inside")
ANGULAR_SPEED = Range("an angular speed", "rad/s", 0.0, 1e9, "a thousand times the fastest turbine")
ANGLE = Range("an angle", "rad", 0.0, 1.2, "70 degrees: teeth of a rack have 14.5 to 25 degrees")
ROLL = Range("a roll angle", "rad", 0.0, 6.2832, "a full turn")
EFFICIENCY = Range("an efficiency", "1", 0.01, 1.0, "worse than any screw, to a drive without losses")
FRICTION = Range("a coefficient of friction", "1", 0.0, 10.0, "more than rubber on rubber")

RATING = Range("a load rating", "N", 1e-6, 1e12, "from a micromechanical guide to the largest force")
RATED_TRAVEL = Range("the travel of a load rating", "m", 1e3, 1e7, "makers use 50 km and 100 km")
RATED_MOMENT = Range(
    "a rated moment", "N m", 1e-9, 1e16, "a small rating at a small arm, to the largest moment"
)
FACTOR = Range("a factor", "1", 1e-6, 1e6, "a million times")
REDUCTION = Range("a factor up to 1", "1", 1e-6, 1.0, "it reduces a load rating")
EXPONENT = Range("an exponent", "1", 1.0, 20.0, "lives of bearings have 3 to 10/3, those of springs up to 10")
DISTANCE = Range("a travelled distance", "m", 1e-3, 1e15, "a million km in each of a million hours")
PERIOD = Range("a period", "s", 1e-9, 1e11, "from a nanosecond to three thousand years")
CYCLES = Range("a number of cycles", "1", 1e-9, 1e12, "a thousand per second for thirty years")
YEARS = Range("a life in years", "years", 1e-6, 1e4, "from half a minute to ten thousand years")
YEARLY = Range("hours per year", "1", 1e-3, 8784.0, "all hours of a leap year")
SHARE = Range("a share", "1", 1e-12, 1e3, "from the rounding of a double to a thousand times the value")
PRELOAD_SHARE = Range("a preload over a rating", "1", 1e-12, 0.5, "catalogues print up to 0.19; 5 % is 0.05")
DAMPING_RATIO = Range("a damping ratio", "1", 1e-12, 1.0, "beyond it nothing rings; 1.3 % is 0.013")
FREQUENCY = Range("a frequency", "Hz", 1e-6, 1e9, "from a turn in ten days to sound in a nanometre")
COMPONENT = Range(
    "a component of a shape", "1", 0.0, 1e9, "shapes in any unit, as of acceleration per newton"
)
TOLERANCE = Range("a tolerance", "1", 1e-13, 0.1, "from the rounding of loads to a tenth of them")
SMOOTHER = Range(
    "a time constant in samples", "1", 0.01, 100.0, "what whole numbers of a controller can weigh"
)
ENTRY = Range("an entry of a compliance matrix", "1", 0.0, 1e3, "the inverse of a stiffness, in any SI unit")
POWER = Range(
    "an exponent of a spectrum", "1", 0.0, 10.0, "measured profiles fall with exponents from 1 to 4"
)

OF_MACHINES = (
    MASS, INERTIA, POSITION, LENGTH, ACCELERATION, STIFFNESS, DAMPING, CLEARANCE, DEFLECTION, FORCE, PRELOAD, RATIO,
    DIRECTION, ANGLE, EFFICIENCY, FRICTION, TILTING, ROLL,
    COMPLIANCE,
)  # fmt: skip
OF_MOTIONS = (TIME, ACCELERATION, JERK, SPEED, TRAVEL, ANGULAR_SPEED, FORCE, MOMENT, RATE)


def noise_in(unit: str) -> Range:
    """The range of a standard deviation of measured values in an SI unit."""
    return Range("a noise", unit, 1e-12, 1e12, "from far below any resolution to far above any signal")
