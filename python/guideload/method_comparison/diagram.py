"""The work-precision diagram as data: what each setting of each method costs, and how accurate its loads are.

The error of a run is the largest difference of its loads from those of a reference. The error of the reference
itself is estimated: by its difference from a second, different method at its tightest tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

from guideload.base.number_text import scientific
from guideload.machine.machine import Machine

if TYPE_CHECKING:
    import pandas as pd

AUTO_RTOL = 1e-6  # the default of `simulate`
# Against finite rotations the loads of the benchmark machines differ by 5e-5 to 3e-4 of the load.
MODEL_ACCURACY = 1e-4


class Setting(NamedTuple):
    """A method with its tolerance (kind `rtol`), its fixed step in s (kind `step`), or neither."""

    method: str
    kind: Literal["rtol", "step"] | None = None
    value: float | None = None

    @property
    def curve(self) -> tuple[str, str | None]:
        """The curve of the diagram that it lies on: all tolerances, or all fixed steps, of a method."""
        return self[:2]

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
class SettingResult:
    """One setting of one method: its cost, and the error of its loads."""

    setting: Setting
    seconds: float | None = None  # median time from the motion to the loads [s]; None if there was no run
    spread: float | None = None  # interquartile range of that time [s]; None if it ran once
    steps: int | None = None
    rejected: int | None = None
    # largest difference from the reference over time and loads [N]; None if there was no run
    error: float | None = None
    load_error: float | None = None  # the same over the largest load; None if there is no load
    # the same over the largest dynamic load (load less static load); None if nothing moves
    dynamic_error: float | None = None
    # whether the difference is below the error of the reference: the errors are that one, an upper bound
    below_reference: bool = False
    pareto_optimal: bool = False  # no other row is as fast and as accurate, and better in one of the two
    failed: str | None = None  # why there are no figures; None if there are

    @property
    def cost(self) -> tuple[float, float] | None:
        """Error [N] and time [s]; None if there was no run."""
        return None if self.error is None or self.seconds is None else (self.error, self.seconds)

    def same_run(self, other: SettingResult) -> bool:
        """Whether both settings lead to the same run, as tolerances do where the samples limit the step."""
        return self.setting.curve == other.setting.curve and replace(self, setting=other.setting) == other


@dataclass(frozen=True)
class Reference:
    """The loads that errors are measured from, and their own error."""

    setting: Setting  # of the reference run
    # of the run that it is compared with; None where no second method ran: `problems` says why
    check: Setting | None
    largest_load: float  # largest load over time [N]
    largest_dynamic: float | None  # largest dynamic load over time [N]; None if nothing moves
    # difference of the two runs, or the rounding of the load if that is more [N]; None without check
    limit: float | None
    problems: tuple[str, ...]

    def over_load(self, error: float) -> float | None:
        """An error [N] over the largest load; None if there is no load."""
        return error / self.largest_load if self.largest_load > 0.0 else None

    def over_dynamic(self, error: float) -> float | None:
        """An error [N] over the largest dynamic load; None if nothing moves."""
        return None if self.largest_dynamic is None else error / self.largest_dynamic

    @property
    def text(self) -> str:
        """Its setting and its error, in a sentence."""
        if self.check is None or self.limit is None:
            return (
                f"{self.setting.text}, not cross-checked ({'; '.join(self.problems)}): its error is not known"
            )
        shares = (
            (self.over_load(self.limit), "the load"),
            (self.over_dynamic(self.limit), "the dynamic load"),
        )
        difference = " and ".join(
            f"{scientific(share)} of {load}" for share, load in shares if share is not None
        )
        return (
            f"{self.setting.text}, cross-checked by {self.check.text}: they agree within {difference or '0 N'}. "
            "Smaller errors cannot be seen"
        )


@dataclass(frozen=True, eq=False)
class WorkPrecision:
    """Time and error of every method over its settings, for one machine and motion; see `SettingResult`.

    error_metric which loads the errors are of, and why these
    auto_method  the method that `auto` picks; None if it fails
    auto_reason  why; or why it fails
    samples      of the motion
    duration     of the motion [s]
    repetitions  how often every setting ran at least
    budget       time that all runs together were allowed to take [s]
    """

    machine: Machine
    rows: tuple[SettingResult, ...]
    reference: Reference
    error_metric: str
    auto_method: str | None
    auto_reason: str
    samples: int
    duration: float
    repetitions: int
    budget: float

    @property
    def auto_row(self) -> SettingResult | None:
        """The row of the method that `auto` picks, at the default tolerance of `simulate`."""
        method = self.auto_method or ""
        settings = (Setting(method), Setting(method, "rtol", AUTO_RTOL))
        return next((row for row in self.rows if row.setting in settings), None)

    def runs(self) -> list[list[SettingResult]]:
        """The rows in order, neighbours that are the same run together."""
        runs: list[list[SettingResult]] = []
        for row in self.rows:
            if runs and runs[-1][0].same_run(row):
                runs[-1].append(row)
            else:
                runs.append([row])
        return runs

    def table(self) -> pd.DataFrame:
        """A row per setting; columns end in their unit where they have one."""
        import pandas as pd

        names = {"spread": "spread_s", "rejected": "rejected_steps", "error": "error_N"}
        rows = [
            {"method": row.setting.method, "setting": row.setting.kind, "value": row.setting.value}
            | {names.get(name, name): vars(row)[name] for name in list(vars(row))[1:-1]}
            | {"picked_by_auto": row is self.auto_row, "failed": row.failed}
            for row in self.rows
        ]
        return pd.DataFrame(rows).astype({"steps": "Int64", "rejected_steps": "Int64"})


def setting_range(rows: list[SettingResult]) -> str:
    """The tolerances or steps of rows of one method: `1e-3 to 1e-9`; a dash for a method that takes none."""
    first, last = rows[0].setting.value_text or "-", rows[-1].setting.value_text
    return f"{first} to {last}" if len(rows) > 1 else first


def pareto_optimal(row: SettingResult, rows: list[SettingResult]) -> bool:
    """Whether a row has run and no other one is as fast and as accurate, and better in one of the two."""
    if row.cost is None:
        return False
    error, seconds = row.cost
    others = {other.cost for other in rows if other.cost is not None} - {row.cost}
    return not any(other[0] <= error and other[1] <= seconds for other in others)
