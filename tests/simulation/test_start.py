"""The start of a run: at rest, or in the quasi-static state of a record that begins under way."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import reference as ref

from guideload import Machine, Motion, simulate
from guideload.base.errors import ArgumentError
from guideload.reports.run import result_report
from guideload.simulation.start import NEGLIGIBLE, start_of
from guideload.traces.reading import motion_from_trace, read_trace


def under_way(**changes: Any) -> Motion:
    """A record of a slow swing that begins at its largest acceleration, 2 m/s2."""
    time = np.arange(1001) / 1000.0
    return replace(Motion.along_x(time, 2.0 * np.cos(2.0 * np.pi * time), recorded=True), **changes)


def test_what_counts_as_standstill():
    machine, motion = ref.cart(), under_way()
    assert start_of(machine, motion, "auto") == "quasi-static"
    assert start_of(machine, motion, "rest") == "rest"
    assert start_of(machine, replace(motion, recorded=False), "auto") == "rest"
    assert start_of(machine, replace(motion, recorded=False), "quasi-static") == "quasi-static"
    still = motion.acceleration.copy()
    still[0] = 0.99 * NEGLIGIBLE * 2.0, 0.0, 0.0
    assert start_of(machine, replace(motion, acceleration=still), "auto") == "rest"
    wrench = np.zeros((motion.time.size, 6))
    wrench[:, 1] = 5.0
    assert start_of(machine, replace(motion, acceleration=still, wrench=wrench), "auto") == "quasi-static"
    with pytest.raises(
        ArgumentError, match="start: expected one of auto, rest, quasi-static, got \"still\"|got 'still'"
    ):
        simulate(machine, motion, start="still")


def test_a_record_at_standstill_starts_at_rest_to_the_bit():
    machine, motion = ref.example()
    auto, rest = simulate(machine, motion), simulate(machine, motion, start="rest")
    assert auto.quantities.attrs["start"] == "rest"
    np.testing.assert_array_equal(auto.carriage_loads, rest.carriage_loads)


def test_the_report_tells_the_start():
    result = simulate(ref.cart(), under_way())
    assert result.quantities.attrs["start"] == "quasi-static"
    text = " ".join(result_report(result).text().split())
    assert "static equilibrium under the weight, the first acceleration" in text


@pytest.mark.parametrize("machine", [ref.cart(), ref.preloaded()], ids=["linear", "preloaded"])
def test_the_audit_warns_of_a_sudden_start(machine: Machine):
    result = simulate(machine, under_way())
    assert not [text for text in result.audit.warnings if "sudden start" in text]
    at_rest = simulate(machine, under_way(), start="rest").audit
    assert [text for text in at_rest.warnings if "sudden start" in text]


def test_the_peaks_of_emps_are_not_its_first_instant(shared_data: Path):
    whole = read_trace(shared_data / "emps_bangbang_1kHz.csv")
    motion = motion_from_trace(replace(whole, time=whole.time[:6000], value=whole.value[:6000]))
    machine = ref.cart()
    first = motion.time[0] + 0.05
    at_rest = simulate(machine, motion, start="rest").peak_columns
    assert (at_rest["time_of_peak_s"] < first).any()  # the blow of the first acceleration
    assert (simulate(machine, motion).peak_columns["time_of_peak_s"] > first).all()
