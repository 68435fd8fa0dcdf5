"""Damage to the bytes of a file, as by a disk, a broken transfer or an editor; every damage is drawn from a seed."""

from __future__ import annotations

import re
import struct

import numpy as np

Generator = np.random.Generator

EXTREME_BYTES = [
    *(struct.pack("<d", value) for value in (np.nan, np.inf, 1e308, -1e308, 5e-324, -0.0)),
    *(value.to_bytes(8, "little") for value in (0, 1, 2**31, 2**32 - 1, 2**63 - 1, 2**63, 2**64 - 1)),
]
EXTREME_CELLS = [
    *("", " ", "nan", "-inf", "inf", "1e308", "-1e308", "1e400", "5e-324", "1e-300", "-0", "0", "7" * 400),
    *("x", "True", "0x10", "1,2", "1.2.3", "1'000", "1e", "--1", "1_000", "9223372036854775807", "-1e20"),
    *("2024-01-31 10:00:00", "31.12.9999 23:59:59", "0001-01-01 00:00:00", "25:61:61"),
    *("#N/A", "1e25", "1e17"),
    *('"', '""', '"1', '1"', "'", "\x00", "\x1b[2J", "\u0663"),
    *("é", "\ufeff", "\u2028", ";", "\t", "x [nan]", "t [1/0]"),
    *("A1" * 66000, '"' + "1" * 131072 + '"', '"' + ",;\t" * 50000 + '"', "{0}", "%s"),
    *("#", "//", "Name", "EOF"),
]


def damaged(content: bytes, rng: Generator) -> bytes:
    """The content with one to three kinds of damage to its bytes."""
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        content = KINDS[int(rng.integers(len(KINDS)))](content, rng)
    return content


def damaged_text(content: bytes, rng: Generator) -> bytes:
    """Text with damage to its cells, lines or encoding, or to its bytes."""
    if rng.random() < 0.3:
        return damaged(content, rng)
    for _ in range(int(rng.choice([1, 1, 2, 4]))):
        content = TEXT_KINDS[int(rng.integers(len(TEXT_KINDS)))](content, rng)
    return content


def _place(content: bytes, rng: Generator) -> tuple[int, int]:
    """Start and end of a piece; its length is spread over the powers of two."""
    start = int(rng.integers(len(content) + 1))
    return start, min(len(content), start + int(2 ** rng.uniform(0, np.log2(len(content) + 2))))


def _cut(content: bytes, rng: Generator) -> bytes:
    return content[: int(rng.integers(len(content) + 1))]


def _head_lost(content: bytes, rng: Generator) -> bytes:
    return content[int(rng.integers(len(content) + 1)) :]


def _flipped(content: bytes, rng: Generator) -> bytes:
    changed = bytearray(content)
    for place in rng.integers(len(content), size=int(rng.choice([1, 1, 2, 8]))) if content else ():
        changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _filled(content: bytes, rng: Generator) -> bytes:
    start, end = _place(content, rng)
    return content[:start] + bytes([int(rng.choice([0, 255]))]) * (end - start) + content[end:]


def _random(content: bytes, rng: Generator) -> bytes:
    start, end = _place(content, rng)
    return content[:start] + rng.bytes(end - start) + content[end:]


def _swapped(content: bytes, rng: Generator) -> bytes:
    size = int(rng.choice([16, 64, 512, 4096]))
    blocks = [content[i : i + size] for i in range(0, len(content), size)]
    if len(blocks) > 1:
        one, other = rng.integers(len(blocks), size=2)
        blocks[one], blocks[other] = blocks[other], blocks[one]
    return b"".join(blocks)


def _doubled(content: bytes, rng: Generator) -> bytes:
    start, end = _place(content, rng)
    return content[:end] + content[start:]


def _left_out(content: bytes, rng: Generator) -> bytes:
    start, end = _place(content, rng)
    return content[:start] + content[end:]


