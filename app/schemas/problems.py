"""Every type of problem that the service answers with (RFC 9457). A docstring is the text of the type's page."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import ConfigDict

from app.schemas.common import Response, described
from app.schemas.response import Candidate

PREFIX = "/problems/"


class Problem(Response):
    """What went wrong, and what to do about it."""

    # `type`, `title` and `status` have defaults here and are always in the answer
    model_config = ConfigDict(json_schema_serialization_defaults_required=True)
    retry_after: ClassVar[int | None] = None

    type: str = described("Path of a page that explains the problem.", None, "/problems/validation")
    title: str = described("Short name of the problem.", None, "Invalid request")
    status: int = described("HTTP status.", "1", 422)
    detail: str = described("What to do.", None, "Correct the fields listed under `errors`.")
    instance: str = described("The request's id.", None, "0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55")

    @classmethod
    def slug(cls) -> str:
        """The type's name, the last part of `type`."""
        return str(cls.model_fields["type"].default).removeprefix(PREFIX)

    @classmethod
    def own_fields(cls) -> tuple[str, ...]:
        """Fields that this type has beyond those of all."""
        return tuple(name for name in cls.model_fields if name not in Problem.model_fields)


class FieldError(Response):
    """One thing wrong with the request."""

    loc: list[str | int] = described("Path to the field.", None, ["body", "start", "q"])
    msg: str = described("What is wrong with it.", None, "List should have at least 1 item")


class Validation(Problem):
    """The request is malformed or contradicts itself: the body is no JSON, a field is missing, unknown, of the wrong
    type or length, out of bounds, or not finite. Correct what `errors` lists and send it again."""

    type: Literal["/problems/validation"] = "/problems/validation"
    title: Literal["Invalid request"] = "Invalid request"
    status: Literal[422] = 422
    errors: list[FieldError] = described(
        "What is wrong, field by field.", None, [{"loc": ["body", "goal"], "msg": "Field required"}]
    )


class UnknownRobot(Problem):
    """No robot has that name. Use one of the names in `known`, which `GET /robots` lists too."""

    type: Literal["/problems/unknown-robot"] = "/problems/unknown-robot"
    title: Literal["Unknown robot"] = "Unknown robot"
    status: Literal[404] = 404
    known: list[str] = described("Names that there are.", None, ["ur5e"])


class _TargetProblem(Problem):
    target: Literal["start", "goal"] = described("Which target; `goal` for the pose of `POST /ik`.", None, "goal")


class UnreachablePose(_TargetProblem):
    """No arm configuration within the joint range reaches the pose. Move it nearer, check that `position` is in metres
    and in the robot's base frame, and that `tcp` is right."""

    type: Literal["/problems/unreachable-pose"] = "/problems/unreachable-pose"
    title: Literal["Unreachable pose"] = "Unreachable pose"
    status: Literal[422] = 422
    distance: float | None = described(
        "Distance to the nearest reachable position; null where it is not known or not the cause.", "m", 0.12
    )


class SingularPose(_TargetProblem):
    """Every arm configuration that reaches the pose is singular: there the arm cannot move in some direction. Move the
    pose a few millimetres, tilt it by a degree, or give joint positions."""

    type: Literal["/problems/singular-pose"] = "/problems/singular-pose"
    title: Literal["Singular pose"] = "Singular pose"
    status: Literal[422] = 422
    smallest_singular_value: float = described("The largest among the configurations.", "1", 1e-9)


class OutsideLimits(Problem):
    """A joint position of the start or goal lies beyond the joint's range, the robot's own or the request's. Give one
    between `lower` and `upper`."""

    type: Literal["/problems/outside-limits"] = "/problems/outside-limits"
    title: Literal["Joint position outside its limits"] = "Joint position outside its limits"
    status: Literal[422] = 422
    joint: str = described("Name of the joint.", None, "elbow_joint")
    value: float = described("Its position.", "rad", 3.5)
    lower: float = described("Least position allowed.", "rad", -3.1416)
    upper: float = described("Greatest position allowed.", "rad", 3.1416)


