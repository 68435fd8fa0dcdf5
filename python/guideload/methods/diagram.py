"""Speed against accuracy: what a chart of the methods holds.

The error of a run is the largest difference of its loads from those of a reference. How far the reference itself
can be trusted is measured: by how much it differs from a second, different method at its tightest tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

from guideload.base.numbers import scientific
from guideload.machine.machine import Machine

if TYPE_CHECKING:
    import pandas as pd

AUTO_RTOL = 1e-6  # the default of `simulate`
# Against finite rotations the loads of the benchmark machines differ by 5e-5 to 3e-4 of the load.
MODEL_ACCURACY = 1e-4


class Setting(NamedTuple):
    """A method and how it is asked for accuracy: by a tolerance, by a fixed step [s], or not at all."""

    method: str
    kind: Literal["rtol", "step"] | None = None
    value: float | None = None

    @property
    def text(self) -> str:
        """As in `rk45 at rtol 1e-6`."""
        return f"{self.method} at {self.kind} {self.value_text}" if self.kind else self.method

    @property
    def value_text(self) -> str:
        """As in `1e-6` or `0.5 ms`; empty without a value."""
        if self.value is None:
            return ""
        return scientific(self.value) if self.kind == "rtol" else f"{1e3 * self.value:.3g} ms"


@dataclass(frozen=True)
class Row:
    """One setting of one method: what it cost and how far its loads are from the reference.

    seconds         median time from the motion to the loads [s]; None if there was no run
    spread          interquartile range of that time [s]; None if it ran once
    error           largest difference from the reference over time and judged loads [N]; None if there was no run
    load_error      the same as part of the largest load; None if there is no load
    dynamic_error   the same as part of the largest dynamic load (load less static load); None if nothing moves
    below_reference the difference is within what the reference can tell: the errors are that limit, an upper bound
    failed          why there are no figures; None if there are
    pareto_optimal        no other row is as fast and as accurate, and better in one of the two
    """

    setting: Setting
    seconds: float | None = None
    spread: float | None = None
    steps: int | None = None
    rejected: int | None = None
    error: float | None = None
    load_error: float | None = None
    dynamic_error: float | None = None
    below_reference: bool = False
    failed: str | None = None
    pareto_optimal: bool = False


@dataclass(frozen=True)
class Reference:
    """What the errors are measured against, and how far it can be trusted.

    largest_load, largest_dynamic: over time and judged loads [N]. limit: difference from the second method, or
    the rounding of the load if that is more [N]; None where no second method ran, for which `problems` has reasons.
    """

    setting: Setting
    check: Setting | None
    largest_load: float
    largest_dynamic: float | None
    limit: float | None
    problems: tuple[str, ...]

    def of_load(self, error: float) -> float | None:
        """An error [N] as part of the largest load; None if there is no load."""
        return error / self.largest_load if self.largest_load > 0.0 else None

    def of_dynamic(self, error: float) -> float | None:
        """An error [N] as part of the largest dynamic load; None if nothing moves."""
        return None if self.largest_dynamic is None else error / self.largest_dynamic

    @property
    def text(self) -> str:
        """Which it is, and how far it can be trusted, in a sentence."""
        if self.check is None or self.limit is None:
            reasons = "; ".join(self.problems)
            return (
                f"{self.setting.text}, not cross-checked ({reasons}): how far it can be trusted is not known"
            )
        shares = ((self.of_load(self.limit), "the load"), (self.of_dynamic(self.limit), "the dynamic load"))
        told = " and ".join(f"{scientific(share)} of {whole}" for share, whole in shares if share is not None)
        return (
            f"{self.setting.text}, cross-checked by {self.check.text}: they agree within {told or '0 N'}. "
            "Smaller errors are below what it can tell"
        )


@dataclass(frozen=True, eq=False)
class WorkPrecision:
    """Time and error of every method over its settings, for one machine and motion; see `Row`.

    judged       which loads the errors are of, and why these
    auto_method  what `auto` picks; None if it fails
    auto_reason  why; or why it fails
    repetitions  times that every setting ran at least; budget [s] what they were allowed to take together
    """

    machine: Machine
    rows: tuple[Row, ...]
    reference: Reference
    judged: str
    auto_method: str | None
    auto_reason: str
    samples: int
    duration: float
    repetitions: int
    budget: float

    @property
    def auto_row(self) -> Row | None:
        """The row of what `auto` picks, at the tolerance that `simulate` takes unless told otherwise."""
        asked = (Setting(self.auto_method or ""), Setting(self.auto_method or "", "rtol", AUTO_RTOL))
        return next((row for row in self.rows if row.setting in asked), None)

    def runs(self) -> list[list[Row]]:
        """The rows in order, those of equal runs together: tolerances that ask for no more than the samples do."""
        runs: list[list[Row]] = []
        for row in self.rows:
            same = runs and runs[-1][0].setting[:2] == row.setting[:2]
            if same and replace(runs[-1][0], setting=row.setting) == row:
                runs[-1].append(row)
            else:
                runs.append([row])
        return runs

    def table(self) -> pd.DataFrame:
        """A row per setting; columns end in their unit where they have one."""
        import pandas as pd

        return pd.DataFrame(
            {
                "method": row.setting.method,
                "setting": row.setting.kind,
                "value": row.setting.value,
                "seconds": row.seconds,
                "spread_s": row.spread,
                "steps": row.steps,
                "rejected_steps": row.rejected,
                "error_N": row.error,
                "load_error": row.load_error,
                "dynamic_error": row.dynamic_error,
                "below_reference": row.below_reference,
                "pareto_optimal": row.pareto_optimal,
                "picked_by_auto": row is self.auto_row,
                "failed": row.failed,
            }
            for row in self.rows
        ).astype({"steps": "Int64", "rejected_steps": "Int64"})


def setting_range(rows: list[Row]) -> str:
    """The tolerances or steps of rows of one method: `1e-3 to 1e-9`; a dash for a method that takes none."""
    first, last = rows[0].setting.value_text or "-", rows[-1].setting.value_text
    return f"{first} to {last}" if len(rows) > 1 else first


def pareto_optimal(row: Row, rows: list[Row]) -> bool:
    """Whether no row is at least as fast and as accurate, and better in one of the two."""
    if row.seconds is None or row.error is None:
        return False
    for other in rows:
        if other.seconds is None or other.error is None:
            continue
        better = other.seconds < row.seconds or other.error < row.error
        if better and other.seconds <= row.seconds and other.error <= row.error:
            return False
    return True
