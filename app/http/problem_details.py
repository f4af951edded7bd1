"""Problem details (RFC 9457) of exceptions: one table."""

from __future__ import annotations

from itertools import islice
from typing import Any

from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError

from joulepath.app.answers.declared import as_json
from joulepath.app.convert.candidates import candidate_counts, most_telling
from joulepath.app.convert.fields import fields, location
from joulepath.app.exceptions import (
    AnswerInUse,
    BodyTooLarge,
    Busy,
    ClusterUnavailable,
    CrossSite,
    EmptyStudy,
    FiguresInUse,
    HeadTooLarge,
    InvalidRequest,
    JobNotCancellable,
    KeyReused,
    MalformedHttp,
    MethodNotAllowed,
    NoKey,
    NoMeshes,
    NotAcceptable,
    NotFound,
    NotOwner,
    NotReady,
    RequestTimeout,
    RobotExists,
    RoleTooLow,
    ServiceError,
    ShuttingDown,
    StoreUnavailable,
    TaskFailed,
    TooManyDeaths,
    TooManyFigures,
    TooManyLogs,
    TooManyRequests,
    TooManyRobots,
    UnknownAnswer,
    UnknownFigures,
    UnknownIdentification,
    UnknownJob,
    UnknownLog,
    UnknownStudy,
    UnsupportedCoding,
    UnsupportedMediaType,
    WorkerDied,
    WrongHost,
)
from joulepath.app.http.validation_messages import told
from joulepath.app.schemas import errors as problems
from joulepath.optimizer import exceptions as optimizer_errors
from joulepath.optimizer.excitation.errors import ExcitationInfeasible
from joulepath.optimizer.identify import errors as identification_errors
from joulepath.optimizer.identify.logs.log_errors import EffortNotUsable, LogTooLarge

TABLE: dict[type[Exception], type[problems.ProblemDetails]] = {
    InvalidRequest: problems.Validation,
    optimizer_errors.InvalidProblem: problems.Validation,
    optimizer_errors.OutsideLimits: problems.OutsideLimits,
    optimizer_errors.ContradictoryOrder: problems.ContradictoryOrder,
    optimizer_errors.InvalidTable: problems.InvalidTable,
    LogTooLarge: problems.LogTooLarge,
    EffortNotUsable: problems.EffortNotUsable,
    ExcitationInfeasible: problems.ExcitationInfeasible,
    identification_errors.NotExcited: problems.NotExcited,
    identification_errors.NothingHeldOut: problems.NothingHeldOut,
    identification_errors.NoPowerChannel: problems.NoPowerChannel,
    identification_errors.MethodNotApplicable: problems.MethodNotApplicable,
    identification_errors.PayloadUnknown: problems.PayloadUnknown,
    optimizer_errors.UnknownRobot: problems.UnknownRobot,
    optimizer_errors.UnreachablePose: problems.UnreachablePose,
    optimizer_errors.SingularPose: problems.SingularPose,
    optimizer_errors.NoReachableTarget: problems.UnreachableTargets,
    optimizer_errors.StartInCollision: problems.StartInCollision,
    optimizer_errors.GoalInCollision: problems.GoalInCollision,
    optimizer_errors.StopInCollision: problems.StopInCollision,
    optimizer_errors.NoSequence: problems.NoSequence,
    optimizer_errors.PathInfeasible: problems.PathInfeasible,
    optimizer_errors.DurationTooShort: problems.DurationTooShort,
    optimizer_errors.CycleTooShort: problems.DwellTooShort,
    optimizer_errors.TorqueInfeasible: problems.TorqueInfeasible,
    optimizer_errors.NoCollisionFreeTrajectory: problems.NoCollisionFreeTrajectory,
    optimizer_errors.NoTrajectory: problems.NoTrajectory,
    optimizer_errors.NotCertified: problems.NotCertified,
    optimizer_errors.FormatUnsuitable: problems.FormatUnsuitable,
    optimizer_errors.DeadlineExceeded: problems.DeadlineExceeded,
    Busy: problems.Busy,
    TooManyRequests: problems.TooManyRequests,
    NotReady: problems.NotReady,
    ShuttingDown: problems.ShuttingDown,
    StoreUnavailable: problems.StoreUnavailable,
    ClusterUnavailable: problems.ClusterUnavailable,
    UnknownAnswer: problems.UnknownAnswer,
    UnknownStudy: problems.UnknownStudy,
    UnknownJob: problems.UnknownJob,
    JobNotCancellable: problems.JobNotCancellable,
    TooManyDeaths: problems.WorkerDied,
    EmptyStudy: problems.EmptyStudy,
    KeyReused: problems.KeyReused,
    RobotExists: problems.RobotExists,
    NoMeshes: problems.NoMeshes,
    UnknownLog: problems.UnknownLog,
    UnknownIdentification: problems.UnknownIdentification,
    TooManyLogs: problems.TooManyLogs,
    TooManyRobots: problems.TooManyRobots,
    UnknownFigures: problems.UnknownFigures,
    FiguresInUse: problems.FiguresInUse,
    TooManyFigures: problems.TooManyFigures,
    NoKey: problems.Unauthenticated,
    RoleTooLow: problems.RoleTooLow,
    NotOwner: problems.NotOwner,
    AnswerInUse: problems.AnswerInUse,
    CrossSite: problems.CrossSite,
    WrongHost: problems.WrongHost,
    NotFound: problems.NotFound,
    MethodNotAllowed: problems.MethodNotAllowed,
    BodyTooLarge: problems.BodyTooLarge,
    HeadTooLarge: problems.HeadTooLarge,
    RequestTimeout: problems.RequestTimeout,
    UnsupportedMediaType: problems.UnsupportedMediaType,
    UnsupportedCoding: problems.UnsupportedCoding,
    NotAcceptable: problems.NotAcceptable,
    MalformedHttp: problems.MalformedHttp,
    WorkerDied: problems.WorkerLost,
    TaskFailed: problems.Internal,
}

