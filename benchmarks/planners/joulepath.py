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
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.solve.methods import solver_for
from joulepath.optimizer.solve.methods.solve_context import SolveContext

PATIENCE = 10.0  # s


class Candidate:
    """One candidate, no refinement, no baselines, no certificate."""

    title = "joulepath, one candidate"
    packages: tuple[str, ...] = ()
    what = (
        "B-spline of 13 control points, duration free, least electrical energy; within limits "
        "between the nodes, too"
    )

    def __init__(self, robot: Robot) -> None:
        _prepare(robot)
        self.robot = robot

    def plan(self, q_start: Array, q_goal: Array) -> SplineMotion | None:
        """See `Planner.plan`."""
        task = PreparedProblem.of(
            Problem(arm=Arm(robot=self.robot, collisions=False), start=q_start, goal=q_goal)
        )
        return _motion(
            solver_for(SolveContext.of(task, q_start, q_goal, Deadline.after(PATIENCE)))
            .solve()
            .spline
        )


class Answer:
    """The answer that a user gets: refined, compared with the baselines, certified."""

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


class Line:
    """One candidate, on the straight line in joint space."""

    title = "joulepath, time-scaled line"
    packages: tuple[str, ...] = ()
    what = (
        "straight line in joint space, time scaling by a B-spline of least electrical energy, "
        "duration free"
    )

    def __init__(self, robot: Robot) -> None:
        _prepare(robot)
        self.robot = robot

    def plan(self, q_start: Array, q_goal: Array) -> SplineMotion | None:
        """See `Planner.plan`."""
        task = PreparedProblem.of(
            Problem(
                arm=Arm(robot=self.robot, collisions=False),
                start=q_start,
                goal=q_goal,
                method="time_scaling",
            )
        )
        return _motion(
            solver_for(SolveContext.of(task, q_start, q_goal, Deadline.after(PATIENCE)))
            .solve()
            .spline
        )


def _prepare(robot: Robot) -> None:
    compile_kernel(robot)
    warm_up(robot.name)


def _motion(spline: Spline | None) -> SplineMotion | None:
    return (
        None if spline is None else SplineMotion(spline.knots, spline.control_points, spline.degree)
    )
