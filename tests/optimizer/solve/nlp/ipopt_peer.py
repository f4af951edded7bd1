"""A second solver for the optimiser's NLPs: the same problem, written plainly in CasADi, solved by
IPOPT.

Shared with the optimiser are the spline basis and the expression for power at one instant.
Objective, constraints, their derivatives (CasADi's own) and the method (interior point) are apart
from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.kernel_expressions import build
from joulepath.optimizer.motion.bspline import REST_POINTS, Basis
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from tests.optimizer.moves import ROBOT

# spacing of the peer's grid in points of the optimiser's grid; a divisor of the points per span
THINNING = 8


@dataclass(frozen=True)
class Optimum:
    """Result of IPOPT: convergence, cost [J], duration [s], free control points (m, nq)."""

    converged: bool
    cost: float
    duration: float
    free: Array


def thinned(basis: Basis) -> Array:
    """First to third derivative on the thinned grid, (3, M, n)."""
    spans = len(np.unique(basis.knots)) - 1
    per_span = basis.at_grid.shape[1] // spans
    return basis.at_grid[:, np.arange(basis.at_grid.shape[1]) % per_span % THINNING == 0]


class Peer:
    """Programs of motions in a spline space, built once and solved for any ends and limits."""

    def __init__(self, basis: Basis) -> None:
        nq, m = ROBOT.nq, basis.n - 2 * REST_POINTS
        value = build(ROBOT)[1]
        free, T = ca.MX.sym("free", m, nq), ca.MX.sym("T")
        start, goal = ca.MX.sym("start", 1, nq), ca.MX.sym("goal", 1, nq)
        p = ca.MX.sym("p", value.size1_in(1))
        rates = ca.MX.sym("rates", 3, nq)
        points = ca.vertcat(ca.repmat(start, REST_POINTS, 1), free, ca.repmat(goal, REST_POINTS, 1))
        y = ca.vertcat(*((ca.DM(basis.at_nodes[d]) @ points / T**d).T for d in range(3)))
        cost, tau = value.map(len(basis.nodes))(y, ca.repmat(p, 1, len(basis.nodes)))
        rows = [
            ca.vec((ca.DM(at) @ points / T ** (d + 1)) / ca.repmat(rates[d, :], len(at), 1))
            for d, at in enumerate(thinned(basis))
        ]
        self._m, self._nq, self._rows = m, nq, sum(row.numel() for row in rows)
        self._nodes = len(basis.nodes)
        self._solver = ca.nlpsol(
            "peer",
            "ipopt",
            {
                "x": ca.vertcat(ca.vec(free), T),
                "p": ca.vertcat(p, start.T, goal.T, ca.vec(rates)),
                "f": T * ca.dot(ca.DM(basis.weights), cost.T),
                "g": ca.vertcat(*rows, ca.vec(tau)),
            },
            {
                "ipopt.print_level": 0,
                "print_time": False,
                "ipopt.sb": "yes",
                "ipopt.tol": 1e-7,
                "ipopt.max_iter": 500,
            },
        )

    def solve(self, program: NonlinearProgram, free: Array, duration: float) -> Optimum:
        """Local optimum near a guess, under the limits and duration bounds of the program."""
        limits, line = program.limits, program.coordinates
        bounds = np.concatenate([np.ones(self._rows), np.tile(limits.tau_max, self._nodes)])
        found = self._solver(
            x0=np.append(free.T.ravel(), duration),
            p=np.concatenate([program.p, line.start, line.goal, limits.rates.T.ravel()]),
            lbx=np.append(np.repeat(limits.q_min, self._m), program.t_min),
            ubx=np.append(np.repeat(limits.q_max, self._m), program.t_max),
            lbg=-bounds,
            ubg=bounds,
        )
        x = found["x"].full().ravel()
        return Optimum(
            converged=bool(self._solver.stats()["success"]),
            cost=float(found["f"]),
            duration=float(x[-1]),
            free=x[:-1].reshape(self._nq, self._m).T,
        )
