"""Valid files of every format that guideload reads, and arrays and tables of unsuitable types, shapes and values."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
from damaged_bytes import Generator, damaged
from numpy.typing import NDArray

from guideload import Machine, Motion, Study, run_study, simulate
from guideload.cli.inputs import EXAMPLES
from guideload.simulation.result import Result

COUNT = 64
TIME = np.round(np.arange(COUNT) * 0.01, 2)
PLACE = np.round(0.05 * (1.0 - np.cos(10.0 * TIME)), 6)
SPEED = np.round(np.gradient(PLACE, TIME), 6)
EXTREMES = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 1e-300, 1e160, -1e25, 1e17, 0.0)
SCOPE_HEAD = (
    "Name\tProject\nFile\tC:\\a.csv\nStarttime of export\t132223104000000000\t2020-01-01\t00:00:00\n\n"
    "Name\tposition\tspeed\nData-Type\tREAL64\tREAL64\nSampleTime[ms]\t10\t10\nUnit\tm (Length)\tm/s\n\n"
)


def texts() -> dict[str, bytes]:
    """CSV files in several dialects, and a TwinCAT Scope export, by name."""
    rows = list(zip(TIME.tolist(), PLACE.tolist(), SPEED.tolist(), strict=True))
    counts = np.round(PLACE * 1e6).astype(int)
    dates = [f"2024-01-31 10:00:{10 + i // 100:02d}.{i % 100:02d}0" for i in range(COUNT)]

    def table(head: str, lines: list[str]) -> bytes:
        return "\n".join([head, *lines, ""]).encode()

    return {
        "comma": table("t_s,x_m,v_m_s", [f"{t},{x},{v}" for t, x, v in rows]),
        "german": table("Zeit [s];Weg [m];v [m/s]", [f"{t};{x};{v}".replace(".", ",") for t, x, v in rows]),
        "units": table("t\tposition\tload\ns\tmm\tN", [f"{t}\t{1e3 * x:.3f}\t1" for t, x, _ in rows]),
        "blanks": table("# t_s x_m", [f"{t}  {x}" for t, x, _ in rows]),
        "dates": table(
            'time,"x, y [mm]"', [f"{d},{1e3 * x:.3f}" for d, (_, x, _) in zip(dates, rows, strict=True)]
        ),
        "bare": table("0.0,0.0", [f"{t},{x}" for t, x, _ in rows[1:]]),
        "counts": table("t_ms,enc_counts", [f"{10 * i},{c}" for i, c in enumerate(counts)]),
        "scope": SCOPE_HEAD.encode()
        + table("0\t0.0\t0.0", [f"{1e3 * t:g}\t{x}\t{v}" for t, x, v in rows[1:]]),
    }


def options_of(name: str) -> dict[str, Any]:
    """Reading options that a valid file of this name needs."""
    own: dict[str, dict[str, Any]] = {
        "bare": dict(time="1", column="2", unit="m"),
        "counts": dict(unit="1e-6 m"),
        "comma": dict(column="x_m"),
        "german": dict(column="Weg [m]"),
        "scope": dict(column="position"),
    }
    return own.get(name, {})


def saved(array: Any, **options: Any) -> bytes:
    """A `.npy` file."""
    buffer = io.BytesIO()
    np.save(buffer, array, **options)
    return buffer.getvalue()


def zipped(members: dict[str, bytes], compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A zip archive whose checksums are right."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def npz(rng: Generator) -> bytes:
    """An `.npz` file, damaged as a whole or in a member, with right checksums; or with unsuitable arrays."""
    members = {"t_s.npy": saved(TIME), "x_m.npy": saved(PLACE), "v_m_s.npy": saved(SPEED)}
    way = rng.random()
    if way < 0.5:
        stored = zipfile.ZIP_STORED if rng.random() < 0.5 else zipfile.ZIP_DEFLATED
        return damaged(zipped(members, stored), rng)
    name = list(members)[int(rng.integers(2))]
    members[name] = (
        _damaged_header(members[name], rng) if way < 0.8 else saved(unsuitable(rng), allow_pickle=True)
    )
    if rng.random() < 0.1:
        members["x_m.npy"] = saved(np.zeros(200_000))  # a small zip bomb
    return zipped(members)


def npy(rng: Generator) -> bytes:
    """An `.npy` file, damaged or with an unsuitable array."""
    whole = saved(np.column_stack([TIME, PLACE]))
    way = rng.random()
    if way < 0.4:
        return damaged(whole, rng)
    return _damaged_header(whole, rng) if way < 0.6 else saved(unsuitable(rng), allow_pickle=True)


def mat(rng: Generator) -> bytes:
    """A `.mat` file of version 5, damaged, or with unsuitable variables."""
    from scipy.io import savemat

    members: dict[str, Any] = {"t_s": TIME, "x_m": PLACE, "v_m_s": SPEED, "fs": 100.0, "note": "made"}
    if (way := rng.random()) > 0.6:
        array = unsuitable(rng)
        odd = ({"a": TIME}, [TIME, PLACE], array if array.dtype.kind in "iufcb" else "text")
        members[list(members)[int(rng.integers(5))]] = odd[int(rng.integers(3))]
    buffer = io.BytesIO()
    savemat(buffer, members, do_compression=rng.random() < 0.5, oned_as=str(rng.choice(["row", "column"])))
    return damaged(buffer.getvalue(), rng) if way < 0.6 else buffer.getvalue()


def matlab73(members: dict[str, NDArray[Any]]) -> bytes:
    """A `.mat` file of version 7.3, as MATLAB writes it: HDF5 behind a header, arrays transposed."""
    import h5py

    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=512) as file:
        for name, values in members.items():
            kind = {"f8": "double", "f4": "single", "u2": "char", "b1": "logical"}
            written = file.create_dataset(name, data=np.atleast_2d(values))
            written.attrs["MATLAB_class"] = np.bytes_(kind.get(values.dtype.str[1:], "double"))
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Jan  1 00:00:00 2024 HDF5 schema 1.00 ."
    return head.ljust(124) + b"\x00\x02IM" + buffer.getvalue()[128:]


def mat73(rng: Generator) -> bytes:
    """A damaged `.mat` file of version 7.3."""
    return damaged(matlab73({"t_s": TIME, "x_m": PLACE, "note": np.frombuffer(b"m\0a\0", "u2")}), rng)


def _damaged_header(content: bytes, rng: Generator) -> bytes:
    """A `.npy` file whose header lies, with its length right; or with damaged bytes."""
    changes = (
        *(
            (b"(64,", one)
            for one in (b"(-64,", b"(10**9,", b"(1000000000000000000,", b"(0,", b"(True,", b"('a',", b"(63,")
        ),
        *(
            (b"(64, 2)", one)
            for one in (b"()", b"(64,2,0)", b"(128,)", b"(2, 64)", b"64", b"(99999999999, 99999999999)")
        ),
        *(
            (b"'<f8'", one)
            for one in (b"'>f8'", b"'<c16'", b"'|O'", b"'<M8[us]'", b"'<U2'", b"'|V8'", b"'<f4'", b"'|b1'")
        ),
        *(
            (b"'<f8'", one)
            for one in (b"[('a','<f4'),('b','<f4')]", b"'zzz'", b"None", b"'<i8'", b"('<f8',(9,))", b"'|S0'")
        ),
        *((b"False", one) for one in (b"True", b"1", b"__import__('os')", b"(" * 90, b"'")),
        *((b"{", one) for one in (b"[", b"{'more': 1, ", b"", b"{" * 300)),
        (b"'descr'", b"'dscr'"),
        (b"\x01\x00v\x00", b"\x02\x00v\x00\x00\x00"),
        (b"\x01\x00v\x00", b"\x03\x00v\x00\x00\xff"),
        (b"\x01\x00v\x00", b"\x09\x00v\x00"),
    )
    old, new = changes[int(rng.integers(len(changes)))]
    if old not in content[:128] or rng.random() < 0.2:
        return damaged(content[:128], rng) + content[128:]
    text = content[10:128].rstrip().replace(old, new, 1)
    if old.startswith(b"\x01"):
        return content.replace(old, new, 1)
    return content[:8] + len(text + b"\n").to_bytes(2, "little") + text + b"\n" + content[128:]


def unsuitable(rng: Generator) -> np.ndarray:
    """An array with a type, shape, layout or values that no trace has; some are valid nevertheless."""
    base = np.column_stack([TIME, PLACE])
    makers = (
        *(
            lambda kind=kind: base.astype(kind)
            for kind in ("c16", "f2", "f4", ">f8", "g", "G", "U9", "S9", "?", "i1")
        ),
        *(
            lambda kind=kind: (base * 1e6).astype(kind)
            for kind in ("M8[s]", "m8[us]", ">i8", "u8", "O", "M8[as]", "M8[Y]")
        ),
        *(
            lambda shape=shape: base.reshape(shape)
            for shape in ((2, 64), (128,), (64, 2, 1), (1, 128), (128, 1))
        ),
        *(
            lambda shape=shape: np.zeros(shape)
            for shape in ((), (0,), (0, 2), (64, 0), (1, 1), (7, 2), (64, 1))
        ),
        lambda: np.asfortranarray(base),
        lambda: np.rec.fromarrays(base.T, names="t_s,x_m"),
        lambda: np.zeros(64, [("t_s", "f8"), ("x_m", "f8", (2,))]),
        lambda: np.zeros(64, [("t_s", "f8"), ("x_m", "O")]),
        lambda: np.zeros(64, [("a", [("t", "f8")]), ("x_m", "f8")]),
        lambda: np.array([None, 1.0, "x", 2j] * 16, dtype=object),
        lambda: np.array(["NaT"] * 64, "M8[ns]"),
        lambda: np.column_stack([np.arange(64), np.full(64, 2**63, "u8") + np.arange(64).astype("u8")]),
        lambda: np.column_stack([TIME, PLACE * 10.0 ** rng.integers(-320, 309)]),
        lambda: np.column_stack([TIME * 10.0 ** rng.integers(-320, 309), PLACE]),
        lambda: np.column_stack([TIME, rng.choice(EXTREMES[3:], 64)]),
        lambda: np.column_stack([rng.permutation(TIME), PLACE]),
        lambda: np.column_stack([np.cumsum(10.0 ** rng.uniform(-320, 300, 64)), PLACE]),
    )
    array = makers[int(rng.integers(len(makers)))]()
    if array.dtype.kind == "f" and array.size and rng.random() < 0.4:
        array = array.copy()
        with np.errstate(all="ignore"):
            array.flat[rng.integers(array.size, size=int(rng.choice([1, 3])))] = rng.choice(EXTREMES)
    if rng.random() < 0.3 and array.ndim == 2 and array.shape[1] == 2:
        return np.ascontiguousarray(array[:, int(rng.integers(2))])
    return array


def frame(rng: Generator) -> bytes:
    """A Parquet trace, damaged, or with columns of unsuitable types."""
    columns: dict[str, Any] = {"t_s": pa.array(TIME), "x_m": pa.array(PLACE), "v_m_s": pa.array(SPEED)}
    way = rng.random()
    metadata: dict[bytes, bytes] = {}
    if way > 0.6:
        name = ("t_s", "x_m", "v_m_s")[int(rng.integers(3))]
        columns[name] = _odd_column(rng)
    if way > 0.9:
        texts = (
            b"{",
            b"[]",
            b"{}",
            b'{"index_columns": ["x"], "columns": []}',
            b'{"index_columns": [{}], "columns": [1]}',
            b'{"index_columns": [{"kind": "range", "name": null, "start": 0, "stop": 9, "step": 0}], "columns": []}',
            b'{"index_columns":["t_s"],"columns":[{"name":"t_s","field_name":"t_s","pandas_type":"x","numpy_type":"O","metadata":null}],"column_indexes":[]}',
        )
        metadata[b"pandas"] = texts[int(rng.integers(len(texts)))]
    table = pa.table(columns).replace_schema_metadata(metadata)
    buffer = io.BytesIO()
    codec = ("NONE", "snappy", "zstd")[int(rng.integers(3))]
    parquet.write_table(table, buffer, compression=codec, write_page_checksum=rng.random() < 0.5)
    return damaged(buffer.getvalue(), rng) if way < 0.6 else buffer.getvalue()


def _odd_column(rng: Generator) -> pa.Array:
    numbers = TIME.tolist()
    makers = (
        lambda: pa.array([str(n) for n in numbers]),
        lambda: pa.array([[n] for n in numbers]),
        lambda: pa.array([{"a": n} for n in numbers]),
        lambda: pa.array([str(n).encode() for n in numbers]),
        lambda: pa.array([n > 0.3 for n in numbers]),
        lambda: pa.nulls(COUNT),
        lambda: pa.array([None if i % 9 == 0 else n for i, n in enumerate(numbers)]),
        lambda: pa.array([None if i % 9 == 0 else i for i in range(COUNT)]),
        lambda: pa.array([2**64 - 1 - i for i in range(COUNT)], pa.uint64()),
        lambda: pa.array([f"{n:.2f}" for n in numbers]).cast(pa.decimal128(20, 2)),
        lambda: pa.array([str(n) for n in numbers]).dictionary_encode(),
        lambda: pa.array(range(COUNT), pa.timestamp("s", "Europe/Berlin")),
        lambda: pa.array([10**11 + i for i in range(COUNT)], pa.timestamp("s")),
        lambda: pa.array(range(COUNT), pa.duration("ms")),
        lambda: pa.array(range(COUNT), pa.date32()),
        lambda: pa.array(range(COUNT), pa.time64("us")),
        lambda: pa.array(np.array(numbers, np.float16)),
        lambda: pa.array(rng.choice(EXTREMES, COUNT)),
        lambda: pa.array(np.array(numbers) * 10.0 ** rng.integers(-300, 308)),
    )
    return makers[int(rng.integers(len(makers)))]()


def _example() -> Machine:
    return Machine.from_toml(EXAMPLES / "manipulator.toml")


def result() -> Result:
    """A small result with uncertain, non-uniform and static quantities."""
    return simulate(_example(), Motion.along_x(TIME, np.gradient(SPEED, TIME), source="made"))


def result_files(folder: Path) -> None:
    """The result in both formats that are read, and its netCDF file as another program writes it."""
    one = result()
    one.to_netcdf(folder / "loads.nc")
    one.to_parquet(folder / "loads.parquet")
    one.data.to_netcdf(folder / "foreign.nc", engine="h5netcdf")


def study_folder(folder: Path) -> None:
    """A finished study of 40 samples in two chunks, with histories."""
    motion = Motion.along_x(TIME, np.gradient(SPEED, TIME), source="made")
    vary = [{"path": "body.mass", "distribution": "uniform", "plus_minus": "10 %"}]
    run_study(
        Study(machine=_example(), motion=motion, samples=40, seed=1, histories=2, vary=vary), folder, chunk=20
    )


def nested(depth: int) -> bytes:
    """JSON of this depth."""
    return b"[" * depth + b"1" + b"]" * depth
