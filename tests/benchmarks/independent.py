"""Every feature of the model against Exudyn, with finite rotations: `python tests/benchmarks/independent.py [--write]`.

One builder makes Exudyn's model from the numbers of a `Machine`: rigid bodies with Tait-Bryan angles, a
spring-damper for each end and row of a carriage, held coordinates by constraints, its own static solution as start.
It shares no matrix, no law and no placement of links with guideload.

All loads are computed at scale 1, 0.1 and 0.01: gravity, accelerations, forces, errors, profiles and clearance
times the scale. guideload's loads are then exactly in proportion. What small rotations leave out shrinks with the
square of the motion, so by ten relative to the loads; an error of the model would stay. Exudyn's steps are
extrapolated from two lengths, and the difference of the two is given too.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import harness
import numpy as np
import reference as ref
from harness import heading, row
from numpy.typing import NDArray

from guideload import Machine, Motion, simulate

Array = NDArray[np.float64]
DOFS = ("x", "y", "z", "rx", "ry", "rz")
SCALES = (1.0, 0.1, 0.01)
STEP = 1e-4  # s, the longer of two
END = 0.5  # s
ORIGIN = [0.0, 0.0, 0.0]
ONLY_X = np.diag([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
DRIVE = 1e10  # N/m, of the spring that moves a rider
NEWTON = 1e-14  # m and rad; at scale 0.01 the links give way by some 1e-7 m
PAGE = Path(__file__).resolve().parents[2] / "docs" / "validation.md"


# ---- the model in Exudyn


@dataclass(frozen=True)
class Spring:
    """A link: a spring and a damper between a point of the body and its foot, along a direction of the frame."""

    point: Array
    direction: Array
    force: Callable[[float], float] | float  # N at a deflection, or N/m
    damping: float
    error: float = 0.0  # m, of the foot
    structure: float = 0.0  # m/N, in series
    x: float = 0.0  # m, of the foot on the rail
    rail: Any = None


def springs_of(machine: Machine) -> list[Spring]:
    """From the keys of the carriages and links, in the order of guideload's results."""
    found = []
    rails = {rail.name: rail for rail in machine.rails}
    for one in machine.carriages:
        rail = rails[one.rail]
        turn = np.array(
            [[0.0, np.cos(rail.roll), np.sin(rail.roll)], [0.0, -np.sin(rail.roll), np.cos(rail.roll)]]
        )
        center = np.array([one.x, *rail.position])
        error = one.mounting_error @ turn + [0.0, *rail.mounting_error]
        rows = (0.0,) if one.width is None else (-0.5 * one.width, 0.5 * one.width)
        for end in (-0.5 * one.length, 0.5 * one.length):
            for axis, places in ((0, rows), (1, (0.0,))):
                share = 0.5 / len(places)
                key = "yz"[axis]
                for place in places:
                    found.append(
                        Spring(
                            center + [end, 0.0, 0.0] + place * turn[1],
                            turn[axis],
                            law_of(one, f"_{key}", share),
                            share * getattr(one, f"damping_{key}"),
                            float(error @ turn[axis]),
                            getattr(one, f"compliance_{key}") / share,
                            one.x + end,
                            rail if rail.profiles else None,
                        )
                    )
    for link in machine.links:
        direction = np.array(link.direction) / np.linalg.norm(link.direction)
        found.append(Spring(np.array(link.point), direction, law_of(link, "", 1.0), link.damping))
    return found


def law_of(one: Any, suffix: str, share: float) -> Callable[[float], float] | float:
    k, gap, preload = (getattr(one, f"{key}{suffix}") for key in ("stiffness", "clearance", "preload"))
    if preload:
        force, opening = share * preload, 2.0 * 1.5 * preload / k
        return lambda d: float(
            force * (max(1.0 + d / opening, 0.0) ** 1.5 - max(1.0 - d / opening, 0.0) ** 1.5)
        )
    if gap:
        return lambda d: float(share * k * (max(d - gap, 0.0) - max(-gap - d, 0.0)))
    return float(share * k)


