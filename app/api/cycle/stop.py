"""A stop of `POST /cycle`."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.schemas.arm import MoveLimits, Payload
from joulepath.app.schemas.common import NO_CONTROLS, PLAIN, Request, described
from joulepath.app.schemas.path import Line, StopPath
from joulepath.app.schemas.request import Branch, Target
from joulepath.optimizer.problem.names import LONGEST_NAME
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.problem.scene import SCENE_RANGES

PlainName = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME, pattern=NO_CONTROLS), PLAIN]


class StopRequest(Request):
    """A stop: the arm comes to rest at the target, or at the end of a path, and may take up or put
    down a payload; or it passes through the target. It has exactly one of `target` and `path`."""

    name: PlainName | None = described(
        "Name of the stop, different from those of the others. Null: its number, from 1.",
        None,
        "pick",
        default=None,
    )
    target: Target | None = described(
        "Joint positions, a pose of the TCP, or one of several targets. The orientation of a "
        "single pose may be free in part: it is then chosen for the whole cycle, and the answer is "
        "`feasible`.",
        None,
        {"pose": {"position": [0.4, -0.2, 0.1], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
        default=None,
    )
    path: StopPath | None = described(
        "A path that the TCP follows, from rest at its first point to rest at its last. Null: "
        "none.",
        None,
        {
            "points": [
                {"position": [0.4, 0.0, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]},
                {"position": [0.4, 0.3, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]},
            ],
            "speed": 0.1,
        },
        default=None,
    )
    via: bool = described(
        "Whether the arm passes through the target without a rest, on its way to the next stop at "
        "which it rests. Then the stop has no `dwell`, `payload`, `path`, lines or "
        "`obstacles_ignored`, and the limits of all stops of this motion hold for all of it.",
        None,
        False,
        default=False,
    )
    dwell: float = described(
        "Time at rest at the stop; with a path, at its end.",
        "s",
        0.4,
        default=0.0,
        ge=0,
        le=DURATIONS.longest,
    )
    payload: Payload | None = described(
        "What the arm carries from here on, the dwell included; with a path, from its end on. "
        "Null: nothing, it is put down. Left out: unchanged.",
        None,
        {"mass": 2.0, "com": [0.0, 0.0, 0.1]},
        default=None,
    )
    branch: Branch | None = described(
        "Allowed branches of the arm configurations at this stop. Null: all branches.",
        None,
        {"elbow": "up"},
        default=None,
    )
    limits: MoveLimits = described(
        "Limits of the moves into this stop, its line and its path included, where they are "
        "tighter than those of the request.",
        None,
        {"acceleration": 5.0, "tcp_speed": 0.5},
        default=MoveLimits(),
    )
    approach: Line | None = described(
        "Straight line of the TCP into the stop, or to the start of its path. The arm rests at its "
        "outer end. Null: none.",
        None,
        {"direction": [0.0, 0.0, 1.0], "distance": 0.08},
        default=None,
    )
    retreat: Line | None = described(
        "Straight line of the TCP out of the stop, or from the end of its path. The arm rests at "
        "its outer end. Null: none.",
        None,
        {"direction": [0.0, 0.0, -1.0], "distance": 0.08},
        default=None,
    )
    obstacles_ignored: Annotated[list[PlainName], Field(max_length=SCENE_RANGES.max_obstacles)] = (
        described(
            "Names of obstacles that do not count at the stop, on its lines and its path, like the "
            "part that is grasped.",
            None,
            ["part"],
            default=[],
        )
    )

    @model_validator(mode="after")
    def _target_or_path(self) -> Self:
        if (self.target is None) == (self.path is None):
            raise PydanticCustomError(
                "target_or_path", "Give a stop exactly one of `target` and `path`"
            )
        return self
