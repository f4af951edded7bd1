"""Paths of the tool from one configuration, shared by tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from joulepath import Arm, Pose, Problem, Solution, ToolPath
from joulepath.models.robot import Array
from tests.optimizer.moves import AMPLE, ROBOT, tcp_pose

HOME = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
ARM = Arm(robot=ROBOT, collisions=False)


def moved(shift: list[float] | Array, turn: Rotation | None = None) -> Pose:
    """The home pose, shifted in the base frame [m] and turned about the tool's own axes."""
    T = tcp_pose(HOME).T.copy()
    T[:3, 3] += shift
    if turn is not None:
        T[:3, :3] = T[:3, :3] @ turn.as_matrix()
    return Pose(T)


def along(goal: Pose, start: Any = HOME, **given: Any) -> Problem:
    path = given.pop("path", ToolPath())
    return Problem(
        **{"arm": ARM, "start": start, "goal": goal, "tool_path": path, "deadline": AMPLE} | given
    )


def poses_of(found: Solution, count: int = 3000) -> Array:
    """Poses (k, 4, 4) of the TCP between the samples of the certificate."""
    spline = found.trajectory.spline
    return np.array([tcp_pose(q).T for q in spline.curve(np.linspace(0.0, spline.duration, count))])
