"""`guideload study`: what it writes and prints, what it refuses, and how it goes on."""

import json
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from command_line import guideload, names, refused
from unrendered import leave_unrendered

from guideload.cli.inputs import EXAMPLES
from guideload.cli.outputs import LIFE_PICTURES, MANIFEST, STUDY_PICTURES
from guideload.study import execution
from guideload.study.result import StudyResult
from guideload.study.storage import FolderStore, chunks_in
from guideload.study.study import Study

STUDY = """\
machine = "machine.toml"
trace = "trace.csv"
samples = 200
seed = 1
histories = 2
quantities = ["resultant", "load"]
[limits]
peak_resultant = "0.5 N"
[[vary]]
path = "body.mass"
distribution = "uniform"
plus_minus = "10 %"
[[vary]]
name = "k"
path = "carriages.*.stiffness_y"
each = "carriage"
distribution = "lognormal"
sigma = 0.2
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A study file, with machine and trace beside it."""
    folder = tmp_path / "Läufe"
    folder.mkdir()
    shutil.copy(str(EXAMPLES / "manipulator.toml"), folder / "machine.toml")
    rows = "".join(f"{i * 1e-2:.2f},{0.3 * min(i / 20, 1):.4f}\n" for i in range(40))
    (folder / "trace.csv").write_text("time_s,velocity_m_s\n" + rows)
    (folder / "study.toml").write_text(STUDY)
    return folder / "study.toml"


def contents(folder: Path) -> dict[str, bytes]:
    parts = FolderStore.open(folder)
    return {name: parts.column(name).tobytes() for name in parts.columns}


def stops_at(monkeypatch: pytest.MonkeyPatch, samples: int) -> None:
    """Ctrl-C when so many samples are done."""
    count = execution._Writer.count

    def counts(self: Any, more: int) -> None:
        count(self, more)
        if self.done >= samples:
            raise KeyboardInterrupt

    monkeypatch.setattr(execution._Writer, "count", counts)


