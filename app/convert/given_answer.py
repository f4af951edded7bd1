"""The program of motions of an answer in a request, for exports and replays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from joulepath.app.convert.arm import to_arm
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.common import RobotName
from joulepath.models.robot import Array
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.evaluate.sample_check import check_samples
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.export.program import Move, Program, Rest, with_payload_at_end
from joulepath.optimizer.motion.joined import spline_through
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cycle import CYCLE_RANGES


@dataclass(frozen=True)
class GivenAnswerLimits:
    """Limits of answers that callers send back, far above those of any answer."""

    knots: int = 4096
    """Most knots of a spline."""
    degree: int = 31
    """Highest degree of a spline."""
    rest: float = CYCLE_RANGES.longest
    """Longest dwell or wait [s]."""
    legs: int = 6 * CYCLE_RANGES.max_stops + 5
    """Most legs: of a stop a move, two lines, a path, a dwell and a wait."""


LIMITS = GivenAnswerLimits()
MOVING = ("move", "line", "path")
Number = Annotated[float, Field(ge=-1e9, le=1e9)]
_Row = Annotated[list[Number], Field(min_length=1, max_length=16)]


class Part(BaseModel):
    """A part of an answer. Other fields are not looked at."""

    model_config = ConfigDict(extra="ignore", strict=True, allow_inf_nan=False, frozen=True)


class _Spline(Part):
    degree: Annotated[int, Field(ge=1, le=LIMITS.degree)]
    knots: Annotated[list[Number], Field(min_length=4, max_length=LIMITS.knots)]
    control_points: Annotated[list[_Row], Field(min_length=2, max_length=LIMITS.knots)]


class _Samples(Part):
    t: Annotated[list[Number], Field(min_length=2, max_length=MOTION_LIMITS.max_samples)]
    q: Annotated[list[_Row], Field(max_length=MOTION_LIMITS.max_samples)]
    v: Annotated[list[_Row], Field(max_length=MOTION_LIMITS.max_samples)]
    a: Annotated[list[_Row], Field(max_length=MOTION_LIMITS.max_samples)]
    tau: Annotated[list[_Row], Field(max_length=MOTION_LIMITS.max_samples)]

    def arrays(self) -> tuple[Array, Array, Array, Array]:
        """q, v, a, tau (k, nq)."""
        given = (self.q, self.v, self.a, self.tau)
        return tuple(_array(rows, "samples") for rows in given)  # type: ignore[return-value]


class _Trajectory(_Samples):
    spline: _Spline


class _Planned(Part):
    """An answer of `POST /optimize`."""

    robot: RobotName
    trajectory: _Trajectory
    arm: dict[str, Any] | None = None


class _Given(Part):
    """An answer of `POST /evaluate`."""

    robot: RobotName
    samples: _Samples | None
    arm: dict[str, Any] | None = None


class _Stop(Part):
    stop: Annotated[str, Field(max_length=256)]


class _Leg(Part):
    kind: Literal["move", "line", "path", "dwell", "wait"]
    start: _Stop
    goal: _Stop
    duration: Annotated[float, Field(ge=0, le=LIMITS.rest)]
    answer: str | None


class _Cycle(Part):
    """An answer of `POST /cycle`."""

    robot: RobotName
    legs: Annotated[list[_Leg], Field(min_length=1, max_length=LIMITS.legs)]
    payload_at_end: dict[str, Any] | None = None


_A_FRONT = "points"
_MOTION = (
    "answer must be one of POST /optimize, of POST /cycle, or of POST /evaluate with sample_period"
)


def to_program(
    answer: dict[str, Any], arm: ArmRequest | None, moves: list[dict[str, Any]]
) -> Program:
    """The motion of an answer at full speed, with validated samples.

    `moves` are the answers of a cycle's moves. Raises ValidationError (of pydantic),
    InvalidRequest, InvalidProblem, NotCertified or UnknownRobot.
    """
    if "legs" in answer:
        return _cycle(_Cycle.model_validate(answer), arm, moves)
    if "trajectory" in answer or "samples" in answer:
        return Program((_move(answer, arm, "move"),))
    if _A_FRONT in answer:
        raise InvalidProblem(
            "answer", "The answer is a front: export one of its points, by its `answer`."
        )
    raise InvalidProblem("answer", f"{_MOTION}: it has no `trajectory`, `legs` or `samples`.")


def arm_of(request: dict[str, Any], answer: dict[str, Any], **instead: Any) -> Arm:
    """The arm of an answer; of its request, where it is too large to be repeated.

    `instead` replaces some fields. Raises InvalidProblem.
    """
    known = answer.get("arm")
    fields = arm_fields_of(request if known is None else known, **instead)
    return to_arm(fields.model_copy(update={"robot": answer["robot"]}))


def arm_at_end(request: dict[str, Any], answer: dict[str, Any], moves: list[Any]) -> Arm:
    """The arm after the last move of an answer; `moves` are the answers of a cycle's moves."""
    if (left := answer.get("payload_at_end")) is None:
        return arm_of(request, (moves or [answer])[-1])
    return arm_of(request, moves[-1], payload=left)