@dataclass
class Finite:
    """A run of Exudyn: link loads, motion of the points and drive force at the stamps of the motion."""

    machine: Machine
    motion: Motion
    push: Array | None = None  # (time, 3) N at L: of the rack
    state: tuple[Array, Array] | None = None  # coordinates and velocities at the start; by default at rest
    riders: dict[str, Motion] = field(default_factory=dict)
    kept: list[Any] = field(default_factory=list)  # user functions, which Exudyn does not hold

    def run(self, step: float) -> dict[str, Array]:
        import exudyn as exu

        machine, motion = self.machine, self.motion
        container = exu.SystemContainer()
        self.kept.append(container)
        self.system = system = container.AddSystem()
        ground = system.CreateGround()
        body = self.body(machine.body)
        foot = self.base(ground)
        held = {
            dof: system.CreateCoordinateConstraint(itemNumbers=[None, body], coordinates=[None, dof])
            for dof in range(6)
            if DOFS[dof] not in machine.free
        }
        self.weigh(body, machine.body)
        for rider in machine.riders:
            self.ride(body, rider)
        wrench = np.zeros((motion.time.size, 6)) if motion.wrench is None else motion.wrench.copy()
        if self.push is not None:
            wrench[:, :3] += self.push
        self.load(system.CreateForce, body, ORIGIN, wrench[:, :3])
        self.load(system.CreateTorque, body, ORIGIN, wrench[:, 3:])
        forces = [self.spring(foot, body, spring) for spring in springs_of(machine)]
        kind = exu.OutputVariableType
        sensors = {
            "link_load": [self.sensor("Object", objectNumber=one, kind=kind.ForceLocal) for one in forces],
            "point_displacement": [
                self.sensor("Body", bodyNumber=body, localPosition=list(point.at), kind=kind.Displacement)
                for point in machine.points
            ],
            "drive": [self.sensor("Object", objectNumber=held[0], kind=kind.Force)] if 0 in held else [],
        }
        system.Assemble()
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = float(np.diff(motion.time)[0])
        if self.state is None:
            self.resting = True
            static = settings.staticSolver
            static.newton.residualMode, static.verboseMode = 1, 0
            static.newton.relativeTolerance, static.newton.absoluteTolerance = 1e-10, NEWTON
            system.SolveStatic(settings, updateInitialValues=True)
        else:
            system.systemData.SetODE2Coordinates(self.state[0], exu.ConfigurationType.Initial)
            system.systemData.SetODE2Coordinates_t(self.state[1], exu.ConfigurationType.Initial)
        self.resting = False
        integration = settings.timeIntegration
        integration.endTime = float(np.ptp(motion.time))
        integration.numberOfSteps = round(integration.endTime / step)
        integration.newton.residualMode = 1
        integration.newton.relativeTolerance, integration.newton.absoluteTolerance = 1e-10, NEWTON
        integration.newton.useModifiedNewton = True  # derivatives of user functions are differences
        integration.verboseMode = 0
        solver = exu.DynamicSolverType.TrapezoidalIndex2
        system.SolveDynamic(settings, solverType=solver, showHints=False)
        stored = {
            name: np.stack(
                [np.array(system.GetSensorStoredData(one))[-motion.time.size :, 1:] for one in of], axis=1
            )
            for name, of in sensors.items()
            if of
        }
        stored["link_load"] = stored["link_load"][:, :, 0]
        self.end = system.systemData.GetODE2Coordinates(), system.systemData.GetODE2Coordinates_t()
        return stored

    def body(self, given: Any, at: Sequence[float] = (0.0, 0.0, 0.0)) -> int:
        """A rigid body whose reference point starts at a place."""
        import exudyn as exu
        from exudyn.rigidBodyUtilities import RigidBodyInertia

        center = np.array(given.center_of_mass) - np.array(at)
        inertia = RigidBodyInertia(given.mass, given.central_inertia(), center, inertiaTensorAtCOM=True)
        kind = exu.NodeType.RotationRxyz
        return self.system.CreateRigidBody(referencePosition=list(at), inertia=inertia, nodeType=kind)

    def ride(self, body: int, rider: Any) -> None:
        """A rigid body on a prismatic joint, with a stiff spring from its place along the joint to its travel."""
        from scipy.interpolate import CubicHermiteSpline

        moved = self.riders[rider.name]
        assert moved.position is not None and moved.velocity is not None
        travel = CubicHermiteSpline(moved.time - moved.time[0], moved.position[:, 0], moved.velocity[:, 0])

        def drive(
            system: Any, t: float, number: int, place: float, speed: float, k: float, c: float, offset: float
        ) -> float:
            wanted = (float(travel(0.0)), 0.0) if self.resting else (float(travel(t)), float(travel(t, 1)))
            return k * (place - wanted[0]) + c * (speed - wanted[1])

        self.kept.append(drive)
        carried, axis = self.body(rider), list(rider.direction)
        self.system.CreatePrismaticJoint(itemNumbers=[body, carried], position=ORIGIN, axis=axis)
        self.system.CreateLinearSpringDamper(
            itemNumbers=[body, carried],
            position=ORIGIN,
            axis=axis,
            stiffness=DRIVE,
            damping=2.0 * np.sqrt(DRIVE * rider.mass),
            springForceUserFunction=drive,
        )
        self.weigh(carried, rider)

    def weigh(self, body: int, given: Any) -> None:
        """Weight and -m a, in the frame of L, at the centre of mass."""
        values = given.mass * (np.array(self.machine.gravity) - self.motion.acceleration)
        self.load(self.system.CreateForce, body, given.center_of_mass, values)

    def load(self, create: Callable[..., Any], body: int, place: Sequence[float], values: Array) -> None:
        """A force or torque (time, 3), linear between the stamps; at rest only what gravity gives."""
        time, at_rest = self.motion.time - self.motion.time[0], values[0].tolist()

        def of(system: Any, t: float, vector: Any) -> list[float]:
            if self.resting:
                return at_rest
            k = min(int(np.searchsorted(time, t, "right")), time.size - 1)
            share = (t - time[k - 1]) / (time[k] - time[k - 1])
            return [float(x) for x in values[k - 1] + share * (values[k] - values[k - 1])]

        self.kept.append(of)
        create(itemNumber=body, localPosition=list(place), loadVectorUserFunction=of)

    def base(self, ground: int) -> int:
        """The ground, or a nearly massless body on the base's stiffness."""
        if self.machine.base is None:
            return ground
        light = ref.body(mass=0.01, center_of_mass=(0.0, 0.0, 0.0), inertia=(1e-3 * np.eye(3)).tolist())
        base = self.body(light)
        stiffness = np.linalg.inv(np.array(self.machine.base.compliance))
        self.connect(ground, base, stiffness, 1e-5 * stiffness)
        return base

    def connect(self, one: int, other: int, stiffness: Array, damping: Array, **options: Any) -> int:
        """A spring-damper for all six directions."""
        return self.system.CreateRigidBodySpringDamper(
            itemNumbers=[one, other],
            stiffness=stiffness,
            damping=damping,
            useIntrinsicFormulation=False,
            **options,
        )

    def spring(self, foot: int, body: int, given: Spring) -> int:
        """A spring-damper whose x is the direction of the link; with a structure in series, a small mass in between."""
        frame, point = frame_along(given.direction), given.point.tolist()
        options = {"rotationMatrixJoint": frame, "localPosition0": point, "localPosition1": point}
        if given.structure:
            light = ref.body(mass=1e-3, center_of_mass=point, inertia=(1e-6 * np.eye(3)).tolist())
            between = self.body(light, point)
            at_body = {"rotationMatrixJoint": frame, "localPosition1": point}
            self.connect(between, body, ONLY_X / given.structure, 0.0 * ONLY_X, **at_body)
            stiff = np.diag([0.0, 1e8, 1e8, 1e4, 1e4, 1e4])
            options = {"rotationMatrixJoint": frame, "localPosition0": point}
            self.connect(foot, between, stiff, 1e-5 * stiff, **options)
            body = between
        stiffness = 0.0 * ONLY_X
        if given.rail is None and not callable(given.force):
            stiffness = given.force * ONLY_X
            options["offset"] = [given.error, 0.0, 0.0, 0.0, 0.0, 0.0]
        else:
            options["springForceTorqueUserFunction"] = self.law(given)
        return self.connect(foot, body, stiffness, given.damping * ONLY_X, **options)

    def law(self, given: Spring) -> Callable[..., list[float]]:
        """Force of a link whose law is not linear or whose rail is not straight."""
        force = given.force
        law = force if callable(force) else lambda d: force * d
        moved = self.profile(given)

        def of(
            mbs: Any, t: float, number: int, d: Any, phi: Any, v: Any, omega: Any, k: Any, b: Any, one: Any,
            two: Any, offset: Any,
        ) -> list[float]:  # fmt: skip
            e, rate = moved(t)
            return [law(d[0] - given.error - e) + given.damping * (v[0] - rate), 0.0, 0.0, 0.0, 0.0, 0.0]

        self.kept.append(of)
        return of

    def profile(self, given: Spring) -> Callable[[float], tuple[float, float]]:
        """Displacement and speed of the foot along the link, at a time."""
        motion, rail = self.motion, given.rail
        if rail is None:
            return lambda t: (0.0, 0.0)
        assert motion.position is not None and motion.velocity is not None
        from scipy.interpolate import CubicHermiteSpline

        path = CubicHermiteSpline(motion.time - motion.time[0], motion.position[:, 0], motion.velocity[:, 0])
        (points,) = rail.profiles
        across = given.direction[1:]

        @lru_cache(maxsize=4)  # Newton's method asks again and again
        def moved(t: float) -> tuple[float, float]:
            at, speed = (float(path(0.0)), 0.0) if self.resting else (float(path(t)), float(path(t, 1)))
            e, slope = points.at(np.array([at + given.x]))
            return float(e[0] @ across), float(slope[0] @ across) * speed

        return moved

    def sensor(self, of: str, kind: Any, **options: Any) -> int:
        import exudyn.itemInterface as item

        options |= {"outputVariableType": kind, "storeInternal": True, "writeToFile": False}
        return int(self.system.AddSensor(getattr(item, f"Sensor{of}")(**options)))


