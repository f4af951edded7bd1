"""The library as the README promises it: what `optimizer` exports, and one problem solved without HTTP."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import joulepath

PUBLIC = {
    "AnyOf",
    "Arm",
    "BranchFilter",
    "ContradictoryOrder",
    "DeadlineExceeded",
    "DurationTooShort",
    "Front",
    "InvalidProblem",
    "JoulepathError",
    "Line",
    "ConeOrientedPose",
    "NoReachableTarget",
    "NoSequence",
    "NoTrajectory",
    "Optimized",
    "OutsideLimits",
    "PathInfeasible",
    "Payload",
    "Pose",
    "Problem",
    "CycleSolution",
    "CycleTooShort",
    "SingularPose",
    "Solution",
    "Stop",
    "StopPath",
    "ToolPath",
    "TorqueInfeasible",
    "UnknownRobot",
    "UnreachablePose",
    "Cycle",
    "load_robot",
    "optimize",
    "optimize_many",
    "plan_cycle",
    "pareto",
}


def test_the_public_names_are_a_promise() -> None:
    assert set(joulepath.__all__) == PUBLIC
    assert joulepath.__all__ == sorted(joulepath.__all__)
    # `optimizer.optimize` is also a module, whose import must not hide the function
    assert callable(joulepath.optimize) and callable(joulepath.optimize_many)
    assert callable(joulepath.pareto)
    assert callable(joulepath.plan_cycle)


def test_one_except_clause_catches_every_error() -> None:
    exported = [getattr(joulepath, name) for name in PUBLIC]
    errors = [each for each in exported if isinstance(each, type) and issubclass(each, BaseException)]
    assert len(errors) == 15
    assert all(issubclass(error, joulepath.JoulepathError) for error in errors)


def test_a_motion_without_http() -> None:
    """The ten lines of the README: joints to joints, everything else left to its default."""
    start, goal = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0]), np.array([1.0, -1.2, 1.8, -2.0, -1.3, 0.5])
    solution = joulepath.optimize(
        joulepath.Problem(arm=joulepath.Arm(robot=joulepath.load_robot("ur5e")), start=start, goal=goal)
    )
    assert isinstance(solution, joulepath.Solution)
    assert solution.certificate.valid
    assert solution.trajectory.q[0] == pytest.approx(start)
    assert solution.trajectory.q[-1] == pytest.approx(goal)
    assert 0 < solution.lower_bound <= solution.energy.electrical.total


def test_the_library_needs_no_web_framework() -> None:
    """A fresh interpreter that imports the library has loaded nothing of the service."""
    code = (
        "import sys, optimizer; "
        "print([m for m in ('app', 'fastapi', 'pydantic', 'starlette', 'uvicorn') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
