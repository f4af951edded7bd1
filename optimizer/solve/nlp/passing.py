"""Passes of a spline through configurations, at free times: equations met by every iterate.

At a pass k the spline s(τ) goes through s_k at some τ_k. To first order, a step of the control
points keeps the pass if it displaces s(τ_k) along the tangent only. These steps form the null space
in which the QP is solved. After a step the curve is put back on its passes exactly, by the least
change of the control points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.motion.bspline import DEGREE
from joulepath.optimizer.motion.passing import pass_times, refined_pass_times
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram


@dataclass(frozen=True)
class PassingSettings:
    """Settings of the passes of an NLP."""

    resting_speed: float = 1e-2
    """Speed by τ below which the curve rests at a pass: then it has no tangent, and the pass cannot
    slide [rad per duration]."""

    slide: float = 0.4
    """Share of the time to its neighbours by which a pass may move in one step."""

    least_gap: float = 1e-3
    """Least time between passes, relative to the duration."""


PASSING = PassingSettings()


@dataclass(frozen=True)
class Passing:
    """Passes of a curve."""

    times: Array
    """Times of the passes in (0, 1), shape (k,)."""

    at: Array
    """Basis functions of the free control points, shape (k, m)."""

    rising: Array
    """First derivatives of the basis functions by τ, shape (k, m)."""

    tangent: Array
    """First derivatives of the curve by τ, shape (k, r)."""

    bend: Array
    """Second derivatives of the curve by τ, shape (k, r)."""

    @property
    def _moving(self) -> Mask:
        """Mask (k,) of the passes at which the curve does not rest."""
        return np.asarray(np.linalg.norm(self.tangent, axis=1) > PASSING.resting_speed)

    def gradients_across(self) -> Array:
        """Gradients (rows, m r) by the free control points of displacements across the curve."""
        r, rows = self.tangent.shape[1], list[Array]()
        for at, tangent, moving in zip(self.at, self.tangent, self._moving, strict=True):
            normals = np.eye(r)
            if moving:
                normals = np.linalg.qr(tangent[:, None], mode="complete")[0][:, 1:].T
            rows.append(np.einsum("m,ij->imj", at, normals).reshape(len(normals), -1))
        return np.concatenate(rows)

    def null_space(self, n: int) -> Array:
        """Orthonormal basis (n, count) of the steps that keep the passes to first order."""
        across = self.gradients_across()
        gradients = np.zeros((n, len(across)))
        gradients[: across.shape[1]] = across.T
        return np.linalg.qr(gradients, mode="complete")[0][:, len(across) :]

    def curvature(self, pull: Array, n: int) -> Array:
        """Hessian of the passes, weighted by their multipliers.

        Args:
            pull: gradient of cost and limits, which the multipliers balance, shape (m, r).
            n: number of decision variables.

        Returns:
            The Hessian, shape (n, n).
        """
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
        """Put the curve on its passes.

        Args:
            free: free control points, shape (m, r).
            near: passes of an iterate nearby, around which passes are searched; None to search
                everywhere.

        Returns:
            The free control points, and their passes.
        """
        curve, target = self._curve(free), self.configurations
        if near is None:
            times = pass_times(curve, target)
        else:
            gaps = np.diff(np.concatenate([[0.0], near.times, [1.0]]))
            times = refined_pass_times(curve, target, near.times, PASSING.slide * float(gaps.min()))
        # two passes at the same time could not both be kept
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
    """The times (k,), with the least gap between neighbours, and before the end."""
    least = PASSING.least_gap * np.arange(1, len(times) + 1)
    return np.asarray(
        np.minimum(np.maximum.accumulate(np.maximum(times, least) - least) + least, 1 - least[::-1])
    )