class DurationTooShort(Problem):
    """No motion within the limits is as fast as `duration` demands. Allow at least `shortest`, or leave the duration to
    the optimiser."""

    type: Literal["/problems/duration-too-short"] = "/problems/duration-too-short"
    title: Literal["Duration too short"] = "Duration too short"
    status: Literal[422] = 422
    shortest: float = described("The least feasible duration.", "s", 0.83)


class TorqueInfeasible(Problem):
    """The arm cannot hold or move that load. Lighten the payload, bring it closer to the flange, or relax the torque
    limit."""

    type: Literal["/problems/torque-infeasible"] = "/problems/torque-infeasible"
    title: Literal["Not enough torque"] = "Not enough torque"
    status: Literal[422] = 422
    joint: str = described("The joint that is too weak.", None, "shoulder_lift_joint")
    needed: float = described("Torque that it needs.", "N·m", 171.0)
    available: float = described("Torque that it has.", "N·m", 150.0)


class _SearchProblem(Problem):
    candidates: list[Candidate] = described(
        "Every start and goal pair looked at, and why it failed.", None, [{"start": "left/up/flip", "status": "failed"}]
    )


class NoTrajectory(_SearchProblem):
    """Every pair of start and goal configurations failed; `candidates` tells why. Relax a limit, allow a longer
    duration, or leave the branch free."""

    type: Literal["/problems/no-trajectory"] = "/problems/no-trajectory"
    title: Literal["No trajectory found"] = "No trajectory found"
    status: Literal[422] = 422


class DeadlineExceeded(_SearchProblem):
    """The deadline passed before any motion was verified. Time spent waiting for a worker counts. Allow a longer
    `deadline`, or try again when the service is less busy."""

    type: Literal["/problems/deadline-exceeded"] = "/problems/deadline-exceeded"
    title: Literal["Deadline exceeded"] = "Deadline exceeded"
    status: Literal[504] = 504


class Busy(Problem):
    """Every worker is taken and the queue is full. Try again after the seconds that the `Retry-After` header gives."""

    retry_after: ClassVar[int | None] = 2
    type: Literal["/problems/busy"] = "/problems/busy"
    title: Literal["Busy"] = "Busy"
    status: Literal[503] = 503


class NotReady(Problem):
    """The workers are still warming up, or none is left alive for the moment. Try again after the seconds that the
    `Retry-After` header gives."""

    retry_after: ClassVar[int | None] = 2
    type: Literal["/problems/not-ready"] = "/problems/not-ready"
    title: Literal["Not ready"] = "Not ready"
    status: Literal[503] = 503


class ShuttingDown(Problem):
    """The service is stopping and gave this request up. Send it again: another instance, or the next one, answers."""

    retry_after: ClassVar[int | None] = 5
    type: Literal["/problems/shutting-down"] = "/problems/shutting-down"
    title: Literal["Shutting down"] = "Shutting down"
    status: Literal[503] = 503


class NotFound(Problem):
    """There is nothing at that path. `GET /openapi.json` lists what there is."""

    type: Literal["/problems/not-found"] = "/problems/not-found"
    title: Literal["Not found"] = "Not found"
    status: Literal[404] = 404


class MethodNotAllowed(Problem):
    """The path does not take that HTTP method. Use one from the `Allow` header."""

    type: Literal["/problems/method-not-allowed"] = "/problems/method-not-allowed"
    title: Literal["Method not allowed"] = "Method not allowed"
    status: Literal[405] = 405


class BodyTooLarge(Problem):
    """The request's body is larger than the service accepts. Every honest request fits in a few kilobytes."""

    type: Literal["/problems/body-too-large"] = "/problems/body-too-large"
    title: Literal["Body too large"] = "Body too large"
    status: Literal[413] = 413


class Internal(Problem):
    """A defect of the service: it is logged with the request's id. Please report it, with the value of `instance`."""

    type: Literal["/problems/internal"] = "/problems/internal"
    title: Literal["Internal error"] = "Internal error"
    status: Literal[500] = 500


PROBLEMS: tuple[type[Problem], ...] = (
    Validation,
    UnknownRobot,
    UnreachablePose,
    SingularPose,
    OutsideLimits,
    DurationTooShort,
    TorqueInfeasible,
    NoTrajectory,
    DeadlineExceeded,
    Busy,
    NotReady,
    ShuttingDown,
    NotFound,
    MethodNotAllowed,
    BodyTooLarge,
    Internal,
)
