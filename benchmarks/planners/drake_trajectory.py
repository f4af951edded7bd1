"""Drake's KinematicTrajectoryOptimization with SNOPT, the electrical energy added as a cost with
exact gradients.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.math import BsplineBasis
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces_
from pydrake.planning import KinematicTrajectoryOptimization
from pydrake.solvers import SnoptSolver, SolverOptions
from pydrake.trajectories import BsplineTrajectory

from benchmarks.motion import SplineMotion
from benchmarks.planners.planner import CONTROL_POINTS, NODES
from joulepath.models.robot import Array, Robot
from joulepath.models.urdf import urdf_of
from joulepath.optimizer.motion.bspline import DEGREE, Basis, clamped
from joulepath.optimizer.motion.seven_segment import shortest_duration

WIDTH = 0.5
"""Width of the smoothed corners of the power [W]."""
KNEE = 0.02
"""Speed range of the smoothed friction reversal [rad/s]."""
RETIMED = 1.5
"""Duration of the initial guess over the shortest duration within the limits on speed, acceleration
and jerk [1]."""
OPTIONS = {
    "Major optimality tolerance": 1e-5,
    "Major feasibility tolerance": 1e-6,
    "Major iterations limit": 500,
}


class DrakeTrajectory:
    """Hull bounds on speed, acceleration and jerk, and effort bounds at the nodes, by methods of
    Drake.

    Drake's plant lacks this friction law, so the effort bounds are tightened by the largest
    friction torque.
    """

    title = "Drake with SNOPT"
    packages: tuple[str, ...] = ("drake",)
    what = (
        "KinematicTrajectoryOptimization, B-spline of 13 control points on 32 nodes, duration "
        "free, hull bounds"
    )

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.basis = Basis.of(clamped(np.linspace(0.0, 1.0, CONTROL_POINTS - DEGREE + 1)), NODES)
        self.plant = _plant(robot)
        self.energy = _Energy(robot, self.plant, self.basis)
        self.solver, self.options = SnoptSolver(), SolverOptions()
        for name, value in OPTIONS.items():
            self.options.SetOption(self.solver.solver_id(), name, value)

    def plan(self, q_start: Array, q_goal: Array) -> SplineMotion | None:
        """See `Planner.plan`."""
        limits, nq = self.robot.limits, self.robot.nq
        duration = RETIMED * float(shortest_duration(q_goal - q_start, limits))
        knots = self.basis.knots
        guess = q_start + np.outer(self.basis.quintic, q_goal - q_start)
        trajectory = BsplineTrajectory(
            BsplineBasis(DEGREE + 1, (knots * duration).tolist()),
            [point[:, None] for point in guess],
        )
        program = KinematicTrajectoryOptimization(trajectory)
        none = np.zeros(nq)
        for s, q in ((0.0, q_start), (1.0, q_goal)):
            program.AddPathPositionConstraint(q, q, s)
            program.AddPathVelocityConstraint(none, none, s)
            program.AddPathAccelerationConstraint(none, none, s)
        program.AddPositionBounds(limits.q_min, limits.q_max)
        program.AddVelocityBounds(-limits.v_max, limits.v_max)
        program.AddAccelerationBounds(-limits.a_max, limits.a_max)
        program.AddJerkBounds(-limits.j_max, limits.j_max)
        program.AddEffortBoundsAtNormalizedTimes(self.plant, self.basis.nodes)
        program.AddDurationConstraint(0.01, 600.0)
        points = program.control_points()
        variables = np.append(points.T.ravel(), program.duration())
        program.get_mutable_prog().AddCost(self.energy, variables)
        result = self.solver.Solve(program.prog(), None, self.options)
        if not result.is_success():
            return None
        found = float(result.GetSolution(program.duration()))
        return SplineMotion(knots * found, np.asarray(result.GetSolution(points)).T, DEGREE)


class _Energy:
    """Electrical energy from the supply [100 J] as a function of the control points, row by row,
    and the duration.

    The plant computes torques and their derivatives by the 3 nq states of a node with automatic
    differentiation. The chain rule leads to the derivatives of the power by the variables, at far
    less cost than automatic differentiation by all 79 variables.
    """

    SCALE = 1e-2

    def __init__(self, robot: Robot, plant: MultibodyPlant, basis: Basis) -> None:
        self.robot, self.basis = robot, basis
        self.plant = plant.ToAutoDiffXd()
        self.context = self.plant.CreateDefaultContext()
        self.forces = MultibodyForces_[AutoDiffXd](self.plant)

    def __call__(self, x: Array) -> Any:
        """The cost, with its gradient if Drake requests it."""
        if x.dtype != object:
            return self._evaluate(x)[0]
        value, gradient = self._evaluate(ExtractValue(x).ravel())
        return InitializeAutoDiff(np.array([value]), (gradient @ ExtractGradient(x))[None])[0, 0]

    def _evaluate(self, x: Array) -> tuple[float, Array]:
        nq, duration = self.robot.nq, x[-1]
        rates = np.array([1.0, 1 / duration, 1 / duration**2])
        states = (self.basis.at_nodes @ x[:-1].reshape(-1, nq)) * rates[:, None, None]
        power, slopes = self._power(states)
        weights = self.basis.weights
        cost = duration * float(weights @ power)
        weighted = slopes * (duration * weights)[None, :, None]
        by_points = np.einsum("d,dkn,dkj->nj", rates, self.basis.at_nodes, weighted)
        by_duration = (
            cost / duration
            - float((weighted * states * np.arange(3)[:, None, None]).sum()) / duration
        )
        return self.SCALE * cost, self.SCALE * np.append(by_points.ravel(), by_duration)

    def _power(self, states: Array) -> tuple[Array, Array]:
        """Power from the supply (N,) [W] at states (3, N, nq), and its derivatives by states."""
        robot, v = self.robot, states[1]
        tau, jacobian = self._torques(states)
        law, drives, electronics = robot.friction, robot.drives, robot.electronics
        root, bent = np.hypot(v, KNEE), np.hypot(v, law.speed)
        friction = law.coulomb * v / root + law.curved * np.arcsinh(v / law.speed) + law.viscous * v
        steepness = law.coulomb * KNEE**2 / root**3 + law.curved / bent + law.viscous
        motor = tau + friction
        i = motor / drives.torque_constant
        size = np.hypot(i, 0.1 * WIDTH)
        loss = (
            drives.copper * i**2 + drives.inverter_linear * size + drives.inverter_quadratic * i**2
        )
        by_current = (
            2 * (drives.copper + drives.inverter_quadratic) * i + drives.inverter_linear * i / size
        )
        by_motor = v + by_current / drives.torque_constant
        base = (
            electronics.idle_power
            + electronics.controller_power
            + float(drives.inverter_constant.sum())
        )
        net = base + (motor * v + loss).sum(axis=1)
        soft = np.hypot(net, WIDTH)
        recovered = electronics.regeneration
        drawn = ((1 - recovered) * soft + (1 + recovered) * net) / 2
        by_net = ((1 - recovered) * net / soft + (1 + recovered)) / 2
        slopes = np.einsum("kj,kjdi->dki", by_motor, jacobian)
        slopes[1] += motor + by_motor * steepness
        return drawn, slopes * by_net[None, :, None]

    def _torques(self, states: Array) -> tuple[Array, Array]:
        """Torques (N, nq) and their derivatives (N, nq, 3, nq) by q, v and a."""
        nq, count = self.robot.nq, states.shape[1]
        tau, jacobian = np.empty((count, nq)), np.empty((count, nq, 3, nq))
        for k in range(count):
            y = InitializeAutoDiff(states[:, k].reshape(-1)).ravel()
            self.plant.SetPositionsAndVelocities(self.context, y[: 2 * nq])
            self.plant.CalcForceElementsContribution(self.context, self.forces)
            found = self.plant.CalcInverseDynamics(self.context, y[2 * nq :], self.forces)
            tau[k] = ExtractValue(found).ravel()
            jacobian[k] = ExtractGradient(found).reshape(nq, 3, nq)
        return tau, jacobian


def _plant(robot: Robot) -> MultibodyPlant:
    """The robot's URDF with rotor inertia and effort limits on its joints."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(urdf_of(robot.name, robot.figures), "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    limits = robot.limits
    effort = limits.tau_max - robot.friction.torque(limits.v_max)
    for name, most, inertia in zip(
        robot.joint_names, effort, robot.drives.rotor_inertia, strict=True
    ):
        actuator = plant.AddJointActuator(f"{name} drive", plant.GetJointByName(name), float(most))
        actuator.set_default_gear_ratio(1.0)
        actuator.set_default_rotor_inertia(float(inertia))
    plant.Finalize()
    return plant
