"""Values and derivatives of the NLP of a retiming at one point."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.path_constraints import ConstraintRatios

_Scalar = TypeVar("_Scalar", bound=np.generic)


@dataclass(frozen=True, eq=False)
class RetimingValues:
    """Cost and constraints at one point x."""

    x: Array
    """Control values and duration, shape (m + 1,)."""

    cost: float
    """Cost [J]."""

    z: Array
    """q, v and a at the nodes, shape (3, N, nq) [rad, rad/s, rad/s²]."""

    at_path: Array
    """q and v at the path points, shape (2, K, nq) [rad, rad/s]."""

    ratios: tuple[Array, Array, Array, Array]
    """Constraints as ratios of at most 1: rates (3, M, nq) and torques (N, nq) relative to their
    limits, which are at least -1, too; path constraints (K, c), and the least speed minus the speed
    (K, 0 or 1), both shifted by their bounds."""

    @property
    def T(self) -> float:
        """Duration [s]."""
        return float(self.x[-1])

    @cached_property
    def ratio(self) -> Array:
        """All ratios, shape (rows,)."""
        return np.concatenate([each.ravel() for each in self.ratios])

    @cached_property
    def two_sided(self) -> Mask:
        """Mask (rows,) of the ratios that are at least -1."""
        rates, torques, *_ = self.ratios
        return np.asarray(np.arange(len(self.ratio)) < rates.size + torques.size)

    @cached_property
    def violation(self) -> Array:
        """Largest excess (g,) over 1 in every group of ratios: rates by derivative and joint,
        torques by joint, path constraints by constraint, and the least speed."""
        rates, torques, *others = self.ratios
        largest = [
            np.abs(rates).max(axis=1).ravel(),
            np.abs(torques).max(axis=0),
            *(each.max(axis=0, initial=0.0) for each in others),
        ]
        return np.asarray(np.maximum(np.concatenate(largest) - 1, 0.0))

    @cached_property
    def group(self) -> Array:
        """Number of the group of every ratio, shape (rows,)."""
        rates, *others = self.ratios
        orders, _, nq = rates.shape
        of_rates = np.arange(orders)[:, None, None] * nq + np.arange(nq)
        found, first = [np.broadcast_to(of_rates, rates.shape).ravel()], orders * nq
        for each in others:
            found.append(np.broadcast_to(first + np.arange(each.shape[1]), each.shape).ravel())
            first += each.shape[1]
        return np.concatenate(found)

    def by_kind(self, values: npt.NDArray[_Scalar]) -> list[npt.NDArray[_Scalar]]:
        """Values (rows,) in the shapes of `ratios`."""
        ends = np.cumsum([each.size for each in self.ratios])
        parts = np.split(values, ends[:-1])
        return [part.reshape(each.shape) for part, each in zip(parts, self.ratios, strict=True)]


@dataclass(frozen=True, eq=False)
class RetimingDerivatives:
    """Derivatives at one point."""

    gradient: Array
    """Gradient of the cost by x, shape (m + 1,)."""

    hessian: Array
    """Hessian of the Lagrangian by x, shape (m + 1, m + 1), without the second derivatives of path
    constraints by q and v."""

    slopes: Array
    """Derivatives of the control points by the control values, shape (n, nq, m)."""

    torque_by_y: Array
    """Derivatives of the torque ratios by q, v and a, shape (N, nq, 3 nq)."""

    path: ConstraintRatios
    """Path constraints with their gradients."""

    speed: ConstraintRatios
    """Speed relative to the least one with its gradients."""

    least_by_values: Array
    """Derivatives of the least speed by the control values, shape (K, m)."""
