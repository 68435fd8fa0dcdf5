"""Make the motor speed of the example, python/guideload/examples/manipulator.csv.

Run: python tests/helpers/make_example_trace.py
The move: there and back, 1.6 m/s, 4 m/s2, jerk 500 m/s3 (ramps of 8 ms), dwells of 0.6 s, cruise 1 s, at 1 kHz. The
motor turns 12 times per turn of a pinion of 127.3 mm pitch diameter. Its encoder gives 65536 counts per turn (16
bit); the drive logs the counts of each millisecond as a speed with one decimal of rpm, and the speed ripples
by 0.2 rpm rms, as speed signals of a servo drive do. The result is the same on every machine: the noise has a
fixed seed.
"""

from pathlib import Path

import numpy as np
from moves import BRISK

RATE = 1000.0  # Hz
GEAR_RATIO, PINION_DIAMETER = 12.0, 0.1273  # -, m
COUNTS, RIPPLE, DECIMALS = 65536, 0.2, 1  # per turn, rpm, of the rpm
FILE = Path(__file__).resolve().parents[2] / "python" / "guideload" / "examples" / "manipulator.csv"


def main() -> None:
    time = BRISK.times(RATE)
    # The counts of one millisecond around each stamp: this drive stamps the middle of its interval.
    turns = GEAR_RATIO / (np.pi * PINION_DIAMETER)
    before = np.floor(BRISK.motion(np.maximum(time - 0.5 / RATE, 0.0))[0] * turns * COUNTS)
    after = np.floor(BRISK.motion(time + 0.5 / RATE)[0] * turns * COUNTS)
    ripple = RIPPLE * np.random.default_rng(1).standard_normal(time.size)
    rpm = (after - before) / COUNTS * RATE * 60.0 + ripple
    rows = [f"{t:.3f},{n:.{DECIMALS}f}".replace(",-0.0", ",0.0") for t, n in zip(time, rpm, strict=True)]
    FILE.parent.mkdir(parents=True, exist_ok=True)
    FILE.write_text("\n".join(["time_s,motor_speed_rpm", *rows]) + "\n", encoding="utf-8", newline="\n")
    print(f"{FILE}: {len(rows)} samples, {FILE.stat().st_size} bytes")


if __name__ == "__main__":
    main()
