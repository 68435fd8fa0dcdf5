"""Planned moves: a motion from distances and limits, of a motion file or in code."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, PrivateAttr, model_validator

from guideload.base.arguments import checked
from guideload.base.config import ConfigModel, exactly, in_range, optional, whole
from guideload.base.errors import (
    ArgumentError,
    ConfigError,
    Problem,
    ValueRefused,
    problem_at,
    refused_at,
    shown,
)
from guideload.base.file_model import FileModel
from guideload.base.number_text import counted, digits
from guideload.base.ranges import ACCELERATION, JERK, LENGTH, PERIOD, POSITION, RATE, SPEED, TIME
from guideload.motion.motion import Motion
from guideload.motion.phase_forces import PhaseForce
from guideload.motion.profiles import (
    DEVIATION,
    IN_TIME,
    LINES,
    Limits,
    Pieces,
    Profile,
    fastest_move,
    move_in_time,
)
from guideload.motion.sampling import Leg, grid_step, sampled

LimitName = Literal["speed", "acceleration", "deceleration", "jerk"]
MOST_STAMPS = 5_000_000  # 0.5 GB of memory for the motion, far more for the loads
FEWEST_STAMPS = 4  # of a move
# Slower than 3 cm in a year, smaller limits end in numbers that a double does not hold.
SPEEDS, ACCELERATIONS, JERKS = (replace(one, least=1e-9) for one in (SPEED, ACCELERATION, JERK))
SHORTEST = LENGTH.least  # m: a shorter distance is rounding of positions
MOST_MOVES = 20  # that are described one by one
NO_JERK = "no jerk beside a trapezoid"
FASTEST = 'its acceleration jumps; with a limit of the jerk, "jerk limited" is the fastest profile'


class MoveLimits(ConfigModel):
    """Profile and limits; in [limits] those of all moves that do not give their own."""

    profile: Profile | None = optional(
        'shape of the acceleration over time; "jerk limited" if left out everywhere'
    )
    speed: Annotated[float, in_range(SPEEDS, above=0.0)] | None = optional('largest speed, e.g. "2 m/s"')
    acceleration: Annotated[float, in_range(ACCELERATIONS, above=0.0)] | None = optional(
        'largest acceleration, e.g. "5 m/s^2"'
    )
    deceleration: Annotated[float, in_range(ACCELERATIONS, above=0.0)] | None = optional(
        "largest deceleration; as the acceleration if left out"
    )
    jerk: Annotated[float, in_range(JERKS, above=0.0)] | None = optional(
        'largest jerk, e.g. "200 m/s^3"; for profiles other than a trapezoid'
    )


class Move(MoveLimits):
    """A move from rest to rest, in the shortest time that its limits and its profile allow, or in its time."""

    distance: Annotated[float, in_range(LENGTH, nonzero=True)] | None = optional(
        'signed, e.g. "1.2 m"; or a target'
    )
    target: Annotated[float, in_range(POSITION)] | None = optional(
        "position of the cart where it ends; or a distance"
    )
    time: Annotated[float, in_range(PERIOD, above=0.0)] | None = optional(
        'duration, e.g. "1.2 s": limits that are left out follow from it, others are kept'
    )
    dwell: Annotated[float, in_range(TIME, least=0.0)] = optional(
        'pause at rest after the move, e.g. "0.5 s"', 0.0
    )
    forces: tuple[PhaseForce, ...] = optional(
        "one [[moves.forces]] table for each process force during the move or a phase of it", ()
    )

    @model_validator(mode="after")
    def _one_end(self) -> Move:
        if (self.distance is None) == (self.target is None):
            raise ValueRefused("either distance or target", self.model_dump(exclude_none=True))
        return self


class Moves(FileModel):
    """A planned motion along x, known exactly: moves one after the other. Raises ConfigError with all problems at once.

    The motion begins and ends at rest. Its acceleration is linear between its stamps, without approximation for the
    profiles "jerk limited" and "trapezoid"; others are drawn with straight lines, and a note states the deviation.
    """

    FILE: ClassVar = "moves.toml"
    WRITTEN_BY: ClassVar = "`guideload init --moves` writes one"
    REQUIRED: ClassVar = ("moves", "[[moves]] tables, as a motion file has")

    limits: Annotated[MoveLimits, exactly(MoveLimits)] = optional(
        "of all moves that do not give their own", MoveLimits()
    )
    start: Annotated[float, in_range(POSITION)] = optional("position of the cart before the first move", 0.0)
    repeat: Annotated[int, whole(1)] = optional("how often the list of moves is run", 1)
    rate: Annotated[float, in_range(RATE, above=0.0)] = optional(
        "least number of stamps per second, at which loads are reported; rounded up to a power of two", 2048.0
    )
    moves: tuple[Move, ...] = Field(min_length=1, description="one [[moves]] table for each move")
    _source: str = PrivateAttr("planned moves")

    @classmethod
    def _of_file(cls, values: dict[str, Any], file: Path) -> Moves:
        if "moves" not in values:
            hint = "`guideload init --moves` writes a motion file"
            raise refused_at(("moves",), cls.REQUIRED[1], None, hint)
        moves = cls(**values)
        moves._source = file.name
        return moves

    @classmethod
    @checked
    def from_texts(cls, texts: Iterable[str]) -> Moves:
        """Moves from texts such as "distance=1.2 m, speed=2 m/s, acceleration=5 m/s^2, jerk=200 m/s^3"."""
        moves: list[dict[str, str]] = []
        for i, text in enumerate(texts):
            pairs = [[word.strip() for word in part.partition("=")] for part in text.split(",")]
            moves.append({key: value for key, _, value in pairs})
            if len(moves[i]) < len(pairs) or not all(key and value for key, value in moves[i].items()):
                expected = "key=value, separated by commas, each key once"
                point = "numbers have a decimal point, " if re.search(r"\d,\d", text) else ""
                raise refused_at(("moves", i), expected, text, f'{point}as in "distance=1.2 m, speed=2 m/s"')
        values: dict[str, Any] = {"moves": moves}
        return cls(**values)

    def motion(self) -> Motion:
        """The motion; its first stamp is 0 s."""
        places = [self.start, *(leg.end for leg in self._legs)]
        travel = f"{min(places):.6g} to {max(places):.6g}"
        notes = [f"planned, known exactly: {counted(len(self._legs), 'move')}, cart from {travel} m"]
        described = zip(range(1, MOST_MOVES + 1), self.complete, self._legs, strict=False)
        notes += [_words(*one) for one in described]
        notes += [f"and {len(self.moves) - MOST_MOVES} more moves"] if len(self.moves) > MOST_MOVES else []
        notes += [
            f"{profile}: drawn with {LINES} straight lines, within {DEVIATION[profile]:.1e} of the peak acceleration"
            for profile in DEVIATION
            if any(move.profile == profile for move in self.complete)
        ]
        return sampled(self._legs, self.rate, self._source, tuple(notes))

    @cached_property
    def complete(self) -> tuple[Move, ...]:
        """The moves with the values of [limits] where they give none. Their deceleration may be None."""
        shared = self.limits.model_dump(exclude_none=True)
        completed = []
        for move in self.moves:
            own = {key: value for key in Move.model_fields if (value := getattr(move, key)) is not None}
            values = {"profile": "jerk limited"} | shared | own
            if values["profile"] == "trapezoid" and move.jerk is None:
                values.pop("jerk", None)
            completed.append(Move.model_construct(**values))
        return tuple(completed)

    @checked
    def limit(self, name: LimitName) -> float:
        """The largest value [SI] of a limit among the moves; 0 if no move has it.

        Raises ArgumentError for a move with a time, whose limits do not decide.
        """
        _require_limit(name)
        for i, move in enumerate(self.moves):
            if move.time is not None:
                raise ArgumentError(
                    f"{name}: moves[{i}] keeps its time whatever its limits; leave the time out, or vary the pace"
                )
        return max(_limit(move, name) or 0.0 for move in self.complete)

    @checked
    def with_limit(self, name: LimitName, factor: float) -> Moves:
        """The same moves with a limit times `factor`, for the moves that have it."""
        _require_limit(name)
        scaled = []
        for move in self.complete:
            value = _limit(move, name)
            scaled.append(move if value is None else move.model_copy(update={name: factor * value}))
        return self.model_copy(update={"limits": MoveLimits(), "moves": scaled})

    @model_validator(mode="after")
    def _possible(self) -> Moves:
        if problems := [*self._wrong_limits()]:
            raise ConfigError(problems)
        count = float(len(self.moves) * self.repeat * FEWEST_STAMPS)
        if count <= MOST_STAMPS:
            time = sum(float(leg.pieces.length.sum()) + leg.dwell for leg in self._legs)
            count = sum(leg.pieces.length.size for leg in self._legs) + time / grid_step(self.rate)
        if not count <= MOST_STAMPS:
            key, hint = ("repeat", "fewer repetitions") if self.repeat > 1 else ("rate", "fewer per second")
            expected = f"a motion of at most {MOST_STAMPS:.0e} stamps"
            raise refused_at((key,), expected, f"{count:.2g} stamps", f"{hint}, or shorter moves")
        return self

    def _wrong_limits(self) -> Iterator[Problem]:
        """Limits that a move lacks, or that its profile does not have."""
        for i, (own, move) in enumerate(zip(self.moves, self.complete, strict=True)):
            for key in ("speed", "acceleration", "jerk"):
                needed = key != "jerk" or move.profile == "jerk limited"
                if needed and move.time is None and getattr(move, key) is None:
                    hint = "here, or in [limits] for all moves"
                    hint += '; or profile = "trapezoid", which has none' if key == "jerk" else ""
                    yield problem_at(("moves", i, key), ValueRefused(f"a largest {key}", None, hint))
            if move.profile == "trapezoid" and own.jerk is not None:
                yield problem_at(("moves", i, "jerk"), ValueRefused(NO_JERK, own.jerk, FASTEST))
        if self.limits.jerk is not None and all(move.profile == "trapezoid" for move in self.complete):
            yield problem_at(("limits", "jerk"), ValueRefused(NO_JERK, self.limits.jerk, FASTEST))

    @cached_property
    def _legs(self) -> list[Leg]:
        legs, place = [], self.start
        for number in range(self.repeat):
            for i, move in enumerate(self.complete):
                end = place + (move.distance or 0.0) if move.target is None else move.target
                if not abs(end - place) >= SHORTEST:
                    again = f" in repetition {number + 1}" if number else ""
                    hint = "for a pause alone, lengthen the dwell of the move before"
                    raise refused_at(
                        ("moves", i, "target"), f"another place than the cart's{again}", end, hint
                    )
                # A distance as given, not as the difference of places, recurs to the bit: it is planned once.
                length = abs(end - place if move.distance is None else move.distance)
                pieces = _planned(i, length, move)
                for k, force in enumerate(move.forces):
                    if not force.pieces(pieces, move.dwell):
                        expected = "a phase that the move has"
                        hint = (
                            "it has no dwell"
                            if force.during == "at rest"
                            else "it never reaches its largest speed"
                        )
                        raise refused_at(("moves", i, "forces", k, "during"), expected, force.during, hint)
                legs.append(Leg(pieces, place, end, move.dwell, move.forces))
                place = end
        return legs


def _require_limit(name: str) -> None:
    """Raise ArgumentError for an unknown limit."""
    if name not in get_args(LimitName):
        raise ArgumentError(f"name: expected one of {', '.join(get_args(LimitName))}, got {shown(name)}")


def _limit(move: Move, name: LimitName) -> float | None:
    """A limit of a complete move [SI]; None if it has none."""
    given: float | None = getattr(move, name)
    return move.acceleration if name == "deceleration" and given is None else given


def _planned(i: int, length: float, move: Move) -> Pieces:
    """A complete move over a length [m]; i: its index."""
    assert move.profile is not None
    limits = Limits(move.profile, *(_limit(move, name) or math.inf for name in get_args(LimitName)))
    if move.time is None:
        return fastest_move(length, limits)
    pieces = move_in_time(length, move.time, limits)
    if pieces.time > move.time * IN_TIME:
        expected = f"at least {pieces.time:.4g} s, the shortest time under its limits"
        hint = "raise its limits, or leave them out: they then follow"
        raise refused_at(("moves", i, "time"), expected, move.time, hint)
    return pieces


def _words(number: int, move: Move, leg: Leg) -> str:
    """A move as it is run: distance, duration, and the largest speed, accelerations and jerk that it reaches."""
    pieces = leg.pieces
    jerk = f"jerk {digits(pieces.jerk)} m/s3" if move.profile != "trapezoid" else "the acceleration jumps"
    forces = "".join(f"; {one.text}" for one in move.forces)
    return (
        f"move {number}: {digits(leg.end - leg.start, 4)} m in {digits(pieces.time, 4)} s, speed up to "
        f"{digits(pieces.speeds().max())} m/s, acceleration {digits(pieces.start.max())} and "
        f"{digits(pieces.start.min())} m/s2, {jerk}{forces}"
    )
