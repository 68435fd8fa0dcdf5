"""Lines of text to samples: a time stamp and a counter in each line."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from guideload.base.errors import shortened

NUMBER = rb"[+-]?\d{1,19}"  # of 64 bits, as nanoseconds since 1970
GAP = rb"(?:[ \t]*[,;][ \t]*|[ \t]+)"
TICKS = re.compile(rb"[ \t]*(%b)%b(%b)[ \t]*\r?" % (NUMBER, GAP, NUMBER))
SECONDS = re.compile(rb"[ \t]*([+-]?\d{1,12}(?:\.\d{0,18})?)%b(%b)[ \t]*\r?" % (GAP, NUMBER))
BLANK = re.compile(rb"[ \t\r]*(?:#.*)?")
HEADING = re.compile(rb"(?:\xef\xbb\xbf)?[ \t\"]*[A-Za-z].*")
LONGEST = 1000  # bytes of a line
LARGEST = 2**63  # stamps and counts are kept as whole numbers of 64 bits


@dataclass(frozen=True)
class Refused:
    """A line that is no sample."""

    number: int
    text: str


@dataclass
class Samples:
    """Samples of some lines: stamps [ticks], counts, and for each the position in the input after its line."""

    stamps: list[int] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    ends: list[tuple[int, int]] = field(default_factory=list)  # bytes, lines
    refused: list[Refused] = field(default_factory=list)


class Lines:
    """Cuts an input into lines, and these into samples.

    A line has a time stamp and a counter with a comma, semicolon, blank or tab between. Empty lines, lines that begin
    with # and a heading in the first line are no samples. Any other line is refused and counted.

    ticks_per_second  of stamps in seconds; None: stamps are whole numbers, in ticks
    position, number  bytes and lines taken from this input so far
    skip              number of samples to leave out, because the monitor has them already
    """

    def __init__(self, ticks_per_second: float | None = None) -> None:
        self.ticks_per_second = ticks_per_second
        self.pattern = TICKS if ticks_per_second is None else SECONDS
        self.malformed = 0
        self.skip = 0
        self.begin()

    def begin(self, position: int = 0, number: int = 0) -> None:
        """Begin at the start of an input, or at the place where reading goes on."""
        self.position, self.number = position, number
        self._rest, self._is_too_long = b"", False

    def end(self) -> Refused | None:
        """The last line of an input without a line end: it may be cut off within a number, so it is no sample."""
        rest, self._rest = self._rest, b""
        is_counted = self._is_too_long or BLANK.fullmatch(rest) is not None
        return None if is_counted else self._refuse(rest, self.number + 1)

    def take(self, data: bytes) -> Samples:
        """The samples of all lines that end in these bytes."""
        found = Samples()
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            self.number += 1
            self.position += len(line) + 1
            if self._is_too_long:
                self._is_too_long = False
            else:
                self._take(line, found)
        if len(self._rest) > LONGEST:
            if not self._is_too_long:
                found.refused.append(self._refuse(self._rest, self.number + 1))
            self._is_too_long = True
            self.position += len(self._rest)
            self._rest = b""
        return found

    def _take(self, line: bytes, found: Samples) -> None:
        sample = self.pattern.fullmatch(line)
        if sample is None:
            is_heading = self.number == 1 and HEADING.fullmatch(line)
            if not is_heading and BLANK.fullmatch(line) is None:
                found.refused.append(self._refuse(line, self.number))
            return
        stamp, count = sample.groups()
        rate = self.ticks_per_second
        ticks = int(stamp) if rate is None else round(float(stamp) * rate)
        if max(abs(ticks), abs(int(count))) >= LARGEST:
            found.refused.append(self._refuse(line, self.number))
            return
        if self.skip:
            self.skip -= 1
            return
        found.stamps.append(ticks)
        found.counts.append(int(count))
        found.ends.append((self.position, self.number))

    def _refuse(self, line: bytes, number: int) -> Refused:
        self.malformed += 1
        return Refused(number, shortened(line[:LONGEST].decode("utf-8", "replace"), 40))
