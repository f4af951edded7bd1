"""Motion of a log, which explains its efforts and its power."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.dynamics.link_regressor import rigid_torques
from joulepath.optimizer.problem.arm import Payload


@dataclass(frozen=True)
class RegressionSettings:
    """Settings of the regressions of efforts against the motion."""

    knee: float = 0.02
    """Speed over which Coulomb friction reverses [rad/s]."""


REGRESSION = RegressionSettings()


def thinned(count: int, most: int, edge: int = 0) -> Indices:
    """Evenly spaced rows of a log.

    Args:
        count: number of rows of the log.
        most: approximate largest number of rows.
        edge: rows left out at either end.
    """
    return np.arange(edge, count - edge, max(1, -(-count // most)))


@dataclass(frozen=True, eq=False)
class LoggedMotion:
    """Motion of an arm with a payload."""

    robot: Robot
    payload: Payload
    gravity: Array
    """Gravity (3,) in the base frame [m/s²]."""
    q: Array
    """Positions (n, joints) [rad]."""
    v: Array
    """Velocities (n, joints) [rad/s]."""
    a: Array
    """Accelerations (n, joints) [rad/s²]."""
    rate: float
    """Rate [Hz]."""

    def at(self, rows: Indices) -> Self:
        """The motion at some rows, in double precision."""
        return replace(
            self,
            q=self.q[rows].astype(float),
            v=self.v[rows].astype(float),
            a=self.a[rows].astype(float),
        )

    def rigid_torques(self) -> Array:
        """Rigid-body torques (n, joints) [N·m] of links and payload."""
        payload = self.payload
        model = self.robot.loaded_model(payload.mass, payload.com, payload.inertia, self.gravity)
        return rigid_torques(model, self.q, self.v, self.a)


def smooth_sign(v: Array) -> Array:
    """Sign of velocities (n,) [rad/s], smoothed over the knee."""
    return np.asarray(v / np.sqrt(v * v + REGRESSION.knee * REGRESSION.knee))
