"""Options of the reading of a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import NoneType
from typing import Literal

from joulepath.models.robot import Array, TorqueSide
from joulepath.optimizer.identify.logs.columns import ColumnMap
from joulepath.optimizer.identify.logs.file_rows import FILE
from joulepath.optimizer.identify.logs.log import EffortMeaning
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.declared_types import check_fields, check_type
from joulepath.optimizer.problem.scalars import check_number


@dataclass(frozen=True)
class LogOptions:
    """Information about a log beyond the content of its file.

    Raises:
        InvalidProblem: an option has another type, or an unknown choice.
    """

    payload: Payload | None = None
    """Payload of the arm; None for the logged payload, or none if it was not logged."""
    gravity: Sequence[float] | Array | None = None
    """Gravity (3,) in the base frame [m/s²]; None for the gravity of the robot."""
    columns: ColumnMap | None = None
    """Names of the columns of the channels, or their numbers from 1; None for a header with known
    names."""
    units: Literal["rad", "deg"] = "rad"
    """Unit of positions, and of the angle in speeds and accelerations."""
    current_units: Literal["A", "mA"] = "A"
    effort: EffortMeaning | Literal["auto"] | None = "auto"
    """Meaning of the efforts; `auto` determines it from the log, and None leaves them out."""
    torque_side: TorqueSide | None = None
    """Where torques were measured: `motor`, or `link`, by sensors behind the gears; None for the
    side of the robot's torque limits. It has no effect on currents."""
    name: str | None = None
    tags: tuple[str, ...] = ()
    max_bytes: int = FILE.max_bytes
    """Largest size of the file after unpacking [bytes]."""

    def __post_init__(self) -> None:
        check_fields(self)
        check_type("columns", self.columns, Mapping, NoneType)
        check_number("max_bytes", self.max_bytes, "bytes", least=1)
