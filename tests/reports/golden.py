"""Golden files: what every kind of report says. `python tests/reports/golden.py` writes them anew; read the difference.

A file has the report as text and, where it has a page of its own, the text of its HTML. `test_golden.py` compares.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import lives
import reference
import studies
from command_line import EXAMPLES, MACHINE, TRACE, guideload
from machines import link
from moves import BRISK, GENTLE
from texts import page_text

from guideload import (
    Catalogue,
    Drive,
    Inspection,
    LoadCase,
    LongRun,
    Machine,
    PointOfInterest,
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

FOLDER = Path(__file__).parent / "golden"
PAGE = "\n==== the page ====\n\n"  # between the text and that of the page

Case = Callable[[], tuple[Report | str, str]]
CASES: dict[str, Case] = {}


def case(make: Case) -> Case:
    """Decorator: a report, or its text, and its page, empty without one of its own."""
    CASES[make.__name__] = make
    return make


def written(name: str) -> str:
    """The content of a golden file."""
    report, page = CASES[name]()
    text = report if isinstance(report, str) else report.text()
    return text + (PAGE + page_text(page) if page else "")


# ---- machines and motions


def rack_and_pinion() -> Machine:
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


# ---- runs


@case
def run() -> tuple[Report, str]:
    result = simulate(rack_and_pinion(), lives.moved(BRISK))
    return result_report(result), html_report.run_page(result)


@case
def run_of_a_trace() -> tuple[Report, str]:
    result = simulate(*reference.example())
    return result_report(result), html_report.run_page(result)


@case
def run_with_every_law() -> tuple[Report, str]:
    return result_report(simulate(every_law(), lives.moved(GENTLE, 500.0))), ""


@case
def run_of_the_papers_dofs() -> tuple[Report, str]:
    machine, motion = reference.example()
    runs = {"All dofs": machine, "The paper's dofs": machine.with_free(["rx", "ry", "rz"])}
    return comparison({name: simulate(one, motion) for name, one in runs.items()}), ""


@case
def compare() -> tuple[Report, str]:
    light, motion = rack_and_pinion(), lives.moved(BRISK)
    heavy = light.model_copy(update={"body": light.body.model_copy(update={"mass": 1500.0})})
    results = {"light": simulate(light, motion), "heavy": simulate(heavy, motion)}
    return comparison_report(results), html_report.comparison_page(results)


@case
def life() -> tuple[Report, str]:
    machine, motion = reference.example()
    products = lives.cart().products
    carriages = tuple(one.model_copy(update={"product": "20"}) for one in machine.carriages)
    rated = machine.model_copy(update={"products": products, "carriages": carriages})
    return life_report(life_of(simulate(rated, motion))), ""


@case
def duty() -> tuple[Report, str]:
    machine = lives.cart(life={"life": "40000 km"})
    loaded = machine.model_copy(update={"body": machine.body.model_copy(update={"mass": 2000.0})})
    motion = lives.moved(GENTLE, 500.0)
    found = duty_cycle([LoadCase("empty", machine, motion, 30.0), LoadCase("full", loaded, motion, 45.0)])
    return duty_report(found), html_report.duty_page(found)


@case
def sizing() -> tuple[Report, str]:
    machine, motion = reference.example()
    machine = machine.model_copy(update={"life": lives.cart(life={"life": "5000 km"}).life})
    found = size(machine, motion, Catalogue.from_toml(EXAMPLES / "catalogue.toml"))
    return sizing_report(machine, found), html_report.sizing_page(machine, found)


@case
def limit() -> tuple[Report, str]:
    machine = rack_and_pinion()
    found = largest(machine, lives.moved(GENTLE, 500.0), "payload", conditions=machine.life)
    return limit_report(machine, found, machine.life), ""


@case
def long_run() -> tuple[Report, str]:
    found = LongRun(rack_and_pinion())
    found.add(lives.moved(GENTLE, 500.0))
    return long_run_report(found), ""


# ---- machines and traces


@case
def machine() -> tuple[Report, str]:
    return machine_report(every_law()), ""


@case
def machine_with_products() -> tuple[Report, str]:
    return machine_report(rack_and_pinion().with_free(["rx", "ry", "rz"])), ""


@case
def modes() -> tuple[Report, str]:
    machine = every_law()
    return modes_report(machine, Modes.of(machine)), ""


@case
def check() -> tuple[str, str]:
    return guideload("check", MACHINE, TRACE).stdout.replace(str(EXAMPLES), ""), ""


@case
def encoder() -> tuple[Report, str]:
    return encoder_report(Inspection.of(read_trace(TRACE), Machine.from_toml(MACHINE))), ""


@case
def response() -> tuple[Report, str]:
    machine = rack_and_pinion()
    return response_report(machine, frequency_response(machine)), ""


@case
def sensitivities() -> tuple[str, str]:
    return guideload("sensitivities", MACHINE, TRACE).stdout, ""


@case
def step_stability() -> tuple[Report, str]:
    found = stability(Machine.from_toml(MACHINE))
    costs = tuple(replace(cost, seconds=cost.seconds and 1e-3) for cost in found.costs)
    return stability_report(replace(found, costs=costs)), ""


@case
def chart() -> tuple[Report, str]:
    """Of the exact method, which always runs: times and the number of settings depend on the computer."""
    found = work_precision(reference.cart(), lives.moved(GENTLE, 500.0), budget=1.0)
    rows = tuple(
        replace(row, seconds=1e-3, spread=1e-5, pareto_optimal=True)
        for row in found.rows
        if row.setting.method == "exact"
    )
    return chart_report(replace(found, rows=rows, repetitions=3)), ""


@case
def catalogue() -> tuple[Report, str]:
    return catalogue_report(Catalogue.from_toml(EXAMPLES / "catalogue.toml")), ""


@case
def product() -> tuple[Report, str]:
    return product_report(Catalogue.from_toml(EXAMPLES / "catalogue.toml")["HGH25CA"]), ""


@case
def identification() -> tuple[str, str]:
    return guideload("identify", EXAMPLES / "identify.toml").stdout, ""


@case
def monitor() -> tuple[Report, str]:
    carriages = [
        {
            "name": "1a",
            "Fy_N": -2158.2,
            "Fz_N": 12.0,
            "largest_resultant_N": 4711.0,
            "time_of_largest_s": 1.234,
        }
        | {"limit_exceeded": 1, "above_limit_s": 0.02, "life_used": 1.5e-6},
        dict.fromkeys(("Fy_N", "Fz_N", "largest_resultant_N", "time_of_largest_s", "life_used"))
        | {"name": "1b", "limit_exceeded": 0, "above_limit_s": 0.0},
    ]
    counts = dict.fromkeys(("missing", "early", "jittering", "stuck", "jumps", "counter_set", "lost"), 0)
    counts |= {"samples": 4000, "malformed": 2, "restarts": 1, "wraps": 0}
    status = {"machine": "Gantry", "limit_N": 4600.0, "is_settling": True, "distance_m": 12.34}
    return monitor_report({**status, "carriages": carriages, "input": counts}), ""


# ---- studies


@case
def study() -> tuple[Report, str]:
    found = studies.study(400, failed={3: "diverged"}, limits={"peak_resultant_N": 7500.0})
    return study_report(found), html_report.study_page(found)


@case
def study_with_sensitivity() -> tuple[Report, str]:
    return study_report(studies.study(60, sensitivity=True)), ""


@case
def study_of_cases() -> tuple[Report, str]:
    return study_report(studies.chosen(studies.study(6, factors=2, limits={"peak_resultant_N": 7500.0}))), ""


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    wanted = sys.argv[1:] or list(CASES)
    for name in wanted:
        (FOLDER / f"{name}.txt").write_text(written(name), encoding="utf-8")
