"""From a request for an export and its program to the file."""

from __future__ import annotations

from collections.abc import Callable

from joulepath.app.exceptions import InvalidRequest
from joulepath.app.schemas import export as asked
from joulepath.app.schemas.export import OPTIONS_OF, ExportFormat, ExportRequest
from joulepath.optimizer.export.axes import Axes
from joulepath.optimizer.export.csv_table import to_csv
from joulepath.optimizer.export.facts import ExportedFile
from joulepath.optimizer.export.franka import FrankaOptions, to_franka
from joulepath.optimizer.export.json_document import to_json
from joulepath.optimizer.export.krl import KrlOptions, to_krl
from joulepath.optimizer.export.npz_arrays import to_npz
from joulepath.optimizer.export.program import Program
from joulepath.optimizer.export.rapid import RapidOptions, to_rapid
from joulepath.optimizer.export.ros_messages import Encoding, RosOptions, to_moveit, to_ros2
from joulepath.optimizer.export.urscript import UrscriptOptions, to_urscript


def _check_options(request: ExportRequest, format: ExportFormat) -> None:
    others = sorted(set(OPTIONS_OF.values()) - {OPTIONS_OF.get(format)})
    wrong = [name for name in others if getattr(request, name) is not None]
    if wrong:
        msg = f"{wrong[0]} is not for the format {format}: leave it out"
        raise InvalidRequest([{"loc": ["body", wrong[0]], "msg": msg}])


def to_file(request: ExportRequest, format: ExportFormat, as_json: bool, program: Program) -> ExportedFile:
    """The file. Raises InvalidRequest for options of another format, and FormatUnsuitable."""
    _check_options(request, format)
    return _WRITERS[format](request, "json" if as_json else "yaml", program)


def _axes(points: asked.PointsOptions) -> Axes:
    return Axes(
        None if points.signs is None else tuple(points.signs),
        None if points.offsets is None else tuple(points.offsets),
    )


def _urscript(request: ExportRequest, preferred: Encoding, program: Program) -> ExportedFile:
    return to_urscript(program, UrscriptOptions(**dict(request.urscript or asked.UrscriptOptions())))


def _ros2(request: ExportRequest, preferred: Encoding, program: Program) -> ExportedFile:
    given = request.ros2 or asked.Ros2Options()
    return to_ros2(program, RosOptions(given.message, given.encoding or preferred, given.controller))


def _moveit(request: ExportRequest, preferred: Encoding, program: Program) -> ExportedFile:
    return to_moveit(program, (request.moveit or asked.MoveitOptions()).encoding or preferred)


def _franka(request: ExportRequest, preferred: Encoding, program: Program) -> ExportedFile:
    return to_franka(program, FrankaOptions((request.franka or asked.FrankaOptions()).form))


def _rapid(request: ExportRequest, preferred: Encoding, program: Program) -> ExportedFile:
    given = request.rapid or asked.RapidOptions()
    return to_rapid(program, RapidOptions(given.tolerance, _axes(given), given.digital_output))


def _krl(request: ExportRequest, preferred: Encoding, program: Program) -> ExportedFile:
    given = request.krl or asked.KrlOptions()
    return to_krl(program, KrlOptions(given.tolerance, _axes(given), given.digital_output))


_WRITERS: dict[ExportFormat, Callable[[ExportRequest, Encoding, Program], ExportedFile]] = {
    ExportFormat.URSCRIPT: _urscript,
    ExportFormat.ROS2: _ros2,
    ExportFormat.MOVEIT: _moveit,
    ExportFormat.FRANKA: _franka,
    ExportFormat.RAPID: _rapid,
    ExportFormat.KRL: _krl,
    ExportFormat.CSV: lambda request, _, program: to_csv(program, (request.table or asked.TableOptions()).period),
    ExportFormat.NPZ: lambda request, _, program: to_npz(program, (request.table or asked.TableOptions()).period),
    ExportFormat.JSON: lambda _request, _, program: to_json(program),
}
