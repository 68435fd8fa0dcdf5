"""Text tables: however one table is written, the same bits are read; what stands in no table is told."""

import bz2
import gzip
import lzma
import time

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trace_files import has_note, refuses, same

from guideload.base.errors import TraceError
from guideload.traces.format.dialect_detection import detect_dialect
from guideload.traces.format.headers import Header
from guideload.traces.reading import Trace, read_trace

COUNT = 120
TIME = np.round(np.arange(COUNT) * 0.004, 3)
PLACE = np.round(30.0 * (1.0 - np.cos(12.0 * TIME)), 4)  # mm


def text_of(
    sep: str = ",",
    decimal: str = ".",
    head: tuple[str, ...] = ("t_s,x_mm,u_V",),
    columns=(TIME, PLACE, PLACE),
    end: str = "\n",
) -> str:
    """The table as text; the rows of `head` are written with commas here."""
    rows = [row.replace(",", sep) for row in head]
    for cells in zip(*columns, strict=True):
        rows.append(sep.join(str(cell).replace(".", decimal) for cell in cells))
    return end.join(rows) + end


@pytest.fixture
def read(tmp_path):
    """Read a text from a file."""

    def read_text(text: str | bytes, **choice) -> Trace:
        path = tmp_path / "trace.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_trace(path, **choice)

    return read_text


@pytest.fixture
def true(read):
    return read(text_of())


SIGNS = [(sep, ".") for sep in (",", ";", "\t", "|", " ", "; ", ", ")] + [(";", ","), ("\t", ","), ("|", ",")]
HEADS = [
    ("t_s,x_mm,u_V",),
    ("t,x,u", "s,mm,V"),
    ("t,x,u", "[s],[mm],[V]"),
    ("time,position,voltage", "(sec),(mm),(V)"),
    ("# logger 7", "t [s],x (mm),µ"),
    ("# t_s,x_mm,u_V",),
    ("Zeit / s,Weg / mm,U",),
]
ROWS_AROUND_NAMES = [
    ("Logger 4711,,", "Rate,250,Hz", ",,", "t_s,x_mm,u_V"),
    ("Logger 4711", "recorded 2024-01-31 14:05", "", "t_s,x_mm,u_V"),
    ("t_s,x_mm,u_V", "time,slide,motor"),
    ("t,x,u", "REAL,LREAL,REAL", "s,mm,V"),
    ("t,x,u", "s,mm,V", "raw,raw,raw"),
    ('"t_s","x_mm","u_V"',),
    ('t_s,"x\n[mm]",u_V',),
]


@pytest.mark.parametrize("head", HEADS + ROWS_AROUND_NAMES)
def test_any_dialect_of_one_table_reads_to_the_same_bits(read, true, head):
    for sep, decimal in SIGNS if head in HEADS else ((",", "."), (";", ",")):
        if sep == " " and (" / " in head[0] or " [" in head[-1]):
            continue  # a blank cannot be both in a name and between names
        trace = read(text_of(sep, decimal, head))
        assert same(trace, true), (sep, decimal, trace.notes)
        assert ("decimal comma" in trace.notes) == (decimal == ",")


@st.composite
def written(draw):
    """Stamps [s] and places in a unit, as the texts that are written."""
    count = draw(st.integers(8, 40))
    ticks = np.cumsum(draw(st.lists(st.integers(1, 3), min_size=count, max_size=count)))
    number = st.floats(-1e4, 1e4).map(lambda x: round(x, 6))
    places = draw(st.lists(number, min_size=count, max_size=count, unique=True))
    return [f"{tick * 0.004:.3f}" for tick in ticks], [f"{place:.6f}" for place in places]


