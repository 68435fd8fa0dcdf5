"""Titles of quantities and other columns, in reports and pictures."""

from __future__ import annotations

from guideload.machine.machine import Machine
from guideload.study.description.measures import CONTACT, QUANTITIES, unit_of
from guideload.study.description.metadata import StudyMetadata


def contact_words(machine: Machine) -> str:
    """Words for `contact_lost` on a machine: of a preloaded carriage, one row is open."""
    laws = [law for carriage in machine.carriages for law in carriage.laws if law.kind != "linear"]
    preloaded = [law.kind == "preloaded" for law in laws]
    if not any(preloaded):
        return "contact lost"
    return "a row open" if all(preloaded) else "contact lost or a row open"


def title_of(name: str, metadata: StudyMetadata) -> str:
    """The title of a column, such as "peak resultant"; a column that is no quantity has its name."""
    stem = name.partition("[")[0]
    if stem == CONTACT:
        return contact_words(metadata.machine)
    return QUANTITIES[stem].title if stem in QUANTITIES else name


def with_unit(name: str, metadata: StudyMetadata) -> str:
    """The title of a column and its unit: "peak resultant [N]"."""
    unit = unit_of(stem) if (stem := name.partition("[")[0]) in QUANTITIES else ""
    return title_of(name, metadata) + (f" [{unit}]" if unit else "")


def with_owner(name: str, metadata: StudyMetadata) -> str:
    """The title of a column with its carriage: "the peak resultant of 1a", or "... of the machine"."""
    stem, _, carriage = name.partition("[")
    if stem not in QUANTITIES:
        return name
    return f"the {title_of(stem, metadata)} of {carriage.removesuffix(']') or 'the machine'}"
