"""The query parameters of `POST /logs`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from joulepath.app.schemas.arm import Payload
from joulepath.app.schemas.common import NO_CONTROLS, PLAIN, RobotName, Vector3, described
from joulepath.app.schemas.log_file import LogFile
from joulepath.app.schemas.queries import Name

Tag = Annotated[str, Field(min_length=1, max_length=32, pattern=NO_CONTROLS), PLAIN]


class LogSettings(LogFile):
    """The query parameters of a log."""

    robot: RobotName = described(
        "Name of the robot, from `GET /robots`.", None, "ur5e", default="ur5e"
    )
    name: Name | None = described("A name of your own.", None, "Palletiser, morning", default=None)
    tags: Annotated[list[Tag], Field(max_length=16)] = described(
        "Tags of your own.", None, ["cold"], default=[]
    )
    payload: Payload | None = described(
        "Payload of the arm. Null: that in the log (`payload`, `payload_cog_0` …), otherwise none.",
        None,
        {"mass": 2.0, "com": [0.0, 0.0, 0.06]},
        default=None,
    )
    gravity: Vector3 | None = described(
        "Acceleration of gravity in the base frame. Null: [0, 0, -9.81], or the robot's "
        "`kinematics.gravity`.",
        "m/s²",
        [0.0, 0.0, -9.81],
        default=None,
    )
