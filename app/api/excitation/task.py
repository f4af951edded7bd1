"""Request and answer of `POST /excitation`, and its work in a worker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from joulepath.app.answers.envelope import MotionAnswer
from joulepath.app.convert.arm import arm_fields, to_arm
from joulepath.app.convert.until import time_left, until
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.common import described
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.examples.values import HOME
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.excitation.excitation_problem import (
    REQUEST_LIMITS,
    Criterion,
    ExcitationProblem,
    Part,
)
from joulepath.optimizer.excitation.excitation_result import Excitation
from joulepath.optimizer.excitation.excite import excite
from joulepath.optimizer.problem.problem import DURATIONS

_ALL: list[Part] = ["inertials", "rotor", "friction"]
_Angles = Annotated[
    list[Annotated[float, Field(ge=-1e3, le=1e3)]], Field(min_length=1, max_length=16)
]
_Noise = Annotated[
    list[Annotated[float, Field(ge=1e-6, le=1e3)]], Field(min_length=1, max_length=16)
]


class ExcitationRequest(ArmRequest):
    """A periodic, collision-free motion for the identification of an arm."""

    parameters: Annotated[list[Part], Field(min_length=1, max_length=3)] = described(
        "Parameters to be identified from the motion: `inertials` (base parameters of the "
        "links), `rotor` (rotor inertias), `friction` (Coulomb, viscous, offset, and load where "
        "a joint carries enough).",
        None,
        ["rotor", "friction"],
        default=_ALL,
    )
    period: float = described("Period of the Fourier series.", "s", 6.0, default=10.0, ge=1, le=60)
    harmonics: int = described("Number of harmonics.", "1", 3, default=5, ge=2, le=10)
    criterion: Criterion = described(
        "`d`: the determinant of the information is maximised. `condition`: the condition of the "
        "columns, scaled to one length, is lowered.",
        None,
        "d",
        default="d",
    )
    speed_fraction: float = described(
        "Greatest joint speed over its limit.", "1", 0.6, default=0.6, ge=0.01, le=1
    )
    clearance: float = described(
        "Least distance of two bodies, the margins of obstacles subtracted.",
        "m",
        0.02,
        default=0.02,
        ge=0,
        le=0.5,
    )
    mounting_plane: bool = described(
        "Whether the arm is mounted on an obstacle that fills everything below z = 0 of its base.",
        None,
        True,
        default=True,
    )
    centre: _Angles | None = described(
        "Joint positions about which the arm moves. Null: they are chosen.",
        "rad",
        HOME,
        default=None,
    )
    noise: _Noise | None = described(
        "Standard deviation of the torque of every joint. Null: 1 % of its limit.",
        "N·m",
        [1.5, 1.5, 1.5, 0.3, 0.3, 0.3],
        default=None,
    )
    starts: int = described("Largest number of random starts.", "1", 3, default=3, ge=1, le=100)
    sample_period: float = described(
        "Time between the returned samples; at most 20,000.",
        "s",
        0.008,
        default=0.008,
        ge=DURATIONS.least_period,
        le=1,
    )
    deadline: DeadlineSeconds = described(
        "Wall time from the arrival of the request, including the wait for a worker. When it "
        "passes, the service returns the best certified motion found so far.",
        "s",
        5.0,
        default=60.0,
    )


@dataclass(frozen=True, kw_only=True)
class ExcitationAnswer(Excitation, MotionAnswer):
    """A motion from rest to rest for the identification of an arm."""


@dataclass(frozen=True)
class ExcitationTask:
    """A validated request and its id; the media type of the answer is `wanted`."""

    request: ExcitationRequest
    request_id: str
    wanted: Literal["json", "csv"]

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /excitation`, within about `deadline` seconds."""
        found = excite(_problem(self.request, deadline), listener())
        if self.wanted == "csv":
            return TaskResult.of_csv(_rows(found))
        request, arm = self.request, arm_fields(self.request)
        return TaskResult.of_json(
            ExcitationAnswer(request=self.request_id, robot=request.robot, arm=arm, **vars(found))
        )


def _problem(request: ExcitationRequest, deadline: float) -> ExcitationProblem:
    """The problem of a request with a remaining time of `deadline` [s].

    Raises UnknownRobot, InvalidProblem or DeadlineExceeded.
    """
    # it may have passed while the request waited
    end = Deadline.after(max(deadline, REQUEST_LIMITS.min_deadline))
    with until(end):
        arm = to_arm(request)
    same = (
        "period",
        "harmonics",
        "criterion",
        "speed_fraction",
        "clearance",
        "mounting_plane",
        "starts",
    )
    return ExcitationProblem(
        arm=arm,
        parts=tuple(request.parameters),
        centre=None if request.centre is None else np.array(request.centre),
        noise=None if request.noise is None else np.array(request.noise),
        sample_period=request.sample_period,
        deadline=time_left(end),
        **{name: getattr(request, name) for name in same},
    )


def _rows(found: Excitation) -> list[list[Any]]:
    """Rows with the columns t, then q, v and a of all joints, for `POST /evaluate`."""
    samples = found.trajectory
    joints = range(1, samples.q.shape[1] + 1)
    table = np.hstack([samples.t[:, None], samples.q, samples.v, samples.a])
    return [["t", *(f"{name}{joint}" for name in "qva" for joint in joints)], *table.tolist()]
