__version__: str

from .models.registry import load_robot
from .optimizer.cycle.cycle_solution import CycleSolution
from .optimizer.exceptions import (
    ContradictoryOrder,
    CycleTooShort,
    DeadlineExceeded,
    DurationTooShort,
    InvalidProblem,
    JoulepathError,
    NoReachableTarget,
    NoSequence,
    NoTrajectory,
    OutsideLimits,
    PathInfeasible,
    SingularPose,
    TorqueInfeasible,
    UnknownRobot,
    UnreachablePose,
)
from .optimizer.optimize import optimize
from .optimizer.optimize_many import Optimized, optimize_many
from .optimizer.pareto import Front, pareto
from .optimizer.plan_cycle import plan_cycle
from .optimizer.problem.arm import Arm, Payload
from .optimizer.problem.branches import BranchFilter
from .optimizer.problem.cone_oriented_pose import ConeOrientedPose
from .optimizer.problem.cycle import Cycle
from .optimizer.problem.line import Line
from .optimizer.problem.pose import Pose
from .optimizer.problem.problem import Problem
from .optimizer.problem.stop_path import StopPath
from .optimizer.problem.stops import Stop
from .optimizer.problem.targets import AnyOf
from .optimizer.problem.tool_path import ToolPath
from .optimizer.solution import Solution

__all__ = [
    "AnyOf",
    "Arm",
    "BranchFilter",
    "ConeOrientedPose",
    "ContradictoryOrder",
    "Cycle",
    "CycleSolution",
    "CycleTooShort",
    "DeadlineExceeded",
    "DurationTooShort",
    "Front",
    "InvalidProblem",
    "JoulepathError",
    "Line",
    "NoReachableTarget",
    "NoSequence",
    "NoTrajectory",
    "Optimized",
    "OutsideLimits",
    "PathInfeasible",
    "Payload",
    "Pose",
    "Problem",
    "SingularPose",
    "Solution",
    "Stop",
    "StopPath",
    "ToolPath",
    "TorqueInfeasible",
    "UnknownRobot",
    "UnreachablePose",
    "__version__",
    "load_robot",
    "optimize",
    "optimize_many",
    "pareto",
    "plan_cycle",
]
