"""A made trace, written in any dialect, is read to the same numbers."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from guideload.traces.reading import read_trace

SIGNS = [(",", "."), (";", "."), ("\t", "."), ("|", "."), (";", ","), ("\t", ","), ("|", ",")]
UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
NUMBER = st.floats(-1e4, 1e4).map(lambda x: round(x, 6))


@st.composite
def traces(draw):
    """Stamps [s] and places in a unit, as the texts that are written."""
    count = draw(st.integers(8, 40))
    ticks = np.cumsum(draw(st.lists(st.integers(1, 3), min_size=count, max_size=count)))
    time = [f"{tick * 0.004:.3f}" for tick in ticks]
    places = draw(st.lists(NUMBER, min_size=count, max_size=count, unique=True))
    return time, [f"{place:.6f}" for place in places]


@given(
    traces(),
    st.sampled_from(SIGNS),
    st.sampled_from(["\n", "\r\n"]),
    st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
    st.sampled_from(sorted(UNITS)),
    st.booleans(),
    st.sampled_from(["", "# logger 7", "Logger 4711"]),
)
def test_any_dialect_is_read_to_the_numbers_that_were_written(
    tmp_path, trace, signs, end, encoding, unit, quoted, above
):
    time, place = trace
    sep, decimal = signs
    rows = [above] * bool(above) + [sep.join(("t_s", f"x_{unit}", "u_V"))]
    for cells in zip(time, place, time, strict=True):
        texts = [cell.replace(".", decimal) for cell in cells]
        rows.append(sep.join(f'"{text}"' if quoted else text for text in texts))
    file = tmp_path / "trace.csv"
    file.write_bytes((end.join(rows) + end).encode(encoding))
    options = {"clock": "ticks", "allow_gaps": True, "hold": 1}  # how the rows follow is not the question
    found = read_trace(file, column=f"x_{unit}", max_speed=1e12, **options)
    expected = np.array([float(text) for text in place])
    stamps = np.array([float(text) for text in time])
    assert np.allclose(found.time - found.time[0], stamps - stamps[0], rtol=0, atol=1e-12)
    assert np.allclose(found.value, expected * UNITS[unit], rtol=1e-15, atol=0)
