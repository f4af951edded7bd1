"""Public entry point: `optimize(problem)` finds the motion of least energy."""

from __future__ import annotations

import time

from joulepath.optimizer.deadline import Clock
from joulepath.optimizer.dynamics.kernel import kernel_for
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.progress import Tell, no_listener, only_news
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.solve.methods import METHODS


@checked_arguments
def optimize(
    problem: Problem,
    clock: Clock = time.perf_counter,
    tell: Tell = no_listener,
    progress: bool = True,
) -> Solution:
    """Find the motion of least energy between a problem's targets, certified against every limit.

    Args:
        problem: arm, targets, and what is asked of the motion. Its `deadline` bounds the wall time.
        clock: function that returns the time [s].
        tell: gets the progress while the search runs: candidates, and the best motion so far.
        progress: whether a bar may show the progress, on a terminal or in a notebook, unless
            `tell` is given.

    Returns:
        The motion with its energy, a proven lower bound on the energy of any motion, and its
        certificate.

    Raises:
        UnreachablePose: no configuration within the limits reaches a pose.
        NoConfigurationFound: a search found no configuration of a pose.
        SingularPose: a pose is reached only on a self-motion of unknown form.
        UnreachableTargets: none of several targets can be reached.
        InCollision: every configuration at the start, or at the goal, collides.
        TorqueInfeasible: the arm cannot hold or move its load.
        PathInfeasible: no configuration leads along the whole tool path.
        DurationTooShort: no motion is as fast as asked for.
        NoTrajectory: every candidate failed.
        DeadlineExceeded: the deadline passed before any motion was certified.
        InvalidProblem: the payload is beyond the robot's rating, or an end outside the tool's cone.
    """
    with one_thread(), progress_bar("Optimising", tell, progress) as tell:
        return Run(problem, clock=clock, tell=only_news(tell), seeks_baselines=True).solution()


def warm_up(robot_name: str) -> None:
    """Load a robot and its kernel and solve a small problem, so that the first request is fast."""
    robot = load_robot(robot_name)
    kernel_for(robot)
    middle = (robot.limits.q_min + robot.limits.q_max) / 2
    for method, solver in METHODS.items():
        # a method that takes seconds would delay the first requests
        if solver.most_solved is None:
            problem = Problem(
                arm=Arm(robot=robot), start=middle + 0.1, goal=middle + 0.4, method=method
            )
            optimize(problem, progress=False)