def test_study_writes_samples_report_and_pictures(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rendered pictures are in test_names.py."""
    leave_unrendered(monkeypatch)
    out = tmp_path / "neue" / "Studie"
    ended = guideload("study", file, "-o", out)
    written = {"study.json", "samples", "histories.nc", "summary.json", "report.txt"}
    assert names(out) == {*written, *STUDY_PICTURES} and (out / MANIFEST).is_file()
    written = (out / "report.txt").read_text(encoding="utf-8")
    assert written.strip() in ended.stdout
    assert ended.stderr == ""
    result = StudyResult.load(out)
    assert (result.finished, result.runs) == (200, 200)
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["runs"] == 200


def test_options_are_those_of_the_file_unless_given(file: Path, tmp_path: Path) -> None:
    run = ("study", file, "--no-pictures", "-o")
    guideload(*run, tmp_path / "a", "--samples", 50, "--seed", 7, "--threads", 1)
    file.write_text(STUDY.replace("= 200", "= 50").replace("seed = 1", "seed = 7"))
    guideload(*run, tmp_path / "b", "--threads", 3)
    assert contents(tmp_path / "a") == contents(tmp_path / "b")
    assert not any(name.endswith(".png") for name in names(tmp_path / "a"))
    file.write_text(STUDY.replace("samples = 200\nseed = 1\n", ""))
    assert "samples: " in refused(*run, tmp_path / "c")
    guideload(*run, tmp_path / "c", "--samples", 50, "--seed", 7)
    assert contents(tmp_path / "a") == contents(tmp_path / "c")


def test_a_study_is_read_once(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made, built = [], Study.__init__

    def counted(self: Study, /, **values: Any) -> None:
        made.append(self)
        built(self, **values)

    monkeypatch.setattr(Study, "__init__", counted)
    run = ("study", file, "-o", tmp_path / "out", "--no-pictures", "--samples", 50, "--seed", 7)
    guideload(*run)
    assert len(made) == 1


def test_ctrl_c_reports_what_is_done_and_tells_how_to_go_on(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_unrendered(monkeypatch)
    whole, out = tmp_path / "whole", tmp_path / "neue Studie"
    guideload("study", file, "-o", whole, "--no-pictures")
    run = ("study", file, "-o", out, "--samples", 200)
    with monkeypatch.context() as patched:
        stops_at(patched, 100)
        ended = guideload(*run, code=130)
    done = StudyResult.load(out).finished
    assert 64 <= done < 200
    assert f"Interrupted: {done} of 200 runs are done. To resume: guideload study " in ended.stderr
    assert (out / "report.txt").read_text(encoding="utf-8").strip() in ended.stdout
    assert set(STUDY_PICTURES) < names(out)
    again = shlex.split(ended.stderr.partition("To resume: guideload ")[2])
    guideload(*again)
    assert contents(out) == contents(whole)
    assert set(STUDY_PICTURES) < names(out)


def test_ctrl_c_before_the_first_sample(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        stops_at(patched, 0)
        ended = guideload("study", file, "-o", tmp_path / "out", code=130)
    assert "0 of 200 runs are done" in ended.stderr
    guideload("study", file, "-o", tmp_path / "out", "--resume", "--no-pictures")
    with monkeypatch.context() as patched:
        from_toml = "guideload.study.study.Study.from_toml"
        patched.setattr(from_toml, lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
        assert guideload("study", file, "-o", tmp_path / "other", code=130).stderr == "Interrupted.\n"
        options = ["-o", str(tmp_path / "out"), "--report", str(tmp_path / "study.html"), "--resume"]
        ended = guideload("study", file, *options, code=130)
        again = shlex.join(["guideload", "study", str(file), *options])
        assert ended.stderr == f"Interrupted. To resume: {again}\n"


def test_a_seed_that_was_drawn_is_recorded_and_found_again(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file.write_text(STUDY.replace("seed = 1\n", ""))
    run = ("study", file, "--no-pictures", "-o")
    with monkeypatch.context() as patched:
        stops_at(patched, 100)
        guideload(*run, tmp_path / "a", code=130)
    guideload(*run, tmp_path / "a", "--resume")
    seed = json.loads((tmp_path / "a" / "study.json").read_text(encoding="utf-8"))["seed"]
    guideload(*run, tmp_path / "b", "--seed", seed)
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


def test_resume_repairs_and_says_so(file: Path, tmp_path: Path) -> None:
    run = ("study", file, "--no-pictures", "-o", tmp_path / "out")
    guideload(*run, "--resume")  # nothing there yet
    before = contents(tmp_path / "out")
    (part,) = chunks_in(tmp_path / "out")
    part.write_bytes(part.read_bytes()[:-50])
    ended = guideload(*run, "--resume")
    assert f"{part} was damaged" in ended.stderr
    assert contents(tmp_path / "out") == before


def test_another_study_is_not_mixed_in(file: Path, tmp_path: Path) -> None:
    run = ("study", file, "--no-pictures", "-o", tmp_path / "out")
    guideload(*run)
    before = contents(tmp_path / "out")
    assert "--resume resumes it, --overwrite replaces it" in refused(*run)
    assert "seed: 1 there, 2 here" in refused(*run, "--resume", "--seed", 2)
    assert "study of 200 runs" in refused(*run, "--resume", "--samples", 20)
    assert "give one" in refused(*run, "--resume", "--overwrite")
    assert contents(tmp_path / "out") == before
    guideload(*run, "--resume", "--samples", 256)
    guideload(*run, "--overwrite", "--seed", 2)
    assert StudyResult.load(tmp_path / "out").metadata.seed == 2


def rate(file: Path, conditions: str) -> None:
    """Give the carriages of the machine beside a study file a product, and conditions of life."""
    text = (EXAMPLES / "manipulator.toml").read_text(encoding="utf-8")
    text = text.replace("stiffness_y", 'product = "20"\nstiffness_y')
    product = '[[products]]\nname = "20"\nmaker = "m"\nedition = "e"\ntype = "ball"\nstatic = "30 kN"\n'
    product += 'dynamic = { value = "20 kN", base = "50 km" }\nstatic_moments = { yaw = 200, pitch = 200 }\n'
    (file.parent / "machine.toml").write_text(text + product + conditions, encoding="utf-8")


def test_changed_limits_and_life_take_effect_when_a_study_goes_on(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run = ("study", file, "--no-pictures", "-o", out)
    rate(file, "[life]\nreliability = 0.95\n")
    guideload(*run)
    before, strict = contents(out), StudyResult.load(out)
    assert strict.metadata.limits == {"peak_resultant_N": 0.5, "static_safety": 1.0}
    rate(file, '[life]\nreliability = 0.9\nlife = "200 km"\nsafety = 2.5\n')
    file.write_text(STUDY.replace('"0.5 N"', '"0.25 N"'))
    guideload(*run, "--resume")
    usual = StudyResult.load(out)
    limits = {"peak_resultant_N": 0.25, "static_safety": 2.5, "life_km": 200.0}
    assert usual.metadata.limits == limits
    factor = (np.log(0.95) / np.log(0.9)) ** (1 / 1.5)
    np.testing.assert_allclose(strict.column("life_km"), factor * usual.column("life_km"))
    file.write_text(STUDY.replace('[limits]\npeak_resultant = "0.5 N"\n', ""))  # and when they are gone
    rate(file, "")
    guideload(*run, "--resume")
    assert StudyResult.load(out).metadata.limits == {"static_safety": 1.0}
    assert contents(out) == before
    rate(file, '[life]\nrule = "thk"\n')
    assert "machine.life.rule: sum there, thk here" in refused(*run, "--resume")


def test_a_refused_resume_tells_what_differs_in_words_and_no_more(file: Path, tmp_path: Path) -> None:
    run = ("study", file, "--no-pictures", "-o", tmp_path / "out")
    file.write_text(STUDY + '[[correlation]]\nbetween = ["body.mass", "k"]\nvalue = 0.2\n')
    guideload(*run)
    changed = STUDY.replace('"0.5 N"', '"0.25 N"').replace("samples = 200", "samples = 300")
    changed = changed.replace("histories = 2", "histories = 3").replace(', "load"]', "]")
    file.write_text(changed.replace('plus_minus = "10 %"', "low = 1000\nhigh = 1500"))
    told = refused(*run, "--resume")
    assert "body.mass: uniform from 1125 to 1375 kg there, uniform from 1000 to 1500 kg here; " in told
    assert "correlation of body.mass and k[1a]: 0.2 there, nothing here" in told
    assert "--overwrite" in told and "another folder" in told
    assert not any(word in told for word in ("limits", "0.25", "runs", "histories", "Factor(", "..."))
    out = tmp_path / "other"
    run = (*run[:-1], out)
    file.write_text(STUDY)
    guideload(*run)
    file.write_text(STUDY.replace("samples = 200", 'samples = 200\nmethod = "rk45"\nrtol = 1e-5'))
    difference = "What differs: method: auto there, rk45 here; rtol: 1e-06 there, 1e-05 here. "
    assert difference in refused(*run, "--resume")
    file.write_text(STUDY.replace(', "load"]', "]"))
    assert "What differs: recorded columns: also mean_load_N[1a], " in refused(*run, "--resume")
    file.write_text(STUDY.replace("stiffness_y", "damping_y"))
    assert "k[1a]: lognormal with median" in refused(*run, "--resume")


def test_a_limit_on_the_life_is_passed_below_it(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_unrendered(monkeypatch)
    rate(file, "")
    file.write_text(STUDY.replace('peak_resultant = "0.5 N"', 'life = "1e12 km"'))
    out = tmp_path / "out"
    ended = guideload("study", file, "-o", out, "--report", out / "report.html")
    assert "h (1 000 000 000 000 km): " in " ".join(ended.stdout.split())
    result = StudyResult.load(out)
    assert result.metadata.limits == {"life_km": 1e12, "static_safety": 1.0}
    row = result.probabilities().loc["life_km", "1a"]
    life = 50.0 * (20e3 / result.column("mean_load_N[1a]")) ** 3
    assert row["count"] == np.count_nonzero(life < 1e12) > 0
    assert set(LIFE_PICTURES) < names(out)
    page = (out / "report.html").read_text(encoding="utf-8")
    for caption in ("life", "static_safety", "failure"):
        assert f"<figcaption>{caption}</figcaption>" in page
    failure = json.loads((out / "summary.json").read_text())["failure"]
    assert [one["carriage"] for one in failure] == ["1a", "1b", "2a", "2b", ""]
    shutil.copy(str(EXAMPLES / "manipulator.toml"), file.parent / "machine.toml")
    told = refused("study", file, "-o", tmp_path / "other")
    assert "row 8: limits.life: expected no limit on life without a rating" in told
    assert "no carriage has a product" in told


def everything(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


LINKS = dict(
    cases="itself", values="hard link", trace="symbolic link", machine="itself", study="symbolic link"
)


@pytest.mark.parametrize(("read", "link"), [*LINKS.items(), ("machine", "hard link")])
def test_what_a_study_reads_is_neither_removed_nor_replaced(
    file: Path, tmp_path: Path, read: str, link: str
) -> None:
    out = tmp_path / "out"
    run = ("study", file, "--no-pictures", "-o", out)
    guideload(*run)
    (part,) = chunks_in(out)
    # Chunks are removed by their name alone, so one may be of a study that was put together by hand.
    taken = part if read in ("cases", "values", "trace") else out / "report.txt"
    if read == "cases":
        pq.write_table(pa.table({"body.mass": [1000.0, 1100.0]}), part)
        text = STUDY.split("[limits]")[0].replace("samples = 200\nseed = 1\n", 'cases = "NAME"\n')
    elif read == "values":
        text = STUDY.replace('distribution = "uniform"\nplus_minus = "10 %"', 'distribution = "sample"\nFILE')
        text = text.replace("FILE", 'file = "NAME"\ncolumn = "body.mass"')
    elif read == "trace":
        time = np.arange(40) * 1e-2
        pq.write_table(pa.table({"time_s": time, "velocity_m_s": np.minimum(time, 0.2)}), part)
        text = STUDY.replace("trace.csv", "NAME")
    elif read == "machine":
        shutil.copy(file.parent / "machine.toml", taken)
        text = STUDY.replace("machine.toml", "NAME")
    else:
        text = STUDY
    name = taken
    if link != "itself":
        name = file.parent / f"read{taken.suffix}"
        name.hardlink_to(taken) if link == "hard link" else name.symlink_to(taken)
    if read == "study":  # a study file below the folder finds its machine and trace beside it no more
        text = text.replace('"machine.toml"', f'"{file.parent / "machine.toml"}"')
        text = text.replace('"trace.csv"', f'"{file.parent / "trace.csv"}"')
        taken.write_text(text)
        run = ("study", name, "--no-pictures", "-o", out)
    file.write_text(text.replace("NAME", str(name)))
    before = everything(tmp_path)
    assert f"{name} is read by this run and would be replaced" in refused(*run, "--overwrite")
    assert everything(tmp_path) == before
    elsewhere = (*run[:-1], tmp_path / "other")
    guideload(*elsewhere, "--overwrite")


def test_files_that_are_not_ours_stay(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "report.txt").write_text("mine")
    assert "is not empty" in refused("study", file, "-o", out)
    assert "is not empty" in refused("study", file, "-o", out, "--resume")
    assert "report.txt was not written by an earlier run" in refused("study", file, "-o", out, "--overwrite")
    (out / "report.txt").rename(out / "notes.txt")
    (out / "study.json").write_text("{}")
    assert "study.json: expected the metadata" in refused("study", file, "-o", out, "--overwrite")
    (out / "study.json").unlink()
    guideload("study", file, "-o", out, "--overwrite", "--no-pictures")
    guideload("study", file, "-o", out, "--overwrite", "--no-pictures")
    assert (out / "notes.txt").read_text() == "mine"
    assert "is a file" in refused("study", file, "-o", file)


def test_a_bad_study_is_refused_before_the_folder_is_touched(file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    guideload("study", file, "-o", out, "--no-pictures")
    before = contents(out)
    file.write_text(STUDY.replace("body.mass", "body.mas"))
    for options in (("--overwrite",), ("--resume",), ()):
        assert "body.mass" in refused("study", file, "-o", out, *options)
    assert contents(out) == before


def test_init_writes_a_study_that_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(file.parent / "trace.csv", "trace.csv")
    guideload("init")
    told = guideload("init", "--study")
    assert "machine.toml (from `guideload init`) and trace.csv" in told.stdout
    assert "guideload study study.toml -o out/" in told.stdout
    guideload("study", "study.toml", "-o", "out", "--samples", 20, "--no-pictures")
    guideload("init", "--study", "other.toml")
    named = (
        Path("study.toml").read_bytes().replace(b"guideload study study.toml", b"guideload study other.toml")
    )
    assert Path("other.toml").read_bytes() == named


def test_probability_of_a_limit_is_the_share_of_runs_beyond_it(file: Path, tmp_path: Path) -> None:
    told = guideload("probability", file, "--limit", "peak_resultant=5 kN", "--error", "10", "--threads", "1")
    text = " ".join(told.stdout.split())
    found = re.match(
        r"Probability of peak resultant above 5000 N, machine: \S+ \((\S+) to (\S+) at 95 %\)", text
    )
    assert found, text
    guideload("study", file, "-o", tmp_path / "out", "--samples", 4096, "--no-pictures")
    result = StudyResult.load(tmp_path / "out")
    peaks = np.max([result.column(f"max_resultant_N[{name}]") for name in result.metadata.carriages], axis=0)
    low, high = map(float, found.groups())
    assert low < np.mean(peaks > 5000.0) < high


def test_a_cluster_that_does_not_answer_is_said(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed", reason="needs the extra: pip install guideload[cluster]")
    monkeypatch.setattr("guideload.study.tasks.CONNECT_TIME", 0.2)
    told = guideload("study", file, "-o", tmp_path / "out", "--cluster", "tcp://127.0.0.1:9", code=1)
    assert "no Dask scheduler answers at tcp://127.0.0.1:9" in told.stderr
    assert not (tmp_path / "out" / "study.json").exists()
