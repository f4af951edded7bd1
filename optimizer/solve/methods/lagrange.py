"""`lagrange`: one polynomial per joint; its values at Chebyshev nodes and the duration are
optimised.

L.-P. Luo, C. Yuan, R.-J. Yan, Q. Yuan, J. Wu, K.-S. Shin, C.-S. Han, "Trajectory planning for
energy minimization of industry robotic manipulators using the Lagrange interpolation method", Int.
J. Precis. Eng. Manuf. 16, 2015: Lagrange interpolation at Chebyshev nodes. The SQP with exact
derivatives is this project's.
"""

from __future__ import annotations

from typing import ClassVar

from joulepath.models.robot import Array
from joulepath.optimizer.motion.polynomial import polynomials
from joulepath.optimizer.motion.ruckig_motion import time_optimal
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.motion.time_scalings import quintic
from joulepath.optimizer.result.solution import BaselineName
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.limit_repair import sampled_overshoot
from joulepath.optimizer.solve.methods.planned_paths import no_polynomial_around
from joulepath.optimizer.solve.methods.solve_result import SolveResult, SolveStatus, with_effort
from joulepath.optimizer.solve.methods.sqp_method import SqpMethod

# degree 15. Two more nodes save a UR5e some 0.15 % of the energy and take a fifth more time, at all
# degrees from 9 to 19; Bernstein's coefficients lose a digit with every three nodes
NODES = 10


class Lagrange(SqpMethod):
    """Solves a candidate by polynomials of degree NODES + 5."""

    guess_baselines: ClassVar[tuple[BaselineName, ...]] = (
        "trapezoid",
        "quintic",
        "ruckig",
        "ruckig_slowed",
        "controller_default",
    )
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic",)

    def solve(self) -> SolveResult:
        """From the time-optimal jerk-limited motion; if that finds no motion, from the quintic.

        If both collide, from planned collision-free paths.
        """
        fastest = time_optimal(self.coordinates.limits, self.q_start, self.q_goal)
        straight = quintic(self.q_start, self.q_goal, 1.0)
        tried: list[SolveResult] = []
        for guess in (fastest, straight) if fastest.duration > 0 else (straight,):
            tried.append(self.solve_from(guess.q, guess.t, fine=False))
            if tried[-1].status in (SolveStatus.SOLVED, SolveStatus.OUT_OF_TIME):
                return with_effort(tried[-1], tried)
        # of two failures, the one with a collision came further
        collided = [
            result
            for result in tried
            if result.status is SolveStatus.FAILED and result.collision is not None
        ]
        if tried[-1].status is SolveStatus.FAILED and collided:
            failed = no_polynomial_around(collided[-1], polynomials(NODES).degree)
            tried.append(self.from_planned_paths(failed))
        return with_effort(tried[-1], tried)

    def along_path(self, q: Array, t: Array) -> SolveResult:
        """From samples q (k, nq) of a collision-free path at times t (k,), which end at 1."""
        space = polynomials(NODES)
        return self.improve(Guess(space, space.fit(q, t), 0.0, collision_free=True))

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """From samples q (k, nq) at times t (k,)."""
        space, duration = polynomials(NODES), float(t[-1])
        return self.improve(Guess(space, space.fit(q, t / duration), duration))

    def overshoot(self, spline: Spline) -> tuple[Array, Array]:
        """Excess (nq,) [rad] below and above the position limits: values at nodes do not bound a
        polynomial between.
        """
        return sampled_overshoot(self.prepared, spline)
