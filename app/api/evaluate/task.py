"""Answer of `POST /evaluate`, and its work in a worker, from the received body."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from functools import reduce
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, Self, TypeVar

import numpy as np
from pydantic import ValidationError

from joulepath.app.answers.declared import as_json
from joulepath.app.answers.envelope import AnswerFigures, MotionAnswer
from joulepath.app.api.evaluate.motion_csv import MotionCsv
from joulepath.app.convert.arm import arm_fields, to_arm
from joulepath.app.convert.fields import location
from joulepath.app.convert.given_motion import own_times, to_motion, to_waypoints
from joulepath.app.convert.json_text import parsed_json, query_values
from joulepath.app.convert.recorded import as_logged, read_csv, reading_of, told_by
from joulepath.app.convert.unlikely_units import unlikely_units
from joulepath.app.convert.until import until
from joulepath.app.convert.warnings import sampled_warnings
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.http.problems import invalid_request
from joulepath.app.schemas.deadline import too_long
from joulepath.app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest, EvaluateSettings
from joulepath.optimizer.csv_table import FIRST_ROW
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.declared import Ratio
from joulepath.optimizer.evaluate.evaluate import evaluate
from joulepath.optimizer.evaluate.evaluation import EvaluatedMotion, Evaluation
from joulepath.optimizer.evaluate.interval_energy import IntervalEnergy
from joulepath.optimizer.evaluate.piecewise_motion import Motion
from joulepath.optimizer.evaluate.recording import Recording, Waypoints
from joulepath.optimizer.exceptions import InvalidProblem, InvalidTable
from joulepath.optimizer.identify.logs.reading import LogReading
from joulepath.optimizer.identify.logs.recorded import MeasuredEnergy, measured
from joulepath.optimizer.problem.arm import Arm

M = TypeVar("M", EvaluateRequest, EvaluateCsvSettings)


@dataclass(frozen=True, kw_only=True)
class EvaluatedInterval(IntervalEnergy):
    """Energy of one segment of the motion, or of the whole motion."""

    measured: MeasuredEnergy | None
    """Measured energies; null without a log of power or efforts."""
    difference: Ratio | None = field(init=False)
    """Measured / predicted - 1 of the electrical energy, by the logged power, or else by the
    efforts. Null without a measurement."""

    def __post_init__(self) -> None:
        super().__post_init__()
        known, ours = self.measured, self.energy.electrical.total
        drawn = None if known is None else known.best
        share = None if drawn is None or ours == 0 else drawn / ours - 1
        object.__setattr__(self, "difference", share)

    @classmethod
    def of(cls, interval: IntervalEnergy, known: MeasuredEnergy | None) -> Self:
        """The energy of an interval, and its measured energies."""
        own = {each.name: getattr(interval, each.name) for each in fields(interval) if each.init}
        return cls(**own, measured=known)


@dataclass(frozen=True)
class Evaluated:
    """The evaluation of a motion of the requested arm.

    A log has `measured` energies of its segments, the segments that bound its `cycles`, and
    remarks.
    """

    asked: EvaluateSettings
    result: Evaluation
    measured: Sequence[MeasuredEnergy] = ()
    cycle_bounds: Sequence[int] = ()
    remarks: Sequence[str] = ()

    @property
    def total(self) -> EvaluatedInterval:
        """The whole motion."""
        return EvaluatedInterval.of(self.result.total, self._known(None, None))

    @property
    def segments(self) -> list[EvaluatedInterval]:
        """The listed segments."""
        return [
            EvaluatedInterval.of(each, self._known(k, k + 1))
            for k, each in enumerate(self.result.segments)
        ]

    @property
    def cycles(self) -> list[EvaluatedInterval]:
        """The cycles of a log that repeats."""
        return [
            EvaluatedInterval.of(each, self._known(*ends))
            for each, ends in zip(self.result.cycles, pairwise(self.cycle_bounds), strict=False)
        ]

    def _known(self, first: int | None, end: int | None) -> MeasuredEnergy | None:
        """Measured energies of consecutive segments; None without any."""
        parts = self.measured[first:end]
        return reduce(MeasuredEnergy.joined, parts) if parts else None


@dataclass(frozen=True, kw_only=True)
class EvaluateAnswer(EvaluatedMotion, MotionAnswer):
    """The energy of a given motion, and its violated limits."""

    total: EvaluatedInterval
    segments: list[EvaluatedInterval]
    cycles: list[EvaluatedInterval]
    warnings: list[str]
    """Remarks on the motion, in words; empty if there are none. If two bodies come closer than 2
    mm, one names them, their distance without margins, and the time. Others report possibly missed
    arm configurations, omitted baselines, contacts of a tool or payload without a shape, or
    figures of the request that are likely in another unit. A log also has the remarks of `POST
    /logs`."""

    @classmethod
    def of(cls, request_id: str, found: Evaluated) -> Self:
        """The answer for the motion of the arm asked about."""
        asked, result = found.asked, found.result
        motion = vars(result) | {
            "total": found.total,
            "segments": found.segments,
            "cycles": found.cycles,
        }
        return cls(
            request=request_id,
            robot=asked.robot,
            arm=arm_fields(asked),
            warnings=[*unlikely_units(asked), *found.remarks, *sampled_warnings(result)],
            **motion,
        )

    @property
    def figures(self) -> AnswerFigures:
        """The figures of this answer in lists."""
        return AnswerFigures(self.robot, self.total.energy.electrical.total, self.duration)


@dataclass(frozen=True)
class EvaluateTask:
    """A received body in `file` of the media type `kind`, and the query's parameters.

    `wanted` is the media type of the answer, `longest` the longest and default deadline [s].
    """

    file: str
    kind: Literal["json", "csv"]
    query: dict[str, str]
    wanted: Literal["json", "csv"]
    request_id: str
    longest: float

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /evaluate`, within about `deadline` seconds. Raises
        InvalidRequest."""
        # when the request began to wait for a worker
        began = Deadline.after(deadline - self.longest)
        found = self._evaluate_csv(began) if self.kind == "csv" else self._evaluate_json(began)
        if self.wanted == "csv":
            return TaskResult.of_csv(_rows(found))
        return TaskResult.of_json(EvaluateAnswer.of(self.request_id, found))

    def _evaluate_csv(self, began: Deadline) -> Evaluated:
        settings = _csv_settings(self.query)
        end = self._end(settings, began, "query")
        try:
            with Path(self.file).open("rb") as file:
                with until(end):
                    arm = to_arm(settings)
                    try:
                        table = MotionCsv.of(file, arm.robot.nq, settings.units)
                    except InvalidTable as error:
                        return self._evaluate_log(settings, end, error)
                    motion = _csv_motion(settings, table)
                return Evaluated(settings, _evaluation(arm, motion, settings, end))
        except InvalidProblem as error:
            raise InvalidRequest([{"loc": location(error, "query"), "msg": str(error)}]) from None

    def _evaluate_log(
        self, settings: EvaluateCsvSettings, end: Deadline, error: InvalidTable
    ) -> Evaluated:
        """The evaluation of a file without the header of a motion, see `error`, as a log."""
        reading = read_csv(Path(self.file), settings, error)
        if settings.model_fields_set & {"time_per_segment", "interpolation"}:
            raise own_times()
        return _evaluated_log(told_by(reading.log, settings), reading, end)

    def _evaluate_json(self, began: Deadline) -> Evaluated:
        body = Path(self.file).read_bytes()
        content = parsed_json(body)
        request = _validated(lambda: EvaluateRequest.model_validate(content), "body")
        return evaluated(request, self._end(request, began, "body"))

    def _end(self, asked: EvaluateSettings, began: Deadline, where: str) -> Deadline:
        """The deadline. Raises InvalidRequest at `where` if it is too long."""
        if wrong := too_long(asked.deadline, self.longest, where):
            raise InvalidRequest(wrong)
        return began.earlier_by(-(asked.deadline or self.longest))


