"""The monitor file: what `guideload monitor build` writes is the same monitor again; and what `push` accepts."""

from pathlib import Path

import numpy as np
import pytest
from watched import SETTINGS, new_monitor, samples, write_monitor

from guideload.base.errors import ArgumentError, ConfigError
from guideload.monitor import Monitor


def test_the_monitor_of_a_file_is_the_one_that_was_written(tmp_path: Path) -> None:
    monitor = Monitor.from_toml(write_monitor(tmp_path))
    assert monitor.constants() == new_monitor().constants()  # with the checksum of all constants
    assert monitor.settings == SETTINGS and monitor.carriages == ["1a", "1b", "2a", "2b"]


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("period", '"1 mm"', "row 3: period"),
        ("lag", "300", "row 5: lag: expected a whole number from 0 to 200, got 300"),
        ("lag", "true", "row 5: lag: expected a whole number from 0 to 200, got true"),
        ("ticks", '"1"', 'ticks: expected a whole number from 1 to 16777216, got "1"'),
        ("smoother", "{ order = 3.0, time_constant = 2.2 }", "smoother.order: expected a whole number"),
        ("smoother", "{ order = 9, time_constant = 2.2 }", "smoother.order"),
        ("machine", '"none.toml"', "row 2: machine.*there is no"),
        ("period", "10.0", "row .: max_acceleration: .*check period and travel_per_count"),
        ("spare", "1", "known key"),
    ],
)
def test_a_wrong_value_is_named(key: str, value: str, message: str, tmp_path: Path) -> None:
    path = write_monitor(tmp_path)
    lines = [line for line in path.read_text().splitlines() if not line.startswith(f"{key} =")]
    number = next(
        (n for n, line in enumerate(path.read_text().splitlines()) if line.startswith(f"{key} =")), 12
    )
    lines.insert(number, f"{key} = {value}")
    path.write_text("\n".join(lines))
    with pytest.raises(ConfigError, match=message):
        Monitor.from_toml(path)


def test_push_takes_any_whole_numbers_and_wraps_them() -> None:
    stamps, counts = samples()
    plain, shifted, listed = new_monitor(), new_monitor(), new_monitor()
    expected = plain.push(stamps, counts)
    for one, other in zip(expected, shifted.push(stamps - 2**40 - 5, counts + 2**33), strict=True):
        assert np.array_equal(one, other)
    assert np.array_equal(listed.push(stamps.tolist(), counts.astype(np.uint32))[2], expected[2])
    taken, periods, loads = new_monitor().push([], [])
    assert (taken.shape, periods.shape, loads.shape) == ((0,), (0,), (0, 4, 5))


def test_push_until_the_limit_is_the_same_push_in_parts() -> None:
    stamps, counts = samples()
    whole, parted = new_monitor(), new_monitor()
    _, _, expected = whole.push(stamps, counts)
    loads, done = [], 0
    while done < stamps.size:
        taken, periods, found = parted.push(stamps[done:], counts[done:], until_limit=True)
        assert taken.shape == periods.shape == found.shape[:1]
        loads.append(found)
        done += taken.size
        exceeded = sum(parted.totals()["limit_exceeded"])
        assert exceeded == len(loads) or (done == stamps.size and exceeded == len(loads) - 1)
    assert np.array_equal(np.concatenate(loads), expected) and parted.totals() == whole.totals()
    assert len(loads) > 2


@pytest.mark.parametrize(
    ("stamps", "counts", "message"),
    [
        ([0.0, 0.1], [1, 2], "stamps: expected a row of whole numbers.*np.round"),
        ([0, 1], [1.5, 2.5], "counts: expected a row of whole numbers"),
        ([0, 1], [1], "got 2 and 1"),
        ([[0, 1]], [[1, 2]], "shape"),
    ],
)
def test_other_samples_are_refused(stamps: list[float], counts: list[float], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        new_monitor().push(stamps, counts)
