"""State validity checks for the path planner: one configuration or line at a time.

`CollisionModel` computes distances at many configurations at once. A planner only needs the
validity of a configuration, or of those along a line: this takes some microseconds here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.arm import Arm


class StateValidityChecker:
    """Checks that all bodies keep their margins and an additional `reserve` [m], and that the tool
    axis is within its cone. Not for several threads at once.

    `model` is the collision model of the arm.
    """

    def __init__(self, arm: Arm, model: CollisionModel, reserve: float = 0.0) -> None:
        self._cone = arm.tool_cone
        # Tool axis in the frame of the last link.
        self._axis = None if self._cone is None else T_last_tcp(arm)[:3, :3] @ self._cone.axis
        self._clearance = model.clearance_check(reserve)
        self._clouds, self._model, self._reserve = (
            np.flatnonzero(model.geometry.is_cloud),
            model,
            reserve,
        )

    def is_valid(self, q: Array) -> bool:
        """Whether q (nq,) [rad] is collision-free with its margins, and within the tool cone."""
        if not self._clearance.is_met(self._model.coupling.positions(q)):
            return False
        if len(self._clouds) and self._hits_cloud(q):
            return False
        if self._cone is None:
            return True
        tool_axis = self._clearance.frames[-1, :3, :3] @ self._axis
        return bool(tool_axis @ self._cone.direction >= math.cos(self._cone.half_angle))

    def is_valid_between(self, q: Array, q_end: Array, count: int) -> tuple[bool, int]:
        """Whether `count` evenly spaced configurations from q to q_end (nq,) [rad], without the
        first, are valid, and how many of these were checked.
        """
        if self._cone is None and not len(self._clouds):
            positions = self._model.coupling.positions
            return self._clearance.is_met_between(positions(q), positions(q_end), count)
        for checked, state in enumerate(np.linspace(q_end, q, count, endpoint=False), start=1):
            if not self.is_valid(state):
                return False, checked
        return True, count

    def _hits_cloud(self, q: Array) -> bool:
        """Whether a body is nearer to a part of a cloud than allowed, by the cloud's own tree."""
        frames = self._model.frames(q[None])
        least = self._model.pair_distances(frames, self._clouds, self._reserve).distance.min()
        return bool(least < self._reserve)


@dataclass(frozen=True)
class ValidityCheckers:
    """Checkers of an arm by their reserves, each built on first use, since this takes
    milliseconds.
    """

    arm: Arm
    model: CollisionModel
    _made: dict[float, StateValidityChecker] = field(default_factory=dict, repr=False)

    def __getitem__(self, reserve: float) -> StateValidityChecker:
        if reserve not in self._made:
            self._made[reserve] = StateValidityChecker(self.arm, self.model, reserve)
        return self._made[reserve]
