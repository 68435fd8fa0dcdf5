"""Studies: from file and from code the same plan; draws as described; refusals with file, row, key and the way out."""

import inspect
import pickle
import re
import shutil
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from scipy.special import ndtri

import guideload
from guideload.base.errors import ArgumentError, ConfigError, SceneError, TraceError
from guideload.cli.options import trace_options
from guideload.machine.drive import Friction
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.study.options import TraceOptions
from guideload.study.rare import exceedance_probability
from guideload.study.study import Study
from guideload.traces.reading import motion_from_trace, read_trace

EXAMPLES = Path(guideload.__file__).parent / "examples"
MACHINE = Machine.from_toml(EXAMPLES / "manipulator.toml")
MOTION = Motion.along_x(np.linspace(0, 1, 11), np.sin(np.arange(11.0)), velocity=np.arange(11.0))
MASS = dict(path="body.mass", distribution="uniform", plus_minus="10 %")
K = dict(name="k", path="carriages.*.stiffness", each="carriage")
STIFFNESS = K | dict(distribution="lognormal", sigma=0.2)
HEAD = 'machine = "manipulator.toml"\ntrace = "manipulator.csv"\n'
DAMPING = STIFFNESS | dict(name="b", path="carriages.*.damping")


def study(*vary: dict[str, Any], **keys: Any) -> Study:
    values: dict[str, Any] = {"machine": MACHINE, "motion": MOTION, "samples": 64, "seed": 5}
    return Study(**(values | {"vary": vary or (MASS,)} | keys))


def refused(*vary: dict[str, Any], **keys: Any) -> str:
    with pytest.raises(ConfigError) as caught:
        study(*vary, **keys)
    return str(caught.value)


# ---- files


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the packaged example."""
    for name in ("manipulator.toml", "manipulator.csv", "study.toml"):
        shutil.copy(EXAMPLES / name, tmp_path)
    return tmp_path


def test_the_packaged_example_is_a_study_of_the_packaged_machine() -> None:
    of = Study.from_toml(EXAMPLES / "study.toml")
    plan = of.plan()
    assert plan.metadata.machine == MACHINE
    assert (plan.metadata.seed, plan.runs) == (1, 10_000)
    names = [factor.name for factor in plan.factors]
    assert names[:5] == ["body.mass", *(f"body.center_of_mass.{axis}" for axis in "xyz"), "k[1a]"]
    assert plan.values(0, 3).shape == (3, len(names))


def test_a_study_in_code_is_the_same_as_from_a_file(folder: Path) -> None:
    (folder / "study.toml").write_text(
        HEAD
        + """samples = 100