@given(
    written(),
    st.sampled_from([*SIGNS, (",", ",")]),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"]),
    st.sampled_from(["m", "mm", "um"]),
    st.booleans(),
    st.sampled_from(["", "# logger 7", "Logger 4711", "µ_x"]),
)
def test_any_encoding_is_read_to_the_numbers_that_were_written(
    read, trace, signs, end, encoding, unit, quoted, above
):
    time, place = trace
    sep, decimal = signs
    if sep == decimal:
        quoted = True
    elif " " in sep:
        quoted, above = False, "" if " " in above else above
    rows = [above] * bool(above) + [sep.join(("t_s", f"x_{unit}", "u_V"))]
    for cells in zip(time, place, time, strict=True):
        texts = [cell.replace(".", decimal) for cell in cells]
        rows.append(sep.join(f'"{text}"' if quoted else text for text in texts))
    options = {"clock": "ticks", "allow_gaps": True, "hold": 1}  # how the rows follow is not the question
    found = read((end.join(rows) + end).encode(encoding), column=f"x_{unit}", max_speed=1e12, **options)
    stamps = np.array(time, float)
    assert np.allclose(found.time - found.time[0], stamps - stamps[0], rtol=0, atol=1e-12)
    expected = np.array(place, float) * {"m": 1.0, "mm": 1e-3, "um": 1e-6}[unit]
    assert np.allclose(found.value, expected, rtol=1e-15, atol=0)


def test_exact_decimals_are_read_as_python_reads_them(read):
    rng = np.random.default_rng(5)
    values = rng.normal(size=COUNT) * 10.0 ** rng.integers(-9, 3, COUNT)
    for decimal in ".,":
        text = text_of(";", decimal, ("t_s,x_m",), (TIME, [repr(float(value)) for value in values]))
        assert np.array_equal(read(text, max_speed=1e12).value, values)


def test_rows_are_counted_as_an_editor_does(read, true):
    """However much stands above the samples, between and below them."""
    lines = text_of(";", ",", ("# made by hand", "t,x,u", "s,mm,V")).splitlines()
    lines[40] = lines[40].replace(lines[40].split(";")[1], "over")
    lines.insert(20, "# a remark; of two parts")
    lines.insert(30, "")
    refuses('column x: .* none in row 43: the first holds "over"', read, "\n".join(lines))
    trace = read("\n".join([*lines, "", ";;", ""]), repair="empty")
    assert np.array_equal(trace.value, np.delete(true.value, 37))  # a column of text, read as exactly
    assert has_note(trace, "1 comments left out, row 21")
    assert has_note(trace, "2 empty lines left out, row 31, 126")
    assert has_note(trace, "1 sample without a number left out, row 43")


def test_rows_of_another_length(read, true):
    lines = text_of().splitlines()
    short = [*lines[:50], lines[50].rsplit(",", 1)[0], *lines[51:]]
    assert same(read("\n".join(short)), true)  # the last column is not used
    with pytest.raises(TraceError, match="3 cells in a row, got more in line 51, 61; where .* comma"):
        read("\n".join(line + ",5" if i in (50, 60) else line for i, line in enumerate(lines)))
    assert same(read("\n".join(line + "," for line in lines)), true)
    assert same(read("\n".join([lines[0], *(line + "," for line in lines[1:])])), true)


@pytest.mark.parametrize(
    ("sep", "row", "text", "message"),
    [
        (",", 2, "0.0,over,1.0", 'the first holds "over"'),  # no row of units
        (",", 2, "nan,nan,nan", "the first is empty or nan"),  # not above the samples
        (";", 61, "0,236;1.234;0", 'the first holds "1.234"; .*groups of digits'),  # 1.234 or 1234
        (";", 61, "0,236;12:5x;0", 'the first holds "12:5x"; .*cut the trace'),
    ],
)
def test_a_cell_that_cannot_be_read_is_refused_with_its_row(read, sep, row, text, message):
    lines = text_of(sep, "," if sep == ";" else ".").splitlines()
    lines[row - 1] = text
    refuses(f"column x_mm: .* none in row {row}: {message}", read, "\n".join(lines))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("t_s,x_mm,u_V", "# " + 70_000 * "x" + "\nt_s,x_mm,u_V"),
        ("t_s,x_mm,u_V", "sep=,\nt_s,x_mm,u_V"),
        ("t_s,x_mm,u_V", "t_s,x_mm,u_V,comment"),
        ("t_s,x_mm,u_V", "X,Y\n1,2\n***,end,***\n\nt_s,x_mm,u_V"),
        ("t_s,x_mm,u_V", "t_s,x_mm,7"),
        ("\n", "\n\n"),
        (",", " , "),
        ("\n0.1", "\r0.1"),
    ],
)
def test_oddities_of_writers(read, true, old, new):
    assert same(read(text_of().replace(old, new)), true)


