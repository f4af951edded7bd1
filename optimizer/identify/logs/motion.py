"""The motion of a log, which its efforts and its power are compared with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.dynamics.link_regressor import rigid_torques
from joulepath.optimizer.problem.arm import Payload


def thinned(count: int, most: int, edge: int = 0) -> Indices:
    """Evenly spaced rows of so many, some at either end left out; about `most` at most."""
    return np.arange(edge, count - edge, max(1, -(-count // most)))


@dataclass(frozen=True, eq=False)
class Motion:
    """q, v, a (n, joints) [rad, s] of an arm with a payload, under `gravity` (3,) [m/s²], at a rate
    [Hz].
    """

    robot: Robot
    payload: Payload
    gravity: Array
    q: Array
    v: Array
    a: Array
    rate: float

    def at(self, rows: Indices) -> Self:
        """The motion at some rows, in double precision."""
        return replace(
            self,
            q=self.q[rows].astype(float),
            v=self.v[rows].astype(float),
            a=self.a[rows].astype(float),
        )

    def rigid_torques(self) -> Array:
        """Torques (n, joints) [N·m] of links and payload."""
        payload = self.payload
        model = self.robot.loaded_model(payload.mass, payload.com, payload.inertia, self.gravity)
        return rigid_torques(model, self.q, self.v, self.a)
