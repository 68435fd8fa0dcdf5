"""Golden files of reports, which `python tests/golden.py --write` writes anew; read the difference.

A file has the report as text and, where it has a page of its own, the text of its HTML. A file is stale if a word
differs, or a number by more than a unit of its last digit.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal
from functools import cache
from pathlib import Path

import lives
import reference
import studies
from command_line import EXAMPLES, MACHINE, TRACE, guideload
from machines import having, link, with_carriages, with_mass
from moves import BRISK, GENTLE
from texts import page_text
from watched import machine as watched_machine
from watched import samples, text_of, watched

from guideload import (
    Catalogue,
    Drive,
    DutyCycle,
    Inspection,
    Life,
    LoadCase,
    LongRun,
    Machine,
    PointOfInterest,
    Result,
    Stability,
    StudyResult,
    WorkPrecision,
    duty_cycle,
    html_report,
    life_of,
    read_trace,
    simulate,
    stability,
    work_precision,
)
from guideload.machine.modes import Modes
from guideload.machine.response import frequency_response
from guideload.reports.catalogue import catalogue_report, product_report
from guideload.reports.compare import comparison_report
from guideload.reports.duty import duty_report
from guideload.reports.life import life_report
from guideload.reports.long_run import long_run_report
from guideload.reports.machine import machine_report, modes_report
from guideload.reports.monitor import monitor_report
from guideload.reports.report import Report
from guideload.reports.response import response_report
from guideload.reports.run import comparison, result_report
from guideload.reports.sizing import limit_report, sizing_report
from guideload.reports.stability import stability_report
from guideload.reports.study import study_report
from guideload.reports.trace import encoder_report
from guideload.reports.work_precision import chart_report
from guideload.sizing import largest, size
from guideload.sizing.size import Sizing

FOLDER = Path(__file__).resolve().parents[1] / "golden" / "reports"
NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d\u202f]*(?:\.\d+)?(?:e-?\d+)?(?![\w.]*\w)")
ROUNDING = Decimal("1e-12")  # smaller numbers are rounding errors: another processor has others
PAGE = "\n==== the page ====\n\n"  # between the text and that of the page


def written(name: str) -> str:
    """The content of a golden file."""
    report = REPORTS[name]()
    text = report.text() if isinstance(report, Report) else report
    return text + (PAGE + page_text(PAGES[name]()) if name in PAGES else "")


def parts(text: str) -> tuple[str, list[str]]:
    """The text with a mark for each number, without line breaks and rules of tables, whose widths follow numbers."""
    return " ".join(NUMBER.sub("#", text).replace("─", " ").split()), NUMBER.findall(text)


def alike(found: str, expected: str) -> bool:
    """Another processor may round the last digit differently; counts of one or two digits are exact."""
    if found == expected:
        return True
    values = [Decimal(text.replace("\u202f", "")) for text in (found, expected)]
    if max(map(abs, values)) < ROUNDING:
        return True
    if all(re.fullmatch(r"[-+]?\d{1,2}", text) for text in (found, expected)):
        return False
    unit = max(Decimal(1).scaleb(int(value.as_tuple().exponent)) for value in values)
    return abs(values[0] - values[1]) <= unit


def differences(name: str) -> list[tuple[str, str]]:
    """Words, or else numbers, that the report and its golden file have differently: now, and in the file."""
    (words, numbers), (expected, golden) = map(
        parts, (written(name), (FOLDER / f"{name}.txt").read_text("utf-8"))
    )
    if words != expected:
        return [(words, expected)]
    return [pair for pair in zip(numbers, golden, strict=True) if not alike(*pair)]


def stale(write: bool = False) -> list[str]:
    """Names of the golden files that differ from what the reports say now; they are written anew if asked."""
    found = [name for name in REPORTS if not (FOLDER / f"{name}.txt").exists() or differences(name)]
    for name in found if write else ():
        (FOLDER / f"{name}.txt").write_text(written(name), encoding="utf-8")
    return [f"reports/{name}" for name in found]


# ---- machines and motions


def geared() -> Machine:
    """A machine with a drive, points and products that reaches what is asked."""
    return lives.cart(
        life={"life": "4000 km", "safety": 2.0},
        drive=Drive(gear_ratio=12.0, pinion_diameter=0.1273),
        points=[PointOfInterest(name="tool", at=(0.0, -0.9, 0.0), settle_window=2e-5)],
    )


def every_law() -> Machine:
    """A carriage for each elastic law, and an extra link with clearance."""
    machine = reference.cart()
    changes = (
        {"stiffness_y": {"positive": 9e7, "negative": 1.4e8}, "compliance_z": 1e-9},
        {"clearance_z": 5e-6, "damping_in_contact": True},
        {"curve_y": [(0.0, 0.0), (6e-6, 400.0), (16e-6, 2000.0)], "stiffness_y": None},
        {"preload_y": 1200.0, "preload_z": 1200.0, "rolling": "ball"},
    )
    carriages = [
        type(one)(**{**dict(one), **change}) for one, change in zip(machine.carriages, changes, strict=True)
    ]
    return machine.model_copy(
        update={
            "carriages": tuple(carriages),
            "links": (link("stop", point=(0, 0.1, 0), stiffness=8e7, clearance=1e-5),),
        }
    )


# ---- results


@cache
def run() -> Result:
    return simulate(geared(), lives.moved(BRISK))


@cache
def traced() -> Result:
    return simulate(*reference.example())


@cache
def two_masses() -> dict[str, Result]:
    return {"light": run(), "heavy": simulate(with_mass(geared(), 1500.0), lives.moved(BRISK))}


def papers_dofs() -> dict[str, Result]:
    machine, motion = reference.example()
    return {"All dofs": traced(), "The paper's dofs": simulate(machine.with_free(["rx", "ry", "rz"]), motion)}


def life_with_band() -> Life:
    machine, motion = reference.example()
    rated = with_carriages(having(machine, products=lives.cart().products), product="20")
    return life_of(simulate(rated, motion))


@cache
def duty() -> DutyCycle:
    machine, motion = lives.cart(life={"life": "40000 km"}), lives.moved(GENTLE, 500.0)
    full = LoadCase("full", with_mass(machine, 2000.0), motion, 45.0)
    return duty_cycle([LoadCase("empty", machine, motion, 30.0), full])


@cache
def sized() -> tuple[Machine, Sizing]:
    machine, motion = reference.example()
    machine = machine.model_copy(update={"life": lives.cart(life={"life": "5000 km"}).life})
    return machine, size(machine, motion, CATALOGUE)


def limit() -> Report:
    machine = geared()
    found = largest(machine, lives.moved(GENTLE, 500.0), "payload", conditions=machine.life)
    return limit_report(machine, found, machine.life)


def long_run() -> LongRun:
    found = LongRun(geared())
    found.add(lives.moved(GENTLE, 500.0))
    return found


def step_stability() -> Stability:
    """With made times."""
    found = stability(Machine.from_toml(MACHINE))
    costs = tuple(replace(cost, seconds=cost.seconds and 1e-3) for cost in found.costs)
    return replace(found, costs=costs)


def chart() -> WorkPrecision:
    """Of the exact method with made times: how many other settings run depends on the computer."""
    found = work_precision(reference.cart(), lives.moved(GENTLE, 500.0), budget=1.0)
    rows = [row for row in found.rows if row.setting.method == "exact"]
    made = tuple(replace(row, seconds=1e-3, spread=1e-5, pareto_optimal=True) for row in rows)
    return replace(found, rows=made, repetitions=3)


@cache
def study() -> StudyResult:
    return studies.study(400, failed={3: "diverged"}, limits={"peak_resultant_N": 7500.0})


def cases() -> StudyResult:
    return studies.chosen(studies.study(6, factors=2, limits={"peak_resultant_N": 7500.0}))


CATALOGUE = Catalogue.from_toml(EXAMPLES / "catalogue.toml")
REPORTS: dict[str, Callable[[], Report | str]] = {
    "run": lambda: result_report(run()),
    "run_of_a_trace": lambda: result_report(traced()),
    "run_with_every_law": lambda: result_report(simulate(every_law(), lives.moved(GENTLE, 500.0))),
    "run_of_the_papers_dofs": lambda: comparison(papers_dofs()),
    "compare": lambda: comparison_report(two_masses()),
    "life": lambda: life_report(life_with_band()),
    "duty": lambda: duty_report(duty()),
    "sizing": lambda: sizing_report(*sized()),
    "limit": limit,
    "long_run": lambda: long_run_report(long_run()),
    "machine": lambda: machine_report(every_law()),
    "machine_with_products": lambda: machine_report(geared().with_free(["rx", "ry", "rz"])),
    "modes": lambda: modes_report(every_law(), Modes.of(every_law())),
    "check": lambda: guideload("check", MACHINE, TRACE).stdout,
    "encoder": lambda: encoder_report(Inspection.of(read_trace(TRACE), Machine.from_toml(MACHINE))),
    "response": lambda: response_report(geared(), frequency_response(geared())),
    "sensitivities": lambda: guideload("sensitivities", MACHINE, TRACE).stdout,
    "step_stability": lambda: stability_report(step_stability()),
    "chart": lambda: chart_report(chart()),
    "catalogue": lambda: catalogue_report(CATALOGUE),
    "product": lambda: product_report(CATALOGUE["HGH25CA"]),
    "identification": lambda: guideload("identify", EXAMPLES / "identify.toml").stdout,
    "monitor": lambda: monitor_report(watched(text_of(*samples())).status(), watched_machine()),
    "study": lambda: study_report(study()),
    "study_with_sensitivity": lambda: study_report(studies.study(60, sensitivity=True)),
    "study_of_cases": lambda: study_report(cases()),
}
PAGES: dict[str, Callable[[], str]] = {
    "run": lambda: html_report.run_page(run()),
    "run_of_a_trace": lambda: html_report.run_page(traced()),
    "compare": lambda: html_report.comparison_page(two_masses()),
    "duty": lambda: html_report.duty_page(duty()),
    "sizing": lambda: html_report.sizing_page(*sized()),
    "study": lambda: html_report.study_page(study()),
}
