"""The TOML file: every value's row, and errors that name file, row, key and value."""

import pickle
from pathlib import Path

import pytest

from guideload.base.errors import ConfigError
from guideload.base.toml import read_toml
from guideload.machine.machine import Machine

GOOD = """\
name = "two carriages"
free = ["y", "z", "rx", "ry", "rz"]
[body]
mass = "1250 kg"
center_of_mass = ["120 mm", "-650 mm", "180 mm"]
inertia = [
    [420, 15, -8],
    [15, 310, 22],
    [-8, 22, 380],
]
[drive]
screw_lead = "20 mm"
[[rails]]
name = "1"
position = ["50 mm", "-350 mm"]
[[carriages]]
name = "1"
rail = "1"
x = "0 mm"
length = "600 mm"
stiffness_y = "120 N/um"
stiffness_z = "120 N/um"
damping_y = "100 kN s/m"
damping_z = 1.0e5  # plain SI
[[links]]
name = "rack"
point = [0, 0, 0]
direction = [1, 0, 0]
stiffness = "80 N/um"
damping = 0
"""


def refused(folder: Path, text: str | bytes) -> ConfigError:
    file = folder / "machine.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ConfigError) as caught:
        Machine.from_toml(file)
    assert caught.value.file == str(file)
    assert all(line.startswith(str(file)) for line in str(caught.value).splitlines())
    return caught.value


# row to change (1 = first), its new text, key, value as written, further words of the message
REFUSALS = [
    (1, "name = 1", "name", "1", "text in quotes"),
    (1, 'name = ""', "name", '""', "a name"),
    (2, "free = []", "free", "[]", "at least one entry"),
    (2, 'free = ["y", "q"]', "free[1]", '"q"', '"rx"'),
    (2, 'free = ["y", "y"]', "free", '["y", "y"]', "each dof once"),
    (2, "gravity = [0, -9.81]", "gravity", "[0, -9.81]", "[x, y, z]"),
    (2, "gravity = [0, -9.81, inf]", "gravity[2]", "inf", "finite"),
    (4, 'mass = "85 mm"', "body.mass", '"85 mm"', "a mass in kg"),
    (4, "mass = -1.0e0", "body.mass", "-1.0e0", "> 0 kg"),
    (4, "mass = nan", "body.mass", "nan", "finite"),
    (4, "mass = true", "body.mass", "true", "a mass in kg"),
    (4, "mass = 1979-05-27 07:32:00", "body.mass", "1979-05-27 07:32:00", "a mass in kg"),
    (5, "center_of_mass = [0, 0, '1 kg']", "body.center_of_mass[2]", "'1 kg'", "a length in m"),
    (5, "center_of_mass = 0.5", "body.center_of_mass", "0.5", "[x, y, z]"),
    (8, "    [15, 310],", "body.inertia[1]", "[15, 310]", "[x, y, z]"),
    (8, '    [15, "310 kg", 22],', "body.inertia[1][1]", '"310 kg"', "a moment of inertia in kg m^2"),
    (12, "screw_lead = -0.02", "drive.screw_lead", "-0.02", "> 0 m"),
    (12, "pinion_diameter = 1\nscrew_lead = 1", "drive", "1", "exactly one of"),
    (12, "gear_ratio = 0\nscrew_lead = 1", "drive.gear_ratio", "0", "other than 0"),
    (14, "", "rails[0].name", "nothing", 'add the key "name"'),
    (18, 'rail = "2"', "carriages[0].rail", '"2"', "a rail's name"),
    (20, "length = 0", "carriages[0].length", "0", "> 0 m"),
    (21, 'stiffness_y = "-4e5 N/m"', "carriages[0].stiffness_y", '"-4e5 N/m"', "> 0 N/m"),
    (21, "stifness_y = 1", "carriages[0].stifness_y", '"stifness_y"', 'did you mean "stiffness_y"?'),
    (
        21,
        "clearance = 1",
        "carriages[0].clearance",
        '"clearance"',
        'did you mean "clearance_y" or "clearance_z"?',
    ),
    (21, "stiffness_y = 1\nqqq = 1", "carriages[0].qqq", '"qqq"', "keys known here: name, rail, type, x"),
    (24, "damping_z = -1", "carriages[0].damping_z", "-1", ">= 0 N s/m"),
    (26, 'name = "1:-y"', "links[0].name", '"1:-y"', "a unique name"),
    (28, "direction = [0, 0, 0.0]", "links[0].direction", "[0, 0, 0.0]", "other than zero"),
    (28, "direction = ['1 m', 0, 0]", "links[0].direction[0]", "'1 m'", "a plain number"),
    (29, "stiffness = {k = 1}", "links[0].stiffness.k", '"k"', "keys known here: positive, negative"),
    (21, "", "carriages[0].stiffness_y", "nothing", "curve_y instead"),
    (21, "stiffness_y = {positive = 1}", "carriages[0].stiffness_y.negative", "nothing", 'key "negative"'),
    (21, "curve_y = [[0, 0], [1, '2 m']]", "carriages[0].curve_y[1][1]", "'2 m'", "a force in N"),
    (30, "damping = 0\nrolling = 'wheel'", "links[0].rolling", "'wheel'", 'expected "ball" or "roller"'),
    (30, "damping = 0\ndamping_in_contact = 1", "links[0].damping_in_contact", "1", "true or false"),
]


