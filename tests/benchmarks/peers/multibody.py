"""Exudyn: a rigid body with finite rotations and its own spring-dampers, which checks the physics as well.

Its model is not ours: rotations are exact and the connectors move with the body. The difference of the loads
is the error of our small rotations (5e-5 of the load on the cart), so on the chart Exudyn cannot pass below
it.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from guideload import Machine
from peers.laws import Law, force
from peers.problem import Array, At, Problem, rest_position


def exudyn(given: Problem, *, solver: str, machine: Machine) -> At:
    """An implicit solver of Exudyn with a fixed step in ms; the explicit ones cannot hold x against a coupled
    mass matrix.

    The frame of L accelerates: the body feels weight and -m a at its centre of mass. Held dofs are held by
    coordinate constraints. Each end of a carriage is a CartesianSpringDamper; a law that is not linear is a
    symbolic user function.
    """
    import exudyn as exu

    def at(step: float) -> Array:
        kept, system, sensors = _model(exu, machine, given)
        settings = exu.SimulationSettings()
        integration, solution = settings.timeIntegration, settings.solution
        integration.endTime = float(given.time[-1] - given.time[0])
        integration.numberOfSteps = round(integration.endTime / (step * 1e-3))
        integration.newton.residualMode = 1  # the default, of forces, fails or takes 50 times as long
        integration.newton.relativeTolerance = 1e-10
        integration.newton.absoluteTolerance = 1e-8
        solution.file.write = False
        solution.sensors.writePeriod = given.step
        kind = getattr(exu.DynamicSolverType, solver)
        system.SolveDynamic(settings, solverType=kind, showHints=False)
        loads = np.zeros((given.time.size, len(machine.carriages), 2))
        for i, sensor in sensors:
            rows = np.array(system.GetSensorStoredData(sensor))
            loads[:, i] += rows[: given.time.size, 2:4]
        return loads

    return at


def _model(exu: Any, machine: Machine, given: Problem) -> tuple[Any, Any, list[tuple[int, int]]]:
    """What must outlive the run; the system; of each end of a carriage, the carriage's index and the force's sensor."""
    import exudyn.itemInterface as item
    from exudyn.rigidBodyUtilities import RigidBodyInertia, RotationVector2RotationMatrix

    container = exu.SystemContainer()
    system = container.AddSystem()
    start = np.zeros(6)
    free = ["x y z rx ry rz".split().index(dof) for dof in machine.free]
    start[free] = rest_position(machine, given.law)
    mass, r = machine.body.mass, list(machine.body.center_of_mass)
    body = system.CreateRigidBody(
        inertia=RigidBodyInertia(mass, machine.body.central_inertia(), r, inertiaTensorAtCOM=True),
        initialDisplacement=start[:3].tolist(),
        initialRotationMatrix=RotationVector2RotationMatrix(start[3:]),
        nodeType=exu.NodeType.RotationRotationVector,
    )
    ground = system.CreateGround()
    for dof in set(range(6)) - set(free):
        system.CreateCoordinateConstraint(itemNumbers=[None, body], coordinates=[None, dof])
    weight, last, step, u = mass * np.array(machine.gravity), given.u.size - 2, given.step, given.u

    def load(system: Any, t: float, vector: Any) -> list[float]:
        at = t / step
        k = min(int(at), last)
        return [float(weight[0] - mass * (u[k] + (u[k + 1] - u[k]) * (at - k))), weight[1], weight[2]]

    system.CreateForce(
        itemNumber=body, localPosition=r, loadVector=weight.tolist(), loadVectorUserFunction=load
    )
    expression = 0 if given.law is None else _symbolic(exu, system, given.law)
    sensors = []
    links = machine.link_table()
    ends = np.flatnonzero(links.directions[:, 1])  # of each end its link along y; that along z follows
    for link in ends:
        point = links.points[link].tolist()
        k, b = float(links.stiffness[link]), float(links.damping[link])
        spring = system.CreateCartesianSpringDamper(
            itemNumbers=[ground, body],
            localPosition0=point,
            localPosition1=point,
            stiffness=[0.0, k, k],
            damping=[0.0, b, b],
            springForceUserFunction=expression,
        )
        sensor = system.AddSensor(
            item.SensorObject(
                objectNumber=spring,
                outputVariableType=exu.OutputVariableType.Force,
                storeInternal=True,
                writeToFile=False,
            )
        )
        sensors.append((int(links.carriage[link]), sensor))
    system.Assemble()
    return (container, expression), system, sensors


def _symbolic(exu: Any, system: Any, law: Law) -> Any:
    """The law along y and z as an expression that Exudyn evaluates itself."""
    from exudyn.advancedUtilities import CreateSymbolicUserFunction

    pull = force(law, SimpleNamespace(maximum=exu.symbolic.max, sqrt=exu.symbolic.sqrt))

    def springs(
        mbs: Any, t: Any, itemNumber: Any, displacement: Any, velocity: Any, stiffness: Any, damping: Any,
        offset: Any,
    ) -> list[Any]:  # fmt: skip
        forces = [pull(displacement[i]) + damping[i] * velocity[i] for i in (1, 2)]
        return [0.0 * displacement[0], *forces]

    return CreateSymbolicUserFunction(
        system, springs, "springForceUserFunction", itemTypeName="ObjectConnectorCartesianSpringDamper"
    )
