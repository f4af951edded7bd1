"""From exceptions to problem details (RFC 9457): one table."""

from __future__ import annotations

from typing import Any

import orjson

from app.convert.fields import candidate_fields, fields, unreachable_fields
from app.engine.reply import Reply
from app.exceptions import (
    BodyTooLarge,
    Busy,
    EmptyStudy,
    InvalidRequest,
    KeyReused,
    MethodNotAllowed,
    NotFound,
    NotReady,
    ServiceError,
    ShuttingDown,
    StoreUnavailable,
    UnknownAnswer,
    UnknownStudy,
    UnsupportedMediaType,
    WorkerDied,
)
from app.schemas import errors as problems
from optimizer import exceptions as optimizer_errors

TABLE: dict[type[Exception], type[problems.ProblemDetails]] = {
    InvalidRequest: problems.Validation,
    optimizer_errors.InvalidProblem: problems.Validation,
    optimizer_errors.OutsideLimits: problems.OutsideLimits,
    optimizer_errors.InvalidTable: problems.InvalidTable,
    optimizer_errors.UnknownRobot: problems.UnknownRobot,
    optimizer_errors.UnreachablePose: problems.UnreachablePose,
    optimizer_errors.SingularPose: problems.SingularPose,
    optimizer_errors.NoReachableTarget: problems.UnreachableTargets,
    optimizer_errors.StartInCollision: problems.StartInCollision,
    optimizer_errors.GoalInCollision: problems.GoalInCollision,
    optimizer_errors.DurationTooShort: problems.DurationTooShort,
    optimizer_errors.TorqueInfeasible: problems.TorqueInfeasible,
    optimizer_errors.NoCollisionFreeTrajectory: problems.NoCollisionFreeTrajectory,
    optimizer_errors.NoTrajectory: problems.NoTrajectory,
    optimizer_errors.DeadlineExceeded: problems.DeadlineExceeded,
    Busy: problems.Busy,
    NotReady: problems.NotReady,
    ShuttingDown: problems.ShuttingDown,
    StoreUnavailable: problems.StoreUnavailable,
    UnknownAnswer: problems.UnknownAnswer,
    UnknownStudy: problems.UnknownStudy,
    EmptyStudy: problems.EmptyStudy,
    KeyReused: problems.KeyReused,
    NotFound: problems.NotFound,
    MethodNotAllowed: problems.MethodNotAllowed,
    BodyTooLarge: problems.BodyTooLarge,
    UnsupportedMediaType: problems.UnsupportedMediaType,
    WorkerDied: problems.Internal,
}


def problem_type(error: Exception) -> type[problems.ProblemDetails]:
    """The type of problem that an exception is; what is not in the table is a defect."""
    return next((TABLE[cls] for cls in type(error).__mro__ if cls in TABLE), problems.Internal)


def problem_reply(error: Exception, instance: str) -> Reply:
    """The answer to the request `instance` that failed with `error`."""
    problem = problem_type(error)
    known = isinstance(error, (ServiceError, optimizer_errors.JoulepathError))
    # an unforeseen exception's message is for the log, not for the caller
    detail = str(error) if known else "This is a defect of the service: report it with the id in `instance`."
    content = {name: problem.model_fields[name].default for name in ("type", "title", "status")}
    content |= {"detail": detail, "instance": instance}
    content |= {name: _own_field(error, name) for name in problem.own_fields()}
    headers = {} if problem.retry_after is None else {"Retry-After": str(problem.retry_after)}
    return Reply(content["status"], orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY), headers)


def _own_field(error: Exception, name: str) -> Any:
    if name == "errors" and isinstance(error, optimizer_errors.InvalidProblem):
        path = [int(part) if part.isdigit() else part for part in error.field.split(".")]
        return [{"loc": ["body", *path], "msg": str(error)}]
    value = getattr(error, name)
    if name == "unreachable":
        return [unreachable_fields(target) for target in value]
    if name == "branches":
        return [fields(branch, *problems.CollidingBranch.model_fields) for branch in value]
    return [candidate_fields(candidate) for candidate in value] if name == "candidates" else value
