"""A watch: samples from an input through the monitor into the store, the curves and what reacts to a limit."""

from __future__ import annotations

import time
from bisect import bisect_left
from collections.abc import Callable
from typing import Any

import numpy as np

from guideload.monitor.monitor import Monitor
from guideload.watch.inputs import Input
from guideload.watch.lines import Lines, Refused
from guideload.watch.reaction import Crossing
from guideload.watch.status import LoadCurves, WatchState, status
from guideload.watch.store import Store

WAIT = 0.2  # s to wait for bytes of the input; after a signal the watch ends within this time
RECORD = 10.0  # s between two records
RATE = 1.0  # s over which the samples per second are counted


class Session:
    """A running watch.

    on_crossing: called at each sample at which carriages rise above their limit; True ends the watch after it.
    on_refused: called at each line that is no sample; True ends the watch before it.
    say: called with each message for the user.
    """

    def __init__(
        self,
        monitor: Monitor,
        source: Input,
        lines: Lines,
        store: Store | None = None,
        *,
        on_crossing: Callable[[Crossing], bool] = lambda _: False,
        on_refused: Callable[[Refused], bool] = lambda _: False,
        say: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.monitor, self.source, self.lines, self.store = monitor, source, lines, store
        self.on_crossing, self.on_refused, self.say = on_crossing, on_refused, say
        self.curves = LoadCurves(monitor.settings.period)
        self.period_now, self.loads = -1, np.zeros((len(monitor.carriages), 5))
        self.samples = 0
        self.per_second = 0.0
        self._counted, self._since = 0, time.monotonic()
        self._saved = 0.0
        if store is not None:
            self._go_on(store.place)
            self._save()  # so that samples of the journal count from a place in this input

    def _go_on(self, place: dict[str, Any]) -> None:
        """Go on at the place in the file at which the record was written."""
        if self.source.find(place):
            self.lines.begin(place["position"], place["line"])
            self.lines.skip = place.get("ahead", 0)
        elif "file" in place:
            self.say(f"{self.source.name} is not what was read before, so it is read from its start")

    def step(self) -> bool:
        """Take what comes from the input within a short time; False at its end, or where a crossing ends the watch."""
        if self.store is not None:
            self.store.end_hour(self._place())
            if time.monotonic() - self._saved >= RECORD:
                self._save()
        found = self.source.read(WAIT)
        self._count()
        if isinstance(found, bytes):
            goes_on = self._take(found)
            # The start of a file has no checksum, so the place after its first samples is written at once.
            if self.store is not None and self.store.place.get("position") == 0 < self.lines.position:
                self._save()
            return goes_on
        if (cut := self.lines.end()) is not None and self.on_refused(cut):
            return False
        if found is None:
            return False
        self.lines.begin()
        self.lines.skip = 0
        if self.store is not None:
            self._save()
        self.say(found)
        return True

    def _take(self, data: bytes) -> bool:
        place, skip = (self.lines.position, self.lines.number), self.lines.skip
        found = self.lines.take(data)
        last = next((refused for refused in found.refused if self.on_refused(refused)), None)
        size = len(found.stamps)
        if last is not None:  # the samples before this line count
            size = bisect_left(found.ends, last.number, key=lambda end: end[1])
        stamps, counts = (np.array(values[:size], np.int64) for values in (found.stamps, found.counts))
        done = 0
        while done < stamps.size:
            before = self.monitor.totals()["limit_exceeded"]
            pushed = self.monitor.push(stamps[done:], counts[done:], until_limit=True)
            taken, periods, loads = pushed
            first, done = done, done + taken.size
            self.samples += taken.size
            self.period_now, self.loads = int(periods[-1]), loads[-1]
            if self.store is not None:
                self.store.append(stamps[first:done], counts[first:done], pushed)
            self.curves.add(periods, loads)
            crossing = self._crossing(before)
            if crossing is not None and self.on_crossing(crossing):
                self.lines.begin(*found.ends[done - 1])
                return False
        if last is not None and size:
            self.lines.begin(*found.ends[size - 1])
        elif last is not None:
            self.lines.begin(*place)
            self.lines.skip = skip
        return last is None

    def _crossing(self, before: list[int]) -> Crossing | None:
        """The crossing at the last sample, if some carriage is above its limit more often than before."""
        after = self.monitor.totals()["limit_exceeded"]
        rose = [index for index, (a, b) in enumerate(zip(before, after, strict=True)) if b > a]
        if not rose:
            return None
        names, forces = self.monitor.carriages, self.loads[:, :2].tolist()
        return Crossing(
            self.period_now,
            self.period_now * self.monitor.settings.period,
            [names[index] for index in rose],
            [(forces[index][0], forces[index][1]) for index in rose],
        )

    def _place(self) -> dict[str, Any]:
        place = self.source.place(self.lines.position)
        return place and {**place, "line": self.lines.number, "ahead": self.lines.skip}

    def _save(self) -> None:
        assert self.store is not None
        self.store.save(self._place())
        self._saved = time.monotonic()

    def _count(self) -> None:
        """Count the samples per second."""
        elapsed = time.monotonic() - self._since
        if elapsed >= RATE:
            self.per_second = (self.samples - self._counted) / elapsed
            self._counted, self._since = self.samples, time.monotonic()

    def status(self) -> dict[str, Any]:
        """The state at this instant, see `watch.status`."""
        return status(self.monitor, self.period_now, self.loads, self.lines.malformed, self.per_second)

    def show(self, ended: bool = False) -> None:
        """Write the state into the folder of the watch, for the page."""
        if self.store is not None:
            state = WatchState(
                written=time.time(), ended=ended, status=self.status(), points=self.curves.points
            )
            state.write(self.store.folder)

    def close(self) -> None:
        """Write all that was received, and end."""
        if self.store is not None:
            self.store.close(self._place())
            self.show(ended=True)
        self.source.close()
