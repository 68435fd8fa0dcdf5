"""Frequency responses and static deflections: exact derivatives, files, and the machine that made the data."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import guideload, refused
from hammer_tests import deflections, derivative_errors, response_curves, unknown, with_corners
from reference import cart, preloaded
from scipy.stats import norm

from guideload import GuideloadError, Machine, TraceError, frequency_response
from guideload.identification.fit import fit
from guideload.identification.measured import Measured
from guideload.identification.model import Model, parse_place
from guideload.identification.model_comparison import _scores
from guideload.identification.response_files import read_curves
from guideload.identification.responses import FrequencyResponses, ResponseCurve
from guideload.identification.result import identify
from guideload.identification.unknowns import UnknownTable

HERTZ = np.linspace(10.0, 200.0, 60)
TRUTH = np.array([0.2, -0.1, 0.3, -0.3, 0.15, -0.4])
TABLES = (
    UnknownTable(path="carriages.*.stiffness_y", each="carriage"),
    UnknownTable(path="carriages.*.stiffness_z"),
    UnknownTable(path=("carriages.*.damping_y", "carriages.*.damping_z"), name="damping"),
)


def model_of(machine: Machine) -> Model:
    machine = with_corners(machine)
    return Model(machine, unknown(machine, *TABLES))


def responses(
    model: Model, rng: np.random.Generator, noise: float, calibration: float = 0.0
) -> FrequencyResponses:
    """Of the machine at TRUTH, with noise; with a gain of 1.03 if there is a calibration."""
    curves = response_curves(model, TRUTH, HERTZ, noise, rng, 1.03 if calibration else 1.0)
    return FrequencyResponses("responses", curves, noise or 0.01, 1e-6, True, calibration=calibration)


@pytest.mark.parametrize("machine", [cart(), preloaded()], ids=["linear", "preloaded"])
def test_responses_are_those_of_the_machine(machine: Machine) -> None:
    """As `frequency_response` gives them, also of preloaded carriages linearised at rest."""
    model = model_of(machine)
    found = frequency_response(model.machine, HERTZ, force_at="p0", direction="y")
    curve = ResponseCurve(
        parse_place("p0 y", model.machine), parse_place("p3 -z", model.machine), 0, HERTZ, np.zeros(60)
    )
    assert curve.computed(model.at(np.zeros(6)))[0] == pytest.approx(-found.displacement[:, 3, 2], rel=1e-9)


@pytest.mark.parametrize("kind", ["responses", "deflections"])
def test_derivatives(kind: str) -> None:
    """Against central differences, whose error here is below 1e-7 of the largest."""
    model = model_of(cart())
    if kind == "deflections":
        data: Measured = deflections(model, TRUTH, [("p0 y", place) for place in ("p0 y", "p1 y", "p2 z")])
        nuisance = np.zeros(0)
    else:
        data, nuisance = responses(model, np.random.default_rng(0), 0.05, 0.02), np.array([1.01])
    errors, own = derivative_errors(
        data, model, 0.7 * TRUTH, nuisance, own_steps=np.full(nuisance.size, 1e-3)
    )
    assert errors.max() < 1e-7 and own.max(initial=0.0) < 1e-9


@pytest.mark.parametrize("calibration", [0.0, 0.05])
def test_the_machine_is_found_again(calibration: float) -> None:
    """Also if the gain of the sensors is 3 % off and unknown."""
    model = model_of(cart())
    data = responses(model, np.random.default_rng(1), 0.02, calibration)
    found = fit(model, [data], starts=4)
    slopes = np.vstack([found.jacobian, np.diag(found.objective.weights)])
    assert found.covariance == pytest.approx(np.linalg.inv(slopes.T @ slopes), rel=1e-6, abs=1e-12)
    sigma = np.sqrt(np.diag(found.covariance))
    assert np.all(abs(found.minimum.x[:6] - TRUTH) < 4.0 * sigma[:6]) and sigma[:6].max() < 0.03
    if calibration:
        gain = found.objective.nuisance_values(found.minimum.x)[0]
        assert gain == pytest.approx([1.03], abs=4 * 0.05 * sigma[6])


@pytest.mark.parametrize("stated", ["nothing", "floor"])
def test_noise_that_is_not_stated_is_found(stated: str) -> None:
    """With 2 % of each response and 0.5 % of the largest: small and large residuals are those of the noise."""
    level, floor = 0.02, 0.005
    model = model_of(cart())
    rng = np.random.default_rng(3)
    exact = responses(model, rng, 0.0)
    curves = []
    for curve in exact.curves:
        size = abs(curve.value)
        noise = np.hypot(level * size, floor * size.max()) * (
            rng.standard_normal((size.size, 2)) @ [1.0, 1.0j]
        )
        curves.append(replace(curve, value=curve.value + noise))
    starts = 0.05, floor if stated == "floor" else 0.0005
    data = FrequencyResponses("responses", tuple(curves), *starts, False, stated == "floor")
    found = fit(model, [data], starts=1)
    assert not found.messages
    sizes = np.concatenate([np.tile(abs(one.value) / abs(one.value).max(), 2) for one in exact.curves])
    order = np.argsort(sizes)
    for third in np.array_split(
        order, 3
    ):  # 240 residuals each: three standard deviations of their rms are 14 %
        assert found.residuals[third].std() == pytest.approx(1.0, abs=0.14)


@pytest.mark.parametrize(("level", "floor"), [(1e-9, 0.001), (0.002, 1e-9)])
def test_small_noise_that_is_not_stated_leaves_the_uncertainty_that_known_noise_leaves(
    level: float, floor: float
) -> None:
    """720 values determine their noise to 3 %, and its dependence on their size to some percent."""
    model, rng = model_of(cart()), np.random.default_rng(5)
    curves = tuple(
        replace(
            one, value=one.value + floor * abs(one.value).max() * (rng.standard_normal((60, 2)) @ [1.0, 1.0j])
        )
        for one in response_curves(model, np.zeros(6), HERTZ, level, rng)
    )
    known = fit(model, [FrequencyResponses("known", curves, level, floor, True)], starts=1)
    found = fit(model, [FrequencyResponses("estimated", curves, 0.05, 0.005, False, False)], starts=1)
    assert np.diag(found.covariance) == pytest.approx(np.diag(known.covariance), rel=0.2)


@pytest.mark.parametrize("known", [True, False])
def test_the_score_of_a_model_is_the_logarithm_of_the_density_of_the_values(known: bool) -> None:
    """Of models of which everything is known before, so that no value that is left out changes them."""
    machine, model = with_corners(cart()), model_of(cart())
    curves = response_curves(model, np.zeros(6), HERTZ, 0.02, np.random.default_rng(4))
    data = FrequencyResponses("responses", curves, 0.02, 1e-3, known)
    for factor in (1.0, 1.02):  # of a stiffness
        value = factor * machine.carriages[0].stiffness_y
        table = UnknownTable(path="carriages.*.stiffness_y", expected=value, spread=1e-6)
        found = identify(machine, (table,), [data], starts=1)
        (test,), density = found.residuals, 0.0
        for curve in data.curves:
            computed = curve.computed(found.model)[0]
            size = (test.factor or 1.0) * abs(computed)
            noise = np.hypot(test.noise.level * size, test.noise.floor * size.max())
            for part in (np.real, np.imag):
                density += norm.logpdf(part(curve.value), part(computed), noise).sum()
        # Rounds on the noise end at changes of 2 %, of which most cancel.
        assert _scores(found).sum() == pytest.approx(density, abs=1.0)


def test_a_table_of_guideload_response_is_read_back(tmp_path: Path) -> None:
    model = model_of(cart())
    points = "".join(
        f'[[points]]\nname = "{one.name}"\nat = {list(one.at)}\n' for one in model.machine.points
    )
    text = (Path(__file__).parents[1] / "data" / "cart.toml").read_text(encoding="utf-8")
    (tmp_path / "machine.toml").write_text(f"{text}\n{points}", encoding="utf-8")
    options = "--force-at", "p0", "--direction", "y", "--csv"
    guideload("response", tmp_path / "machine.toml", *options, tmp_path / "h.csv")
    unknown_table = '[[unknown]]\npath = "carriages.*.stiffness_y"\n'
    data = '[[frequency_responses]]\nfile = "h.csv"\nforce = "p0 y"\nnoise = "1 %"\nlow = "20 Hz"\nhigh = "50 Hz"\n'
    (tmp_path / "identify.toml").write_text(
        f'machine = "machine.toml"\n{unknown_table}{data}', encoding="utf-8"
    )
    shown = guideload("identify", tmp_path / "identify.toml").stdout
    assert "carriages.*.stiffness_y N/um 120 120 120 120" in " ".join(shown.split())
    (tmp_path / "wrong.toml").write_text(
        f'machine = "machine.toml"\n{unknown_table}{data}'.replace('"p0 y"', '"p0 q"'), encoding="utf-8"
    )
    assert "frequency_responses[0]: expected a point and an axis" in refused(
        "identify", tmp_path / "wrong.toml"
    )


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # pyuff leaves its file open
def test_universal_files_hold_the_same_curves(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    model = model_of(cart())
    data = responses(model, np.random.default_rng(1), 0.02)
    nodes = {str(10 + i): f"p{i}" for i in range(5)}
    node_of = {name: int(node) for node, name in nodes.items()}
    for curve in data.curves:
        (hit, hit_axis), (place, axis) = (one.name.split() for one in (curve.force, curve.place))
        pyuff.UFF(str(tmp_path / "h.uff")).write_sets(
            pyuff.prepare_58(
                binary=1, func_type=4, id1="h", rsp_node=node_of[place], rsp_dir="xyz".index(axis) + 1,
                ref_node=node_of[hit], ref_dir="xyz".index(hit_axis) + 1, data=curve.value, x=curve.frequency,
                ordinate_spec_data_type=12, orddenom_spec_data_type=13, abscissa_spec_data_type=18,
            ),
            mode="add",
        )  # fmt: skip
    read = read_curves(tmp_path / "h.uff", model.machine, None, nodes, 50.0, 100.0)
    for curve, other in zip(data.curves, read, strict=True):
        inside = (HERTZ >= 50.0) & (HERTZ <= 100.0)
        assert (other.name, other.derivatives) == (curve.name, 2)
        assert other.frequency == pytest.approx(HERTZ[inside]) and other.value == pytest.approx(
            curve.value[inside]
        )


INCH_POUND = {
    "type": 164, "units_code": 7, "units_description": "inch (pound f)", "temp_mode": 1,
    "length": 39.37007874, "force": 0.2248089431, "temp": 1.8, "temp_offset": 459.67,
}  # fmt: skip
OF_ONE = {"rsp_node": 1, "rsp_dir": 2, "ref_node": 1, "ref_dir": 2, "func_type": 4, "id1": "h", "binary": 0}
ACCELERANCE = {"ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13, "abscissa_spec_data_type": 18}
CURVE = (0.01 + 0.02j) * np.arange(1.0, 11.0)
POUND = 4.4482216152605


def universal(file: Path, *sets: dict[str, Any], value: Any = CURVE, **changes: Any) -> Path:
    """A universal file with one response, and other datasets before it."""
    pyuff = pytest.importorskip("pyuff")
    response = (
        OF_ONE | ACCELERANCE | {"data": value, "x": 10.0 * np.arange(1.0, 1.0 + np.size(value))} | changes
    )
    for one in (*sets, pyuff.prepare_58(**response)):
        pyuff.UFF(str(file)).write_sets(one, mode="add")
    return file


def read_one(file: Path) -> np.ndarray:
    (curve,) = read_curves(file, model_of(cart()).machine, None, {"1": "p0"}, 0.0, 1e4)
    return curve.value


LABELS = "ordinate_axis_units_lab", "orddenom_axis_units_lab"
unclosed = pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # pyuff leaves it open


@unclosed
@pytest.mark.parametrize(
    ("sets", "labels", "factor"),
    [
        ((), ("", ""), 1.0),
        ((), ("m/s^2", "N"), 1.0),
        ((), ("g", "N"), 9.80665),
        ((), ("g", "lbf"), 9.80665 / POUND),
        ((), ("mm/s^2/N", ""), 1e-3),
        ((), ("g/lbf", ""), 9.80665 / POUND),
        ((), ("1/kg", "NONE"), 1.0),
        ((INCH_POUND,), ("", ""), 0.0254 / POUND),
        ((INCH_POUND,), ("inch/s^2", "lbf"), 0.0254 / POUND),
        ((INCH_POUND,), ("inch/s^2", "NONE"), 0.0254 / POUND),
    ],
)
def test_units_of_universal_files_count(
    tmp_path: Path, sets: tuple[dict[str, Any], ...], labels: tuple[str, str], factor: float
) -> None:
    file = universal(tmp_path / "h.uff", *sets, **dict(zip(LABELS, labels, strict=True)))
    assert read_one(file) == pytest.approx(factor * CURVE, rel=1e-5)


@unclosed
@pytest.mark.parametrize(
    ("label", "per_hertz"), [("", 1.0), ("Hz", 1.0), ("HZ", 1.0), ("kHz", 1e-3), ("rad/s", 2.0 * np.pi)]
)
def test_the_unit_of_frequencies_counts(tmp_path: Path, label: str, per_hertz: float) -> None:
    """10 to 100 Hz in any unit are 10 to 100 Hz."""
    hertz = 10.0 * np.arange(1.0, 11.0)
    file = universal(tmp_path / "h.uff", x=per_hertz * hertz, abscissa_axis_units_lab=label)
    (curve,) = read_curves(file, model_of(cart()).machine, None, {"1": "p0"}, 0.0, 1e4)
    assert curve.frequency == pytest.approx(hertz, rel=1e-4)


@unclosed
@pytest.mark.parametrize("datasets", [1, 2, 3])
def test_a_binary_universal_file_is_whole_or_refused(tmp_path: Path, datasets: int) -> None:
    """Whatever the number of its datasets; their ends follow binary data without a line break."""
    for _ in range(datasets):
        file = universal(tmp_path / "h.uff", binary=1)
    machine, nodes = model_of(cart()).machine, {"1": "p0"}
    assert len(read_curves(file, machine, None, nodes, 0.0, 1e4)) == datasets
    whole = file.read_bytes()
    for lost in (2, 8, 100):
        file.write_bytes(whole[:-lost])
        with pytest.raises(TraceError, match="is cut off"):
            read_curves(file, machine, None, nodes, 0.0, 1e4)


@unclosed
@pytest.mark.parametrize(
    ("sets", "changes", "words"),
    [
        ((INCH_POUND,), {LABELS[0]: "g", LABELS[1]: "lbf"}, "dataset 164 says inch"),
        ((), {"abscissa_axis_units_lab": "order"}, 'such as Hz or rad/s, got "order"; dataset 1 of'),
        ((), {LABELS[0]: "furlong"}, 'unit labels such as m/s^2 and N, got "furlong"'),
        ((), {"orddenom_spec_data_type": 12}, "responses per force"),
        ((), {"abscissa_spec_data_type": 17}, "responses over frequency"),
        ((), {"value": abs(CURVE)}, "complex responses"),
        ((), {"value": 0.0 * CURVE}, "zeros alone"),
    ],
)
def test_what_a_universal_file_cannot_mean_is_refused(
    tmp_path: Path, sets: tuple[dict[str, Any], ...], changes: dict[str, Any], words: str
) -> None:
    file = universal(tmp_path / "h.uff", *sets, **changes)
    with pytest.raises(GuideloadError, match=re.escape(words)) as error:
        read_one(file)
    assert "h.uff" in str(error.value)


@unclosed
def test_a_damaged_universal_file_is_refused(tmp_path: Path) -> None:
    """Cut off, with a lost line, with decimal commas, with a number that is none."""
    lines = universal(tmp_path / "h.uff").read_text(encoding="utf-8").splitlines(keepends=True)
    values = len(lines) - 3
    changed = {
        "cut off": lines[:-1],
        "as its header says": [*lines[:values], *lines[values + 1 :]],
        "no readable universal file": [
            *lines[:values],
            lines[values].replace(".", ","),
            *lines[values + 1 :],
        ],
        "finite numbers": [
            *lines[:values],
            re.sub(r"^.{13}", f"{'nan':>13}", lines[values]),
            *lines[values + 1 :],
        ],
    }
    for words, text in changed.items():
        file = tmp_path / "damaged.uff"
        file.write_text("".join(text), encoding="utf-8")
        with pytest.raises(GuideloadError, match=words):
            read_one(file)


def test_deflections_tell_the_sum_of_stiffnesses_that_carry_a_central_force() -> None:
    """A force through the middle of equal springs: u = F/(sum of k), whatever else is measured there."""
    machine = with_corners(cart())
    model = Model(machine, unknown(machine, UnknownTable(path="carriages.*.stiffness_z")))
    data = deflections(model, np.array([-0.5]), [("p0 z", "p0 z")], 1e-3)
    assert fit(model, [data]).minimum.x == pytest.approx([-0.5], abs=1e-3)