def test_one_sign_for_columns_and_decimals_is_refused(read):
    with pytest.raises(TraceError, match="half as many names: .* save the table with ; or tab"):
        read(text_of(",", ",", ("t_s,x_mm",), (TIME, PLACE)))


@pytest.mark.parametrize(
    ("sep", "decimal", "group"),
    [(";", ".", ","), (",", ".", ","), (";", ",", "."), ("\t", ",", "."), ("\t", ".", "'"), ("|", ",", "'")],
)
def test_groups_of_digits_are_read_where_they_are_plain(read, sep, decimal, group):
    """As the same numbers without groups; cells of a column with both signs tell which is which."""
    large = 100.0 * PLACE
    signs = str.maketrans({",": group, ".": decimal})
    cells = [f"{value:,.2f}".translate(signs) for value in large]
    assert any(len(cell) > 6 for cell in cells) and any(len(cell) < 6 for cell in cells)
    quoted = [f'"{cell}"' if sep == "," else cell for cell in cells]
    rows = [f"{time}".replace(".", decimal) + sep + cell for time, cell in zip(TIME, quoted, strict=True)]
    plain = [f"{time},{value:.2f}" for time, value in zip(TIME, large, strict=True)]
    first = read("\n".join(["t_s,x_mm", *plain]))
    assert same(read("\n".join([f"t_s{sep}x_mm", *rows])), first)


def test_groups_of_digits_that_may_be_decimals_are_refused():
    table = {"t_s": TIME, "x_mm": np.array([f"{value:.3f}" for value in PLACE], object)}
    table["x_mm"][50] = "1,234"
    refuses('none in index 50: the first holds "1,234"; write .* decimal point', read_trace, table)


def test_groups_in_quotes_are_no_decimal_commas(read):
    """Quoted cells among commas: all of three digits after the comma may be thousands; any other tells decimals."""
    rows = [f'{4 * i},"{1234 + i:,}"' for i in range(COUNT)]
    with pytest.raises(TraceError, match='such as "1,234" may have groups of digits or a decimal comma'):
        read("\n".join(["t_ms,x_mm", *rows]))
    decimals = [f'{4 * i},"{(994 + i) // 1000},{(994 + i) % 1000:03d}"' for i in range(COUNT)]
    trace = read("\n".join(["t_ms,x_mm", *decimals]))
    assert trace.value[-1] == pytest.approx((994 + COUNT - 1) * 1e-6)


@pytest.mark.parametrize("unit", ["t", "[t]", "Zeit", "time"])
def test_a_row_of_units_that_says_time_gives_no_unit(read, true, unit):
    """A t is no tonne where the name says time."""
    assert same(read(text_of(head=("time,x,u", f"{unit},mm,V"))), true)
    assert same(read(text_of(head=(f"t [{unit.strip('[]')}],x_mm,u",))), true)


@pytest.mark.parametrize(
    "head",
    [
        ("time,Analog 1,u", "s,Axis position [mm],V"),
        ("time,Analog 1,u", ",Axis position,force", "s,mm,V"),
        ("time,Analog 1,u", "time,Axis position mm,force"),
        ("Axis name,Axis position [mm],force", "time [s],Analog 1,u"),
        ("time [s],Axis position [mm],force", "Channel 0,Analog 1,Analog 2"),
    ],
)
def test_of_two_rows_of_names_each_column_has_the_one_that_names_a_quantity(read, true, head):
    """Loggers write their channels above or below what is connected to them."""
    trace = read(text_of(head=head))
    assert same(trace, true) and trace.column.startswith("Axis position")


