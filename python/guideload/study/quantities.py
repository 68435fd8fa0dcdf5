"""The figures of a sample that statistics are about, made of the columns that a study stores."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ValueRefused
from guideload.machine.machine import Machine
from guideload.study.metadata import StudyMetadata

if TYPE_CHECKING:
    from guideload.study.store import SampleStore


class Quantity(NamedTuple):
    """A figure of every sample, of each carriage and, of the worst of them, of the whole machine.

    title              in tables and pictures
    sources            quantity and statistic of the columns whose largest magnitude it is
    in_summary         whether the summary has it
    smallest_is_worst  as of a life
    of_machine         whether there is one only, not one of each carriage
    has_worst          whether one of two is the worse; not so of a time or of the load at the start
    """

    title: str
    sources: tuple[tuple[str, str], ...]
    in_summary: bool = False
    smallest_is_worst: bool = False
    of_machine: bool = False
    has_worst: bool = True

    def worse(self, one: Array, other: Array) -> Array:
        """The worse of two in each sample; NaN where either has none."""
        found: Array = np.minimum(one, other) if self.smallest_is_worst else np.maximum(one, other)
        return found


def _peak(title: str, quantity: str, *, in_summary: bool = False, of_machine: bool = False) -> Quantity:
    sources = (quantity, "min"), (quantity, "max")
    return Quantity(title, sources, in_summary=in_summary, of_machine=of_machine)


PEAK = "peak_resultant_N"
LIFE = "life_km"
CONTACT = "contact_lost"
QUANTITIES = {
    PEAK: Quantity("peak resultant", (("resultant", "max"),), in_summary=True),
    "peak_Fx_N": _peak("peak |Fx|", "Fx"),
    "peak_Fy_N": _peak("peak |Fy|", "Fy", in_summary=True),
    "peak_Fz_N": _peak("peak |Fz|", "Fz", in_summary=True),
    "peak_Mx_Nm": _peak("peak |Mx|", "Mx"),
    "peak_My_Nm": _peak("peak |My|", "My"),
    "peak_Mz_Nm": _peak("peak |Mz|", "Mz"),
    "mean_load_N": Quantity("mean load", (("load", "mean"),), in_summary=True),
    LIFE: Quantity("life", (("load", "mean"),), in_summary=True, smallest_is_worst=True),
    "rms_resultant_N": Quantity("rms resultant", (("resultant", "rms"),), in_summary=True),
    **{f"rms_F{axis}_N": Quantity(f"rms F{axis}", ((f"F{axis}", "rms"),), in_summary=True) for axis in "xyz"},
    **{
        f"rms_M{axis}_Nm": Quantity(f"rms M{axis}", ((f"M{axis}", "rms"),), in_summary=True) for axis in "xyz"
    },
    CONTACT: Quantity("contact lost", (("contact", "lost"),), in_summary=True),
    "peak_drive_N": _peak("peak drive force", "drive", in_summary=True, of_machine=True),
    "rms_drive_N": Quantity("rms drive force", (("drive", "rms"),), in_summary=True, of_machine=True),
}


# A measure as it is stored, of which no quantity is made where a study keeps less than that takes.
STORED = re.compile(r"(min|max|time_of_min|time_of_max|start)_(F[xyz]|M[xyz]|resultant|drive)_(?:Nm|N|s)")
STORED_TITLES = {
    "min": "smallest {}",
    "max": "largest {}",
    "time_of_min": "time of the smallest {}",
    "time_of_max": "time of the largest {}",
    "start": "{} at the start",
}


def quantity_of(name: str) -> Quantity | None:
    """The quantity of this name, one of `QUANTITIES` or a measure as stored, "max_Fy_N"; None if there is none."""
    if name in QUANTITIES or not (stored := STORED.fullmatch(name)):
        return QUANTITIES.get(name)
    statistic, quantity = stored.groups()
    return Quantity(
        STORED_TITLES[statistic].format({"drive": "drive force"}.get(quantity, quantity)),
        ((quantity, statistic),),
        in_summary=True,
        smallest_is_worst=statistic == "min",
        of_machine=quantity == "drive",
        has_worst=statistic in ("min", "max"),
    )


def known_quantity(name: str) -> Quantity:
    """The quantity of a name that a study has, see `available`. Raises KeyError for any other."""
    found = quantity_of(name)
    if found is None:
        raise KeyError(name)
    return found


def unit_of(name: str) -> str:
    """The unit at the end of a quantity's name, "" without one."""
    ends = re.search(r"_(Nm|N|km|s)$", name)
    return {"Nm": "N m"}.get(ends[1], ends[1]) if ends else ""