@pytest.mark.parametrize(("row", "new", "key", "value", "words"), REFUSALS)
def test_refusals_name_row_key_and_value(
    tmp_path: Path, row: int, new: str, key: str, value: str, words: str
) -> None:
    lines = GOOD.splitlines()
    lines[row - 1] = new
    error = refused(tmp_path, "\n".join(lines))
    assert key in [problem.key for problem in error.problems]
    problem = next(problem for problem in error.problems if problem.key == key)
    # A missing key and a whole table are at the row of the header, others where they are written.
    header = {"drive": 11, "rails[0].name": 13, "carriages[0].stiffness_y": 16}
    expected_row = row + new.partition(key.split(".")[-1].partition("[")[0])[0].count("\n")
    if key == "drive" or not new:
        expected_row = header[key]
    assert problem.row == expected_row
    text = problem.text("machine.toml")
    assert text.startswith(f"machine.toml, row {expected_row}: {key}: expected ")
    assert value in text
    assert words in text


def test_keys_that_exclude_each_other_are_reported_with_all_other_problems(tmp_path: Path) -> None:
    keys = 'damping_y = -1\npreload_y = "2 kN"\nclearance_y = "5 um"'
    text = GOOD.replace('damping_y = "100 kN s/m"', keys)
    keys = "curve = [[0, 0], [1e-5, 800]]\nstiffness = 8e7\nrolling = 'ball'"
    error = refused(tmp_path, text.replace('stiffness = "80 N/um"', keys))
    assert [(problem.row, problem.key) for problem in error.problems] == [
        (16, "carriages[0].rolling"),
        (23, "carriages[0].damping_y"),
        (25, "carriages[0].clearance_y"),
        (32, "links[0].stiffness"),
        (33, "links[0].rolling"),
    ]
    assert 'got "5 um"; preload leaves no clearance' in str(error)
    assert 'got nothing; add the key "rolling"' in str(error)


def test_all_problems_are_reported_in_the_order_of_the_rows(tmp_path: Path) -> None:
    text = GOOD.replace('"1250 kg"', "-1").replace('rail = "1"', 'rail = "l"')
    error = refused(tmp_path, text.replace("[1, 0, 0]", "[0, 0, 0]").replace('name = "two', 'nme = "two'))
    keys = [problem.key for problem in error.problems]
    assert keys == ["nme", "body.mass", "carriages[0].rail", "links[0].direction"]
    assert [problem.row for problem in error.problems] == [1, 4, 18, 28]
    assert (error.key, error.row, error.value) == ("nme", 1, "two carriages")
    assert len(str(error).splitlines()) == 4


def test_names_are_unique(tmp_path: Path) -> None:
    twice = GOOD + GOOD[GOOD.index("[[rails]]") :]
    error = refused(tmp_path, twice)
    keys = [problem.key for problem in error.problems]
    assert keys == ["rails[1].name", "carriages[1].name", "links[1].name"]
    assert "rails[0] has it already" in str(error)


