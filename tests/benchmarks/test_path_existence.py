"""The judge of tasks that are left out: it finds a path where there is one, and none to a goal that is shut in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.cells import cell_task
from benchmarks.path_existence import path_exists
from joulepath.optimizer.problem.scene import Obstacle, Scene, Sphere

# s: far more than a path on a table takes, and little where there is none
AMPLE, SHORT = 60.0, 0.2


def test_a_path_exists_where_a_task_is_solvable_and_not_into_an_obstacle() -> None:
    task = cell_task(0, 0)
    assert path_exists(task.arm, task.q_start, [task.q_goal], AMPLE)
    at_goal = np.eye(4)
    at_goal[:3, 3] = task.T_goal[:3, 3]
    ball = Obstacle("ball", Sphere(0.05), at_goal, 0.0)
    shut = replace(task.arm, scene=Scene([*task.arm.scene.obstacles, ball]))
    assert not path_exists(shut, task.q_start, [task.q_goal], SHORT)
