"""Methods: one parametrisation of a motion per file."""

from __future__ import annotations

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import MethodName, Problem
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.lagrange import Lagrange
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.passing_spline import PassingSpline
from joulepath.optimizer.solve.methods.polynomial_ga import PolynomialGA
from joulepath.optimizer.solve.methods.time_scaling import TimeScaling
from joulepath.optimizer.solve.methods.tool_path_motion import ToolPathMotion
from joulepath.optimizer.solve.methods.uniform_scaling import UniformScaling

METHODS: dict[MethodName, type[Method]] = {
    "bspline": FreeSpline,
    "time_scaling": TimeScaling,
    "lagrange": Lagrange,
    "uniform_scaling": UniformScaling,
    "polynomial_ga": PolynomialGA,
}


def method_of(problem: Problem) -> type[Method]:
    """The method of a problem; along a tool path, and through passes, there is one way."""
    if problem.passes:
        return PassingSpline
    return METHODS[problem.method] if problem.tool_path is None else ToolPathMotion


def solver_for(
    prepared: PreparedProblem,
    q_start: Array,
    q_goal: Array,
    deadline: Deadline,
    interval: DurationInterval | None = None,
) -> Method:
    """The solver of the problem's method for a candidate from q_start to q_goal (nq,) in an
    interval of durations.
    """
    return method_of(prepared.problem)(prepared, q_start, q_goal, deadline, interval)
