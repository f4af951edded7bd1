"""Finds a robot arm's motion of least energy. A library: `optimize(Problem(start, goal))` gives a `Solution`.

The names below are the public ones; robots and their figures are in `models`.
"""

from optimizer.arm import Payload, Pose
from optimizer.exceptions import (
    DeadlineExceeded,
    DurationTooShort,
    InvalidProblem,
    JoulepathError,
    NoReachableTarget,
    NoTrajectory,
    OutsideLimits,
    SingularPose,
    TorqueInfeasible,
    UnknownRobot,
    UnreachablePose,
)
from optimizer.optimize import optimize
from optimizer.orientation import LoosePose
from optimizer.pareto import Front, pareto
from optimizer.problem import BranchFilter, Problem
from optimizer.solution import Solution
from optimizer.targets import AnyOf

__all__ = [
    "AnyOf",
    "BranchFilter",
    "DeadlineExceeded",
    "DurationTooShort",
    "Front",
    "InvalidProblem",
    "JoulepathError",
    "LoosePose",
    "NoReachableTarget",
    "NoTrajectory",
    "OutsideLimits",
    "Payload",
    "Pose",
    "Problem",
    "SingularPose",
    "Solution",
    "TorqueInfeasible",
    "UnknownRobot",
    "UnreachablePose",
    "optimize",
    "pareto",
]