seed = 5
histories = 2
[reading]
column = "motor_speed_rpm"
smoothing = "savitzky_golay"
window = "50 ms"
[limits]
peak_resultant = "8 kN"
[[vary]]
path = "body.mass"
distribution = "uniform"
low = "1100 kg"
high = "1.4 t"
[[vary]]
name = "k"
path = ["carriages.*.stiffness"]
each = "carriage"
distribution = "sample"
file = "k.csv"
[[correlation]]
between = ["body.mass", "k"]
value = 0.2
"""
    )
    (folder / "k.csv").write_text("k [N/um]\n118\n123\n131\n")
    written = Study.from_toml(folder / "study.toml").plan()
    trace = read_trace(folder / "manipulator.csv", column="motor_speed_rpm")
    motion = motion_from_trace(trace, MACHINE.drive, smoothing="savitzky_golay", window=0.05)
    coded = study(
        MASS | {"plus_minus": None, "low": 1100, "high": 1400},
        K | dict(distribution="sample", values=[118e6, 123e6, 131e6]),
        motion=motion,
        samples=100,
        histories=[1, 0],
        limits={"peak_resultant": 8000.0},
        correlation=[{"between": ["k", "body.mass"], "value": 0.2}],
    ).plan()
    assert written.metadata.fingerprint == coded.metadata.fingerprint
    assert np.array_equal(written.values(0, 100), coded.values(0, 100))
    assert (written.histories, written.metadata) == ((0, 1), coded.metadata)
    assert set(written.values(0, 100)[:, 1]) == {118e6, 123e6, 131e6}


def test_the_file_takes_all_options_of_the_command_line_for_a_trace() -> None:
    @trace_options
    def command(**options: Any) -> None: ...

    options = {option.name for option in click.Command("run", params=command.__click_params__).params}
    functions = (read_trace, motion_from_trace)
    keywords = {
        name: parameter.kind
        for function in functions
        for name, parameter in inspect.signature(function).parameters.items()
    }
    told = re.search(r"# \[reading\]\n((?:#.*\n)+)", (EXAMPLES / "study.toml").read_text())
    assert told is not None
    commented = set(re.findall(r"\w+", told[1])) - {"motor_speed_rpm"}
    assert set(TraceOptions.model_fields) == options
    assert options == {name for name, kind in keywords.items() if kind is inspect.Parameter.KEYWORD_ONLY}
    assert options == commented


def test_a_study_reads_a_trace_as_the_command_does(folder: Path) -> None:
    time = np.arange(400) * 1e-3
    counts = np.round(3e5 * (1 - np.cos(7 * time))).astype(int) % 2**16
    rows = [f"{t:.4f},{count}" for t, count in zip(time, counts, strict=True)]
    rows[100:100] = rows[99:100]
    (folder / "manipulator.csv").write_text("time_s,x [counts]\n" + "\n".join(rows) + "\n")
    told = dict(unit="1e-6 m", quantum="2 um", clock="ticks", counter_bits=16, repair="doubled")
    reading = "\n".join(f"{key} = {value!r}" for key, value in told.items())
    text = (folder / "study.toml").read_text().replace("# [reading]\n", f"[reading]\n{reading}\n")
    (folder / "study.toml").write_text(text)
    motion = Study.from_toml(folder / "study.toml").motion
    expected = motion_from_trace(read_trace(folder / "manipulator.csv", **told), MACHINE.drive)
    assert np.array_equal(motion.acceleration, expected.acceleration)
    assert motion.notes == expected.notes
    (folder / "study.toml").write_text(text.replace("counter_bits = 16", "counter_bits = 63"))
    with pytest.raises(ConfigError, match=r"row \d+: reading.counter_bits: .* a whole number from 0 to 62"):
        Study.from_toml(folder / "study.toml")


def test_samples_and_seed_may_be_given_in_place_of_the_files(folder: Path) -> None:
    file = folder / "study.toml"
    text = file.read_text()
    of = Study.from_toml(file, samples=40, seed=3)
    assert (of.samples, of.seed) == (40, 3)
    assert (Study.from_toml(file, seed=3).samples, Study.from_toml(file, samples=40).seed) == (10_000, 1)
    for number in ("= 0", '= "many"', None):  # what is replaced takes no part
        rows = [row for row in text.splitlines() if not row.startswith(("samples =", "seed ="))]
        rows[4:4] = [] if number is None else [f"samples {number}", f"seed {number}"]
        file.write_text("\n".join(rows))
        again = Study.from_toml(file, samples=40, seed=3)
        assert again.plan().metadata.fingerprint == of.plan().metadata.fingerprint
        assert np.array_equal(again.plan().values(0, 40), of.plan().values(0, 40))
    file.write_text(text)
    with pytest.raises(ConfigError) as caught:
        Study.from_toml(file, samples=2**40)
    assert (caught.value.key, caught.value.row) == ("samples", None)  # it stands in no row
    assert f"got {2**40}" in str(caught.value)
    (folder / "cases.csv").write_text("body.mass [t]\n1.1\n1.3\n")
    file.write_text(HEAD + 'cases = "cases.csv"\n')
    with pytest.raises(ConfigError, match="no samples beside cases, got 5"):
        Study.from_toml(file, samples=5)


def test_a_study_lists_the_files_that_it_reads(folder: Path) -> None:
    file = folder / "study.toml"
    three = {folder / name for name in ("study.toml", "manipulator.toml", "manipulator.csv")}
    assert set(Study.from_toml(file).inputs) == three
    (folder / "m.csv").write_text("m [t]\n1.1\n1.3\n")
    measured = '[[vary]]\npath = "body.mass"\ndistribution = "sample"\nfile = "m.csv"\n'
    file.write_text(f"{HEAD}samples = 4\n{measured}")
    of = Study.from_toml(file)
    assert set(of.inputs) == set(of.model_copy(update={"samples": 8}).inputs) == {*three, folder / "m.csv"}
    (folder / "cases.csv").write_text("body.mass [t]\n1.1\n1.3\n")
    file.write_text(HEAD + 'cases = "cases.csv"\n')
    assert set(Study.from_toml(file).inputs) == {*three, folder / "cases.csv"}
    in_code = Study(machine=MACHINE, motion=MOTION, cases=str(folder / "cases.csv"))
    assert in_code.inputs == (folder / "cases.csv",)
    assert study(MASS).inputs == ()


# a row of the example that begins so, its new text, key, further words of the message
REFUSALS = [
    ("machine", "machine = 1", "machine", "text in quotes"),
    ("samples", "samples = 0", "samples", "a whole number from 1"),
    ("samples", "", "samples", "got nothing; add samples = 10_000"),
    ("seed", "seed = -1", "seed", "a whole number from 0"),
    ("sampling", 'sampling = "sobel"', "sampling", '"sobol", "latin hypercube" or "random"'),
    ("sensitivity", "sensitivity = true", "sensitivity", "false where factors are correlated"),
    ("histories", "histories = [3, 10_000]", "histories", "indices below 10000"),
    ("seed", "exponent = 3", "exponent", "is the exponent of the carriages' product"),
    ("seed", "life = 3", "life", "life follows from the machine file"),
    ("samples", "sample = 3", "sample", 'did you mean "samples"?'),
    ("peak_resultant", 'peak_resultant = "7 kg"', "limits.peak_resultant", "a force in N"),
    ("peak_resultant", 'peak_result = "7 kN"', "limits.peak_result", "known are peak_resultant"),
    ("path", 'path = "body.mas"', "vary[0].path", "did you mean body.mass"),
    ("path", 'path = "carriages.*.preload_y"', "vary[0].path", "it takes a preload"),
    ("path", "path = []", "vary[0].path", "at least one entry"),
    ("plus_minus", 'plus_minus = "10 kN"', "vary[0].plus_minus", "a mass in kg"),
    ("plus_minus", 'plus_minus = "100 %"', "vary[0].distribution", "body.mass > 0 kg"),
    ("plus_minus", 'plusminus = "10 %"', "vary[0].plusminus", 'did you mean "plus_minus"?'),
    ("plus_minus", "", "vary[0]", "either plus_minus, or low and high"),
    ("each", 'each = "carriage"', "vary[1].each", "paths of carriages"),
    ("within", "within = 1.0", "vary[2].within", "between -1 and 1"),
    ("within", "within = -0.4", "correlation[0].value", "a positive definite matrix"),
    ("between", 'between = ["k", "c"]', "correlation[0].between", "they are body.mass"),
    ("between", 'between = ["k", "k[1a]"]', "correlation[0].between", "different entries"),
    ("value", "value = 2", "correlation[0].value", "between -1 and 1"),
]


@pytest.mark.parametrize(("begins", "text", "key", "words"), REFUSALS)
def test_refusals_name_file_row_and_key(folder: Path, begins: str, text: str, key: str, words: str) -> None:
    file = folder / "study.toml"
    rows = file.read_text().splitlines()
    at = next(i for i, row in enumerate(rows) if row.split("=")[0].strip() == begins)
    rows[at] = text
    file.write_text("\n".join(rows))
    with pytest.raises(ConfigError) as caught:
        Study.from_toml(file)
    assert (caught.value.file, caught.value.key) == (str(file), key)
    if text and "got nothing" not in words and key not in ("vary[0].distribution", "correlation[0].value"):
        assert caught.value.row == at + 1
    assert words in str(caught.value)


def test_problems_in_other_files_are_refused_with_their_names(folder: Path) -> None:
    file = folder / "study.toml"
    text = file.read_text()
    machine = (folder / "manipulator.toml").read_text()
    (folder / "manipulator.toml").write_text(machine.replace('mass = "1250 kg"', "mass = 0"))
    with pytest.raises(ConfigError, match=r"manipulator\.toml, row \d+: body.mass: expected > 0 kg"):
        Study.from_toml(file)
    (folder / "manipulator.toml").write_text(machine)
    for old, key in (("manipulator.csv", "trace"), ("manipulator.toml", "machine")):
        file.write_text(text.replace(old, "nothing"))
        with pytest.raises(ConfigError, match=rf"row \d: {key}: .* there is no {folder / 'nothing'}"):
            Study.from_toml(file)
    (folder / "manipulator.csv").write_text("nothing\n")
    file.write_text(text)
    with pytest.raises(TraceError, match=r"manipulator\.csv"):
        Study.from_toml(file)
    with pytest.raises(ConfigError, match="`guideload init --study` writes one"):
        Study.from_toml(folder / "none.toml")


def test_the_cases_of_the_example_only_need_their_mark_removed(folder: Path) -> None:
    file = folder / "study.toml"
    text = file.read_text().replace("# cases =", "cases =").replace("samples = 10_000", "")
    file.write_text(text.partition("[[vary]]")[0].replace("histories = 20", ""))
    (folder / "cases.csv").write_text("body.mass [t]\n1.1\n1.3\n")
    assert Study.from_toml(file).plan().runs == 2


@pytest.mark.parametrize("table", ["limits", "reading"])
def test_a_key_of_the_study_inside_a_table_is_refused_with_a_hint(folder: Path, table: str) -> None:
    file = folder / "study.toml"
    text = file.read_text().replace("# [reading]", "[reading]")
    file.write_text(text.replace(f"[{table}]", f'[{table}]\ncases = "cases.csv"'))
    with pytest.raises(ConfigError, match=rf"{table}.cases: .*put it above the first \[table\]"):
        Study.from_toml(file)


def test_refusals_say_nothing_twice() -> None:
    said = {
        refused(MASS, correlation=[{"between": ["a", "b"], "value": 1.5}]): "between -1 and 1",
        refused(MASS | {"distribution": "norml"}): "lognormal",
        refused(sampling="sobel"): "latin hypercube",
        refused(method="euler"): "implicit",
        refused(STIFFNESS | {"each": "cart"}): '"rail"',
    }
    assert [text.count(words) for text, words in said.items()] == [1] * len(said), said
    assert 'did you mean "normal"?' in refused(MASS | {"distribution": "norml"})
    assert "vary[0].distribution: expected" in refused({"path": "body.mass"})


# ---- draws


def test_each_says_how_many_draws_there_are() -> None:
    def names(**keys: Any) -> list[str]:
        return [factor.name for factor in study(STIFFNESS | keys).plan().factors]

    assert names(each=None) == ["k"]
    assert names() == ["k[1a]", "k[1b]", "k[2a]", "k[2b]"]
    assert names(each="rail") == ["k[1]", "k[2]"]
    assert names(each="value")[:2] == ["k[carriages[1a].stiffness_y]", "k[carriages[1a].stiffness_z]"]
    assert names(name=None)[0] == "carriages[1a].stiffness"
    assert names(name=None, path="carriages.*.x", each="value", sigma=0.1)[0] == "carriages[1a].x"
    drawn = study(STIFFNESS).plan().factors[0]
    assert drawn.targets == ("carriages[1a].stiffness_y", "carriages[1a].stiffness_z")
    assert (drawn.unit, drawn.form) == ("1", "factor")


def test_a_draw_of_one_place_is_its_value_and_of_several_a_factor() -> None:
    plan = study(MASS, STIFFNESS, samples=4096).plan()
    mass, factor = plan.values(0, 4096)[:, :2].T
    assert 1125.0 < mass.min() < 1130.0 and 1370.0 < mass.max() < 1375.0
    assert abs(np.median(factor) - 1.0) < 2e-3 and abs(np.log(factor).std() - 0.2) < 1e-3
    targets = {target: (constant, terms) for target, constant, terms in plan.changes}
    assert targets["mass", 0, 0] == (0.0, ((0, 1.0),))
    assert targets["law", 0, "stiffness"] == (0.0, ((1, MACHINE.carriages[0].stiffness_y / 2),))


def test_correlations_are_within_an_entry_by_part_or_among_all() -> None:
    pairs = [dict(between=["k", "b"], value=0.5), dict(between=["body.mass", "b[2b]"], value=-0.4)]
    keys = dict(samples=20_000, sampling="random", correlation=pairs)
    plan = study(MASS, STIFFNESS | {"within": 0.3}, DAMPING, **keys).plan()
    values = plan.values(0, 20_000)
    values[:, 0] = ndtri((values[:, 0] / 1250.0 - 0.9) / 0.2)
    values[:, 1:] = np.log(values[:, 1:])
    expected = np.eye(9)
    expected[1:5, 1:5] += 0.3 * (1 - np.eye(4))
    for i in range(1, 5):
        expected[i, i + 4] = expected[i + 4, i] = 0.5
    expected[0, 8] = expected[8, 0] = -0.4
    assert np.abs(np.corrcoef(values.T) - expected).max() < 4.5 / np.sqrt(20_000)  # 1 in 4000 for 36 pairs


@pytest.mark.parametrize("sampling", ["sobol", "latin hypercube", "random"])
def test_values_are_the_same_in_any_range_and_after_a_pickle(sampling: str) -> None:
    pairs = [{"between": ["body.mass", "k"], "value": 0.4}]
    plan = study(MASS, STIFFNESS, sampling=sampling, samples=500, correlation=pairs).plan()
    whole = plan.values(0, 500)
    again = pickle.loads(pickle.dumps(plan))
    assert again.metadata.fingerprint == plan.metadata.fingerprint
    for start, stop in ((499, 500), (0, 1), (3, 100), (100, 101), (101, 500), (7, 7)):
        for of_plan in (plan, again):
            assert of_plan.values(start, stop).tobytes() == whole[start:stop].tobytes()
    with pytest.raises(ArgumentError, match="0 <= start <= stop <= 500, got 400 and 501"):
        plan.values(400, 501)


def test_the_fingerprint_is_of_all_that_decides_a_result_and_no_more() -> None:
    base = study(MASS, STIFFNESS).plan().metadata.fingerprint
    same = [dict(samples=128), dict(histories=3), dict(limits={"peak_resultant": 1.0})]
    assert {study(MASS, STIFFNESS, **keys).plan().metadata.fingerprint for keys in same} == {base}
    nearly = Motion.along_x(MOTION.time, MOTION.acceleration[:, 0] * 1.0000001, velocity=np.arange(11.0))
    options = dict(seed=6, sampling="random", sensitivity=True, rtol=1e-7, method="rk45")
    other: list[dict[str, Any]] = [
        *({key: value} for key, value in options.items()),
        dict(statistics=["max"]),
        dict(machine=MACHINE.with_free(["z", "rx", "ry", "rz"])),
        dict(motion=nearly),
        dict(correlation=[{"between": ["k", "body.mass"], "value": 0.1}]),
        dict(vary=(MASS, STIFFNESS | {"sigma": 0.21})),
        dict(sampling="latin hypercube"),
        dict(sampling="latin hypercube", samples=128),
        dict(replicates=16),
    ]
    prints = [study(MASS, STIFFNESS, **keys).plan().metadata.fingerprint for keys in other]
    assert len({base, *prints}) == 1 + len(other)


def test_replicates_are_for_sequences_that_fill_space_evenly() -> None:
    assert [
        study(sampling=one).plan().metadata.replicates for one in ("sobol", "latin hypercube", "random")
    ] == [8, 8, 1]
    assert study(replicates=1).plan().metadata.replicates == 1
    assert "random samples are independent" in refused(sampling="random", replicates=4)
    assert "a whole number from 1 to 1024, got 0" in refused(replicates=0)
    assert "at most 64, the number of samples, got 100" in refused(replicates=100)
    for key, value in (("replicates", 8), ("sampling", "random")):
        told = refused(vary=(), samples=None, cases={"body.mass [t]": [1.0]}, **{key: value})
        assert f"{key}: expected no {key} beside cases" in told


def test_a_missing_seed_is_drawn_and_stored() -> None:
    other = Study(machine=MACHINE, motion=MOTION, samples=4, vary=(MASS,))
    assert study(seed=1).model_copy(update={}).seed == 1
    more = other.model_copy(update={"samples": 8})
    assert more.seed == other.seed
    assert np.array_equal(more.plan().values(0, 4), other.plan().values(0, 4))
    assert other.seed != Study(machine=MACHINE, motion=MOTION, samples=4, vary=(MASS,)).seed


# ---- given cases


def test_cases_are_run_in_order(tmp_path: Path) -> None:
    names, file = ["body.mass", "carriages.*.stiffness", "carriages[1a].x"], tmp_path / "cases.csv"
    headers = ("body.mass [t]", "carriages.*.stiffness [%]", "carriages[1a].x")
    table = dict(zip(headers, ([1.0, 1.2, 0.9], [100, 90, 80], [-0.5, -0.4, -0.6]), strict=True))
    file.write_text(",".join(headers) + "\n1.0,100,-0.5\n1.2,90,-0.4\n0.9,80,-0.6\n")
    expected = [[1000.0, 1.0, -0.5], [1200.0, 0.9, -0.4], [900.0, 0.8, -0.6]]
    plans = [Study(machine=MACHINE, motion=MOTION, cases=cases).plan() for cases in (table, file, str(file))]
    for plan in plans:
        assert (plan.runs, plan.metadata.seed) == (3, None)
        assert [factor.name for factor in plan.factors] == names
        assert np.allclose(plan.values(0, 3), expected, rtol=1e-15, atol=0.0)
        assert np.array_equal(plan.values(1, 2), plan.values(0, 3)[1:2])
    assert len({plan.metadata.fingerprint for plan in plans}) == 1
    assert pickle.loads(pickle.dumps(plans[0])).metadata.fingerprint == plans[0].metadata.fingerprint


def test_units_of_cases_may_be_in_a_separate_row(tmp_path: Path) -> None:
    file = tmp_path / "cases.csv"
    file.write_text("body.mass;carriages[1a].x\nkg;mm\n1100,0;-500\n1200,0;-400\n")
    plan = Study(machine=MACHINE, motion=MOTION, cases=file).plan()
    assert np.allclose(plan.values(0, 2), [[1100.0, -0.5], [1200.0, -0.4]], rtol=1e-15, atol=0.0)


def test_a_cell_of_cases_without_a_number_is_named(tmp_path: Path) -> None:
    file = tmp_path / "cases.csv"
    file.write_text("body.mass [t],carriages[1a].x\n1.1,-0.5\n1.2,\n1.3,-0.4\n")
    with pytest.raises(
        TraceError, match=r"cases.csv: column carriages\[1a\].x: .* in row 3: .*remove the rows"
    ):
        Study(machine=MACHINE, motion=MOTION, cases=file)


@pytest.mark.parametrize("last", ["nan,nan", "n/a,", "nan,\n,\n"])
def test_a_last_row_without_numbers_is_no_empty_line(tmp_path: Path, last: str) -> None:
    file = tmp_path / "cases.csv"
    file.write_text(f"body.mass [t],carriages[1a].x\n1.1,-0.5\n1.2,-0.4\n{last}\n")
    with pytest.raises(
        TraceError, match=r"cases.csv: column body.mass \[t\]: .* in row 4: .*remove the rows"
    ):
        Study(machine=MACHINE, motion=MOTION, cases=file)
    file.write_text("body.mass [t],carriages[1a].x\n1.1,-0.5\n1.2,-0.4\n,\n\n")
    assert Study(machine=MACHINE, motion=MOTION, cases=file).plan().runs == 2


def test_what_is_no_table_of_cases_is_told_without_the_machine(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").touch()
    for cases, words in (
        (tmp_path / "no.csv", r"cases: expected a table of cases.*no\.csv: no such file"),
        (tmp_path / "empty.csv", r"cases: expected a table of cases.*empty\.csv: the file is empty"),
        (3, r"cases: expected a table of cases, or its file, got 3; table: expected a path"),
    ):
        with pytest.raises(ConfigError, match=words) as caught:
            Study(machine=MACHINE, motion=MOTION, cases=cases)
        assert "machine" not in str(caught.value)
    missing = {"path": "body.mass", "distribution": "sample", "file": str(tmp_path / "no.csv")}
    assert "vary[0].file: expected a table of measured values" in refused(missing)
    assert "motion: expected a Motion, got 3" in refused(motion=3)
    assert "limits: expected a table of keys and values, got 3" in refused(limits=3)


def test_a_seed_beside_cases_is_refused_at_its_row(folder: Path) -> None:
    (folder / "cases.csv").write_text("body.mass [t]\n1.1\n")
    head = 'machine = "manipulator.toml"\ntrace = "manipulator.csv"\ncases = "cases.csv"\n'
    (folder / "study.toml").write_text(head)
    assert Study.from_toml(folder / "study.toml").plan().runs == 1
    (folder / "study.toml").write_text(head + "seed = 7\n")
    with pytest.raises(ConfigError, match=r"row 4: seed: expected no seed beside cases, got 7"):
        Study.from_toml(folder / "study.toml")


@pytest.mark.parametrize(
    ("cases", "words"),
    [
        ({"body.mas": [1.0]}, "cases: expected a known path.*did you mean body.mass.*column body.mas"),
        ({"body.mass [m]": [1.0]}, "a mass in kg.*column body.mass"),
        ({"body.mass": [1.0, 0.0]}, "body.mass > 0 kg"),
        ({"gravity.x [%]": [100.0, 150.0]}, r"0 has no percent \(column gravity.x"),
        (
            {"carriages.*.x": [0.1], "carriages[1a].x": [0.2]},
            r"carriages\.\*\.x sets carriages\[1a\].x already",
        ),
    ],
)
def test_cases_that_cannot_be_are_refused(cases: dict[str, list[float]], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Study(machine=MACHINE, motion=MOTION, cases=cases)
    with pytest.raises(TraceError, match="finite numbers"):
        Study(machine=MACHINE, motion=MOTION, cases={"body.mass": [1.0, np.nan]})


# ---- what is kept


def test_columns_tell_statistic_quantity_unit_and_carriage() -> None:
    plan = study(limits={"peak_Fy": "1 kN", "peak_drive": "2 kN", "mean_load": 500}).plan()
    assert len(plan.metadata.columns) == len(plan.metadata.measures) == 4 * (5 * 6 + 2) + 6
    named = dict(zip(plan.metadata.columns, plan.metadata.measures, strict=True))
    assert named["max_Fy_N[1a]"] == ("Fy", 0, "max")
    assert named["time_of_min_My_s[2b]"] == ("My", 3, "time_of_min")
    assert named["rms_Mz_Nm[1b]"] == ("Mz", 1, "rms")
    assert named["mean_load_N[1a]"] == ("load", 0, "mean")
    assert named["contact_lost[2a]"] == ("contact", 2, "lost")
    assert named["max_drive_N"] == ("drive", 0, "max")
    assert plan.metadata.limits == {"peak_Fy_N": 1000.0, "peak_drive_N": 2000.0, "mean_load_N": 500.0}
    assert study(histories=100).plan().histories == tuple(range(64))
    assert study(histories=[9, 3]).plan().histories == (3, 9)
    few = study(quantities=["resultant"], statistics=["max"]).plan()
    assert few.metadata.columns == tuple(f"max_resultant_N[{name}]" for name in ("1a", "1b", "2a", "2b"))


def test_the_force_of_the_drive_is_named_and_limited_as_what_it_is() -> None:
    """A study has the reaction of the held x; with friction the drive's force is larger: a limit on it is refused."""
    for friction in ({"seal": "300 N"}, {"coefficient": 0.01}, {"viscous": "200 N s/m"}):
        braked = MACHINE.model_copy(update={"friction": Friction(**friction)})
        words = refused(machine=braked, limits={"peak_drive": "2 kN"})
        assert "limits.peak_drive: expected no limit on peak drive force of a machine with friction" in words
        plan = study(machine=braked).plan()
        assert plan.metadata.title("peak_drive_N") == "peak drive force without friction"
        assert plan.metadata.title("peak_Fy_N") == "peak |Fy|"
        with pytest.raises(ArgumentError, match="limit on rms_drive_N: expected no limit on rms drive force"):
            exceedance_probability(plan, "rms_drive_N", "2 kN")
    none = MACHINE.model_copy(update={"friction": Friction(seal="0 N")})
    plan = study(machine=none, limits={"peak_drive": "2 kN"}).plan()
    assert plan.metadata.title("peak_drive_N") == "peak drive force"


