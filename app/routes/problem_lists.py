"""Lists of problems that several routes return."""

from __future__ import annotations

from joulepath.app.schemas import errors as problems

WORKER_PROBLEMS: tuple[type[problems.ProblemDetails], ...] = (
    problems.Validation,
    problems.UnknownRobot,
    problems.BodyTooLarge,
    problems.RequestTimeout,
    problems.ShuttingDown,
    problems.DeadlineExceeded,
    problems.WorkerLost,
    problems.StoreUnavailable,
)
"""Of every request that a worker computes."""

ADDING_PROBLEMS: tuple[type[problems.ProblemDetails], ...] = (
    problems.Validation,
    problems.BodyTooLarge,
    problems.RequestTimeout,
    problems.ShuttingDown,
    problems.DeadlineExceeded,
    problems.WorkerLost,
    problems.TooManyRobots,
    problems.StoreUnavailable,
)
"""Of every request that adds a robot."""

MOTION_PROBLEMS: tuple[type[problems.ProblemDetails], ...] = (
    *WORKER_PROBLEMS,
    problems.UnknownFigures,
    problems.UnreachablePose,
    problems.SingularPose,
    problems.UnreachableTargets,
    problems.OutsideLimits,
    problems.StartInCollision,
    problems.GoalInCollision,
    problems.DurationTooShort,
    problems.TorqueInfeasible,
    problems.NoTrajectory,
    problems.NoCollisionFreeTrajectory,
)
"""Of every request that optimises a motion."""

CYCLE_PROBLEMS: tuple[type[problems.ProblemDetails], ...] = (
    *WORKER_PROBLEMS,
    problems.UnknownFigures,
    problems.UnreachablePose,
    problems.SingularPose,
    problems.UnreachableTargets,
    problems.OutsideLimits,
    problems.StartInCollision,
    problems.StopInCollision,
    problems.TorqueInfeasible,
    problems.ContradictoryOrder,
    problems.DwellTooShort,
    problems.NoSequence,
    problems.PathInfeasible,
)
"""Of a request for a round."""
