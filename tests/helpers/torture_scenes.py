"""The table of the torture set: see torture.py. Lengths, times and forces that have to meet are whole powers of two."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from torture import Scene, released

Array = NDArray[np.float64]
Force = float | tuple[float, float, float]  # N along y, or x, y, z
GAP = 2.0**-10  # m
KICK = (2.0**-10, 2.0**7)  # s, N: 1/8 m/s, and 1/16 GAP of travel
ARRIVES = 2.0**-7 - 2.0**-11 + 2.0**-10  # s: at the edge of the gap after this kick


def pushes(*pieces: tuple[float, Force]) -> dict[str, Array]:
    """Constant forces for some time, one after the other."""
    return ramps(*((duration, force, force) for duration, force in pieces))


def ramps(*pieces: tuple[float, Force, Force]) -> dict[str, Array]:
    """Forces that change evenly for some time, one after the other: duration, at its start, at its end."""
    ends = np.cumsum([duration for duration, *_ in pieces])
    corners = np.column_stack([np.concatenate([[0.0], ends[:-1]]), ends]).ravel()
    forces = [(0.0, force, 0.0) if np.isscalar(force) else force for _, *both in pieces for force in both]
    return {"corners": corners, "forces": np.array(forces, dtype=float)}


def evenly(end: float, count: int = 200, start: float = 0.0) -> Array:
    return np.linspace(start, end, count + 1)[1:]


def around(*instants: float) -> Array:
    """Instants from 1 ps to 1 us to either side of each."""
    near = 10.0 ** np.arange(-12.0, -5.0)
    return np.unique([time + shift for time in instants for shift in (*-near, *near)])


def gap(stiffness: float, clearance: float = GAP, **keys: Any) -> dict[str, Any]:
    return {"stiffness": stiffness, "clearance": clearance, **keys}


def meetings(stiffness: float, turns: int) -> Array:
    """Instants at which a mass that bounces in its gap after the kick meets an edge."""
    across, touch = 2.0 * GAP / (KICK[0] * KICK[1]), np.pi / np.sqrt(stiffness)
    return ARRIVES + np.arange(turns) * (across + touch)


def noise() -> dict[str, Array]:
    rng = np.random.default_rng(0)
    corners = np.arange(201) / 1000.0
    forces = np.zeros((201, 3))
    forces[1:, 1] = 40.0 * rng.standard_normal(200)
    return {"corners": corners, "forces": forces}


def scenes() -> list[Scene]:
    """All scenes."""
    thrown = pushes(KICK, (0.1, 0.0))
    grazing = 1e4 * GAP / 2.0  # N: half a swing on a spring of 1e4 N/m reaches the edge
    return [
        Scene(
            "short contact",
            "the contact lasts 31 us, a thousandth of the time between samples; a step passes over it",
            {"y": gap(1e10)},
            **thrown,
            asked=evenly(0.1, 20),
        ),
        Scene(
            "late contact",
            "nothing happens for 4000 s, then a contact of 0.3 ms",
            {"y": gap(1e8)},
            **pushes((KICK[0], 2.0**-12), (5000.0, 0.0)),
            asked=evenly(5000.0, 50),
        ),
        Scene(
            "late pulse",
            "rest for 1000 s, then a pulse of 20 ms",
            {"y": {"stiffness": 1e4, "damping": 20.0}},
            **ramps((1000.0, 0.0, 0.0), (0.01, 0.0, 10.0), (0.01, 10.0, 0.0), (0.48, 0.0, 0.0)),
            asked=evenly(1000.5, 250, start=1000.0),
        ),
        Scene(
            "43 impacts",
            "each impact adds to the error",
            {"y": gap(1e6)},
            **pushes(KICK, (1.0, 0.0)),
            asked=evenly(1.0),
        ),
        Scene(
            "event at t0",
            "the mass starts on an edge of its law, where the stiffness changes by three decades",
            {"y": {"stiffness": {"positive": 1e7, "negative": 1e4}}},
            **pushes((0.1, 10.0), (0.1, -10.0)),
            asked=evenly(0.2),
        ),
        Scene(
            "event at a sample",
            "the mass arrives at the edge exactly at a sample",
            {"y": gap(1e6)},
            **pushes(KICK, (ARRIVES - KICK[0], 0.0), (0.05, 0.0)),
            asked=evenly(0.05),
        ),
        Scene(
            "jump at an event",
            "the force reverses at the instant of arrival",
            {"y": gap(1e6)},
            **pushes(KICK, (ARRIVES - KICK[0], 0.0), (2.0**-9, -300.0), (0.04, 0.0)),
            asked=evenly(0.04),
        ),
        Scene(
            "rest on an edge",
            "it comes to rest exactly on the edge: the event function is zero for 0.1 s; then it is pushed out",
            {"y": gap(1e6)},
            **pushes((2.0**-5, 1.0), (2.0**-5, -1.0), (0.125, 0.0), (0.01, 5.0), (0.05, 0.0)),
            asked=evenly(0.2),
        ),
        Scene(
            "grazing, short of it",
            "100 swings end 1e-9 of the gap short of a contact 10 000 times as stiff",
            {"y": gap(1e8), "y spring": {"stiffness": 1e4}},
            **pushes((6.3, grazing * (1.0 - 1e-9))),
            asked=evenly(6.3),
        ),
        Scene(
            "grazing, beyond",
            "each swing touches the contact for 0.2 ms of 63, and is cut short by it",
            {"y": gap(1e8), "y spring": {"stiffness": 1e4}},
            **pushes((3.0, grazing * (1.0 + 1e-5))),
            asked=evenly(3.0),
        ),
        Scene(
            "two events at once",
            "contacts along y and z, of different stiffness, close at the same instant",
            {
                "y": gap(1e6),
                "y spring": {"stiffness": 100.0},
                "z": gap(1e8, damping=50.0, damping_in_contact=True),
                "z spring": {"stiffness": 100.0},
            },
            **pushes((KICK[0], (0.0, KICK[1], KICK[1])), (0.1, 0.0)),
            asked=evenly(0.1, 97),
        ),
        Scene(
            "two events in 80 ps",
            "they close one after the other, closer than any step or tolerance",
            {"y": gap(1e6), "z": gap(1e8, GAP + 1e-11)},
            **pushes((KICK[0], (0.0, KICK[1], KICK[1])), (0.1, 0.0)),
            asked=evenly(0.1),
        ),
        Scene(
            "two edges in one place",
            "two links of one axis close at the same edge, one with a damper in contact",
            {"y": gap(1e6), "y other": gap(3e7, damping=200.0, damping_in_contact=True)},
            **thrown,
            asked=evenly(0.1, 97),
        ),
        Scene(
            "six decades at an edge",
            "the stiffness changes from 1e3 to 1e9 N/m at an edge that is passed again and again",
            {"y": {"stiffness": {"positive": 1e9, "negative": 1e3}}},
            **pushes((2.0**-10, -100.0), (0.5, 0.0)),
            asked=evenly(0.5, 50),
        ),
        Scene(
            "output beside events",
            "instants are asked from 1 ps to 1 us beside each event, inside the step that it cuts",
            {"y": gap(1e6)},
            **thrown,
            asked=around(*meetings(1e6, 4), *(meetings(1e6, 4) + np.pi / 1e3)),
        ),
        Scene(
            "lifts for an instant",
            "a pulse of 1.01 times the weight lifts the mass off its contact for a moment",
            {"y": gap(1e8)},
            gravity=-9.80665,
            **ramps((0.01, 0.0, 0.0), (2e-4, 0.0, 16.0), (2e-4, 16.0, 0.0), (0.01, 0.0, 0.0)),
            asked=evenly(0.02),
        ),
        Scene(
            "creeps over an edge",
            "an overdamped mass passes an edge at 1e-8 m/s",
            {"y": {"curve": [[-1e-3, -10.0], [0.0, 0.0], [1e-5, 0.1], [1e-3, 1e5]], "damping": 3e3}},
            **ramps((20.0, 0.0, 0.2)),
            asked=evenly(20.0),
        ),
        Scene(
            "chatter",
            "a mass dropped on a damped contact bounces ever more quickly until it rests",
            {"y": gap(1e8, damping=670.0, damping_in_contact=True)},
            gravity=-9.80665,
            **pushes((5e-3, 25.0), (0.25, 0.0)),
            asked=evenly(0.25, 61),
        ),
        Scene(
            "rattle",
            "an alternating force throws the mass from stop to stop",
            {"y": gap(1e7, damping=1000.0, damping_in_contact=True)},
            **pushes(*[(0.013, 40.0 * (-1.0) ** turn) for turn in range(30)]),
            asked=evenly(0.39, 61),
        ),
        Scene(
            "noise over a contact",
            "the force has a corner every 1 ms, and a contact comes and goes",
            {"y": gap(1e6, 1e-5), "y spring": {"stiffness": 1e5, "damping": 30.0}},
            **noise(),
            asked=evenly(0.2),
        ),
        Scene(
            "step at t0",
            "the force is there from the first instant on",
            {"y": {"stiffness": 1e6, "damping": 20.0}},
            **pushes((0.2, 100.0)),
            asked=evenly(0.2),
        ),
        Scene(
            "hardly damped",
            "500 periods of a vibration with damping ratio 1e-6: a method's own damping is 1000 times that",
            {"y": {"stiffness": 1e6, "damping": 2e-3}},
            **pushes((3.2, 100.0)),
            asked=evenly(3.2, 200, start=3.0),
        ),
        Scene(
            "strongly damped",
            "decays at 1 and at 1e6 1/s: stability holds explicit steps to 3 us",
            {"y": {"stiffness": 1e6, "damping": 1e6}},
            **ramps((0.5, 0.0, 100.0), (1.0, 100.0, 100.0)),
            asked=evenly(1.5),
        ),
        Scene(
            "both at once",
            "an undamped vibration of 160 Hz beside a decay at 1e6 1/s",
            {"y": {"stiffness": 1e6, "damping": 1e6}, "z": {"stiffness": 1e6}},
            **pushes((0.3, (0.0, 100.0, 100.0))),
            asked=evenly(0.3),
        ),
        Scene(
            "impacts that stick",
            "the contact is so strongly damped that the mass sticks to it for a moment at each impact",
            {"y": gap(1e9, damping=1e5, damping_in_contact=True)},
            **pushes(*[(0.02, 40.0 * (-1.0) ** turn) for turn in range(5)]),
            asked=evenly(0.1, 61),
        ),
        Scene(
            "row just opens",
            "a preloaded row of balls opens for a moment at the end of each swing: the slope has a kink there",
            {"y": {"stiffness": 6e7, "preload": 1000.0, "rolling": "ball"}},
            **pushes((0.01, 1500.0)),
            asked=np.empty(0),
            by=released,
        ),
        Scene(
            "light preload",
            "rollers with a preload of a thousandth of the load: the law bends within 1 % of the deflection",
            {"y": {"stiffness": 1e8, "preload": 1.0, "rolling": "roller"}},
            **pushes((0.01, 1000.0)),
            asked=np.empty(0),
            by=released,
        ),
    ]