def test_what_a_scene_does_not_have_is_left_out_or_refused_where_it_was_asked_for() -> None:
    still = Motion.along_x([0.0, 1.0], [0.0, 0.0])
    assert not any("mean_load" in name for name in study(motion=still).plan().metadata.columns)
    assert "has no velocity" in refused(motion=still, quantities=["load"])
    assert "add them to quantities" in refused(quantities=["Fy"], limits={"peak_resultant": 1.0})
    links = [{"name": "rack", "point": [0, 0, 0], "direction": [1, 0, 0], "stiffness": 8e7, "damping": 0}]
    floating = MACHINE.model_copy(update={"links": links, "free": ("x", *MACHINE.free)})
    assert not any("drive" in name for name in study(machine=floating).plan().metadata.columns)
    assert "x is free" in refused(machine=floating, quantities=["drive"])


# ---- refusals


def test_studies_that_cannot_be_are_refused_before_anything_runs() -> None:
    assert "vary: " in refused(vary=())
    assert "samples: " in refused(samples=None)
    assert "no samples beside cases" in refused(vary=(), cases={"body.mass": [1.0]})
    assert "no vary beside cases" in refused(samples=None, cases={"body.mass": [1.0]})
    assert "vary[1].path" in refused(MASS, MASS) and "body.mass is set by vary[0]" in refused(MASS, MASS)
    assert "a unique name" in refused(MASS | {"name": "k"}, STIFFNESS | {"each": None})
    normal = dict(name="a", distribution="normal", mean=1, sigma=1)
    assert "paths of one unit" in refused(normal | {"path": ["body.mass", "gravity.y"]})
    twice = [{"between": ["body.mass", "k"], "value": value} for value in (0.1, 0.2)]
    assert "each pair once" in refused(MASS, STIFFNESS, correlation=twice)
    assert "a name where there are several paths" in refused(MASS | {"path": ["body.mass", "motion.scale"]})
    assert "no within where there is one draw" in refused(MASS | {"within": 0.3})
    below = dict(path="carriages.*.clearance", distribution="normal", sigma="1 um")
    assert "carriages[1a].clearance_y >= 0 m" in refused(below)
    unsupported = MACHINE.with_free(["x", *MACHINE.free])
    with pytest.raises(SceneError, match="x"):
        study(machine=unsupported)


def test_a_normal_mass_needs_no_cut_where_no_draw_reaches_below_zero() -> None:
    study(dict(path="body.mass", distribution="normal", sigma="10 %"))
    assert "at_least" in refused(dict(path="body.mass", distribution="normal", sigma="15 %"))
    study(dict(path="body.mass", distribution="normal", sigma="15 %", at_least="20 %"))


def test_contradicting_correlations_are_refused_with_what_would_do() -> None:
    three = [MASS, dict(path="motion.scale", distribution="normal", sigma=0.1), DAMPING | {"each": None}]
    pairs = [("body.mass", "motion.scale", 0.9), ("motion.scale", "b", 0.9), ("body.mass", "b", -0.9)]
    told = refused(*three, correlation=[{"between": [a, b], "value": v} for a, b, v in pairs])
    assert "a positive definite matrix" in told and "smallest eigenvalue is -0.8" in told
    factor = float(told.split("all of them times ")[1].split()[0])
    study(*three, correlation=[{"between": [a, b], "value": factor * v} for a, b, v in pairs])
