"""A plain CasADi script: a B-spline transcribed with `Opti`, solved by IPOPT with exact
derivatives.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from benchmarks.motion import SplineMotion
from benchmarks.planners.planner import CONTROL_POINTS, NODES
from joulepath.models.robot import Array, FrictionLaw, Robot
from joulepath.optimizer.dynamics.inverse_dynamics import SymbolicPayload, inverse_dynamics
from joulepath.optimizer.dynamics.losses import drawn_power, power_flow
from joulepath.optimizer.motion.bspline import DEGREE, Basis, basis_matrix, clamped
from joulepath.optimizer.motion.seven_segment import shortest_duration

WIDTH = 0.5
"""Width of the smoothed corners of the power [W]."""
KNEE = 0.02
"""Speed range of the smoothed friction reversal [rad/s]."""
RETIMED = 1.5
"""Duration of the initial guess over the shortest duration within the limits on speed, acceleration
and jerk [1]."""
RESTING = 3
"""Number of equal control points at each end, for a start and an end at rest."""
GRID = np.linspace(0.0, 1.0, 61)
"""Points of the limits of `CasadiOptiGrid`."""
OPTIONS: dict[str, Any] = {"print_time": False}
IPOPT: dict[str, Any] = {"print_level": 0, "sb": "yes", "max_iter": 300, "tol": 1e-6}


class CasadiOpti:
    """An NLP that is built once, with the two configurations as parameters.

    Torque limits are constraints at the Gauss-Legendre nodes of the cost. Limits on speed,
    acceleration and jerk are constraints on the control points of the derivatives; their convex
    hull contains the derivatives.
    """

    title = "CasADi Opti with IPOPT, hull bounds"
    packages: tuple[str, ...] = ("casadi",)
    what = (
        "B-spline of 13 control points on 32 nodes, duration free, the same dynamics and energy, "
        "hull bounds"
    )
    hull = True

    def __init__(self, robot: Robot, n: int = CONTROL_POINTS, nodes: int = NODES) -> None:
        self.robot = robot
        self.basis = basis = Basis.of(clamped(np.linspace(0.0, 1.0, n - DEGREE + 1)), nodes)
        limits, columns = robot.limits, n - 2 * RESTING

        opti = self.opti = ca.Opti()
        self.free, self.duration = opti.variable(robot.nq, columns), opti.variable()
        self.q_start, self.q_goal = opti.parameter(robot.nq), opti.parameter(robot.nq)
        self.points = ca.horzcat(*[self.q_start] * RESTING, self.free, *[self.q_goal] * RESTING)
        states = [self.points @ basis.at_nodes[d].T / self.duration**d for d in range(3)]
        power, tau = _node(robot).map(len(basis.nodes))(*states)
        opti.minimize(self.duration * (power @ basis.weights))
        opti.subject_to(opti.bounded(-1, ca.vec(tau / _wide(limits.tau_max, len(basis.nodes))), 1))
        for order, most in enumerate((limits.v_max, limits.a_max, limits.j_max), start=1):
            inner = (
                derivative_points(basis.knots, order)
                if self.hull
                else basis_matrix(basis.knots, GRID, order)
            )
            rate = self.points @ inner.T / self.duration**order
            opti.subject_to(opti.bounded(-1, ca.vec(rate / _wide(most, len(inner))), 1))
        lower, upper = _wide(limits.q_min, columns), _wide(limits.q_max, columns)
        opti.subject_to(opti.bounded(lower.ravel("F"), ca.vec(self.free), upper.ravel("F")))
        opti.subject_to(opti.bounded(0.01, self.duration, 600.0))
        opti.solver("ipopt", OPTIONS, IPOPT)

    def plan(
        self, q_start: Array, q_goal: Array, perturbation: Array | None = None
    ) -> SplineMotion | None:
        """See `Planner.plan`. `perturbation` (n - 6, nq) [rad] is added to the free control points
        of the initial guess.
        """
        opti, basis = self.opti, self.basis
        free = q_start + np.outer(basis.quintic[RESTING:-RESTING], q_goal - q_start)
        opti.set_value(self.q_start, q_start)
        opti.set_value(self.q_goal, q_goal)
        opti.set_initial(self.free, (free if perturbation is None else free + perturbation).T)
        opti.set_initial(
            self.duration, RETIMED * float(shortest_duration(q_goal - q_start, self.robot.limits))
        )
        try:
            solution = opti.solve()
        except RuntimeError:  # Opti raises it if the solver fails
            return None
        duration = float(solution.value(self.duration))
        return SplineMotion(basis.knots * duration, np.array(solution.value(self.points)).T, DEGREE)


class CasadiOptiGrid(CasadiOpti):
    """`CasadiOpti` with limits on speed, acceleration and jerk at the points of a grid: less
    conservative, but violated between the points.
    """

    title = "CasADi Opti with IPOPT, bounds on a grid"
    what = (
        "as before, with bounds on speed, acceleration and jerk at 61 points instead of the hull's"
    )
    hull = False


def derivative_points(knots: Array, order: int) -> Array:
    """Matrix (n - order, n) from control points to the control points of a derivative (de Boor
    1978, ch. X)."""
    n = len(knots) - DEGREE - 1
    matrix = np.eye(n)
    for k in range(order):
        degree = DEGREE - k
        spans = np.array([knots[i + DEGREE + 1] - knots[i + k + 1] for i in range(n - k - 1)])
        matrix = degree * np.diff(matrix, axis=0) / spans[:, None]
    return matrix


def _wide(limit: Array, columns: int) -> Array:
    """A limit (nq,) repeated for every column: (nq, columns)."""
    return np.tile(limit[:, None], columns)


def _node(robot: Robot) -> ca.Function:
    """(q, v, a) → power drawn from the supply [W] and motor torque (nq,) [N·m], with smoothed
    corners.
    """
    q, v, a = (ca.SX.sym(name, robot.nq) for name in "qva")
    no_payload = SymbolicPayload(ca.SX(0), ca.SX(3, 1), ca.SX(6, 1))
    tau = inverse_dynamics(
        robot.model,
        q,
        v,
        a,
        no_payload,
        ca.SX(robot.model.gravity.linear),
        ca.SX(robot.drives.rotor_inertia),
    )
    law = robot.friction
    friction = FrictionLaw(law.name, law.coulomb, law.curved, law.speed, law.viscous, KNEE)
    flow = power_flow(tau, v, a, robot.drives, friction, 0.1 * WIDTH, ca)
    electronics = robot.electronics
    net = electronics.idle_power + electronics.controller_power + ca.sum1(flow.joints)
    return ca.Function(
        "node", [q, v, a], [drawn_power(net, electronics.regeneration, WIDTH, ca), flow.tau_motor]
    )