def evaluated(request: EvaluateRequest, end: Deadline) -> Evaluated:
    """The evaluation of the motion in a request, until about `end`. Raises UnknownLog."""
    if request.log is not None:
        with until(end):
            reading = reading_of(request.log)
        return _evaluated_log(as_logged(request), reading, end)
    with until(end):
        arm, motion = to_arm(request), to_motion(request)
    return Evaluated(request, _evaluation(arm, motion, request, end))


def _evaluated_log(asked: EvaluateSettings, reading: LogReading, end: Deadline) -> Evaluated:
    """The evaluation of the motion of a log until about `end`, with measured energies."""
    with until(end):
        arm = to_arm(asked)
    motion, remarks = reading.log.recording(), reading.report.warnings
    result = _evaluation(arm, motion, asked, end)
    return Evaluated(asked, result, measured(reading.log, arm), motion.cycles, remarks)


def _evaluation(arm: Arm, motion: Motion, asked: EvaluateSettings, end: Deadline) -> Evaluation:
    """The evaluation of a motion until about `end`, whose progress the task's listener gets."""
    return evaluate(arm, motion, asked.sample_period, end.left, tell=listener(), progress=False)


def _csv_settings(query: dict[str, str]) -> EvaluateCsvSettings:
    """Settings from query parameters in JSON or as bare words. Raises InvalidRequest."""
    return _validated(lambda: EvaluateCsvSettings.model_validate(query_values(query)), "query")


def _validated(validate: Callable[[], M], where: str) -> M:
    """The result of `validate`. Raises InvalidRequest at `where`."""
    try:
        return validate()
    except ValidationError as error:
        raise invalid_request(error, where) from None


def _csv_motion(settings: EvaluateCsvSettings, table: MotionCsv) -> Waypoints | Recording:
    """The motion in a CSV file. Raises InvalidProblem."""
    if not table.has_time:
        return to_waypoints(settings, table.configurations(), FIRST_ROW)
    if settings.model_fields_set & {"time_per_segment", "interpolation"}:
        raise own_times()
    return Recording(table.log(), FIRST_ROW)


def _rows(found: Evaluated) -> Iterator[Iterable[Any]]:
    """The answer as a table: one row per segment, and a last row `total`.

    Columns have the names of the JSON fields.
    """
    head: list[str] = []
    rows = [(str(k), each) for k, each in enumerate(found.segments, 1)]
    for name, interval in [*rows, ("total", found.total)]:
        row = {"segment": name, **dict(_flat("", interval))}
        # many segments have none
        row = {
            key: value for key, value in row.items() if not key.startswith("electrical.interval")
        }
        known = interval.energy.electrical.interval
        for end in ("p5", "p95"):
            row[f"electrical.interval.{end}"] = None if known is None else getattr(known, end)
        if not head:
            head = list(row)
            yield head
        yield (row.get(key) for key in head)


def _flat(name: str, value: Any) -> list[tuple[str, Any]]:
    """Names and values of a nested answer: `electrical.total`, `per_joint.friction.1`, …"""
    if is_dataclass(value):
        value = as_json(value)
    if isinstance(value, dict):
        # almost all fields are in `energy`: it would only make the names longer
        parts = [
            (key if not name or name == "energy" else f"{name}.{key}", part)
            for key, part in value.items()
        ]
    elif isinstance(value, np.ndarray):
        parts = [(f"{name}.{j}", part) for j, part in enumerate(value.tolist(), 1)]
    else:
        return [(name, value)]
    return [column for key, part in parts for column in _flat(key, part)]
