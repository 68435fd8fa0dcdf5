"""Counters that wrap around: unwrapping is the inverse of wrapping, and does nothing to what did not wrap."""

import numpy as np
import pytest
from trace_files import has_note, refuses

from guideload.base.errors import TraceError
from guideload.traces.content.counters import unwrap
from guideload.traces.reading import read_trace

TIME = np.arange(4000) * 0.001


def wrapped(counts: np.ndarray, bits: int, signed: bool) -> np.ndarray:
    low = -(1 << (bits - 1)) if signed else 0
    return (counts - low) % (1 << bits) + low


def travel(bits: int, turns: float) -> np.ndarray:
    """Counts of an axis that goes `turns` times through the counter's range and back, in a smooth move."""
    return np.round(turns * 2.0**bits * 0.5 * (1.0 - np.cos(2.0 * np.pi * TIME / TIME[-1]))).astype(np.int64)


@pytest.mark.parametrize("bits", [16, 24, 32])
@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize("turns", [0.3, 1.7, 40.0])
@pytest.mark.parametrize("start", [0, 12345, -7, 32_767])
def test_unwrapping_undoes_wrapping(bits, signed, turns, start):
    true = travel(bits, turns) + start
    given = wrapped(true, bits, signed)
    found = unwrap(given)
    assert np.array_equal(found.counts - found.counts[0], true - true[0])
    assert found.counts[0] == given[0]
    assert found.wraps.tolist() == (np.flatnonzero(np.abs(np.diff(given)) > 1 << (bits - 1)) + 1).tolist()
    assert found.bits == (bits if found.wraps.size else 0)
    assert np.array_equal(unwrap(given, bits).counts, found.counts)


def test_what_did_not_wrap_stays():
    rng = np.random.default_rng(2)
    for counts in (travel(16, 0.9), travel(40, 0.9), rng.integers(0, 50_000, 1000), np.zeros(9, np.int64)):
        assert np.array_equal(unwrap(counts).counts, counts) and unwrap(counts).bits == 0
    spike = travel(16, 0.4)
    spike[2000] = 65_000 - spike[2000]  # far off, but not by the whole range
    assert unwrap(spike).bits == 0
    wrapping = wrapped(travel(16, 3.0), 16, False)
    assert np.array_equal(unwrap(wrapping, 0).counts, wrapping)


def test_a_width_that_cannot_be_is_refused():
    refuses("counts from 0 to 70000 do not fit into 16 bits", unwrap, np.array([0, 70_000]), 16)
    refuses("counter_bits: expected 0 or 2 to 62, got 1", unwrap, np.array([0, 1]), 1)


@pytest.mark.parametrize("signed", [False, True])
def test_a_trace_of_counts_is_that_of_the_travel(signed):
    true = travel(16, 3.0)
    plain = read_trace({"t_s": TIME, "encoder_counts": true}, unit="1 um")
    counts = wrapped(true + 500, 16, signed)
    trace = read_trace({"t_s": TIME, "encoder_counts": counts}, unit="1 um")
    assert np.array_equal(trace.value, plain.value)
    assert has_note(trace, "16-bit counter wrapped around 6 times, made continuous, index")
    with pytest.raises(TraceError, match="jumps that motion cannot make"):
        read_trace({"t_s": TIME, "encoder_counts": counts}, unit="1 um", counter_bits=0)
    with pytest.raises(TraceError, match="--counter-bits"):
        read_trace({"t_s": TIME, "encoder_counts": wrapped(true, 14, signed)}, unit="1 um")
    odd = wrapped(true, 14, signed)  # a width that nobody would guess
    trace = read_trace({"t_s": TIME, "encoder_counts": odd}, unit="1 um", counter_bits=14)
    assert np.array_equal(trace.value, plain.value)
    narrow = counts.astype(np.int16 if signed else np.uint16)  # their differences overflow
    assert np.array_equal(read_trace({"t_s": TIME, "x_counts": narrow}, unit="1 um").value, plain.value)
