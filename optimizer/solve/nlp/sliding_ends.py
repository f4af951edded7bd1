"""Ends that may slide along the curves of configurations that hold their poses: kept by every
iterate of an NLP.

To first order, the steps that keep the poses move an end along the tangent of its curve. They form
the null space in which the QP is solved. After each step the ends are put back on their curves
exactly. What this moves them by, all of the motion follows along the rest-to-rest quintic: an end
that moved alone would need a jerk beyond the limits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.sparse import csr_array

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram


@dataclass(frozen=True)
class Slide:
    """Ends on their curves: the row of each among the free control points, its curve's tangent and
    bend (r,), and the share (m,) of its displacement that every control point follows."""

    rows: tuple[int, ...]
    shares: tuple[Array, ...]
    tangents: tuple[Array, ...]
    bends: tuple[Callable[[], Array], ...]

    def null_space(self, n: int) -> csr_array:
        """Orthonormal steps (n, count) of the n decision variables that keep the poses to first
        order.

        Each variable has a share in one of the steps: its own, or that along the tangent of its
        curve.
        """
        share, fresh = np.ones(n), np.ones(n, dtype=np.intp)
        for row, tangent in zip(self.rows, self.tangents, strict=True):
            first, r = row * len(tangent), len(tangent)
            share[first : first + r] = tangent
            fresh[first + 1 : first + r] = 0
        step = np.cumsum(fresh) - 1
        return csr_array((share, step, np.arange(n + 1)), shape=(n, int(step[-1]) + 1))

    def curvature(self, pull: Array, n: int) -> Array:
        """Second derivatives (n, n) of the poses, weighed by their multipliers: the forces that
        balance the gradient `pull` (m, r) of the cost and the limits."""
        result = np.zeros((n, n))
        for row, share, tangent, bend in zip(
            self.rows, self.shares, self.tangents, self.bends, strict=True
        ):
            own = slice(row * len(tangent), (row + 1) * len(tangent))
            result[own, own] = float(share @ pull @ bend()) * np.outer(tangent, tangent)
        return result


class SlidingEnds:
    """The ends of an NLP that slide: `start_curve` and `goal_curve` of the program, of which one
    may be None.
    """

    def __init__(self, program: NonlinearProgram) -> None:
        last = program.free_count - 1
        quintic = program.free_points(program.basis.quintic[:, None])[:, 0]
        both = ((0, 1 - quintic, program.start_curve), (last, quintic, program.goal_curve))
        self._curves = [(row, share, curve) for row, share, curve in both if curve is not None]

    def put(self, free: Array, near: Slide | None = None) -> tuple[Array, Slide] | None:
        """The free control points (m, r) with the ends put on their curves; None if an end has no
        place near.

        The tangents keep the sense that they have at the ends `near`.
        """
        tangents, bends = list[Array](), list[Callable[[], Array]]()
        for k, (row, share, curve) in enumerate(self._curves):
            q = curve.put(free[row])
            if q is None:
                return None
            free = free + np.outer(share, q - free[row])
            free[row] = q
            tangent = curve.tangent(q)
            tangents.append(
                tangent if near is None or tangent @ near.tangents[k] >= 0 else -tangent
            )
            bends.append(partial(curve.bend, q, tangents[-1]))
        rows, shares, _ = zip(*self._curves, strict=True)
        return free, Slide(rows, shares, tuple(tangents), tuple(bends))
