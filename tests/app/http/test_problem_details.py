"""Exceptions as problem details, without a server."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from joulepath.app import exceptions as service
from joulepath.app.engine.result import json_document
from joulepath.app.exceptions import ServiceError
from joulepath.app.http.problem_details import TABLE, problem_content, problem_type
from joulepath.app.schemas.errors import Internal, NoTrajectory, OutsideLimits, UnreachablePose
from joulepath.optimizer import exceptions
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.excitation.errors import ExcitationInfeasible
from joulepath.optimizer.identify import errors as identification_errors
from joulepath.optimizer.identify.logs.log_errors import EffortNotUsable, LogTooLarge
from joulepath.optimizer.result.candidates import CandidateReport, CandidateStatus, UnreachableTarget
from joulepath.optimizer.result.certificate import Clearance

CANDIDATE = CandidateReport(
    "left/up/flip", 0, "left/up/flip", 0, np.zeros(6), np.ones(6), CandidateStatus.FAILED, "no step left", 12.5
)
COLLIDING = exceptions.CollidingBranch("left/up/flip", 0, np.zeros(6), ("table", "forearm"), 0.02)
HIT = Clearance(-0.02, -0.02, ("table", "forearm"), 0.5)
ERRORS: list[JoulepathError] = [
    exceptions.InvalidProblem("limits.velocity", "limits.velocity must be positive."),
    exceptions.OutsideLimits("start", "elbow_joint", 4.0, -3.1, 3.1),
    exceptions.UnknownRobot("r2d2", ["ur5e"]),
    exceptions.UnreachablePose("goal", 0.1, "The goal pose is out of reach."),
    exceptions.UnreachablePose("goal", None, "The goal pose is out of reach."),
    exceptions.NoReachableTarget("start", [UnreachableTarget("start", 0, "The start pose is out of reach.")]),
    exceptions.SingularPose("goal", 1e-9),
    exceptions.DurationTooShort(0.8, 0.83, proven=False, late=True),
    exceptions.DurationTooShort(0.8),
    exceptions.TorqueInfeasible("elbow_joint", 200.0, 150.0),
    exceptions.NoTrajectory([CANDIDATE]),
    exceptions.DeadlineExceeded([CANDIDATE]),
    exceptions.InvalidTable("Times must increase.", 17, "t"),
    LogTooLarge(1_000_000, "rows"),
    ExcitationInfeasible("clearance"),
    EffortNotUsable("Log motor currents.", "external", {"elbow_joint": 0.02, "shoulder_lift_joint": None}),
    identification_errors.NotExcited(["coulomb", "viscous"], "ur5e", ["friction"], 2.0, [0.0, 0.0, 0.05]),
    identification_errors.NothingHeldOut(1),
    identification_errors.NoPowerChannel(),
    identification_errors.MethodNotApplicable("base_wrench", "it needs a force."),
    identification_errors.PayloadUnknown([0, 5]),
    exceptions.StartInCollision([COLLIDING]),
    exceptions.GoalInCollision([COLLIDING, replace(COLLIDING, depth=0.01)]),
    exceptions.NoCollisionFreeTrajectory([CANDIDATE], HIT, "left/up/flip", "left/up/no_flip"),
    exceptions.StopInCollision("stops/pick", [COLLIDING]),
    exceptions.NoSequence("stops/place", ["left/up/flip"], ["left/up/no_flip"]),
    exceptions.CycleTooShort(5.5, 0.9),
    exceptions.ContradictoryOrder("before", "No order is possible.", ["pick", "place"]),
    exceptions.NotCertified(2, "its velocity is at 1.2 of the limit", {"velocity": 1.2, "torque": np.nan}),
    exceptions.FormatUnsuitable("urscript", "This robot has 7 joints: use ros2."),
    exceptions.PathInfeasible(0.5, [exceptions.PathAttempt("left/up/flip", 0.6, "singular")]),
]


OURS = ("joulepath.app.exceptions", "joulepath.optimizer.")
"""Modules of errors."""
SERVICE_ERRORS: list[ServiceError] = [
    service.InvalidRequest([{"loc": ["body", "start"], "msg": "Field required"}]),
    *(kind() for kind in (service.Busy, service.NotReady, service.ShuttingDown, service.WorkerDied)),
    *(kind() for kind in (service.TaskFailed, service.UnknownAnswer, service.EmptyStudy)),
    *(service.StoreUnavailable(cause) for cause in service.StoreUnavailable.MESSAGES),
    *(kind() for kind in (service.UnknownStudy, service.UnknownIteration, service.KeyReused, service.NotFound)),
    *(kind() for kind in (service.MethodNotAllowed, service.BodyTooLarge, service.UnsupportedMediaType)),
    *(
        kind()
        for kind in (
            service.RobotExists,
            service.BundledRobot,
            service.TooManyRobots,
            service.AnswerInUse,
            service.NoMeshes,
        )
    ),
    *(kind() for kind in (service.UnknownFigures, service.FiguresInUse, service.TooManyFigures)),
    *(kind() for kind in (service.NoKey, service.WrongKey, service.CrossSite, service.WrongHost)),
    service.RoleTooLow("read", "compute"),
    service.NotOwner("press_shop"),
    service.NotOwner(None),
    *(kind() for kind in (service.UnsupportedCoding, service.NotAcceptable, service.MalformedHttp)),
    *(kind() for kind in (service.TooManyRequests, service.TooManyConnections, service.TooManyConnectionsOfClient)),
    *(kind() for kind in (service.TooManyBytes, service.TooManyBytesOfClient)),
    *(
        service.ClusterUnavailable(),
        service.UnknownLog(),
        service.UnknownIdentification(),
        service.TooManyLogs(1 << 30),
    ),
    *(service.HeadTooLarge(32_768), service.RequestTimeout(10.0)),
    *(kind() for kind in (service.TooManyWaiting, service.UnknownJob)),
    service.PartsNeeded(["/answers/7b5f3a52"]),
    *(kind() for kind in (service.JobNotCancellable, service.TooManyDeaths, service.ClusterUnavailable)),
]


def sent(error: Exception) -> bytes:
    return json_document(problem_content(error, "the-id"))


def all_kinds(kind: type[Exception]) -> set[type[Exception]]:
    return set(kind.__subclasses__()).union(*(all_kinds(child) for child in kind.__subclasses__()))


def test_none_is_left_out() -> None:
    # a base that only others are made of is never raised
    assert {type(error) for error in ERRORS} == all_kinds(JoulepathError) - {exceptions.InCollision}
    assert {type(error) for error in SERVICE_ERRORS} == all_kinds(ServiceError)


@pytest.mark.parametrize("error", [*ERRORS, *SERVICE_ERRORS], ids=lambda error: type(error).__name__)
def test_survives_pickling(error: Exception) -> None:
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is type(error)
    assert str(copy) == str(error)
    assert repr(vars(copy)) == repr(vars(error))


@pytest.mark.parametrize("error", [*ERRORS, *SERVICE_ERRORS], ids=lambda error: type(error).__name__)
def test_becomes_a_problem_that_fits_its_schema(error: Exception) -> None:
    problem = problem_type(error).model_validate_json(sent(error))
    assert (problem.instance, problem.detail) == ("the-id", str(error))


def test_the_most_special_type_wins() -> None:
    assert problem_type(ERRORS[1]) is OutsideLimits


def test_candidates_are_told() -> None:
    content = json.loads(sent(exceptions.NoTrajectory([CANDIDATE])))
    assert content["candidates"][0]["q_goal"] == [1.0] * 6
    NoTrajectory.model_validate(content)


def test_an_unforeseen_error_keeps_its_message_to_itself() -> None:
    body = sent(ZeroDivisionError("secret"))
    assert b"secret" not in body
    Internal.model_validate_json(body)


def test_an_unknown_distance_is_null() -> None:
    content = json.loads(sent(ERRORS[4]))
    assert content["distance"] is None
    UnreachablePose.model_validate(content)


def test_every_exception_of_the_table_is_an_error_of_ours() -> None:
    assert all(kind.__module__.startswith(OURS) for kind in TABLE)
