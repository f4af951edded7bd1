"""Concave friction torques between nodes of speed, for the greatest values H of `dual_bound`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, FrictionLaw


@dataclass(frozen=True)
class NodeSettings:
    """Settings of the nodes of speed; any nodes give a valid bound."""

    knees: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
    """Nodes near rest, in knees of Coulomb friction."""
    speeds: tuple[float, ...] = (
        *(0.02, 0.05, 0.09, 0.14, 0.2, 0.27),
        *(0.35, 0.44, 0.55, 0.67, 0.82, 1.0),
    )
    """The other nodes, as shares of the greatest speed."""
    most_knee: float = 0.01
    """Greatest node near rest, as a share of the greatest speed."""
    least_bend: float = 1e-12
    """Least change of the slope of the torque in an interval [N·m·s/rad], against division by 0."""


NODES = NodeSettings()


@dataclass(frozen=True)
class FrictionConjugate:
    """A concave friction torque of unloaded joints, bounded by its chords between nodes of speed.

    The C function of `speed_conjugate` computes the greatest values from these intervals.
    """

    first: Array
    """First speed of each interval, shape (k, nq) [rad/s]."""
    last: Array
    """Last speed of each interval, shape (k, nq) [rad/s]."""
    constant: Array
    """Value of the chord at speed 0, shape (k, nq) [N·m]."""
    slope: Array
    """Slope of the chord, shape (k, nq) [N·m·s/rad]."""
    sagitta: Array
    """Bound on the rise of the torque above its chord, shape (k, nq) [N·m]."""
    load: Array | None = None
    """Share of the carried torque that friction takes, shape (nq,); None if it takes none."""

    @classmethod
    def of(cls, law: FrictionLaw, v_max: Array) -> FrictionConjugate | None:
        """The intervals up to v_max (nq,) [rad/s]; None for a law with a negative coefficient.

        Such a law is not concave.
        """
        if (
            min(law.coulomb.min(), law.curved.min(), law.viscous.min()) < 0
            or law.knee <= 0
            or law.speed.min() <= 0
        ):
            return None
        if law.load is not None and not ((law.load >= 0) & (law.load < 1)).all():
            return None
        knee = np.minimum(law.knee, NODES.most_knee / NODES.knees[-1] * v_max)
        nodes = np.outer(NODES.knees, knee), np.outer(NODES.speeds, v_max)
        v = np.concatenate([np.zeros((1, len(v_max))), *nodes])
        torque, step = law.unloaded.torque(v), np.diff(v, axis=0)
        rate = law.coulomb * law.knee**2 / (v * v + law.knee**2) ** 1.5 + law.curved / np.hypot(
            v, law.speed
        )
        rate = rate + law.viscous
        slope = np.diff(torque, axis=0) / step
        # between two nodes the torque is below the tangents at both nodes; they intersect at a
        # distance `at` from the first node
        bend = np.maximum(rate[:-1] - rate[1:], NODES.least_bend)
        at = np.clip((np.diff(torque, axis=0) - rate[1:] * step) / bend, 0.0, step)
        sagitta = np.maximum((rate[:-1] - slope) * at, 0.0)
        return cls(v[:-1], v[1:], torque[:-1] - slope * v[:-1], slope, sagitta, law.load)

    @cached_property
    def by_joint(self) -> tuple[Array, ...]:
        """`first`, `last`, `constant`, `slope` and `sagitta`, each of shape (nq, k)."""
        intervals = self.first, self.last, self.constant, self.slope, self.sagitta
        return tuple(np.ascontiguousarray(each.T) for each in intervals)

    def stiffness(self, law: FrictionLaw) -> Array:
        """Approximate least second derivative of v tau_f(v) beyond Coulomb friction's step, shape
        (nq,).

        It is the unit of the weights of a dual bound, whose validity does not depend on it.
        """
        return np.asarray(law.loss_curvature(self.last).min(axis=0))
