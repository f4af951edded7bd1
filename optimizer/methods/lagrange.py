"""`lagrange`: every joint one polynomial over the motion, its values at Chebyshev nodes and the duration optimised.

L.-P. Luo, C. Yuan, R.-J. Yan, Q. Yuan, J. Wu, K.-S. Shin, C.-S. Han, "Trajectory planning for energy minimization of
industry robotic manipulators using the Lagrange interpolation method", Int. J. Precis. Eng. Manuf. 16, 2015: Lagrange
interpolation at Chebyshev nodes. The SQP with exact derivatives is this project's.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
from scipy.interpolate import BSpline

from models.robot import Array
from optimizer.methods.method import SolveResult
from optimizer.methods.sqp_method import Guess, SqpMethod
from optimizer.solution import BaselineName
from optimizer.trajectories.polynomial import polynomials
from optimizer.trajectories.ruckig_motion import time_optimal
from optimizer.trajectories.spline import Spline
from optimizer.trajectories.time_scalings import quintic

# degree 15: every two nodes more save a UR5e some 0.15 % and take a fifth more time, here as at degrees 9 to 19, while
# Bernstein's coefficients lose a digit with each three
NODES = 10
# points at which a motion's positions are held against their limits
POSITION_POINTS = 512
# nodes are moved inwards by this multiple of what the polynomial exceeds a limit by between them
POSITION_REPAIR = 1.5
# a joint that starts or ends on its limit is beyond it by no more than this [rad]
ROUNDING = 1e-9


class Lagrange(SqpMethod):
    """Solves a candidate over polynomials of degree NODES + 5."""

    guess_baselines: ClassVar[tuple[BaselineName, ...]] = (
        "trapezoid",
        "quintic",
        "ruckig",
        "ruckig_slowed",
        "controller_default",
    )

    def solve(self) -> SolveResult:
        """From the fastest jerk-limited motion, then from the quintic if that finds nothing."""
        fastest = time_optimal(self.coordinates.limits, self.q_start, self.q_goal)
        if fastest.duration > 0:
            first = self.solve_from(fastest.q, fastest.t, fine=False)
            if first.status in ("solved", "out of time"):
                return first
        else:
            first = SolveResult("failed", "not tried")
        straight = quintic(self.q_start, self.q_goal, 1.0)
        second = self.solve_from(straight.q, straight.t, fine=False)
        return replace(second, iterations=first.iterations + second.iterations, solves=first.solves + second.solves)

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """From samples q (k, nq) at times t (k,)."""
        space, duration = polynomials(NODES), float(t[-1])
        return self.improve(Guess(space, space.fit(q, t / duration), duration))

    def _overshoot(self, spline: Spline) -> tuple[Array, ...]:
        """Values at nodes do not bound a polynomial between them."""
        q = BSpline(spline.knots, spline.control_points, spline.degree)(
            np.linspace(0.0, spline.duration, POSITION_POINTS)
        )
        limits = self.prepared.problem.arm.active_limits
        below, above = limits.q_min - q.min(axis=0), q.max(axis=0) - limits.q_max
        return tuple(np.where(beyond > ROUNDING, POSITION_REPAIR * beyond, 0.0) for beyond in (below, above))
