__version__: str

from .app.client.client import Client
from .app.client.errors import ServiceUnreachable
from .app.exceptions.base import InvalidRequest, ServiceError
from .models.mjcf import mjcf
from .models.own_arm.description import InvalidArm
from .models.registry import robot_names
from .models.robot import Limits, Robot
from .models.tools.registry import tool_names
from .models.uncertainty.document import InvalidFigures
from .optimizer.collision.model import ClosestPair
from .optimizer.compare import Compared, Comparison, compare
from .optimizer.cycle.cycle_move import CycleMove
from .optimizer.cycle.cycle_solution import CycleBaseline, CycleSolution
from .optimizer.cycle.errors import CycleTooShort, NoSequence
from .optimizer.evaluate.errors import NotCertified
from .optimizer.evaluate.evaluate import evaluate
from .optimizer.evaluate.evaluation import Evaluation
from .optimizer.evaluate.interval_energy import IntervalEnergy
from .optimizer.evaluate.limit_report import LimitReport
from .optimizer.evaluate.nearest_contact import LeastClearance
from .optimizer.evaluate.recording import RecordedRows, Recording, Waypoints
from .optimizer.exceptions import (
    ContradictoryOrder,
    DeadlineExceeded,
    InvalidProblem,
    InvalidTable,
    JoulepathError,
    NoConfigurationFound,
    NoTrajectory,
    OutsideLimits,
    SingularPose,
    UnknownRobot,
    UnknownTool,
    UnreachablePose,
    UnreachableTargets,
)
from .optimizer.excitation.errors import ExcitationInfeasible
from .optimizer.export.errors import FormatUnsuitable
from .optimizer.export.export import ExportedFile, export
from .optimizer.export.franka import FrankaOptions
from .optimizer.export.joint_limits_file import LimitsOptions
from .optimizer.export.krl import KrlOptions
from .optimizer.export.mcap_recording import McapOptions
from .optimizer.export.program import Move, Program, Rest
from .optimizer.export.rapid import RapidOptions
from .optimizer.export.ros_messages import MoveitOptions, Ros2Options
from .optimizer.export.rows import TableOptions
from .optimizer.export.urscript import UrscriptOptions
from .optimizer.identify.errors import (
    EffortNotUsable,
    LogTooLarge,
    MethodNotApplicable,
    NoPowerChannel,
    NotExcited,
    NothingHeldOut,
    PayloadUnknown,
)
from .optimizer.identify.identify import Identification, identify
from .optimizer.identify.logs.log import Log, LogMove
from .optimizer.identify.logs.log_options import LogOptions
from .optimizer.identify.logs.reading import LogReading, LogReport, read_log
from .optimizer.identify.options import Coupling, IdentificationOptions
from .optimizer.identify.results import Advice, IdentifiedParameter, Validation
from .optimizer.inverse_kinematics import IKSolution, IKSolutions, inverse_kinematics
from .optimizer.joint_limits.errors import NoJointLimits
from .optimizer.joint_limits.joint_limits import JointLimits, joint_limits
from .optimizer.kinematics.errors import OrientationNotHeld
from .optimizer.motion.spline import Spline
from .optimizer.optimize import optimize
from .optimizer.optimize_many import Optimized, optimize_many
from .optimizer.pareto import pareto
from .optimizer.placement.errors import NoPlacement
from .optimizer.placement.place import place
from .optimizer.placement.placement import WeightedCycle
from .optimizer.placement.placement_solution import (
    FoundPlace,
    MapPoint,
    PlacedPose,
    PlacementSolution,
    Tolerance,
)
from .optimizer.placement.region import Group, Moved, Places, Region
from .optimizer.plan_cycle import plan_cycle
from .optimizer.problem.arm import Arm, Inverter, Payload
from .optimizer.problem.branches import BranchFilter
from .optimizer.problem.bus import Bus
from .optimizer.problem.clouds import Points, TriangleMesh, Voxels
from .optimizer.problem.cone_oriented_pose import ConeOrientedPose
from .optimizer.problem.cycle import Cycle
from .optimizer.problem.dwell import Dwell
from .optimizer.problem.even_body import even_payload
from .optimizer.problem.free_order import FreeOrder
from .optimizer.problem.line import Line
from .optimizer.problem.pose import Pose
from .optimizer.problem.problem import Problem
from .optimizer.problem.robots import load_robot
from .optimizer.problem.scene import (
    Attachment,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    Obstacle,
    Scene,
    Sphere,
    capsule_between,
)
from .optimizer.problem.stop_path import StopPath
from .optimizer.problem.stops import Stop
from .optimizer.problem.targets import AnyOf, SampledPoses
from .optimizer.problem.tool import Tool, load_tool
from .optimizer.problem.tool_cone import ToolCone
from .optimizer.problem.tool_path import ToolPath
from .optimizer.progress import CandidatesFound, CandidateTried, Improved, StepsDone
from .optimizer.replay.outcome import Outcome
from .optimizer.replay.planned import PlannedBaseline, PlannedMotion, PlannedTorques
from .optimizer.replay.play import Contact
from .optimizer.replay.replay import replay
from .optimizer.replay.replay_result import (
    AsPlanned,
    Replay,
    ReplayedChange,
    ReplayedRun,
    SavingRange,
    SimulatedSaving,
)
from .optimizer.result.baseline import Baseline
from .optimizer.result.candidates import CandidateReport, CandidateStatus, UnreachableTarget
from .optimizer.result.certificate import Certificate, Clearance
from .optimizer.result.energy import (
    ElectricalEnergy,
    Energy,
    EnergyInterval,
    JointEnergy,
    MechanicalEnergy,
    SavingInterval,
    StorageUse,
)
from .optimizer.result.front import Dropped, Front, FrontSolver
from .optimizer.result.solution import (
    Configuration,
    LimitsInForce,
    Samples,
    Solution,
    SolverReport,
    Trajectory,
)
from .optimizer.search.errors import (
    DurationTooShort,
    GoalInCollision,
    InCollision,
    NoCollisionFreeTrajectory,
    PathInfeasible,
    StartInCollision,
    StopInCollision,
    TorqueInfeasible,
)
from .optimizer.what_if import WhatIf, what_if

