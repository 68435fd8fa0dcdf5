"""Make the motor speed of the example, python/guideload/examples/manipulator.csv.

Run: python tests/make_example_trace.py
The move: there and back, 1.6 m/s, 2.2 m/s2, jerk 25 m/s3, dwells of 0.6 s, cruise 1 s, at 1 kHz. The motor
turns 12 times per turn of a pinion of 127.3 mm pitch diameter. Its encoder gives 65536 counts per turn (16
bit); the drive logs the counts of each millisecond as a speed with one decimal of rpm, and the speed ripples
by 0.2 rpm rms, as speed signals of a servo drive do. The result is the same on every machine: the noise has a
fixed seed.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SPEED, ACCELERATION, JERK = 1.6, 2.2, 25.0  # m/s, m/s2, m/s3
DWELL, CRUISE, RATE = 0.6, 1.0, 1000.0  # s, s, Hz
GEAR_RATIO, PINION_DIAMETER = 12.0, 0.1273  # -, m
COUNTS, RIPPLE, DECIMALS = 65536, 0.2, 1  # per turn, rpm, of the rpm
FILE = Path(__file__).resolve().parents[1] / "python" / "guideload" / "examples" / "manipulator.csv"


def corners() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (s) and accelerations (m/s2) of the corners of the acceleration, which is linear between them."""
    ramp = ACCELERATION / JERK
    hold = SPEED / ACCELERATION - ramp
    up = [(ramp, 1.0), (hold, 1.0), (ramp, 0.0)]
    down = [(ramp, -1.0), (hold, -1.0), (ramp, 0.0)]
    there = [*up, (CRUISE, 0.0), *down]
    back = [(length, -sign) for length, sign in there]
    pieces = [(0.0, 0.0), (DWELL, 0.0), *there, (DWELL, 0.0), *back, (DWELL, 0.0)]
    lengths, signs = np.array(pieces).T
    return np.cumsum(lengths), ACCELERATION * signs


def motion(time: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Position, velocity and acceleration at the times, exactly."""
    knots, height = corners()
    lengths = np.diff(knots)
    slope = np.diff(height) / lengths
    gain = height[:-1] * lengths + slope * lengths**2 / 2.0
    speed = np.concatenate([[0.0], np.cumsum(gain)])
    step = speed[:-1] * lengths + height[:-1] * lengths**2 / 2.0 + slope * lengths**3 / 6.0
    place = np.concatenate([[0.0], np.cumsum(step)])
    piece = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, lengths.size - 1)
    since = np.minimum(time, knots[-1]) - knots[piece]
    acceleration = height[piece] + slope[piece] * since
    velocity = speed[piece] + height[piece] * since + slope[piece] * since**2 / 2.0
    position = (
        place[piece] + speed[piece] * since + height[piece] * since**2 / 2.0 + slope[piece] * since**3 / 6.0
    )
    return position, velocity, acceleration


def times() -> NDArray[np.float64]:
    """Time stamps of the trace, s."""
    samples: NDArray[np.float64] = np.arange(int(corners()[0][-1] * RATE) + 1) / RATE
    return samples


def main() -> None:
    time = times()
    # The counts of one millisecond around each stamp: this drive stamps the middle of its interval.
    turns = GEAR_RATIO / (np.pi * PINION_DIAMETER)
    before = np.floor(motion(np.maximum(time - 0.5 / RATE, 0.0))[0] * turns * COUNTS)
    after = np.floor(motion(time + 0.5 / RATE)[0] * turns * COUNTS)
    ripple = RIPPLE * np.random.default_rng(1).standard_normal(time.size)
    rpm = (after - before) / COUNTS * RATE * 60.0 + ripple
    rows = [f"{t:.3f},{n:.{DECIMALS}f}".replace(",-0.0", ",0.0") for t, n in zip(time, rpm, strict=True)]
    FILE.parent.mkdir(parents=True, exist_ok=True)
    FILE.write_text("\n".join(["time_s,motor_speed_rpm", *rows]) + "\n", encoding="utf-8", newline="\n")
    print(f"{FILE}: {len(rows)} samples, {FILE.stat().st_size} bytes")


if __name__ == "__main__":
    main()
