"""How a file of a log is read: its columns and their units."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from joulepath.app.schemas.common import NO_CONTROLS, Request, described
from joulepath.app.schemas.lengths import LENGTHS

EffortMeaning = Literal["current", "torque", "external"]
_Column = (
    Annotated[str, Field(min_length=1, max_length=LENGTHS.name, pattern=NO_CONTROLS)]
    | Annotated[int, Field(ge=1, le=1000)]
)
_Columns = Annotated[list[_Column], Field(min_length=1, max_length=16)]
_Efforts = Annotated[list[_Column | None], Field(min_length=1, max_length=16)]


class LogColumns(Request):
    """Names of the columns of a log, as in its header, or their numbers from 1. A channel of joints
    has one column per joint, from base to flange. Null: no column. An effort is null for a joint
    without logged effort.
    """

    time: _Column = described("Times [s].", None, "time_s")
    nanoseconds: _Column | None = described(
        "Nanoseconds that complete times in whole seconds.", None, "nsecs", default=None
    )
    q: _Columns = described("Joint positions.", None, ["axis_1", "axis_2"])
    v: _Columns | None = described("Joint velocities.", None, ["speed_1", "speed_2"], default=None)
    a: _Columns | None = described("Joint accelerations.", None, ["acc_1", "acc_2"], default=None)
    current: _Efforts | None = described(
        "Motor currents.", None, ["amps_1", "amps_2"], default=None
    )
    torque: _Efforts | None = described(
        "Torques at the joints.", None, ["nm_1", "nm_2"], default=None
    )
    effort: _Efforts | None = described(
        "Efforts of unknown meaning.", None, ["eff_1", "eff_2"], default=None
    )
    temperature: _Columns | None = described(
        "Temperatures of the joints [°C].", None, ["t_1", "t_2"], default=None
    )
    wrench: _Columns | None = described(
        "Force [N] and torque [N·m] on a sensor beneath the base, about and along the axes of the "
        "base frame.",
        None,
        ["f_x", "f_y", "f_z", "t_x", "t_y", "t_z"],
        default=None,
    )
    power: _Column | None = described(
        "Power drawn from the bus of the arm [W].", None, "watts", default=None
    )


class LogFile(Request):
    """Information about a log beyond the content of its file."""

    columns: LogColumns | None = described(
        "Columns of the channels. Required for a header with unknown column names.",
        None,
        {"time": "t", "q": ["q1", "q2", "q3", "q4", "q5", "q6"]},
        default=None,
    )
    units: Literal["rad", "deg"] = described(
        "Angular unit of positions, velocities and accelerations.", None, "rad", default="rad"
    )
    current_units: Literal["A", "mA"] = described("Unit of currents.", None, "A", default="A")
    effort: Literal["auto", "current", "torque", "external"] = described(
        "What the efforts are: motor currents, torques at the joints, or torques from outside, "
        "without gravity. `auto` detects it.",
        None,
        "auto",
        default="auto",
    )
    torque_side: Literal["motor", "link"] | None = described(
        "Where torques were measured: at the `motor`, with rotor and friction; or at the `link`, "
        "by sensors behind the gears, without them. Null: as the robot's `limits.torque_side`. It "
        "has no effect on currents.",
        None,
        "link",
        default=None,
    )
