"""Time and memory of a run over a long record: `python tests/benchmarks/long_record.py [SAMPLES]`.

Writes a Parquet file of moves there and back at 1 kHz, encoder quantum 2 um, and runs the cart over it in blocks; then
the same over a tenth of it, to show that the time is linear and the memory bounded.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from guideload import LongRun, motion_blocks

ROWS = 1 << 20  # written at once
QUANTUM = 2e-6  # m


def write(file: Path, count: int) -> None:
    """A record of `count` samples."""
    schema = pa.schema([("t [s]", pa.float64()), ("x [m]", pa.float64())])
    with pq.ParquetWriter(file, schema) as writer:
        for start in range(0, count, ROWS):
            stamps = np.arange(start, min(start + ROWS, count)) * 1e-3
            phase = np.clip(np.abs((stamps / 2.0) % 2.0 - 1.0) * 1.4 - 0.2, 0.0, 1.0)
            position = 0.4 * phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2)
            columns = [stamps, np.round(position / QUANTUM) * QUANTUM]
            writer.write_table(pa.table(columns, schema=schema))


def run(file: Path) -> None:
    """Run the cart over a record, and print time and memory."""
    import lives

    began = time.perf_counter()
    long = LongRun(lives.cart())
    for block in motion_blocks(file):
        long.add(block)
    taken = time.perf_counter() - began
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    per_sample = 1e6 * taken / long.samples
    print(
        f"{long.samples:>11} samples, {len(long.blocks):>4} blocks: {taken:7.1f} s, {per_sample:.2f} us per sample"
    )
    print(f"{'':11} at most {memory:.0f} MiB; life {1e-3 * long.machine_life:.6g} km")


def main() -> None:
    if len(sys.argv) > 2:
        run(Path(sys.argv[2]))
        return
    most = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000
    with tempfile.TemporaryDirectory() as folder:
        for count in (most // 10, most):
            file = Path(folder) / "record.parquet"
            write(file, count)
            # In a process of its own, so that the memory is that of this run.
            subprocess.run([sys.executable, __file__, "run", str(file)], check=True)


if __name__ == "__main__":
    main()
