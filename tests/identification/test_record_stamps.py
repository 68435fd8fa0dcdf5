"""Stamps of records beside a trace: those of its own columns, and dates of two files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from motor_records import axis

from guideload.identification.tables import MotorForceTable


@pytest.mark.parametrize("dates", [False, True])
def test_a_record_keeps_its_place_beside_the_trace(tmp_path: Path, dates: bool) -> None:
    """Its columns in the file of the trace have the unit of time of [reading]; dates of both files are of one clock."""
    time = np.arange(200) * 1e-3
    noon = np.datetime64("2026-01-31T12:00:00.000")
    stamps = noon + np.arange(200).astype("m8[ms]") if dates else time
    header, unit = ("time", {}) if dates else ("time [ms]", {"time_unit": "s"})
    rows = {header: stamps, "x_m": np.round(0.1 * time**3, 9), "force [N]": time}
    pd.DataFrame(rows).to_csv(tmp_path / "trace.csv", index=False)
    late = {header: stamps + (np.timedelta64(30, "ms") if dates else 0.03), "force [N]": time}
    pd.DataFrame(late).to_csv(tmp_path / "late.csv", index=False)
    for file, start in ((None, 0.0), ("late.csv", 0.03)):
        table = MotorForceTable(trace="trace.csv", column="force [N]", reading=unit, file=file)
        motion = table.reading.motion(tmp_path / table.trace, axis())
        if file is None or dates:
            record = table.stamped(tmp_path, {"force [N]": "N"}, motion)
            assert record.time == pytest.approx(time + start, abs=1e-9)
