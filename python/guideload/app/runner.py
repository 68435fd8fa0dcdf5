"""The loop of runs: one at a time, at most one waiting, the newest state wins."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import suppress
from functools import partial

from guideload.app.answer import Answer, Refusal, Solver, Step
from guideload.app.state import State

SHORT = 0.1  # s: a run that takes longer shows its progress, and ends when the state changes
REST = 0.25  # s without a change, after which the answer is judged


class Overtaken(Exception):
    """The state changed, so the work is not needed any more."""


class Runner:
    """Answers the newest state, in a thread of its own, so that the page stays usable.

    deliver: called with each answer; progress: with what is being done by a run that takes longer than `SHORT`, and
    with "" at its end. Both are called in the loop of the page. Between two parts of a run (machine, motion, loads,
    life, drive, judgement) it ends if the state has changed and it already takes longer than `SHORT`.
    """

    def __init__(
        self, solver: Solver, deliver: Callable[[Answer | Refusal], None], progress: Callable[[str], None]
    ) -> None:
        self.solver, self.deliver, self.progress = solver, deliver, progress
        self.state: State | None = None
        self.serial, self.answered = 0, 0  # of the newest state, and of the last one that was answered
        self.changed = asyncio.Event()
        self.runs, self.judgements = (
            ThreadPoolExecutor(1, f"guideload {name}") for name in ("run", "judgement")
        )
        self.task: asyncio.Task[None] | None = None

    def request(self, state: State) -> None:
        """Answer this state next; one that waits is forgotten."""
        self.state, self.serial = state, self.serial + 1
        self.changed.set()
        if self.task is None or self.task.done():
            self.task = asyncio.create_task(self._work())

    @property
    def is_behind(self) -> bool:
        """Whether the answer of the newest state is yet to come."""
        return self.answered != self.serial and self.task is not None and not self.task.done()

    async def _work(self) -> None:
        while True:
            serial, state = self.serial, self.state
            assert state is not None
            self.changed.clear()
            with suppress(Overtaken):
                answer = await self._run(self.runs, partial(self.solver.answer, state), serial, SHORT)
                self.answered = serial
                self.deliver(answer)
                with suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self.changed.wait(), REST)
                if serial == self.serial and isinstance(answer, Answer):
                    await self._judge(answer, serial)
            if serial == self.serial:
                return

    async def _judge(self, answer: Answer, serial: int) -> None:
        """Judge an answer; that of a long record takes a minute, so a newer state does not wait for its end."""
        work = self._run(self.judgements, partial(self.solver.judged, answer), serial, 0.0)
        judging, newer = asyncio.create_task(work), asyncio.create_task(self.changed.wait())
        await asyncio.wait((judging, newer), return_when=asyncio.FIRST_COMPLETED)
        newer.cancel()
        if serial == self.serial:
            self.deliver(await judging)
        else:
            judging.add_done_callback(lambda done: done.exception())  # of what is overtaken nobody asks

    async def _run(
        self, thread: Executor, work: Callable[[Step], Answer | Refusal], serial: int, patience: float
    ) -> Answer | Refusal:
        """Work in a thread; what is overtaken ends at its next step, once it takes longer than `patience`."""
        loop, start, is_long = asyncio.get_running_loop(), time.perf_counter(), False

        def step(name: str) -> None:
            nonlocal is_long
            elapsed = time.perf_counter() - start
            if serial != self.serial and elapsed > patience:
                raise Overtaken
            if elapsed > SHORT:
                is_long = True
                loop.call_soon_threadsafe(self.progress, name)

        try:
            return await loop.run_in_executor(thread, work, step)
        finally:
            if is_long:
                self.progress("")