MOST_ERRORS = 20
"""Errors that a `validation` problem lists at most: a body can have thousands, and the first ones suffice."""


def problem_type(error: Exception) -> type[problems.ProblemDetails]:
    """The problem type of an exception. An exception that is not in the table is a defect of the service."""
    return next((TABLE[cls] for cls in type(error).__mro__ if cls in TABLE), problems.Internal)


def problem_content(error: Exception, instance: str) -> dict[str, Any]:
    """The problem's fields: the request `instance` failed with `error`."""
    problem = problem_type(error)
    known = isinstance(error, (ServiceError, optimizer_errors.JoulepathError))
    content = {name: problem.model_fields[name].default for name in ("type", "title", "status")}
    # an unforeseen exception's message is for the log, not for the client
    content |= {"detail": str(error if known else TaskFailed()), "instance": instance}
    return content | {name: _own_field(error, name) for name in problem.own_fields()}


def invalid_request(error: ValidationError | RequestValidationError, *where: str) -> InvalidRequest:
    """The InvalidRequest for errors of pydantic or FastAPI; their locations start with `where`.

    What each says is in `validation_messages`.
    """
    entries = (entry for each in error.errors()[:MOST_ERRORS] for entry in told(each, where))
    return InvalidRequest(list(islice(entries, MOST_ERRORS)))


def _own_field(error: Exception, name: str) -> Any:
    if name == "errors" and isinstance(error, optimizer_errors.InvalidProblem):
        return [{"loc": location(error, "body"), "msg": str(error)}]
    if name == "candidate_counts":
        return candidate_counts(error.candidates)  # type: ignore[attr-defined]
    value = getattr(error, name)
    if name == "unreachable":
        return [as_json(target) for target in value]
    if name == "branches":
        return [fields(branch, *problems.CollidingBranch.model_fields) for branch in value]
    if name == "attempts":
        return [fields(attempt, "label", "followed", "reason") for attempt in value]
    return [as_json(candidate) for candidate in most_telling(value)] if name == "candidates" else value
