"""joulepath itself: one candidate, the whole answer, and the straight line with an optimised time
scaling.
"""

from __future__ import annotations

from benchmarks.motion import SplineMotion
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.optimize import optimize, warm_up
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import MethodName, Problem
from joulepath.optimizer.solve.methods import solver_for
from joulepath.optimizer.solve.methods.solve_context import SolveContext

SOLVE_TIME = 10.0
"""Longest time of one solve [s]."""


class Candidate:
    """One candidate, without refinement, baselines and certificate."""

    title = "joulepath, one candidate"
    packages: tuple[str, ...] = ()
    what = (
        "B-spline of 13 control points, duration free, least electrical energy; within limits "
        "between the nodes, too"
    )
    method: MethodName = "bspline"

    def __init__(self, robot: Robot) -> None:
        _prepare(robot)
        self.robot = robot

    def plan(self, q_start: Array, q_goal: Array) -> SplineMotion | None:
        """See `Planner.plan`."""
        arm = Arm(robot=self.robot, collisions=False)
        task = PreparedProblem.of(Problem(arm=arm, start=q_start, goal=q_goal, method=self.method))
        context = SolveContext.of(task, q_start, q_goal, Deadline.after(SOLVE_TIME))
        return _motion(solver_for(context).solve().spline)


class Answer:
    """The answer of `optimize`: refined, compared with the baselines, and certified."""

    title = "joulepath, whole answer"
    packages: tuple[str, ...] = ()
    what = (
        "one candidate, refined over more control points, compared with all baselines, and "
        "certified"
    )

    def __init__(self, robot: Robot) -> None:
        _prepare(robot)
        self.robot = robot

    def plan(self, q_start: Array, q_goal: Array) -> SplineMotion | None:
        """See `Planner.plan`."""
        try:
            return _motion(
                optimize(
                    Problem(arm=Arm(robot=self.robot, collisions=False), start=q_start, goal=q_goal)
                ).trajectory.spline
            )
        except JoulepathError:
            return None


class Line(Candidate):
    """One candidate on the straight line in joint space."""

    title = "joulepath, time-scaled line"
    what = (
        "straight line in joint space, time scaling by a B-spline of least electrical energy, "
        "duration free"
    )
    method: MethodName = "time_scaling"


def _prepare(robot: Robot) -> None:
    compile_kernel(robot)
    warm_up(robot.name)


def _motion(spline: Spline | None) -> SplineMotion | None:
    return (
        None if spline is None else SplineMotion(spline.knots, spline.control_points, spline.degree)
    )
