"""Ends that slide along self-motions of their poses: equations met by every iterate of an NLP.

To first order, a step keeps a pose if it moves the end along the tangent of its curve. These steps
form the null space in which the QP is solved. After a step the ends are put back on their curves
exactly. The whole motion follows the displacement along the rest-to-rest quintic: moving an end
alone would need a jerk beyond the limits.
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
    """Ends on their curves, one entry per sliding end."""

    rows: tuple[int, ...]
    """Rows of the ends among the free control points."""

    shares: tuple[Array, ...]
    """Shares (m,) of an end's displacement by which the control points move."""

    tangents: tuple[Array, ...]
    """Unit tangents (r,) of the curves."""

    bends: tuple[Callable[[], Array], ...]
    """Second derivatives (r,) of the curves by their arc length."""

    def null_space(self, n: int) -> csr_array:
        """Orthonormal basis (n, count) of the steps that keep the poses to first order.

        A control point at an end moves along the tangent; any other variable has its own step.
        """
        share, fresh = np.ones(n), np.ones(n, dtype=np.intp)
        for row, tangent in zip(self.rows, self.tangents, strict=True):
            first, r = row * len(tangent), len(tangent)
            share[first : first + r] = tangent
            fresh[first + 1 : first + r] = 0
        step = np.cumsum(fresh) - 1
        return csr_array((share, step, np.arange(n + 1)), shape=(n, int(step[-1]) + 1))

    def curvature(self, pull: Array, n: int) -> Array:
        """Hessian of the poses, weighted by their multipliers.

        Args:
            pull: gradient of cost and limits, which the multipliers balance, shape (m, r).
            n: number of decision variables.

        Returns:
            The Hessian, shape (n, n).
        """
        result = np.zeros((n, n))
        for row, share, tangent, bend in zip(
            self.rows, self.shares, self.tangents, self.bends, strict=True
        ):
            own = slice(row * len(tangent), (row + 1) * len(tangent))
            result[own, own] = float(share @ pull @ bend()) * np.outer(tangent, tangent)
        return result


class SlidingEnds:
    """Sliding ends of an NLP, on its `start_curve` and `goal_curve`; one curve may be None."""

    def __init__(self, program: NonlinearProgram) -> None:
        last = program.free_count - 1
        quintic = program.free_points(program.basis.quintic[:, None])[:, 0]
        both = ((0, 1 - quintic, program.start_curve), (last, quintic, program.goal_curve))
        self._curves = [(row, share, curve) for row, share, curve in both if curve is not None]

    def put(self, free: Array, near: Slide | None = None) -> tuple[Array, Slide] | None:
        """Put the ends on their curves.

        Args:
            free: free control points, shape (m, r).
            near: ends of an iterate nearby, whose sense of the tangents is kept; None for any.

        Returns:
            The free control points and their ends; None if a curve has no point nearby.
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