@pytest.mark.parametrize(
    "head",
    [
        ("Zeit,Weg,Moment", "t,s,M", "ms,mm,Nm"),
        ("Zeit,Weg,Strom", "t,s,I", "ms,mm,A"),
        ("Zeit,Position,u", "t,x,u", "ms,mm,V"),
        ("Time,Position,Temperature", "ms,mm,°C"),
        ("Time,Position,Current,Voltage,Load", "msec.,mm,A,V,%"),
        ("ms,mm,V", "Time,Position,Voltage"),
        ("[ms],[mm],[V]", "Time,Position,Voltage", "t,x,u"),
    ],
)
def test_the_row_of_units_is_found_among_symbols(read, true, head):
    """Above or below the names, and beside columns of other quantities; a symbol is no unit."""
    columns = (np.round(1e3 * TIME), PLACE, *[PLACE] * head[0].count(","))[: head[0].count(",") + 1]
    trace = read(text_of(head=head, columns=columns))
    assert same(trace, true) and trace.column in head[0] + head[1]
    assert not has_note(trace, "gives no unit")


@pytest.mark.parametrize(
    "name", ["torque_N_m", "Torque M", "Moment_M", "power_N_m_s", "stiffness_N_per_m", "strain_per_m"]
)
def test_what_ends_in_m_may_be_no_length(read, true, name):
    """It is not taken for the position, whose header gives no unit; nor is it a second one."""
    refuses("no header gives a unit of motion: position", read, text_of(head=(f"t_s,position,{name}",)))
    assert same(read(text_of(head=(f"t_s,x_mm,{name}",))), true)


@pytest.mark.parametrize(
    "name",
    ["Position in 1/10 mm", "Position 0.1 mm", "Pos in 0@1 mm", "Position 10^-1 mm", "Position 1e-1 mm", "x / 10 mm",
     "Position [mm] x1000", "Position*10 [mm]", "Position [mm (x10)]", "Position [0.1 mm]"],
)  # fmt: skip
def test_a_multiplier_is_not_left_out(read, name):
    refuses("no header gives a unit of motion", read, text_of(";", head=(f"t_s,{name}",)).replace("@", ","))


def test_a_temperature_called_t_is_no_time(read):
    refuses("no time column among", read, text_of(head=("T [°C],x_mm,u_V",)))


def test_a_unit_of_time_may_be_given_in_place_of_the_header(read, true):
    """Milliseconds under [s], and without a unit."""
    for header in ("t [s],x_mm,u", "t,x_mm,u"):
        text = text_of(head=(header,), columns=(np.round(1e3 * TIME), PLACE, PLACE))
        assert same(read(text, time_unit="ms"), true) and not same(read(text), true)
    cycles = text_of(head=("cycle,x_mm,u",), columns=(np.arange(COUNT), PLACE, PLACE))
    refuses("no time_unit .* beside a rate", read, cycles, time="cycle", rate=250, time_unit="ms")
    refuses("no time_unit .* without a time column", read, text_of(), rate=250, time_unit="ms")
    refuses("is a length", read, text_of(), time_unit="mm")


def test_a_speed_in_turns_needs_no_motor_in_its_name(read):
    values = np.round(100.0 * np.sin(12.0 * TIME), 3)
    trace = read(text_of(head=("time,Speed,u",), columns=(TIME, values, PLACE)), unit="rpm")
    assert trace.kind == "motor_speed" and trace.value == pytest.approx(values * np.pi / 30.0)


def test_an_empty_line_in_a_single_column_is_an_empty_cell(read):
    """The samples after it keep their time; line ends that were doubled are no cells."""
    lines = text_of(head=("x_mm",), columns=(PLACE,)).splitlines()
    first = read("\n".join(lines), rate=250)
    lines[50] = ""
    refuses("column x_mm: .* none in row 51", read, "\n".join(lines), rate=250)
    trace = read("\n".join(lines), rate=250, repair="empty")
    assert np.array_equal(trace.time, np.delete(first.time, 49))
    assert same(read("\n\n".join(text_of(head=("x_mm",), columns=(PLACE,)).split()), rate=250), first)


def test_a_long_standstill_hides_no_decimal_comma(read):
    """The decimal sign is looked for in the whole text, if the first lines hold whole numbers only."""
    lines = ["x_mm", *["0"] * 40_000, *(f"{0.5 * value:.1f}".replace(".", ",") for value in range(1, 40))]
    trace = read("\n".join(lines), rate=100)
    assert trace.value[-1] == pytest.approx(0.0195)


def test_much_above_the_samples(read, true):
    for remark in ("no number", "number 7", "a,number,7"):
        assert same(read("\n".join([*[remark] * 1500, "", text_of()])), true)