def title_of(name: str, studied: StudyMetadata) -> str:
    """The title of a quantity; that of lost contact is what it means on this machine."""
    return contact_words(studied.machine) if name == CONTACT else known_quantity(name).title


def titled(name: str, studied: StudyMetadata) -> str:
    """A quantity as a title: "Peak resultant"."""
    title = title_of(name, studied)
    return title[0].upper() + title[1:]


def with_unit(name: str, studied: StudyMetadata) -> str:
    """A quantity and its unit, "peak resultant [N]"; any other column by its name."""
    stem = name.partition("[")[0]
    if quantity_of(stem) is None:
        return name
    unit = unit_of(stem)
    return title_of(stem, studied) + (f" [{unit}]" if unit else "")


def described(name: str, studied: StudyMetadata) -> str:
    """`the peak resultant of 1a`, `... of the machine`; any other column by its name."""
    stem, _, carriage = name.partition("[")
    if quantity_of(stem) is None:
        return name
    return f"the {title_of(stem, studied)} of {carriage.removesuffix(']') or 'the machine'}"


def available(studied: StudyMetadata) -> tuple[str, ...]:
    """The names of the quantities that a study has columns for; of a life also rating and travel.

    After those of `QUANTITIES` the measures as stored that none of them is made of: "max_Fy_N" without "min_Fy_N".
    """
    kinds = {(quantity, statistic) for quantity, _, statistic in studied.measures}
    has_life = studied.rating is not None and studied.life_base is not None
    made = [
        name
        for name, quantity in QUANTITIES.items()
        if kinds.issuperset(quantity.sources) and (name != LIFE or has_life)
    ]
    used = {source for name in made for source in QUANTITIES[name].sources}
    stored = {column.partition("[")[0]: None for column in studied.columns}
    rest = ((name, quantity_of(name)) for name in stored if name not in made)
    return (*made, *(name for name, one in rest if one is not None and not used.issuperset(one.sources)))


def summarised(studied: StudyMetadata) -> tuple[str, ...]:
    """The quantities that the summary has; all there are where it would have none of loads."""
    names = available(studied)
    chosen = tuple(name for name in names if known_quantity(name).in_summary)
    return chosen if set(chosen) - {CONTACT} else names


def contact_words(machine: Machine) -> str:
    """What `contact_lost` means on a machine: where a carriage is preloaded, that one of its rows is open."""
    laws = [law for carriage in machine.carriages for law in carriage.laws if law.kind != "linear"]
    preloaded = [law.kind == "preloaded" for law in laws]
    if not any(preloaded):
        return "contact lost"
    return "a row open" if all(preloaded) else "contact lost or a row open"


def figure(parts: SampleStore, studied: StudyMetadata, name: str, index: int) -> Array:
    """A quantity of the carriage with this index, (runs,)."""
    columns = dict(zip(studied.measures, studied.columns, strict=True))
    first, *rest = (
        parts.column(columns[quantity, index, statistic])
        for quantity, statistic in known_quantity(name).sources
    )
    for other in rest:
        first = np.maximum(np.abs(first), np.abs(other))
    if name != LIFE:
        return first
    assert studied.rating is not None and studied.life_base is not None
    with np.errstate(divide="ignore"):  # without load it lasts for ever
        life: Array = 1e-3 * studied.life_base * (studied.rating / first) ** studied.exponent
    return life


def limits_of(studied: StudyMetadata) -> dict[str, float]:
    """The limits asked for, by quantity and in its unit. Raises ValueRefused for a quantity that there is not."""
    names = {re.sub(r"_(Nm|N|km)$", "", name): name for name in available(studied)}
    found = {}
    for key, limit in studied.limits.items():
        if key not in names:
            near = get_close_matches(key, names, n=3, cutoff=0.4) or sorted(names)
            raise ValueRefused("a quantity of the study", key, f"nearest: {', '.join(near)}")
        found[names[key]] = 1e-3 * limit if names[key] == LIFE else limit
    return found
