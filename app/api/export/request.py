"""Request of `POST /export/{format}`."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.schemas.common import Request, between, described
from joulepath.app.schemas.given_answer import AnswerRequest
from joulepath.optimizer.export.export import FORMATS, ExportOptions
from joulepath.optimizer.export.formats import FormatName
from joulepath.optimizer.export.option_ranges import OPTION_RANGES
from joulepath.optimizer.export.ros_messages import Encoding

PREFIX, CONTROLLER, SIGNAL = (
    f"^{pattern}$"
    for pattern in (OPTION_RANGES.prefix, OPTION_RANGES.controller, OPTION_RANGES.signal)
)
ENCODING = "`yaml` or `json`. Null: `json` if the header `Accept` asks for it, else `yaml`."


class TableOptions(Request):
    """Options of `csv` and `npz`."""

    period: float = described(
        "Time between two rows.", "s", 0.004, default=0.008, **between(OPTION_RANGES.period)
    )


class McapOptions(TableOptions):
    """Options of `mcap`."""

    prefix: str = described(
        "Prefix of all names of joints and links.",
        None,
        "left_",
        default="",
        pattern=PREFIX,
    )


class UrscriptOptions(Request):
    """Options of `urscript`."""

    rate: Literal[500, 125] = described(
        "Rate of the controller: 500 for e-series and later, 125 for CB3.", "Hz", 125, default=500
    )
    form: Literal["polynomials", "points"] = described(
        "`polynomials`: the controller evaluates the spline. `points`: the program has every set "
        "point.",
        None,
        "points",
        default="polynomials",
    )
    lookahead_time: float = described(
        "`lookahead_time` of servoj: a larger value is smoother, but delays the arm more.",
        "s",
        0.05,
        default=0.1,
        **between(OPTION_RANGES.lookahead_time),
    )
    gain: float = described(
        "servoj's `gain`.", "1", 500.0, default=300.0, **between(OPTION_RANGES.gain)
    )
    digital_output: int | None = described(
        "Standard digital output that is on from each grasp to the release. Null: none is "
        "switched.",
        None,
        0,
        default=None,
        **between(OPTION_RANGES.standard_output),
    )


class LimitsOptions(Request):
    """Options of `joint_limits`."""

    prefix: str = described(
        "Prefix of all joint names, as in the robot's description in ROS.",
        None,
        "left_",
        default="",
        pattern=PREFIX,
    )


class MoveitOptions(LimitsOptions):
    """Options of `moveit`."""

    encoding: Encoding | None = described(ENCODING, None, "json", default=None)


class Ros2Options(MoveitOptions):
    """Options of `ros2`. As JSON, it is the whole operation for rosbridge."""

    message: Literal["goal", "trajectory"] = described(
        "`goal`: of control_msgs/action/FollowJointTrajectory. `trajectory`: "
        "trajectory_msgs/msg/JointTrajectory.",
        None,
        "trajectory",
        default="goal",
    )
    controller: str = described(
        "Name of the controller's node.",
        None,
        "scaled_joint_trajectory_controller",
        default="joint_trajectory_controller",
        min_length=1,
        max_length=128,
        pattern=CONTROLLER,
    )


class FrankaOptions(Request):
    """Options of `franka`."""

    form: Literal["csv", "cpp"] = described(
        "`csv`: a table with t, q and v. `cpp`: a C++ header with a motion generator.",
        None,
        "cpp",
        default="csv",
    )


class PointsOptions(Request):
    """Options of both `rapid` and `krl`."""

    tolerance: float = described(
        "Deviation from the spline for which the number of points is chosen. The file states "
        "the deviation reached.",
        "rad",
        0.002,
        default=0.005,
        **between(OPTION_RANGES.tolerance),
    )
    signs: Annotated[list[Literal[1, -1]], Field(min_length=1, max_length=16)] | None = described(
        "Sign of the controller's axes relative to the joints of the robot's model, one per "
        "joint. Null: equal.",
        None,
        [1, -1, 1, 1, 1, 1],
        default=None,
    )
    offsets: (
        Annotated[
            list[Annotated[float, Field(**between(OPTION_RANGES.offset))]],
            Field(min_length=1, max_length=16),
        ]
        | None
    ) = described(
        "Position of the controller's axes where the model's joints are at zero, one per joint. "
        "Null: zero.",
        "deg",
        [0.0, -90.0, 90.0, 0.0, 0.0, 0.0],
        default=None,
    )


class RapidOptions(PointsOptions):
    """Options of `rapid`."""

    digital_output: str | None = described(
        "Name of the output signal that is on from each grasp to the release. Null: none is "
        "switched.",
        None,
        "doGripper",
        default=None,
        pattern=SIGNAL,
    )


class KrlOptions(PointsOptions):
    """Options of `krl`."""

    digital_output: int | None = described(
        "Number of the output that is on from each grasp to the release. Null: none is switched.",
        None,
        1,
        default=None,
        **between(OPTION_RANGES.krl_output),
    )


class ExportRequest(AnswerRequest):
    """An answer, and how to export it. Options of other formats than the one in the path are
    refused.
    """

    speed_scale: float = described(
        "Fraction of the speed: every move is slowed down uniformly and certified again. Rests "
        "stay as they are.",
        "1",
        0.1,
        default=1.0,
        ge=0.01,
        le=1.0,
    )
    table: TableOptions | None = described(
        "Options of `csv` and `npz`.", None, {"period": 0.004}, default=None
    )
    urscript: UrscriptOptions | None = described(
        "Options of `urscript`.", None, {"digital_output": 0}, default=None
    )
    ros2: Ros2Options | None = described(
        "Options of `ros2`.", None, {"message": "trajectory"}, default=None
    )
    moveit: MoveitOptions | None = described(
        "Options of `moveit`.", None, {"encoding": "json"}, default=None
    )
    franka: FrankaOptions | None = described(
        "Options of `franka`.", None, {"form": "cpp"}, default=None
    )
    rapid: RapidOptions | None = described(
        "Options of `rapid`.", None, {"tolerance": 0.002}, default=None
    )
    krl: KrlOptions | None = described(
        "Options of `krl`.", None, {"tolerance": 0.002}, default=None
    )
    mcap: McapOptions | None = described("Options of `mcap`.", None, {"period": 0.02}, default=None)
    limits: LimitsOptions | None = described(
        "Options of `joint_limits`.", None, {"prefix": "left_"}, default=None
    )


def option_field(format: FormatName) -> str | None:
    """Field of the request with the options of a format, named after their class; None if it has
    none.
    """
    kind = FORMATS[format].options
    return None if kind is None else kind.__name__.removesuffix("Options").lower()


def to_options(
    request: ExportRequest, format: FormatName, preferred: Encoding
) -> ExportOptions | None:
    """The options of the library for a format.

    Messages have the `preferred` encoding unless the request names one. Raises
    InvalidRequest for options of another format.
    """
    own = option_field(format)
    for name in sorted(
        {other for each in FORMATS if (other := option_field(each)) is not None} - {own}
    ):
        if getattr(request, name) is not None:
            msg = f"{name} is not for the format {format}: leave it out"
            raise InvalidRequest([{"loc": ["body", name], "msg": msg}])
    kind = FORMATS[format].options
    if kind is None or own is None:
        return None
    given: dict[str, Any] = dict(getattr(request, own) or {})
    if "encoding" in kind.__dataclass_fields__:
        given["encoding"] = given.get("encoding") or preferred
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in given.items()
    }
    return kind(**values)