def test_few_rows_below_much_else(read):
    """Blanks in names and dates make as many columns of each: the tab is the separator all the same."""
    stamps = [f"22.11.2024 11:59:{i:02d}.000" for i in range(20)]
    rows = [f"{stamp}\t{place}" for stamp, place in zip(stamps, PLACE, strict=False)]
    trace = read("\n".join(["# logger", "Device 7", "time\tpos [mm]", *rows]))
    assert np.array_equal(trace.time, np.arange(20.0)) and trace.column == "pos [mm]"


def test_one_column_with_a_rate(read, true):
    for decimal in ".,":
        for head in (("x_mm",), ("x", "mm")):
            trace = read(text_of(",", decimal, head, (PLACE,)), rate=250)
            assert np.array_equal(trace.value, true.value)
            assert trace.time == pytest.approx(TIME, abs=1e-12)


@pytest.mark.parametrize(
    ("names", "words", "unit"),
    [
        ("x_mm", "x", "mm"),
        ("Position [mm];Position in mm;Position / mm;Position, mm;Position mm", "position", "mm"),
        ("Position {MM}", "position", "mm"),
        ("Position (µm)", "position", "µm"),
        ("Position [mm] X1", "position x 1", "mm"),
        ("Time (sec)", "time", "s"),
        ("Zeit [Sekunden]", "zeit", "s"),
        ("t_ms", "t", "ms"),
        ("n [U/min];n [1/min];n (RPM);n [min⁻¹]", "n", "rpm"),
        ("v [m/sec]", "v", "m/s"),
        ("Geber [Inkremente]", "geber", "counts"),
        ("encoder_counts", "encoder", "counts"),
        ("Unit row (none)", "unit row", "none"),
        ("Mz_N_m", "mz", "N m"),
        ("Axis 1, mm;Axis 1 mm", "axis 1", "mm"),
        ("TIME [S]", "time", "s"),
    ],
)
def test_units_in_their_spellings(names, words, unit):
    for name in names.split(";"):
        assert Header.of(name) == Header(tuple(words.split()), unit)


def test_a_unit_may_be_given_in_any_spelling(read):
    text = text_of(head=("t_s,motor,u_V",))
    first = read(text, column="motor", unit="rpm")
    for unit in ("RPM", "U/min", "1/min", "rev/min"):
        assert np.array_equal(read(text, column="motor", unit=unit).value, first.value)


def test_detection_looks_at_lines_only():
    """The dialect of the first lines is that of the whole."""
    lines = text_of(";", ",", ("t,x,u", "s,mm,V")).splitlines()
    whole = detect_dialect(lines)
    assert (whole.separator, whole.decimal, whole.width, whole.first) == (";", ",", 3, 2)
    assert whole.names == ("t", "x", "u")
    assert whole.units == ("s", "mm", "V")
    assert all(detect_dialect(lines[:count]) == whole for count in range(4, len(lines), 7))


def scope_text(
    sep: str = "\t", decimal: str = ",", one_clock: bool = False, full_stamp: bool = False, end: str = "\n"
) -> str:
    """A TwinCAT Scope export: two channels of 4 ms and one of 8 ms, which has half as many samples."""
    key = [] if one_clock else ["KEY"]

    def row(name: str, *cells: str) -> str:
        return sep.join([name, cells[0], *([name] if key else []), cells[1], name, cells[2]])

    start = 133_500_000_000_000_000
    rows = [
        f"Name{sep}press 7{sep}",
        f"File{sep}C:\\scope\\press.csv{sep}",
        f"Starttime of export{sep}{start}{sep}Montag, 22. Januar 2024{sep}14:05:06.789",
        "",
        row("Name", "Axis 1.ActPos", "Axis 1.ActVelo", "Slow"),
        row("SymbolComment", "", "", ""),
        row("Data-Type", "REAL64", "REAL64", "INT16"),
        row("SampleTime[ms]", "4", "4", "8"),
        row("Unit", "mm (Length)", "(None)", "(None)"),
        row("Offset", "0", "0", "0"),
        row("ScaleFactor", "1", "1", "1"),
        "",
    ]
    for i in range(COUNT):
        stamps = [start + 40_000 * i, start + 80_000 * i] if full_stamp else [4 * i, 8 * i]
        cells = [str(stamps[0]), str(PLACE[i]), *([str(stamps[0])] if key else []), str(i % 7)]
        if i < COUNT // 2:
            cells += [str(stamps[1]), str(i)]
        elif one_clock:
            cells += [" ", " "]
        rows.append(sep.join(cell.replace(".", decimal) for cell in cells))
    return end.join([*rows, "EOF"])


