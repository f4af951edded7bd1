"""Methods: one parametrisation of a motion per file."""

from __future__ import annotations

from joulepath.optimizer.problem.problem import MethodName, Problem
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.lagrange import Lagrange
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.passing_spline import PassingSpline
from joulepath.optimizer.solve.methods.polynomial_ga import PolynomialGA
from joulepath.optimizer.solve.methods.solve_context import SolveContext
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


def solver_for(context: SolveContext) -> Method:
    """The problem's method for the candidate of a context."""
    return method_of(context.prepared.problem)(context)
