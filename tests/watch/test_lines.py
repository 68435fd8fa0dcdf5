"""Lines of text to samples: which are one, and that it does not matter how the bytes arrive."""

import pytest

from guideload.watch.lines import LONGEST, Lines

TEXT = b"time,count\r\n0,10\n\n# pause\n1; -11\r\n 2\t+12\n3 13\nfour,14\n5,15,1\n6,1_6\n7,17.0\n-8,18\n"


def taken(
    text: bytes, *cuts: int, rate: float | None = None
) -> tuple[list[int], list[int], list[int], Lines]:
    """Stamps, counts and numbers of refused lines of a text that arrives in pieces."""
    lines, stamps, counts, refused = Lines(rate), [], [], []
    for start, end in zip((0, *cuts), (*cuts, len(text)), strict=True):
        found = lines.take(text[start:end])
        stamps += found.stamps
        counts += found.counts
        refused += [one.number for one in found.refused]
    return stamps, counts, refused, lines


def test_a_sample_is_two_whole_numbers() -> None:
    stamps, counts, refused, lines = taken(TEXT)
    assert stamps == [0, 1, 2, 3, -8] and counts == [10, -11, 12, 13, 18]
    assert refused == [8, 9, 10, 11] and lines.malformed == 4
    assert lines.position == len(TEXT) and lines.number == 12


def test_it_does_not_matter_where_the_bytes_are_cut() -> None:
    whole = taken(TEXT)[:3]
    for cut in range(len(TEXT)):
        assert taken(TEXT, cut)[:3] == whole
        assert taken(TEXT, cut, min(cut + 3, len(TEXT)))[:3] == whole


def test_stamps_in_seconds_become_ticks() -> None:
    assert taken(b"0.0,1\n0.0010004,2\n2,3\n1e-3,4\n", rate=1e6)[:3] == ([0, 1000, 2_000_000], [1, 2, 3], [4])


def test_a_time_beyond_64_bits_of_ticks_is_no_sample() -> None:
    assert taken(b"999999999999,1\n1,2\n", rate=1e9)[:3] == ([10**9], [2], [1])


def test_numbers_have_64_bits() -> None:
    """Nanoseconds since 1970 have 19 digits."""
    text = b"1790000000000000000,-9223372036854775807\n9223372036854775808,1\n1,9223372036854775808\n"
    assert taken(text)[:3] == ([1_790_000_000_000_000_000], [1 - 2**63], [2, 3])


def test_a_last_line_without_an_end_is_no_sample() -> None:
    """It may be cut off within a number."""
    *_, lines = taken(b"1,10\n2,1")
    refused = lines.end()
    assert refused is not None and refused.number == 2 and lines.malformed == 1
    assert lines.end() is None and lines.position == len(b"1,10\n")


def test_only_the_first_line_can_be_a_heading() -> None:
    assert taken(b"t,n\n1,2\nt,n\n")[2] == [3]
    assert taken(b"\xef\xbb\xbfstamp count\n1,2\n")[2] == []


@pytest.mark.parametrize("piece", [1, 700, 5000])
def test_a_line_without_end_takes_no_memory_and_counts_once(piece: int) -> None:
    text = b"1,1\n" + b"9" * 4 * LONGEST + b"\n2,2\n"
    stamps, _, refused, lines = taken(text, *range(piece, len(text), piece))
    assert stamps == [1, 2] and refused == [2] and lines.malformed == 1
    assert lines.position == len(text) and lines.number == 3
    *_, lines = taken(text[:-6], *range(piece, len(text) - 6, piece))
    assert lines.end() is None and lines.malformed == 1


def test_known_samples_are_skipped() -> None:
    lines = Lines()
    lines.skip = 3
    found = lines.take(b"1,1\nbad\n2,2\n3,3\n4,4\n")
    assert found.stamps == [4] and found.ends == [(20, 5)] and lines.skip == 0