def test_a_machine_needs_a_body_and_something_that_holds_it(tmp_path: Path) -> None:
    error = refused(tmp_path, "")
    assert [problem.key for problem in error.problems] == ["carriages", "body"]
    assert 'add the key "body"' in str(error)


@pytest.mark.parametrize(
    ("text", "row", "words"),
    [
        ("[body]\nmass = 1250 kg\n", 2, "got mass = 1250 kg; "),
        ("[body]\nmass = 1\nmass = 2\n", 3, "each key once"),
        ("[body]\nmass = [1,\n", 2, "quotes"),
        ("[body\nmass = 1\n", 1, "got [body"),
        (b"[body]\n# \xb5m\nmass = 1\n", 2, "UTF-8"),
    ],
)
def test_what_is_not_toml_is_reported_with_its_row(
    tmp_path: Path, text: str | bytes, row: int, words: str
) -> None:
    error = refused(tmp_path, text)
    assert error.row == row
    assert f"row {row}: expected " in str(error)
    assert words in str(error)


def test_a_missing_file_and_a_folder(tmp_path: Path) -> None:
    for file in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(ConfigError, match="guideload init") as caught:
            Machine.from_toml(file)
        assert str(file) in str(caught.value)


def test_errors_survive_pickling(tmp_path: Path) -> None:
    error = refused(tmp_path, GOOD.replace("1250 kg", "85 mm"))
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.row, again.key) == (str(error), error.row, error.key)


def test_byte_order_mark_and_windows_rows(tmp_path: Path) -> None:
    file = tmp_path / "machine.toml"
    file.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert Machine.from_toml(file).body.mass == 1250.0
    assert refused(tmp_path, GOOD.replace("\n", "\r\n").replace("1250 kg", "x")).row == 4


def test_places_of_every_kind_of_toml(tmp_path: Path) -> None:
    text = '''\
a.b = 1.5 # [no] = "table"
"c \\"d" = 1979-05-27 07:32:00
e = [ # [1]
  "x, ]", # "
  [1, -2e3],
  { f = 1, g.h = [true] },
]
i = """
[not.a.table]
j = 1 \\""""
k = \'\'\'
l = 1\'\'\'\'
m = \'n = "\'
[o."p.q"]
r = ""
[[s]]
t = 1
  [[s.u]]
  v = 1
  [[s.u]]
  v = 2
  [s.w]
  x = 3
[[s]]
[[s.u]]
v = 4
y = []
z = {}
'''
    rows = {
        ("a", "b"): (1, "1.5"),
        ('c "d',): (2, "1979-05-27 07:32:00"),
        ("e", 0): (4, '"x, ]"'),
        ("e", 1): (5, "[1, -2e3]"),
        ("e", 1, 1): (5, "-2e3"),
        ("e", 2): (6, "{ f = 1, g.h = [true] }"),
        ("e", 2, "g", "h", 0): (6, "true"),
        ("i",): (8, '""" [not.a.table] j = 1 \\""""'),
        ("k",): (11, "''' l = 1''''"),
        ("m",): (13, "'n = \"'"),
        ("o", "p.q"): (14, ""),
        ("o", "p.q", "r"): (15, '""'),
        ("s", 0): (16, ""),
        ("s", 0, "t"): (17, "1"),
        ("s", 0, "u", 0, "v"): (19, "1"),
        ("s", 0, "u", 1, "v"): (21, "2"),
        ("s", 0, "w", "x"): (23, "3"),
        ("s", 1): (24, ""),
        ("s", 1, "u", 0, "v"): (26, "4"),
        ("s", 1, "u", 0, "y"): (27, "[]"),
        ("s", 1, "u", 0, "z"): (28, "{}"),
    }
    file = tmp_path / "any.toml"
    file.write_text(text, encoding="utf-8")
    values, found = read_toml(file)
    assert {path: (found[path].row, found[path].text) for path in rows} == rows
    assert found[("e",)].row == 3
    assert set(leaves(values)) <= set(found)
    assert {path[0] for path in found} == {*values, "a", "o"}


def leaves(value: object, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """The paths of all values within a TOML value."""
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else []
    inner = [leaf for key, part in parts for leaf in leaves(part, (*path, key))]
    return inner or [path]
