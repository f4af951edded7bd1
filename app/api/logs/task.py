"""POST /logs in a worker: reads the file of the received body, and reports its content."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from joulepath.app.api.logs.request import LogSettings
from joulepath.app.convert.arm import robot_named
from joulepath.app.convert.fields import location
from joulepath.app.convert.recorded import to_log_options
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.logs.reading import LogReading, read_log


@dataclass(frozen=True)
class ReadLogTask:
    """A received body in `file`, of at most `most_bytes` after unpacking, and the settings of its
    request.
    """

    file: str
    request: LogSettings
    most_bytes: int
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The report on the log, within about `deadline` seconds.

        Raises UnknownRobot, InvalidTable, LogTooLarge, EffortNotUsable, InvalidRequest or
        DeadlineExceeded.
        """
        try:
            robot = robot_named(self.request.robot)
            with until(Deadline.after(deadline)):
                reading = read_log(
                    Path(self.file), robot, to_log_options(self.request, self.most_bytes)
                )
        except InvalidProblem as error:
            raise InvalidRequest([{"loc": location(error, "query"), "msg": str(error)}]) from None
        return TaskResult.of_json(_report_fields(reading))


def _report_fields(reading: LogReading) -> dict[str, Any]:
    """Fields of an answer about the content of a log."""
    log, report = reading.log, reading.report
    return {
        "rows": report.rows,
        "duration": log.duration,
        "dropped": report.dropped,
        "rate": log.rate,
        "jitter": list(report.jitter),
        "payload": log.payload.mass,
        "channels": [asdict(channel) for channel in report.channels],
        "effort": None if report.effort is None else asdict(report.effort),
        "moves": [
            {"start": move.start / log.rate, "end": move.end / log.rate, "at_rest": move.at_rest}
            for move in log.moves
        ],
        "warnings": list(report.warnings),
    }
