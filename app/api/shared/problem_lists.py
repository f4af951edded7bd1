"""Lists of problems common to several routes."""

from __future__ import annotations

from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.queue import ShuttingDown, WorkerLost
from joulepath.app.exceptions.stored import StoreUnavailable, TooManyRobots, UnknownFigures
from joulepath.app.exceptions.transport import BodyTooLarge, RequestTimeout
from joulepath.optimizer.cycle.errors import CycleTooShort, NoSequence
from joulepath.optimizer.exceptions import (
    ContradictoryOrder,
    DeadlineExceeded,
    DeclaredError,
    NoConfigurationFound,
    NoTrajectory,
    OutsideLimits,
    SingularPose,
    UnknownRobot,
    UnknownTool,
    UnreachablePose,
    UnreachableTargets,
)
from joulepath.optimizer.kinematics.errors import OrientationNotHeld
from joulepath.optimizer.search.errors import (
    DurationTooShort,
    GoalInCollision,
    NoCollisionFreeTrajectory,
    PathInfeasible,
    StartInCollision,
    StopInCollision,
    TorqueInfeasible,
)

WORKER_PROBLEMS: tuple[type[DeclaredError], ...] = (
    InvalidRequest,
    UnknownRobot,
    UnknownTool,
    BodyTooLarge,
    RequestTimeout,
    ShuttingDown,
    DeadlineExceeded,
    WorkerLost,
    StoreUnavailable,
)
"""Of every request that a worker computes."""

ADDING_PROBLEMS: tuple[type[DeclaredError], ...] = (
    InvalidRequest,
    BodyTooLarge,
    RequestTimeout,
    ShuttingDown,
    DeadlineExceeded,
    WorkerLost,
    TooManyRobots,
    StoreUnavailable,
)
"""Of every request that adds a robot."""

POSE_PROBLEMS: tuple[type[DeclaredError], ...] = (
    UnreachablePose,
    NoConfigurationFound,
    OrientationNotHeld,
    SingularPose,
)
"""Of a pose that the arm should reach."""

MOTION_PROBLEMS: tuple[type[DeclaredError], ...] = (
    *WORKER_PROBLEMS,
    UnknownFigures,
    *POSE_PROBLEMS,
    UnreachableTargets,
    OutsideLimits,
    StartInCollision,
    GoalInCollision,
    DurationTooShort,
    TorqueInfeasible,
    NoTrajectory,
    NoCollisionFreeTrajectory,
)
"""Of every request that optimises a motion."""

CYCLE_PROBLEMS: tuple[type[DeclaredError], ...] = (
    *WORKER_PROBLEMS,
    UnknownFigures,
    *POSE_PROBLEMS,
    UnreachableTargets,
    OutsideLimits,
    StartInCollision,
    StopInCollision,
    TorqueInfeasible,
    ContradictoryOrder,
    CycleTooShort,
    NoSequence,
    PathInfeasible,
)
"""Of a request for a cycle."""