def frame_along(direction: Array) -> Array:
    """Axes as columns, the first along a direction."""
    along = direction / np.linalg.norm(direction)
    across = np.cross(along, [1.0, 0.0, 0.0] if abs(along[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    return np.column_stack([along, across, np.cross(along, across)])


# ---- the features


def move(scale: float, size: float = 4.0, **forces: Any) -> Motion:
    """A smooth there and back along x, with position and velocity of scale 1 for the profiles of rails."""
    t = np.round(np.arange(round(END * 1000) + 1) * 1e-3, 12)
    w = 2.0 * np.pi / 0.4
    on = t <= 0.4
    a = np.where(on, size * np.sin(w * t), 0.0)
    v = np.where(on, size / w * (1.0 - np.cos(w * t)), 0.0)
    x = np.where(on, size / w * (t - np.sin(w * t) / w), size / w * 0.4)
    return Motion.along_x(t, scale * a, velocity=v, position=x)


def cart(scale: float, **changes: Any) -> Machine:
    """The yardstick's cart under scaled gravity."""
    gravity = changes.pop("gravity", (0.0, -9.80665, 0.0))
    machine = ref.cart(**changes.pop("laws", {}))
    return Machine(**machine.model_dump() | {"gravity": scale * np.array(gravity)} | changes)


@dataclass(frozen=True)
class Feature:
    """A row of the table."""

    name: str
    machine: Callable[[float], Machine]
    motion: Callable[[float], Motion] = move
    quantity: str = "link_load"
    riders: Callable[[float], dict[str, Motion]] | None = None
    start: Callable[[float], Array] | None = None  # coordinates at rest, where Exudyn finds none


def one_rail(scale: float) -> Machine:
    """Two wide carriages on one rail, which alone hold the body against roll."""
    wide = {
        "length": 0.1,
        "width": 0.08,
        "stiffness_y": 4e8,
        "stiffness_z": 4e8,
        "damping_y": 2e5,
        "damping_z": 2e5,
    }
    carriages = [{"name": name, "rail": "1", "x": x, **wide} for name, x in (("a", -0.25), ("b", 0.3))]
    body = ref.body(mass=200.0, center_of_mass=(0.02, 0.15, 0.1), inertia=(8.0 * np.eye(3)).tolist())
    return cart(scale, body=body, rails=[{"name": "1", "position": [0.0, 0.0]}], carriages=carriages)


def rolled(scale: float) -> Machine:
    rails = [
        {"name": "1", "position": [0.05, -0.35], "roll": 0.6},
        {"name": "2", "position": [0.05, 0.35], "roll": -1.1},
    ]
    return cart(scale, rails=rails)


def with_errors(scale: float) -> Machine:
    """Rails and a carriage some 20 um beside their place."""
    machine = cart(scale).model_dump()
    machine["rails"][1]["mounting_error"] = (2e-5 * scale, -1e-5 * scale)
    machine["carriages"][0]["mounting_error"] = (-1.5e-5 * scale, 2e-5 * scale)
    return Machine(**machine)


def wavy(scale: float) -> Machine:
    rng = np.random.default_rng(3)
    places = np.linspace(-1.0, 1.5, 26)
    machine = cart(scale).model_dump()
    for rail in machine["rails"]:
        bent = np.column_stack([places, scale * 2e-5 * rng.standard_normal((26, 2))])
        rail["straightness"] = bent.tolist()
    return Machine(**machine)


def on_base(scale: float, damping: float = 5e4) -> Machine:
    arms = np.array([[1.0, 0, 0, 0, 0, 0], [0, 1.0, 0, 0, 0, 0], [0, 0, 1.0, 0, 0, 0]])
    point = np.array([[0, 0, -0.4, 1.0, 0, 0], [0, 0, 0, 0, 1.0, 0], [0.4, 0, 0, 0, 0, 1.0]])
    compliance = 2e-9 * arms.T @ arms + 1e-9 * point.T @ point
    given = (0.5 * (compliance + compliance.T)).tolist()
    return cart(scale, laws={"damping": damping}, base={"compliance": given})


def grips(scale: float) -> Machine:
    part = {"mass": 300.0, "center_of_mass": [0.3, -0.5, 0.4], "inertia": (20.0 * np.eye(3)).tolist()}
    return cart(scale, payloads=[{"name": "part", "times": [[0.15, 0.3]], **part}])


def pressed(scale: float) -> Motion:
    motion = move(scale)
    force = np.outer(np.sin(2.0 * np.pi * motion.time / END) ** 2, scale * np.array([500.0, 3000.0, -2000.0]))
    return motion.with_force((0.3, -0.8, 0.5), force)


def with_laws(**of: float) -> Callable[[float], Machine]:
    """The cart with laws on all carriages, of which the clearance is scaled."""

    def machine(scale: float) -> Machine:
        lengths = {key: value * scale for key, value in of.items() if not key.startswith("compliance")}
        both = {
            f"{key}_{axis}": value
            for key, value in (of | lengths).items()
            for axis in "yz"
            if key != "damping"
        }
        return cart(scale, laws=both | {"damping": of.get("damping", 5e4)})

    return machine


def within_play(scale: float) -> Array:
    """Where the cart rests on its contacts, in the middle of the clearance of the others."""
    from peers.laws import Sided
    from peers.problem import rest_position

    found = np.zeros(6)
    found[1:] = rest_position(cart(scale), Sided(6e7, 6e7, 5e-6 * scale))
    return found


def tool(scale: float) -> Machine:
    return cart(scale, points=[{"name": "tool", "at": [0.4, -1.1, 0.6]}])


def preloaded(scale: float) -> Machine:
    """On preloaded balls, of which a row opens."""
    return cart(scale, laws={"preload_y": 400.0 * scale, "preload_z": 400.0 * scale, "rolling": "ball"})


def with_rider(scale: float) -> Machine:
    slide = {"mass": 150.0, "center_of_mass": [0.2, -0.6, -0.3], "inertia": (6.0 * np.eye(3)).tolist()}
    return cart(scale, riders=[{"name": "slide", "direction": [0.0, 0.6, 0.8], **slide}])


def slide(scale: float) -> dict[str, Motion]:
    """There along its direction and back, by 64 mm at scale 1."""
    return {"slide": move(1.0, scale)}


def with_rack(scale: float) -> Machine:
    rack = {"pinion_diameter": 0.1, "pressure_angle": 0.35, "push_direction": [0.0, 0.8, 0.6]}
    return cart(scale, drive=rack)


FEATURES = (
    Feature("four carriages on two rails", cart),
    Feature("roll stiffness, one rail", one_rail),
    Feature("rails turned by 34 and -63 degrees", rolled),
    Feature("vertical travel", lambda scale: cart(scale, gravity=(-9.80665, 0.0, 0.0))),
    Feature("process force at a point", cart, pressed),
    Feature("motion of a point 1.3 m away", tool, quantity="point_displacement"),
    Feature("mounting errors", with_errors),
    Feature("rails that are not straight", wavy),
    Feature("elastic base", on_base),
    Feature("the same with a tenth of the damping", lambda scale: on_base(scale, 5e3)),
    Feature("compliance in series", with_laws(compliance=4e-9)),
    Feature("the same with a tenth of the damping of the carriages", with_laws(compliance=4e-9, damping=5e3)),
    Feature("clearance of 5 um", with_laws(clearance=5e-6), start=within_play),
    Feature("preloaded balls", preloaded),
    Feature("a payload gripped and released", grips),
    Feature("a rider that moves across", with_rider, riders=slide),
    Feature("push of a rack", with_rack),
)


def finite(feature: Feature, scale: float, step: float) -> Array:
    """The quantity by Exudyn, at the stamps of the motion."""
    machine, motion = feature.machine(scale), feature.motion(scale)
    if machine.payloads:
        return gripped(machine, motion, step)
    push = None
    state = None if feature.start is None else (feature.start(scale), np.zeros(6))
    for _ in range(4 if machine.drive else 1):  # each round leaves about a hundredth of the change
        found = Finite(machine, motion, push, state, feature.riders(scale) if feature.riders else {}).run(
            step
        )
        if machine.drive:
            force = np.abs(found["drive"].reshape(motion.time.size, -1)[:, 0])
            push = np.outer(machine.drive.push_per_force * force, machine.drive.push_direction or (0, 0, 0))
    return found[feature.quantity]


def gripped(machine: Machine, motion: Motion, step: float) -> Array:
    """Stretch by stretch; at a grip the momentum of the free dofs is that of the body before it."""
    (payload,) = machine.payloads
    assert payload.times is not None
    marks = [0, *(int(np.argmin(np.abs(motion.time - t))) for t in payload.times[0]), motion.time.size - 1]
    loads, state = [], None
    bare, full = machine.with_payloads([]), machine.with_payloads([payload.name])
    free = np.ix_([DOFS.index(dof) for dof in machine.free], [DOFS.index(dof) for dof in machine.free])
    for stage, (begin, end) in enumerate(zip(marks[:-1], marks[1:], strict=True)):
        one = Finite((bare, full, bare)[stage], ref.piece(motion, begin, end + 1), state=state)
        if stage == 1:
            assert state is not None
            before, after = (ref.matrices(each)[0][free] for each in (bare, full))
            q, v = state
            v = np.array(v)
            v[free[1].ravel()] = np.linalg.solve(after, before @ v[free[1].ravel()])
            one.state = q, v
        found = one.run(step)["link_load"]
        loads.append(found if stage == 2 else found[:-1])
        state = one.end
    return np.concatenate(loads)


def ours(feature: Feature, scale: float) -> Array:
    machine, motion = feature.machine(scale), feature.motion(scale)
    riders = feature.riders(scale) if feature.riders else None
    result = simulate(machine, motion, riders=riders, rtol=1e-9, times=motion.time, start="rest")
    return result.quantities[feature.quantity]


def differences(feature: Feature) -> tuple[list[float], float]:
    """At each scale, of the largest value; and that between Exudyn's two steps."""
    found, gap = [], 0.0
    for scale in SCALES:
        expected = ours(feature, scale)
        coarse, fine = (finite(feature, scale, step) for step in (STEP, 0.5 * STEP))
        extrapolated = fine + (fine - coarse) / 3.0
        keep = np.ones(len(expected), bool)
        if feature.machine(scale).payloads:  # both loads of a change are right there
            keep = np.abs(feature.motion(scale).time[:, None] - [0.15, 0.3]).min(axis=1) > 1e-9
        size = np.abs(expected).max()
        found.append(float(np.abs(extrapolated - expected)[keep].max() / size))
        gap = max(gap, float(np.abs(fine - coarse)[keep].max() / size))
    return found, gap


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--write", action="store_true", help="the table of docs/validation.md")
    parser.add_argument("--only", default="", metavar="WORD", help="features whose name has this word")
    asked = parser.parse_args()
    warnings.simplefilter("ignore", DeprecationWarning)
    lines = [heading("feature", *(f"scale {scale:g}" for scale in SCALES), "Exudyn's two steps")]
    print("\n".join(lines), flush=True)
    for feature in FEATURES:
        if asked.only not in feature.name:
            continue
        try:
            found, gap = differences(feature)
        except Exception as error:  # Exudyn's solver gave up
            print(f"{feature.name}: {str(error).splitlines()[0]}", flush=True)
            continue
        lines.append(row(feature.name, *(f"{one:.1e}" for one in found), f"{gap:.0e}"))
        print(lines[-1], flush=True)
    if asked.write:
        harness.write_block(PAGE, "features", "\n".join(lines))


if __name__ == "__main__":
    main()
