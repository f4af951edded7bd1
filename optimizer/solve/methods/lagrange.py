"""`lagrange`: one polynomial per joint, optimised by its values at Chebyshev nodes.

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
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.limit_repair import sampled_overshoot
from joulepath.optimizer.solve.methods.planned_paths import no_polynomial_around
from joulepath.optimizer.solve.methods.solve_result import SolveResult, SolveStatus, with_effort
from joulepath.optimizer.solve.methods.sqp_method import SqpMethod


class Lagrange(SqpMethod):
    """Solves a candidate by polynomials of degree `nodes` + 5."""

    nodes: ClassVar[int] = 10
    """Free values of every polynomial. Two more save a UR5e some 0.15 % of the energy and take a
    fifth more time, at all degrees from 9 to 19; Bernstein coefficients lose a digit with every
    three nodes."""

    guess_baselines: ClassVar[tuple[BaselineName, ...]] = (
        "trapezoid",
        "quintic",
        "ruckig",
        "ruckig_slowed",
        "controller_default",
    )
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic",)

    def solve(self) -> SolveResult:
        """Solve from the time-optimal jerk-limited motion, then from the quintic.

        If both attempts collide, planned collision-free paths follow.
        """
        fastest = time_optimal(self.coordinates.limits, self.q_start, self.q_goal)
        straight = quintic(self.q_start, self.q_goal, 1.0)
        tried: list[SolveResult] = []
        for guess in (fastest, straight) if fastest.duration > 0 else (straight,):
            tried.append(self.solve_from(guess.q, guess.t, fine=False))
            if tried[-1].status in (SolveStatus.SOLVED, SolveStatus.OUT_OF_TIME):
                return with_effort(tried[-1], tried)
        # an attempt that collides came further than an infeasible one
        collided = [
            result
            for result in tried
            if result.status is SolveStatus.FAILED and result.collision is not None
        ]
        if tried[-1].status is SolveStatus.FAILED and collided:
            failed = no_polynomial_around(collided[-1], polynomials(self.nodes).degree)
            tried.append(self.from_planned_paths(failed))
        return with_effort(tried[-1], tried)

    def along_path(self, q: Array, t: Array) -> SolveResult:
        """Solve from samples q (k, nq) [rad] of a collision-free path at times t (k,) in [0, 1]."""
        space = polynomials(self.nodes)
        return self.improve(Guess(space, space.fit(q, t), 0.0, collision_free=True))

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """Solve from samples q (k, nq) [rad] at times t (k,) [s]."""
        space, duration = polynomials(self.nodes), float(t[-1])
        return self.improve(Guess(space, space.fit(q, t / duration), duration))

    def overshoot(self, spline: Spline) -> tuple[Array, Array]:
        """Excess (nq,) [rad] below and above the position limits, measured at samples.

        The values at the nodes do not bound a polynomial.
        """
        return sampled_overshoot(self.prepared, spline)
