"""Headers of columns: their words, their unit in common spellings, and the kind of column."""

from __future__ import annotations

import re
from dataclasses import dataclass

from guideload.base.errors import ValueRefused
from guideload.base.units import factor

# Kinds of columns and their SI units. Counts are converted to a position.
KINDS = {"position": "m", "counts": "m", "velocity": "m/s", "motor_speed": "rad/s"}

# Spellings that `base.units` does not read, in lower case.
SPELLINGS = {
    spelling: unit
    for unit, spellings in {
        "counts": "counts count cnt cnts inc incs increments inkremente ink ticks tick pulses impulse",
        "s": "S sec secs second seconds sek sekunde sekunden",
        "ms": "msec msecs msek millisecond milliseconds millisekunden",
        "us": "usec µsec μsec microsecond microseconds mikrosekunden",
        "ns": "nsec nanosecond nanoseconds",
        "min": "minute minutes minuten",
        "rpm": "u/min umdr/min umdr./min upm r/min rev/min 1/min /min min-1 min^-1 min⁻¹",
        "m": "meter meters metre metres",
        "mm": "millimeter millimeters millimetre millimetres",
        "um": "micron microns micrometer micrometers",
        "in": "inch inches zoll",
        "m/s": "mps m/sec meter/s",
        "mm/s": "mmps mm/sec",
        "rad/s": "radps rad/sec",
    }.items()
    for spelling in spellings.split()
}
# Units of no trace, as written, that show a row of units.
OTHER_UNITS = set("A mA V mV W kW K °C degC °F % bar mbar Pa kPa MPa ohm Ω VA dB".split())
# Unit suffixes of names, as in "v_mm_per_s"; brackets may hold any unit.
SUFFIXES = {
    **{f"{length}{sign}": f"{length}/s" for length in ("mm", "m", "rad") for sign in ("_per_s", "_s", "ps")},
    **{
        word: SPELLINGS.get(word, word)
        for word in "counts count ticks cnt inc rpm min sec mm um cm ms us ns s m".split()
    },
}
# A name with one, the longest that fits. N_m and N_per_m are no lengths, nor is M, a torque; nm may be nanometres.
SUFFIXED = re.compile(
    rf"""
    (.*?)_(
        (?i:
            (?: (?:[mk]?n|kg)_(?:s_)? | (?:\w+_)?per_ )?               # the unit begins before the length
            (?: (?:mm|m)_(?:per_)?s | mm | um | cm | (?-i:m) )
            | {"|".join(SUFFIXES.keys() - {"m"})}
        )
        | [mk]?Nm?                                                    # of a force or torque, as written
    )
    """,
    re.DOTALL | re.VERBOSE,
)
# Units at the end of a name, without brackets: "Position mm", "v in mm/s", "Zeit / ms". Single capitals are symbols.
TRAILING = re.compile(
    r"(.*?\S)(?:\s*/\s+|\s*,\s*|\s+(?:in\s+)?)"
    r"((?i:mm/s|m/s|rad/s|mm|[uµμ]m|ms|[uµμ]s|ns|rpm|U/min|1/min|counts|inc|ticks|sec)|[ms])"
)
# Multiplier of a unit, at the end of the name before it or behind the unit: "in 1/10 mm", "0.1 mm", "mm x1000".
MULTIPLIER = re.compile(
    r"(?:(?:/|\bin)\s+)?(?<![\w.,])(1/10+|0[.,]\d+|10\^-?\d+|\d+[eE]-?\d+)\s*$|(?:/|\bin)\s+(\d+)\s*$"
    r"|([*×]\s*\d\S*|(?<=\s)x\s?10+\b)"
)
TIME_WORDS = set(
    "t time times timestamp timestamps elapsed datetime date zeit zeitstempel uhrzeit datum".split()
)
# Words that may accompany TIME_WORDS in a name.
TIME_FILLERS = set("stamp rel relative abs absolute system local utc device pc log".split())
LONGEST_NAME, LONGEST_UNIT = 1000, 40  # characters; longer ones are damage
POSITION_WORDS = {"position", "pos"}
VELOCITY_WORDS = {"velocity", "vel", "velo", "speed", "geschwindigkeit"}
MEASURED_WORDS = {"meas", "measured", "actual", "act", "feedback", "fbk", "ist"}
COMMAND_WORDS = set("ref reference cmd command commanded setpoint set target demand desired soll".split())