@pytest.mark.parametrize(("sep", "decimal"), [("\t", ","), ("\t", "."), (";", ","), (";", "."), (",", ".")])
@pytest.mark.parametrize("one_clock", [False, True])
@pytest.mark.parametrize("full_stamp", [False, True])
def test_twincat_scope_exports(read, true, sep, decimal, one_clock, full_stamp):
    text = scope_text(sep, decimal, one_clock, full_stamp, "\r\n")
    trace = read(text)
    assert trace.column == "Axis 1.ActPos" and "TwinCAT Scope export" in trace.notes
    assert same(trace, true)
    slow = read(text, column="Slow", unit="mm")
    assert np.array_equal(slow.time, np.arange(COUNT // 2) * 8 / 1000)
    assert slow.value == pytest.approx(np.arange(COUNT // 2) * 1e-3, rel=1e-15)


def test_twincat_scope_filled_with_the_previous_value(read, true):
    """A slow channel may stand twice with the same stamp, to fill the table: those are no samples."""
    rows = scope_text("\t", ".").splitlines()[:-1]
    head, samples = rows[:12], [row.split("\t") for row in rows[12:]]
    slow = [row[4:] for row in samples[: COUNT // 2]]
    filled = ["\t".join([*row[:4], *slow[i // 2]]) for i, row in enumerate(samples)]
    trace = read("\n".join([*head, *filled]), column="Slow", unit="mm")
    assert trace.value == pytest.approx(np.arange(COUNT // 2) * 1e-3, rel=1e-15)


def test_twincat_scope_without_time_columns(read, true):
    rows = scope_text("\t", ".").splitlines()[:-1]
    samples = ["\t".join(row.split("\t")[1:4:2]) for row in rows[12:]]
    head = ["\t".join(row.split("\t")[:4]) if i > 3 else row for i, row in enumerate(rows[:12])]
    trace = read("\n".join([*head, *samples]), column="Axis 1.ActPos")
    assert np.array_equal(trace.value, true.value) and trace.time == pytest.approx(true.time, abs=1e-12)


def test_twincat_scope_without_time_columns_has_one_sample_time(read, true):
    """Of channels with different ones, no rate is that of all rows."""
    rows = scope_text("\t", ".").splitlines()[:-1]
    samples = ["\t".join(row.split("\t")[1::2]) for row in rows[12:]]
    text = "\n".join([*rows[:12], *samples])
    refuses(r"no time column among .* \(--rate 1000\)", read, text, column="Axis 1.ActPos")
    assert np.array_equal(read(text, column="Axis 1.ActPos", rate=250).value, true.value)


def test_a_compressed_file_is_to_be_unpacked(read):
    for pack in (gzip.compress, bz2.compress, lzma.compress):
        refuses("is compressed; unpack it", read, pack(text_of().encode()))


def test_twincat_scope_with_blanks_is_refused(read):
    refuses("Scope export with a blank .* tab or semicolon", read, scope_text(" ", "."))


def test_reading_takes_a_second_for_a_million_rows(tmp_path):
    """In time of the processor, since machines that run tests are shared; a fifth of the rows."""
    count = 200_000
    stamps = np.arange(count) / 1000.0
    frame = pd.DataFrame({"t_s": stamps, "x_m": np.round(0.1 * np.sin(stamps), 7)})
    frame.to_csv(tmp_path / "a.csv", index=False, sep=";", decimal=",")
    read_trace(tmp_path / "a.csv")  # the libraries are loaded
    taken = []
    for _ in range(3):
        start = time.process_time()
        read_trace(tmp_path / "a.csv")
        taken.append(time.process_time() - start)
    assert min(taken) < 0.2
