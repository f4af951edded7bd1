"""Every type of problem that the service answers with (RFC 9457). A docstring is the text of the type's page."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import ConfigDict, Field

from app.schemas.common import Response, described, part
from app.schemas.response import Candidate, UnreachableTarget

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


def _fixed(value: Any, name: str) -> Any:
    """A field that is the same in every problem of a type."""
    return Field(default=value, description=Problem.model_fields[name].description, examples=[value])


class FieldError(Response):
    """One thing wrong with the request."""

    loc: list[str | int] = described("Path to the field.", None, ["body", "start", "q"])
    msg: str = described("What is wrong with it.", None, "List should have at least 1 item")


class Validation(Problem):
    """The request is malformed or contradicts itself: the body is no JSON, a field is missing, unknown, of the wrong
    type or length, out of bounds, or not finite. Correct what `errors` lists and send it again."""

    type: Literal["/problems/validation"] = _fixed("/problems/validation", "type")
    title: Literal["Invalid request"] = _fixed("Invalid request", "title")
    status: Literal[422] = _fixed(422, "status")
    errors: list[FieldError] = part("What is wrong, field by field.")


class UnknownRobot(Problem):
    """No robot has that name. Use one of the names in `known`, which `GET /robots` lists too."""

    type: Literal["/problems/unknown-robot"] = _fixed("/problems/unknown-robot", "type")
    title: Literal["Unknown robot"] = _fixed("Unknown robot", "title")
    status: Literal[404] = _fixed(404, "status")
    known: list[str] = described("Names that there are.", None, ["ur5e"])


class _TargetProblem(Problem):
    target: Literal["start", "goal"] = described("Which target; `goal` for the pose of `POST /ik`.", None, "goal")


class UnreachablePose(_TargetProblem):
    """No arm configuration within the joint range reaches the pose. Move it nearer, check that `position` is in metres
    and in the robot's base frame, and that `tcp` is right."""

    type: Literal["/problems/unreachable-pose"] = _fixed("/problems/unreachable-pose", "type")
    title: Literal["Unreachable pose"] = _fixed("Unreachable pose", "title")
    status: Literal[422] = _fixed(422, "status")
    distance: float | None = described(
        "Distance to the nearest reachable position; null where it is not known or not the cause.", "m", 0.12
    )


class SingularPose(_TargetProblem):
    """Every arm configuration that reaches the pose is singular: there the arm cannot move in some direction. Move the
    pose a few millimetres, tilt it by a degree, or give joint positions."""

    type: Literal["/problems/singular-pose"] = _fixed("/problems/singular-pose", "type")
    title: Literal["Singular pose"] = _fixed("Singular pose", "title")
    status: Literal[422] = _fixed(422, "status")
    smallest_singular_value: float = described("The largest among the configurations.", "1", 1e-9)


class UnreachableTargets(_TargetProblem):
    """The arm can go to none of the targets of an `any_of`; `unreachable` tells why of each: out of reach, singular, or
    outside the joint range. Correct at least one of them."""

    type: Literal["/problems/unreachable-targets"] = _fixed("/problems/unreachable-targets", "type")
    title: Literal["No target within reach"] = _fixed("No target within reach", "title")
    status: Literal[422] = _fixed(422, "status")
    unreachable: list[UnreachableTarget] = part("Every target of the `any_of`, and why it cannot be reached.")


class OutsideLimits(Problem):
    """A joint position of the start or goal lies beyond the joint's range, the robot's own or the request's. Give one
    between `lower` and `upper`."""

    type: Literal["/problems/outside-limits"] = _fixed("/problems/outside-limits", "type")
    title: Literal["Joint position outside its limits"] = _fixed("Joint position outside its limits", "title")
    status: Literal[422] = _fixed(422, "status")
    joint: str = described("Name of the joint.", None, "elbow_joint")
    value: float = described("Its position.", "rad", 3.5)
    lower: float = described("Least position allowed.", "rad", -3.1416)
    upper: float = described("Greatest position allowed.", "rad", 3.1416)