@dataclass(frozen=True)
class Header:
    """A column's name taken apart: words in lower case, and its unit ("" if the header gives none)."""

    words: tuple[str, ...]
    unit: str

    @classmethod
    def of(cls, name: str, unit: str = "") -> Header:
        """The header of a column; unit: from a row of units below the names, overrides a unit in the name.

        For a time column, a "unit" that is a word for time is ignored: "t" in a row of symbols "t; x" is no tonne.
        A multiplier in the name becomes part of the unit, which is then unknown: "Position in 1/10 mm".
        """
        base, own_unit = _split(name)
        scaled = MULTIPLIER.search(base) if unit or own_unit else None
        if scaled:
            unit = f"{scaled[1] or scaled[2] or scaled[3]} {unit or own_unit}"
            base = base.replace(scaled[0], "")
        spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", base)
        words = tuple(re.findall(r"[a-zäöüß]+|\d+", spaced.lower()))
        if set(words) & TIME_WORDS:
            unit, own_unit = ("" if text.lower() in TIME_WORDS else text for text in (unit, own_unit))
        return cls(words, unit or own_unit)

    @property
    def kind(self) -> str:
        """The kind of column according to the unit, or ""."""
        return "counts" if self.unit == "counts" else kind_of_unit(self.unit)

    @property
    def word_kind(self) -> str:
        """The kind of column according to the words, or ""."""
        if POSITION_WORDS & set(self.words):
            return "position"
        if VELOCITY_WORDS & set(self.words):
            return "motor_speed" if "motor" in self.words else "velocity"
        return ""

    @property
    def is_time(self) -> bool:
        """Whether the words mean time, and the unit is empty, a unit of time or counts of a clock."""
        return self._says_time and (self.unit in ("", "counts") or converts(self.unit, "s"))

    @property
    def is_time_in_unknown_unit(self) -> bool:
        """Whether the words mean time, and the unit is none that is known, such as 0.1 ms; T [°C] is no time."""
        known = self.unit in ("", "counts", *OTHER_UNITS) or converts(self.unit, self.unit)
        return self._says_time and not known

    @property
    def _says_time(self) -> bool:
        words = set(self.words)
        return words <= TIME_WORDS | TIME_FILLERS and bool(words & TIME_WORDS)


def _split(name: str) -> tuple[str, str]:
    """A name without its unit, and the unit."""
    if len(name) > LONGEST_NAME:
        return "", ""
    bracket = re.fullmatch(r"\s*(.*?)\s*[\[({<]\s*(.*?)\s*[\])}>]\s*", name, re.DOTALL)
    if bracket:
        return bracket[1], known_unit(bracket[2]) or bracket[2]
    inside = re.search(r"\[\s*([^\[\]]*?)\s*\]", name)
    if inside and known_unit(inside[1]):
        return name[: inside.start()] + " " + name[inside.end() :], known_unit(inside[1])
    base = name.strip()
    if suffixed := SUFFIXED.fullmatch(base):
        return suffixed[1], SUFFIXES.get(suffixed[2].lower(), suffixed[2].replace("_", " "))
    if trailing := TRAILING.fullmatch(base):
        return trailing[1], known_unit(trailing[2])
    return base, ""


def known_unit(text: str) -> str:
    """A unit as `base.units` reads it, or "counts", from any spelling of it; "" if the text is no unit.

    Descriptions in brackets, as in "mm (Length)", are left out.
    """
    bare = re.sub(r"(?<=\S)\s+\([^\d)]*\)$", "", text[:LONGEST_NAME].strip()).strip("[](){}<>. ")
    if not bare or bare == "1" or len(bare) > LONGEST_UNIT:
        return ""
    # "RPM" and "MM" occur, but are no units as written; M and other single capitals are symbols of quantities.
    spelled = [bare, bare.lower()] if len(bare) > 1 else [bare]
    for written in spelled:
        if written in SPELLINGS or converts(written, written):
            return SPELLINGS.get(written, written)
    return ""


def kind_of_unit(unit: str) -> str:
    """position, velocity or motor_speed according to the unit's dimension; "" for any other text."""
    return next((kind for kind, si in KINDS.items() if unit and converts(unit, si)), "")


def converts(unit: str, target: str) -> bool:
    """Whether `unit` is a unit of the dimension of `target`."""
    try:
        factor(unit, target)
    except ValueRefused:
        return False
    return True