__all__ = [
    "Advice",
    "AnyOf",
    "Arm",
    "AsPlanned",
    "Attachment",
    "Baseline",
    "Box",
    "BranchFilter",
    "Bus",
    "CandidateReport",
    "CandidateStatus",
    "CandidateTried",
    "CandidatesFound",
    "Capsule",
    "Certificate",
    "Clearance",
    "Client",
    "ClosestPair",
    "Compared",
    "Comparison",
    "ConeOrientedPose",
    "Configuration",
    "Contact",
    "ContradictoryOrder",
    "Coupling",
    "Cycle",
    "CycleBaseline",
    "CycleMove",
    "CycleSolution",
    "CycleTooShort",
    "Cylinder",
    "DeadlineExceeded",
    "Dropped",
    "DurationTooShort",
    "Dwell",
    "EffortNotUsable",
    "ElectricalEnergy",
    "Energy",
    "EnergyInterval",
    "Evaluation",
    "ExcitationInfeasible",
    "ExportedFile",
    "FormatUnsuitable",
    "FoundPlace",
    "FrankaOptions",
    "FreeOrder",
    "Front",
    "FrontSolver",
    "GoalInCollision",
    "Group",
    "HalfSpace",
    "IKSolution",
    "IKSolutions",
    "Identification",
    "IdentificationOptions",
    "IdentifiedParameter",
    "Improved",
    "InCollision",
    "IntervalEnergy",
    "InvalidArm",
    "InvalidFigures",
    "InvalidProblem",
    "InvalidRequest",
    "InvalidTable",
    "Inverter",
    "JointEnergy",
    "JointLimits",
    "JoulepathError",
    "KrlOptions",
    "LeastClearance",
    "LimitReport",
    "Limits",
    "LimitsInForce",
    "LimitsOptions",
    "Line",
    "Log",
    "LogMove",
    "LogOptions",
    "LogReading",
    "LogReport",
    "LogTooLarge",
    "MapPoint",
    "McapOptions",
    "MechanicalEnergy",
    "Mesh",
    "MethodNotApplicable",
    "Move",
    "Moved",
    "MoveitOptions",
    "NoCollisionFreeTrajectory",
    "NoConfigurationFound",
    "NoJointLimits",
    "NoPlacement",
    "NoPowerChannel",
    "NoSequence",
    "NoTrajectory",
    "NotCertified",
    "NotExcited",
    "NothingHeldOut",
    "Obstacle",
    "Optimized",
    "OrientationNotHeld",
    "Outcome",
    "OutsideLimits",
    "PathInfeasible",
    "Payload",
    "PayloadUnknown",
    "PlacedPose",
    "PlacementSolution",
    "Places",
    "PlannedBaseline",
    "PlannedMotion",
    "PlannedTorques",
    "Points",
    "Pose",
    "Problem",
    "Program",
    "RapidOptions",
    "RecordedRows",
    "Recording",
    "Region",
    "Replay",
    "ReplayedChange",
    "ReplayedRun",
    "Rest",
    "Robot",
    "Ros2Options",
    "SampledPoses",
    "Samples",
    "SavingInterval",
    "SavingRange",
    "Scene",
    "ServiceError",
    "ServiceUnreachable",
    "SimulatedSaving",
    "SingularPose",
    "Solution",
    "SolverReport",
    "Sphere",
    "Spline",
    "StartInCollision",
    "StepsDone",
    "Stop",
    "StopInCollision",
    "StopPath",
    "StorageUse",
    "TableOptions",
    "Tolerance",
    "Tool",
    "ToolCone",
    "ToolPath",
    "TorqueInfeasible",
    "Trajectory",
    "TriangleMesh",
    "UnknownRobot",
    "UnknownTool",
    "UnreachablePose",
    "UnreachableTarget",
    "UnreachableTargets",
    "UrscriptOptions",
    "Validation",
    "Voxels",
    "Waypoints",
    "WeightedCycle",
    "WhatIf",
    "capsule_between",
    "compare",
    "evaluate",
    "even_payload",
    "export",
    "identify",
    "inverse_kinematics",
    "joint_limits",
    "load_robot",
    "load_tool",
    "mjcf",
    "optimize",
    "optimize_many",
    "pareto",
    "place",
    "plan_cycle",
    "read_log",
    "replay",
    "robot_names",
    "tool_names",
    "what_if",
]
