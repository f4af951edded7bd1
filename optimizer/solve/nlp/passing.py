"""Configurations that a spline passes through, at times that are free: equations of an NLP, met by
every iterate.

At a pass k the spline s(τ) goes through s_k at some τ_k. Along the curve the pass may slide, across
it the curve is held: to first order, the steps of the control points that keep the pass are those
whose displacement of s(τ_k) is along the tangent there. They form the null space in which the QP is
solved. After each step the curve is put back on its passes exactly, by the least change of the
control points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.motion.bspline import DEGREE
from joulepath.optimizer.motion.passing import nearby, pass_times
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram

# rad per duration: a curve that is slower at a pass rests there, and has no tangent along which the
# pass may slide
RESTING = 1e-2
# share of the time to its neighbours by which a pass may slide in one step
SLIDE = 0.4


@dataclass(frozen=True)
class Passing:
    """Where a curve passes: times (k,) in (0, 1), the basis functions `at` (k, m) of the free
    control points there and their `rising` (k, m), and the curve's tangent and bend (k, r) by τ."""

    times: Array
    at: Array
    rising: Array
    tangent: Array
    bend: Array

    @property
    def _moving(self) -> Mask:
        """Whether the curve does not rest at each of the passes (k,)."""
        return np.asarray(np.linalg.norm(self.tangent, axis=1) > RESTING)

    def held(self) -> Array:
        """Gradients (rows, m r) by the free control points of what a step must not change."""
        r, rows = self.tangent.shape[1], list[Array]()
        for at, tangent, moving in zip(self.at, self.tangent, self._moving, strict=True):
            across = np.eye(r)
            if moving:
                across = np.linalg.qr(tangent[:, None], mode="complete")[0][:, 1:].T
            rows.append(np.einsum("m,ij->imj", at, across).reshape(len(across), -1))
        return np.concatenate(rows)

    def null_space(self, n: int) -> Array:
        """Orthonormal steps (n, count) of the n decision variables that keep the passes to first
        order.
        """
        held = self.held()
        gradients = np.zeros((n, len(held)))
        gradients[: held.shape[1]] = held.T
        return np.linalg.qr(gradients, mode="complete")[0][:, len(held) :]

    def curvature(self, pull: Array, n: int) -> Array:
        """Second derivatives (n, n) of the passes, weighed by their multipliers: the forces that
        balance the gradient `pull` (m, r) of the cost and the limits."""
        multiplier = -np.linalg.lstsq(self.at.T, pull, rcond=None)[0]
        result = np.zeros((n, n))
        size = (self.tangent**2).sum(axis=1)
        for k in np.flatnonzero(self._moving):
            force = multiplier[k] - self.tangent[k] * (multiplier[k] @ self.tangent[k]) / size[k]
            slide = -np.outer(self.at[k], self.tangent[k] / size[k]).ravel()
            turned = np.outer(self.rising[k], force).ravel()
            both = np.outer(turned, slide)
            result[: len(slide), : len(slide)] += (
                both + both.T + (force @ self.bend[k]) * np.outer(slide, slide)
            )
        return result


class Passes:
    """The passes of an NLP: `configurations` (k, r) in the spline's coordinates."""

    def __init__(self, program: NonlinearProgram, configurations: Array) -> None:
        self.p, self.configurations = program, configurations

    def put(self, free: Array, near: Passing | None = None) -> tuple[Array, Passing]:
        """The control points (m, r) put on the passes, and where these are.

        They are looked for close to where they were in the curve `near`, or everywhere.
        """
        curve, target = self._curve(free), self.configurations
        if near is None:
            times = pass_times(curve, target)
        else:
            gaps = np.diff(np.concatenate([[0.0], near.times, [1.0]]))
            times = nearby(curve, target, near.times, SLIDE * float(gaps.min()))
        # two passes at one time cannot both be kept
        times = _apart(times)
        at = self._columns(times, 0)
        missing = target - curve(times)
        free = free + np.linalg.lstsq(at, missing, rcond=None)[0]
        curve = self._curve(free)
        return free, Passing(times, at, self._columns(times, 1), curve(times, 1), curve(times, 2))

    def _columns(self, times: Array, derivative: int) -> Array:
        return self.p.free_columns(self.p.basis.matrix(times, derivative))

    def _curve(self, free: Array) -> BSpline:
        return BSpline(self.p.basis.knots, self.p.points(free), DEGREE)


def _apart(times: Array) -> Array:
    """The times (k,), each at least a thousandth of the duration after the one before and before
    the end.
    """
    least = 1e-3 * np.arange(1, len(times) + 1)
    return np.asarray(
        np.minimum(np.maximum.accumulate(np.maximum(times, least) - least) + least, 1 - least[::-1])
    )
