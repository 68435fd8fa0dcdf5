"""What all tabs of the page share: the session, the loop of runs, and the last answers."""

from __future__ import annotations

import asyncio

from guideload.app.answer import Answer, Problem, Refusal, Solver
from guideload.app.runner import Runner
from guideload.app.state import Session

WAIT = 0.02  # s between two looks for an answer


class Part:
    """A view of the page, with a method for each kind of change; in_view: whether its tab shows it."""

    in_view = False

    def show_state(self) -> None:
        """The state changed."""

    def show_answer(self) -> None:
        """There is a new answer."""

    def show_progress(self, what: str) -> None:
        """A long run does `what`; "" at its end."""


class Hub:
    """Session and answers.

    answer      of the newest state that was answered, or why it has none
    last_valid  the last answer that is not a refusal; None before there is one
    """

    def __init__(self, session: Session) -> None:
        self.session, self.solver = session, Solver(session)
        self.views: list[Part] = []
        self.answer: Answer | Refusal | None = None
        self.last_valid: Answer | None = None
        self.runner: Runner | None = None
        session.listeners.append(self._changed)

    def start(self) -> None:
        """Begin to answer; called in the loop of the page."""
        self.runner = Runner(self.solver, self._deliver, self._progress)
        self.runner.request(self.session.state)

    def look(self) -> None:
        """Take over what another program changed: the files of the page, and those that they name."""
        self.session.look()
        if self.runner is not None and self.solver.is_outdated:
            self.runner.request(self.session.state)

    async def newest(self) -> Answer | None:
        """The answer of the present state, as soon as it is there; None if the state has none."""
        while self.runner is not None and self.runner.is_behind:
            await asyncio.sleep(WAIT)
        present = self.answer is not None and self.answer.state == self.session.state
        return self.answer if present and isinstance(self.answer, Answer) else None

    def _changed(self) -> None:
        if self.runner is not None and self.runner.state != self.session.state:
            self.runner.request(self.session.state)  # first: no view can keep an old answer on the page
        for view in list(self.views):
            view.show_state()

    @property
    def problems(self) -> tuple[Problem, ...]:
        """Why the newest state has no answer."""
        return self.answer.problems if isinstance(self.answer, Refusal) else ()

    def _deliver(self, answer: Answer | Refusal) -> None:
        self.answer = answer
        if isinstance(answer, Answer):
            self.last_valid = answer
        if isinstance(answer, Refusal) or answer.report is not None:
            self.session.keep_after_drag()
        for view in list(self.views):
            view.show_answer()

    def _progress(self, what: str) -> None:
        for view in list(self.views):
            view.show_progress(what)
