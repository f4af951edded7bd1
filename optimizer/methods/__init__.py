"""How a motion is parametrised: a method each, over the same problem, candidates, bounds and certificate."""

from __future__ import annotations

from models.robot import Array
from optimizer.methods.duration_intervals import Window
from optimizer.methods.free_spline import FreeSpline
from optimizer.methods.lagrange import Lagrange
from optimizer.methods.method import Solver
from optimizer.methods.polynomial_ga import PolynomialGA
from optimizer.methods.time_scaling import TimeScaling
from optimizer.methods.uniform_scaling import UniformScaling
from optimizer.prepared_problem import Task
from optimizer.problem.problem import Method

METHODS: dict[Method, type[Solver]] = {
    "bspline": FreeSpline,
    "time_scaling": TimeScaling,
    "lagrange": Lagrange,
    "uniform_scaling": UniformScaling,
    "polynomial_ga": PolynomialGA,
}


def solver_for(task: Task, q_start: Array, q_goal: Array, deadline: float, window: Window | None = None) -> Solver:
    """The solver of the problem's method for a candidate from q_start to q_goal (nq,) in a window of durations."""
    return METHODS[task.problem.method](task, q_start, q_goal, deadline, window)