def arm_fields_of(request: dict[str, Any], **instead: Any) -> ArmRequest:
    """The fields of the arm in a request; `instead` replaces some fields."""
    names = ArmRequest.model_fields
    given = {k: value for k, value in request.items() if k in names}
    return ArmRequest.model_validate(given | instead)


def paths_of_moves(answer: dict[str, Any]) -> list[str]:
    """The paths of the answers of a cycle's moves; empty for another answer. Raises ValidationError
    or InvalidProblem."""
    if "legs" not in answer:
        return []
    legs = [leg for leg in _Cycle.model_validate(answer).legs if leg.kind in MOVING]
    if any(leg.answer is None for leg in legs):
        raise InvalidProblem(
            "answer", "The moves of the cycle are not stored: send the cycle to POST /cycle again."
        )
    return [leg.answer for leg in legs if leg.answer is not None]


def _cycle(found: _Cycle, arm: ArmRequest | None, moves: list[dict[str, Any]]) -> Program:
    if arm is not None:
        raise InvalidProblem("arm", "The moves of a cycle have arms of their own: leave `arm` out.")
    answers, steps = iter(moves), list[Move | Rest]()
    for leg in found.legs:
        if leg.kind in MOVING:
            steps.append(_move(next(answers), None, f"{leg.start.stop} to {leg.goal.stop}"))
        else:
            steps.append(Rest(leg.duration, f"{leg.kind} at {leg.goal.stop}"))
    # a cycle without moves is refused by the program
    if found.payload_at_end is not None and moves:
        left = arm_of({}, moves[-1], payload=found.payload_at_end).payload
        steps = with_payload_at_end(steps, left)
    return Program(tuple(steps))


def _move(answer: dict[str, Any], arm: ArmRequest | None, label: str) -> Move:
    if "trajectory" in answer:
        planned = _Planned.model_validate(answer)
        made = _arm(planned.robot, planned.arm, arm)
        return _checked(
            Move(_spline(planned.trajectory.spline, made.robot.nq), made, label), planned.trajectory
        )
    given = _Given.model_validate(answer)
    if given.samples is None:
        raise InvalidProblem(
            "answer",
            "The answer has no samples: request them from POST /evaluate with sample_period.",
        )
    made = _arm(given.robot, given.arm, arm)
    return _checked(Move(_through(given.samples, made.robot.nq), made, label), given.samples)


def _checked(move: Move, samples: _Samples) -> Move:
    """The move. Raises NotCertified unless the samples are its own."""
    check_samples(move.arm, move.spline, np.array(samples.t), samples.arrays())
    return move


def _arm(robot: str, own: dict[str, Any] | None, instead: ArmRequest | None) -> Arm:
    if instead is not None:
        if "robot" in instead.model_fields_set and instead.robot != robot:
            raise InvalidProblem(
                "arm.robot", f"The answer belongs to the robot {robot}: leave arm.robot out."
            )
        return to_arm(instead.model_copy(update={"robot": robot}))
    if own is None:
        raise InvalidProblem(
            "arm", "The answer does not contain its arm: give `arm`, as in its request."
        )
    return to_arm(ArmRequest.model_validate({**own, "robot": robot}))


def _spline(given: _Spline, nq: int) -> Spline:
    """Raises InvalidRequest unless it is a clamped B-spline of the robot's joints."""
    knots, points, ends = (
        np.array(given.knots),
        _array(given.control_points, "control_points"),
        given.degree + 1,
    )
    if points.shape[1] != nq:
        raise _wrong(
            "control_points", f"Every row must have {nq} numbers, one per joint of the robot"
        )
    if len(knots) != len(points) + ends or len(points) < ends:
        raise _wrong("knots", "There must be degree + 1 more knots than control points")
    inner = knots[ends:-ends]
    clamped = (knots[:ends] == 0).all() and (knots[-ends:] == knots[-1]).all()
    if not clamped or (np.diff(knots) < 0).any() or ((inner <= 0) | (inner >= knots[-1])).any():
        raise _wrong(
            "knots",
            "The knots must increase from degree + 1 zeros to degree + 1 times the duration",
        )
    return Spline(given.degree, knots, points)


def _through(samples: _Samples, nq: int) -> Spline:
    t, (q, v, a, _) = np.array(samples.t), samples.arrays()
    if (
        any(rows.shape != (len(t), nq) for rows in (q, v, a))
        or t[0] != 0
        or (np.diff(t) < 1e-6).any()
    ):
        raise InvalidProblem(
            "answer", f"samples must have {nq} joints, as many rows as times, and times from 0 on."
        )
    return spline_through(t, q, v, a)


def _array(rows: list[list[float]], name: str) -> Array:
    if any(len(row) != len(rows[0]) for row in rows):
        raise _wrong(name, "Every row must have one number per joint")
    return np.array(rows, dtype=float)


def _wrong(name: str, message: str) -> InvalidRequest:
    return InvalidRequest([{"loc": ["body", "answer", name], "msg": message}])