class InvalidTable(Problem):
    """A given motion cannot be read: a value is no number, not finite or no radians, times do not increase, a line has
    too few or too many columns, the header is missing or unknown, or the file is no CSV at all. `row` and `column` say
    where; correct it and send it again."""

    type: Literal["/problems/invalid-table"] = _fixed("/problems/invalid-table", "type")
    title: Literal["Invalid motion table"] = _fixed("Invalid motion table", "title")
    status: Literal[422] = _fixed(422, "status")
    row: int | None = described(
        "Line of the CSV file, the header being the first, or index into the list that was sent, from 0; null where no "
        "single row is to blame.",
        "1",
        17,
    )
    column: str | None = described("Column, as a CSV's header names it; null where no single one is.", None, "q3")


_PAIR = "Names of the two bodies: links, `tool`, `payload`, or an obstacle."
_DEPTH = "How far they would have to part to be allowed."


class CollidingBranch(Response):
    """An arm configuration in which the arm hits something."""

    label: str = described("Branch: shoulder/elbow/wrist.", None, "left/up/no_flip")
    target: int = described("Which target of `any_of` it reaches, counted from 0; 0 for a single target.", None, 0)
    q: list[float] = described("Joint positions.", "rad", [0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
    pair: list[str] = described(_PAIR, None, ["table", "forearm"])
    depth: float = described(_DEPTH, "m", 0.031)


class _InCollision(Problem):
    pair: list[str] = described(f"{_PAIR} Of the least bad arm configuration.", None, ["table", "forearm"])
    depth: float = described(_DEPTH, "m", 0.031)
    branches: list[CollidingBranch] = part(
        "Every arm configuration and what it hits, the least bad first; of more than 64, the first ones."
    )


class StartInCollision(_InCollision):
    """In every arm configuration at the start, the arm hits itself, its tool, its payload or an obstacle, or is nearer
    to it than its margin. Move the start or the obstacle, or set `collisions` to false if the shapes are too coarse."""

    type: Literal["/problems/start-in-collision"] = _fixed("/problems/start-in-collision", "type")
    title: Literal["Start in collision"] = _fixed("Start in collision", "title")
    status: Literal[422] = _fixed(422, "status")


class GoalInCollision(_InCollision):
    """In every arm configuration at the goal, the arm hits itself, its tool, its payload or an obstacle, or is nearer
    to it than its margin. Move the goal or the obstacle, or set `collisions` to false if the shapes are too coarse."""

    type: Literal["/problems/goal-in-collision"] = _fixed("/problems/goal-in-collision", "type")
    title: Literal["Goal in collision"] = _fixed("Goal in collision", "title")
    status: Literal[422] = _fixed(422, "status")


class DurationTooShort(Problem):
    """No motion within the limits is as fast as `duration` demands. Allow at least `shortest`, or leave the duration to
    the optimiser."""

    type: Literal["/problems/duration-too-short"] = _fixed("/problems/duration-too-short", "type")
    title: Literal["Duration too short"] = _fixed("Duration too short", "title")
    status: Literal[422] = _fixed(422, "status")
    shortest: float = described("The least feasible duration.", "s", 0.83)


class TorqueInfeasible(Problem):
    """The arm cannot hold or move that load. Lighten the payload, bring it closer to the flange, or relax the torque
    limit."""

    type: Literal["/problems/torque-infeasible"] = _fixed("/problems/torque-infeasible", "type")
    title: Literal["Not enough torque"] = _fixed("Not enough torque", "title")
    status: Literal[422] = _fixed(422, "status")
    joint: str = described("The joint that is too weak.", None, "shoulder_lift_joint")
    needed: float = described("Torque that it needs.", "N·m", 171.0)
    available: float = described("Torque that it has.", "N·m", 150.0)


class _SearchProblem(Problem):
    candidates: list[Candidate] = part("Every start and goal pair looked at, and why it failed.")


class NoTrajectory(_SearchProblem):
    """Every pair of start and goal configurations failed; `candidates` tells why. Relax a limit, allow a longer
    duration, or leave the branch free."""

    type: Literal["/problems/no-trajectory"] = _fixed("/problems/no-trajectory", "type")
    title: Literal["No trajectory found"] = _fixed("No trajectory found", "title")
    status: Literal[422] = _fixed(422, "status")


class NoCollisionFreeTrajectory(_SearchProblem):
    """No motion was found that hits nothing. That is no proof that there is none: the search goes from several first
    guesses. Make room at what `pair` names, move the start or the goal, leave the branch free, or go in two moves."""

    type: Literal["/problems/no-collision-free-trajectory"] = _fixed("/problems/no-collision-free-trajectory", "type")
    title: Literal["No collision-free trajectory found"] = _fixed("No collision-free trajectory found", "title")
    status: Literal[422] = _fixed(422, "status")
    pair: list[str] = described(f"{_PAIR} Of the best attempt.", None, ["table", "forearm"])
    depth: float = described(_DEPTH, "m", 0.031)
    time: float = described("When, from the attempt's start.", "s", 0.62)
    start: str = described("Branch at the attempt's start.", None, "left/up/no_flip")
    goal: str = described("Branch at its goal.", None, "left/up/no_flip")


class DeadlineExceeded(_SearchProblem):
    """The deadline passed before any motion was verified. Time spent waiting for a worker counts. Allow a longer
    `deadline`, or try again when the service is less busy."""

    type: Literal["/problems/deadline-exceeded"] = _fixed("/problems/deadline-exceeded", "type")
    title: Literal["Deadline exceeded"] = _fixed("Deadline exceeded", "title")
    status: Literal[504] = _fixed(504, "status")


class Busy(Problem):
    """Every worker is taken and the queue is full. Try again after the seconds that the `Retry-After` header gives."""

    retry_after: ClassVar[int | None] = 2
    type: Literal["/problems/busy"] = _fixed("/problems/busy", "type")
    title: Literal["Busy"] = _fixed("Busy", "title")
    status: Literal[503] = _fixed(503, "status")


class NotReady(Problem):
    """The workers are still warming up, or none is left alive for the moment. Try again after the seconds that the
    `Retry-After` header gives."""

    retry_after: ClassVar[int | None] = 2
    type: Literal["/problems/not-ready"] = _fixed("/problems/not-ready", "type")
    title: Literal["Not ready"] = _fixed("Not ready", "title")
    status: Literal[503] = _fixed(503, "status")


class ShuttingDown(Problem):
    """The service is stopping and gave this request up. Send it again: another instance, or the next one, answers."""

    retry_after: ClassVar[int | None] = 5
    type: Literal["/problems/shutting-down"] = _fixed("/problems/shutting-down", "type")
    title: Literal["Shutting down"] = _fixed("Shutting down", "title")
    status: Literal[503] = _fixed(503, "status")


class StoreUnavailable(Problem):
    """The database that keeps studies and answers cannot be reached, read or written. What needs none, `/optimize`
    among it, goes on. Try again after the seconds that the `Retry-After` header gives; the service's log says what is
    wrong."""

    retry_after: ClassVar[int | None] = 5
    type: Literal["/problems/store-unavailable"] = _fixed("/problems/store-unavailable", "type")
    title: Literal["Database unavailable"] = _fixed("Database unavailable", "title")
    status: Literal[503] = _fixed(503, "status")


class UnknownAnswer(Problem):
    """No answer is kept under that id: it never was, its study was deleted, or it made room for newer ones. Send the
    request that gave it again."""

    type: Literal["/problems/unknown-answer"] = _fixed("/problems/unknown-answer", "type")
    title: Literal["Unknown answer"] = _fixed("Unknown answer", "title")
    status: Literal[404] = _fixed(404, "status")


class UnknownStudy(Problem):
    """No study has that id, or the study has no iteration of that number: it never was, or the study was deleted.
    `GET /studies` lists what there is."""

    type: Literal["/problems/unknown-study"] = _fixed("/problems/unknown-study", "type")
    title: Literal["Unknown study"] = _fixed("Unknown study", "title")
    status: Literal[404] = _fixed(404, "status")


class EmptyStudy(Problem):
    """What is asked for starts from an iteration of the study, and there is none yet. Add a first one with
    `POST /studies/{id}/iterations`."""

    type: Literal["/problems/empty-study"] = _fixed("/problems/empty-study", "type")
    title: Literal["Empty study"] = _fixed("Empty study", "title")
    status: Literal[409] = _fixed(409, "status")


class KeyReused(Problem):
    """The `Idempotency-Key` came before, with a different request. A key belongs to one request and its repetitions:
    take a new one."""

    type: Literal["/problems/key-reused"] = _fixed("/problems/key-reused", "type")
    title: Literal["Idempotency-Key reused"] = _fixed("Idempotency-Key reused", "title")
    status: Literal[422] = _fixed(422, "status")


class NotFound(Problem):
    """There is nothing at that path. `GET /openapi.json` lists what there is."""

    type: Literal["/problems/not-found"] = _fixed("/problems/not-found", "type")
    title: Literal["Not found"] = _fixed("Not found", "title")
    status: Literal[404] = _fixed(404, "status")


class MethodNotAllowed(Problem):
    """The path does not take that HTTP method. Use one from the `Allow` header."""

    type: Literal["/problems/method-not-allowed"] = _fixed("/problems/method-not-allowed", "type")
    title: Literal["MethodName not allowed"] = _fixed("MethodName not allowed", "title")
    status: Literal[405] = _fixed(405, "status")


class BodyTooLarge(Problem):
    """The request's body is larger than the service accepts. Every honest request fits in a
    few kilobytes, but for motions sent to `POST /evaluate`, which may be a thousand times larger: thin them out."""

    type: Literal["/problems/body-too-large"] = _fixed("/problems/body-too-large", "type")
    title: Literal["Body too large"] = _fixed("Body too large", "title")
    status: Literal[413] = _fixed(413, "status")


class UnsupportedMediaType(Problem):
    """The body is of a kind that the path does not take. Declare it by its `Content-Type`: `application/json` or
    `text/csv`."""

    type: Literal["/problems/unsupported-media-type"] = _fixed("/problems/unsupported-media-type", "type")
    title: Literal["Unsupported media type"] = _fixed("Unsupported media type", "title")
    status: Literal[415] = _fixed(415, "status")


class Internal(Problem):
    """A defect of the service: it is logged with the request's id. Please report it, with the value of `instance`."""

    type: Literal["/problems/internal"] = _fixed("/problems/internal", "type")
    title: Literal["Internal error"] = _fixed("Internal error", "title")
    status: Literal[500] = _fixed(500, "status")


PROBLEMS: tuple[type[Problem], ...] = (
    Validation,
    UnknownRobot,
    UnreachablePose,
    SingularPose,
    UnreachableTargets,
    OutsideLimits,
    InvalidTable,
    StartInCollision,
    GoalInCollision,
    DurationTooShort,
    TorqueInfeasible,
    NoTrajectory,
    NoCollisionFreeTrajectory,
    DeadlineExceeded,
    Busy,
    NotReady,
    ShuttingDown,
    StoreUnavailable,
    UnknownAnswer,
    UnknownStudy,
    EmptyStudy,
    KeyReused,
    NotFound,
    MethodNotAllowed,
    BodyTooLarge,
    UnsupportedMediaType,
    Internal,
)
