"""What the second look at a study says about its samples, in words."""

from __future__ import annotations

from guideload.base.number_text import counted, percent, scientific
from guideload.study.description.metadata import SecondLooks


def doubts_of(look: SecondLooks | str | None, what: str) -> tuple[str, ...]:
    """Doubts about samples, the gravest first. what: "sample" or "case"."""
    if not isinstance(look, SecondLooks):
        return ()
    of, doubts = f"of {counted(look.solved, what)} solved again", []
    if look.unpredictable:
        doubts.append(
            f"Doubtful: {look.unpredictable} {of} cannot be predicted: impacts amplify small differences. A motion "
            f"times 1 + {scientific(look.perturbation)} changes loads by up to {percent(look.sensitivity)} of "
            f"the largest load ({what} {look.sensitivity_in}). Damping that always acts (damping_in_contact = false), "
            "more damping or less clearance makes the loads predictable."
        )
    if look.doubtful:
        way_out = "look for extreme values" if look.method == "exact" else "use a smaller rtol"
        doubts.append(
            f"Doubtful: {look.doubtful} {of}, by {_method(look)}, {'differs' if look.doubtful == 1 else 'differ'} by "
            f"up to {percent(look.difference)} of the largest load ({what} {look.difference_in}); only "
            f"{scientific(look.explained)} is explained. Solve this {what} by itself, with simulate, and {way_out}."
        )
    return tuple(doubts)


def outcome_of(look: SecondLooks | str | None, what: str) -> str:
    """The outcome of a second look without doubts."""
    if look is None:
        return f"not judged: the second look at some {what}s follows when all are done"
    if isinstance(look, str):
        return f"second look: {look}"
    missing = f"; {look.failed} could not be solved again: {look.reason}" if look.failed else ""
    return (
        f"{counted(look.solved, what)} solved again by {_method(look)}: peaks of all links agree to "
        f"{scientific(look.difference)} of the largest load{missing}"
    )


def _method(look: SecondLooks) -> str:
    if look.method == "exact":
        return look.method
    return f"{'another method' if look.method == 'auto' else look.method} at rtol {scientific(look.rtol)}"
