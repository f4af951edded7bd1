"""From a request for an export and its program to the file."""

from __future__ import annotations

from typing import Literal

from app.exceptions import InvalidRequest
from app.schemas import export as asked
from app.schemas.export import OPTIONS_OF, ExportFormat, ExportRequest
from optimizer.exports.csv_table import to_csv
from optimizer.exports.facts import ExportedFile
from optimizer.exports.json_document import to_json
from optimizer.exports.npz_arrays import to_npz
from optimizer.exports.program import Program
from optimizer.exports.ros_messages import RosOptions, to_moveit, to_ros2
from optimizer.exports.urscript import UrscriptOptions, to_urscript


def check_options(request: ExportRequest, format: ExportFormat) -> None:
    """Raises InvalidRequest for options of another format."""
    others = sorted(set(OPTIONS_OF.values()) - {OPTIONS_OF.get(format)})
    wrong = [name for name in others if getattr(request, name) is not None]
    if wrong:
        msg = f"{wrong[0]} is not for the format {format}: leave it out"
        raise InvalidRequest([{"loc": ["body", wrong[0]], "msg": msg}])


def to_file(request: ExportRequest, format: ExportFormat, as_json: bool, program: Program) -> ExportedFile:
    """The file. Raises InvalidRequest for options of another format, and FormatUnsuitable."""
    check_options(request, format)
    table, urscript, ros2, moveit = (
        request.table or asked.TableOptions(),
        request.urscript or asked.UrscriptOptions(),
        request.ros2 or asked.Ros2Options(),
        request.moveit or asked.MoveitOptions(),
    )
    preferred: Literal["yaml", "json"] = "json" if as_json else "yaml"
    if format is ExportFormat.URSCRIPT:
        return to_urscript(program, UrscriptOptions(**dict(urscript)))
    if format is ExportFormat.ROS2:
        return to_ros2(program, RosOptions(ros2.message, ros2.encoding or preferred, ros2.controller))
    if format is ExportFormat.MOVEIT:
        return to_moveit(program, moveit.encoding or preferred)
    if format is ExportFormat.CSV:
        return to_csv(program, table.period)
    if format is ExportFormat.NPZ:
        return to_npz(program, table.period)
    return to_json(program)