def _extreme(content: bytes, rng: Generator) -> bytes:
    start = int(rng.integers(len(content) + 1)) // 8 * 8 + int(rng.choice([0, 0, 4, 1]))
    value = EXTREME_BYTES[int(rng.integers(len(EXTREME_BYTES)))][: int(rng.choice([2, 4, 8]))]
    return content[:start] + value + content[start + len(value) :]


KINDS = [
    *(_cut, _head_lost, _flipped, _flipped, _filled, _random),
    *(_swapped, _doubled, _left_out, _extreme, _extreme),
]


def _cell(content: bytes, rng: Generator) -> bytes:
    cells = list(re.finditer(rb"[^,;\t|\r\n]+", content))
    if not cells:
        return content
    cell = (
        cells[int(rng.integers(len(cells)))]
        if rng.random() < 0.7
        else cells[int(rng.integers(min(8, len(cells))))]
    )
    text = EXTREME_CELLS[int(rng.integers(len(EXTREME_CELLS)))].encode()
    return content[: cell.start()] + text + content[cell.end() :]


def _column(content: bytes, rng: Generator) -> bytes:
    """A whole column replaced, multiplied or shifted into an extreme range."""
    lines = content.split(b"\n")
    sign = next(
        (one for one in (b"\t", b";", b",", b"|", b" ") if one in lines[-2 if len(lines) > 1 else 0]), b","
    )
    column, exponent = int(rng.integers(3)), int(rng.choice([-320, -300, -160, -30, 15, 30, 160, 300, 306]))
    text = EXTREME_CELLS[int(rng.integers(len(EXTREME_CELLS)))].encode() if rng.random() < 0.3 else None
    for i, line in enumerate(lines):
        cells = line.split(sign)
        if column < len(cells) and re.fullmatch(rb"-?[\d.]+\r?", cells[column]):
            cells[column] = text if text is not None else cells[column].rstrip(b"\r") + b"e%d" % exponent
            lines[i] = sign.join(cells)
    return b"\n".join(lines)


def _line(content: bytes, rng: Generator) -> bytes:
    lines = content.split(b"\n")
    at = int(rng.integers(len(lines))) if rng.random() < 0.7 else 0
    extra = (
        *(b"", b'"', b",,,,,,", b"# note", b"x\xff\xfe"),
        *(lines[at], lines[-1], lines[at] * 3, b"\x00" * 9, b"1 2 3"),
    )
    action = int(rng.integers(3))
    chosen = extra[int(rng.integers(len(extra)))]
    lines[at : at + (action < 2)] = [chosen] if action else []
    return b"\n".join(lines)


def _line_ends(content: bytes, rng: Generator) -> bytes:
    ends = (b"\r\n", b"\r", b"\n\n", b"\r\r\n", b"", b"\x0b", b"\x85", b"\x00")
    end = ends[int(rng.integers(len(ends)))]
    share = float(rng.choice([1.0, 0.5, 0.05]))
    lines = content.split(b"\n")
    mixed = [line + (end if rng.random() < share else b"\n") for line in lines]
    return b"".join(mixed)


def _encoded(content: bytes, rng: Generator) -> bytes:
    codes = ("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig", "utf-7", "cp037")
    coded = content.decode("latin-1").encode(codes[int(rng.integers(len(codes)))], "replace")
    return _flipped(coded, rng) if rng.random() < 0.3 else coded


def _few_lines(content: bytes, rng: Generator) -> bytes:
    lines = content.split(b"\n")
    return b"\n".join(lines[: int(rng.integers(0, 12))])


def _ragged(content: bytes, rng: Generator) -> bytes:
    lines = content.split(b"\n")
    for at in rng.integers(len(lines), size=3):
        cells = re.split(rb"([,;\t|])", lines[at])
        lines[at] = b"".join(cells[: int(rng.integers(len(cells) + 1))]) + (b",1" * int(rng.integers(3)))
    return b"\n".join(lines)


TEXT_KINDS = [_cell, _cell, _cell, _column, _column, _line, _line_ends, _encoded, _few_lines, _ragged]
