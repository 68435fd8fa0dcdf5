"""Numbers that no log or axis has, and cells longer than any: refused by file, column and rows, without a warning."""

import numpy as np
import pytest
from trace_files import refuses, write_trace

from guideload.traces.reading import read_trace

TIME = np.round(np.arange(40) * 0.01, 2)
PLACE = np.round(0.05 * (1.0 - np.cos(20.0 * TIME)), 6)


@pytest.mark.parametrize("text", ["1e308", "-1e308", "1e25", "2e12"])
@pytest.mark.parametrize("column", ["t_s", "x_m"])
def test_a_number_out_of_all_proportion_is_refused_with_its_row(tmp_path, column, text):
    path = write_trace(tmp_path, {"t_s": TIME, "x_m": PLACE}, {(7, column): text})
    refuses(
        rf"^trace.csv: column {column}: expected at most 1e\+\d\d.* in row 7; check the unit",
        read_trace,
        path,
    )


def test_a_step_of_time_below_rounding_is_refused_with_its_row(tmp_path):
    path = write_trace(tmp_path, {"t_s": [0.0, 5e-324, *TIME[2:]], "x_m": PLACE})
    refuses(
        r"^trace.csv: column t_s: expected steps of time of 1e-15 s or more, .* before row 3",
        read_trace,
        path,
    )


@pytest.mark.parametrize("unit", ["nan", "inf", "m^-0", "1/0", "m" * 10_000])
def test_a_header_with_no_unit_in_its_brackets_is_no_crash(tmp_path, unit):
    refuses("no header gives a unit", read_trace, write_trace(tmp_path, {"t_s": TIME, f"x [{unit}]": PLACE}))


@pytest.mark.parametrize("cell", ['"' + "1" * 131_072 + '"', '"' + ",;" * 60_000 + '"', "A1" * 70_000])
def test_a_cell_longer_than_any_is_refused(tmp_path, cell):
    path = write_trace(tmp_path, {"t_s": TIME, "x_m": PLACE}, {(9, "x_m"): cell})
    refuses(r"^trace.csv: ", read_trace, path)
