"""Which product of a catalogue holds: the machine is run with every candidate in place of its carriages' products."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial
from typing import TYPE_CHECKING, Any

from guideload.base.arguments import checked, whole_number
from guideload.base.cores import cores, threads
from guideload.base.errors import ArgumentError, GuideloadError
from guideload.base.number_text import joined
from guideload.catalogue.catalogue import Catalogue, has_words
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.product import Product
from guideload.drive.requirements import drive_requirements
from guideload.life.life import life_of
from guideload.machine.components import Carriage
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.motion import Motion
from guideload.simulation.result import Result
from guideload.simulation.simulation import simulate
from guideload.sizing.requirements import Margins, margins_of

if TYPE_CHECKING:
    import pandas as pd

# Keys of a product that change neither loads nor life.
WITHOUT_EFFECT = {
    "name",
    "maker",
    "edition",
    "page",
    "unverified",
    "series",
    "size",
    "mass",
    "preload_classes",
}
AT_ONCE = 16  # least number of candidates between two looks at whether enough were tried
LARGER = 20  # candidates that commands and the page try after the smallest that holds
LAW_KEYS = ("stiffness", "curve", "preload", "clearance")


@dataclass(frozen=True, eq=False)
class Candidate:
    """A product in one preload class on all carriages of the machine, with the figures of its run.

    product, preload_class  None if the product has no preload classes
    machine                 with this product; None if the run failed. Products that differ in nothing but name and mass
                            share one run, under the name of the first of them
    life                    m of travel, of the machine
    life_hours              h
    static_safety           of the weakest carriage
    margins                 figure over requirement; None if the run failed
    drive_force             N, largest of the drive, with friction
    first_mode              Hz, lowest natural frequency
    reason                  why the run failed; empty if it did not
    """

    product: Product
    preload_class: str | None
    machine: Machine | None = None
    life: float = math.nan
    life_hours: float = math.nan
    static_safety: float = math.nan
    margins: Margins | None = None
    drive_force: float = math.nan
    first_mode: float = math.nan
    reason: str = ""

    @property
    def name(self) -> str:
        """Product and preload class."""
        return (
            self.product.name if self.preload_class is None else f"{self.product.name} {self.preload_class}"
        )

    @property
    def stiffness_from(self) -> str:
        """Where the stiffness of the run comes from: `by catalogue`, `estimated, within 30 %`, `by machine file`."""
        return self.product.stiffness_source(self.preload_class) or "by machine file"

    @property
    def holds(self) -> bool:
        """Whether it was run and meets every requirement."""
        return self.margins is not None and self.margins.hold

    @property
    def carriage_mass(self) -> float:
        """Mass of all carriages of the machine [kg]; nan if the record does not have it, or the run failed."""
        if self.machine is None or self.product.mass is None:
            return math.nan
        return self.product.mass * len(self.machine.carriages)

    @property
    def size(self) -> float:
        """The dynamic load rating for 100 km of travel [N], by which candidates are ranked."""
        return self.product.rating_for_100_km


@dataclass(frozen=True, eq=False)
class Sizing:
    """The candidates that were tried, from the smallest to the largest load rating; failed ones last.

    conditions  the requirements
    result      run of `best`; other candidates keep figures only, to save memory
    untried     number of larger candidates that were not tried
    """

    candidates: tuple[Candidate, ...]
    conditions: LifeConditions
    result: Result | None = None
    untried: int = 0

    @property
    def smallest(self) -> Candidate | None:
        """The smallest candidate that holds; None if none does."""
        return next((one for one in self.candidates if one.holds), None)

    @property
    def best(self) -> Candidate | None:
        """The smallest candidate that holds, or else the one with the largest margin; None if none could be run."""
        margins = {one: one.margins.smallest for one in self.candidates if one.margins is not None}
        return self.smallest or max(margins, key=margins.__getitem__, default=None)

    def table(self) -> pd.DataFrame:
        """A row per candidate; names of columns end in the unit."""
        import pandas as pd

        rows = [
            {
                "holds": one.holds,
                "dynamic_rating_N": math.nan if one.product.dynamic is None else one.product.dynamic.value,
                "static_rating_N": math.nan if one.product.static is None else one.product.static,
                "life_hours": one.life_hours,
                "life_km": 1e-3 * one.life,
                "static_safety": one.static_safety,
                "margin": math.nan if one.margins is None else one.margins.smallest,
                "fails_first": "" if one.margins is None else one.margins.first_to_fail,
                "drive_force_N": one.drive_force,
                "first_mode_Hz": one.first_mode,
                "carriage_mass_kg": one.carriage_mass,
                "stiffness_from": one.stiffness_from,
                "reason": one.reason,
            }
            for one in self.candidates
        ]
        return pd.DataFrame(rows, index=pd.Index([one.name for one in self.candidates], name="product"))


@checked
def size(
    machine: Machine,
    motion: Motion,
    catalogue: Catalogue,
    *,
    products: Iterable[str] | None = None,
    conditions: LifeConditions | None = None,
    riders: Mapping[str, Motion] | None = None,
    larger: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sizing:
    """Run the machine with the products and preload classes of a catalogue, from the smallest on, and rank them.

    products    products to try: a name, or words that each occur in maker or name, "HIWIN 25"; default: all
    conditions  requirements; default: the table [life] of the machine
    riders      the motion of each rider that moves, as for `simulate`
    larger      number of candidates to try after the smallest that holds; default: all
    progress    called with the number of finished candidates and of all; with `larger` it may end before all

    A product replaces ratings, stiffness, length and width of the carriages; those that its record lacks, and a
    stiffness that cannot be estimated either, stay those of the machine. Damping grows with the square root of the
    stiffness, which keeps the damping ratios. The mass stays.
    Raises ArgumentError for an unknown product, a negative `larger`, or a machine without carriages.
    """
    if not machine.carriages:
        raise ArgumentError("machine: it has no carriages to size")
    conditions = conditions or machine.life
    larger = None if larger is None else whole_number("larger", larger, least=0)
    chosen = catalogue.products if products is None else _selected(catalogue, products)
    trials = [Candidate(product, kind) for product in chosen for kind in _classes(product)]
    trials.sort(key=lambda one: (one.size, one.name))
    candidates: list[Candidate] = []
    enough = len(trials)
    at_once = enough if larger is None else max(AT_ONCE, 2 * cores())
    with threads(cores()) as submit:
        runs: dict[tuple[object, ...], Future[Candidate]] = {}
        while len(candidates) < enough:
            some = trials[len(candidates) :][:at_once]
            for one in some:
                alike = _properties(one.product, one.preload_class)
                if alike not in runs:
                    runs[alike] = submit(partial(_tried, machine, motion, riders, one), conditions)
            for one in some:
                run = runs[_properties(one.product, one.preload_class)].result()
                candidates.append(replace(run, product=one.product, preload_class=one.preload_class))
                if candidates[-1].holds and larger is not None:
                    enough = min(enough, len(candidates) + larger)
                if progress is not None:
                    progress(len(candidates), len(trials))
    ranked = sorted(candidates[:enough], key=lambda one: one.margins is None)
    found = Sizing(tuple(ranked), conditions, untried=len(trials) - len(ranked))
    best = found.best
    if best is None:
        return found
    equipped = with_product(machine, best.product, best.preload_class)  # its run may be that of another name
    return replace(found, result=simulate(equipped, motion, riders=riders))


def _selected(catalogue: Catalogue, texts: Iterable[str]) -> list[Product]:
    """The products that the texts name: one by its name, or all whose maker and name have every word.

    Raises ArgumentError.
    """
    found: dict[str, Product] = {}
    for text in texts:
        named = {one.name: one for one in catalogue.products if one.name == text}
        every = {one.name: one for one in catalogue.products if has_words(text, one.maker, one.name)}
        if not (named or every):
            makers = dict.fromkeys(one.maker for one in catalogue.products)
            near = get_close_matches(text, [*(one.name for one in catalogue.products), *makers], n=1)
            hint = f"did you mean {near[0]}?" if near else f"its makers are {joined(makers)}"
            raise ArgumentError(
                f"products: {text!r} is neither a name in the catalogue nor words of maker and name, as in 'HIWIN 25'; "
                f"{hint}"
            )
        found |= named or every
    return list(found.values())


def _classes(product: Product) -> list[str | None]:
    """The preload classes of a product; None for one that has no elastic law."""
    return [kind.name for kind in product.preload_classes] or [None]


def _properties(product: Product, preload_class: str | None) -> tuple[object, ...]:
    """All of a product in a preload class on which a run and its life depend."""
    kind = product.class_named(preload_class)
    law = None if kind is None else kind.model_copy(update={"name": "any"})
    return law, *(getattr(product, key) for key in Product.model_fields if key not in WITHOUT_EFFECT)


def _tried(
    machine: Machine,
    motion: Motion,
    riders: Mapping[str, Motion] | None,
    trial: Candidate,
    conditions: LifeConditions,
) -> Candidate:
    """The candidate with the figures of its run; its reason if the run is refused."""
    try:
        equipped = with_product(machine, trial.product, trial.preload_class)
        result = simulate(equipped, motion, riders=riders)
        life, needed = life_of(result, conditions), drive_requirements(result)
        return replace(
            trial,
            machine=equipped,
            life=life.machine,
            life_hours=life.hours(life.machine),
            static_safety=life.weakest.static.safety,
            margins=margins_of(life, needed),
            drive_force=needed.peak_force,
            first_mode=float(Modes.of(equipped).frequency.min(initial=math.inf)),
        )
    except GuideloadError as error:
        return replace(trial, reason=str(error))


@checked
def with_product(machine: Machine, product: Product, preload_class: str | None) -> Machine:
    """The machine with a product on every carriage, which keeps its place and its damping ratio."""
    laws = product.law_keys(preload_class)
    distances = product.model_distances()
    shared: dict[str, Any] = {
        "product": product.name,
        "preload_class": preload_class,
        "type": None,
        **distances,
    }
    if "length" in distances:
        shared |= {"stiffness_pitch": None, "stiffness_yaw": None}
    if "width" in distances:
        shared["stiffness_roll"] = None
    if laws:
        shared |= {f"{key}_{axis}": None for key in LAW_KEYS for axis in "yz"} | {"rolling": None}
        shared |= {"clearance_y": 0.0, "clearance_z": 0.0, "damping_in_contact": False}
        shared |= laws["y"] | laws["z"]
    carriages = [with_same_damping_ratio(one, one.model_copy(update=shared)) for one in machine.carriages]
    parts: dict[str, Any] = {"carriages": tuple(carriages), "carriage_types": {}}
    return machine.model_copy(update=parts | {"products": (product,), "catalogue": None})


def with_same_damping_ratio(before: Carriage, new: Carriage) -> Carriage:
    """The new carriage with the damping ratios that it had before: damping grows with the square root of stiffness."""
    damping = {
        f"damping_{axis}": getattr(before, f"damping_{axis}")
        * math.sqrt(law.stiffness / old.stiffness)
        * (share / left)
        for axis, old, law, share, left in zip(
            "yz", before.laws, new.laws, before.damping_shares, new.damping_shares, strict=True
        )
    }
    return new if before.laws == new.laws else new.model_copy(update=damping)
