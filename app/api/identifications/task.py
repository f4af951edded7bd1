"""POST /identifications in a worker: fits the figures of an arm to stored logs."""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from joulepath.app.answers.envelope import AnswerFigures
from joulepath.app.api.identifications.answer import IdentificationResult
from joulepath.app.api.identifications.request import Fraction, IdentifyRequest
from joulepath.app.convert.arm import robot_named
from joulepath.app.convert.fields import location
from joulepath.app.convert.recorded import GivenLog
from joulepath.app.convert.until import until
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import StoredAnswer, TaskResult, json_document
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.identify import Identification, identify
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.results import Curves, Validation

_DECIMALS = 4
"""Of the times, torques and powers of a picture."""


@dataclass(frozen=True)
class IdentifyTask:
    """A validated request, and its logs: of the fit, then of the validation."""

    request: IdentifyRequest
    logs: tuple[GivenLog, ...]
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The result within about `deadline` seconds, and the curves of its residuals.

        Raises UnknownRobot, EffortNotUsable, MethodNotApplicable, NotExcited, NothingHeldOut,
        NoPowerChannel, PayloadUnknown, InvalidRequest or DeadlineExceeded.
        """
        with until(Deadline.after(deadline)):
            return self._identified()

    def _identified(self) -> TaskResult:
        logs = [each.reading.log for each in self.logs]
        count, robot = len(self.request.logs), robot_named(logs[0].robot)
        try:
            _check_unseen(logs[count:], logs[:count])
            options = _to_options(self.request)
            found = identify(robot, logs[:count], options, tell=listener(), progress=False)
            others = found.validate(logs[count:]) if logs[count:] else found.validation
        except InvalidProblem as error:
            raise InvalidRequest([{"loc": location(error, "body"), "msg": str(error)}]) from None
        warnings = [
            f"Log {each.settings['name'] or each.id}: {text}"
            for each in self.logs
            for text in each.reading.report.warnings
        ]
        moves = _residual_fields(found, others, self.request.all_logs)
        curves = StoredAnswer(
            str(uuid.uuid4()), json_document({"moves": moves}), AnswerFigures(robot.name)
        )
        return TaskResult.of_json(IdentificationResult.of(found, others, warnings), (curves,))


def _check_unseen(others: Sequence[Log], fitted: Sequence[Log]) -> None:
    """Check that no log of the validation has the positions of a log of the fit.

    Raises:
        InvalidProblem: the same log is in both; the validation would repeat the errors of the fit.
    """
    if any(np.array_equal(other.q, each.q) for other in others for each in fitted):
        raise InvalidProblem(
            "validate",
            "A log of `validate` is also in `logs`. Name another log, or leave out `validate`: "
            "some motions of `logs` are then held out of the fit for the validation.",
        )


def _to_options(request: IdentifyRequest) -> IdentificationOptions:
    """The options of the library. Raises InvalidProblem."""
    by = request.validate_
    held_out = 1.0 if by == "moves" else by.fraction if isinstance(by, Fraction) else 0.0
    return IdentificationOptions(
        fit=tuple(request.fit),
        refit=None if request.inertials == "automatic" else request.inertials == "refit",
        method=request.method,
        period=request.period,
        held_out=held_out,
        terms=tuple(request.friction.terms),
        knee=request.friction.knee,
        estimator=request.estimator,
        velocity_threshold=request.velocity_threshold,
        prior_weight=request.prior_weight,
        mains=request.mains or (),
    )


def _residual_fields(
    found: Identification, validation: Validation | None, logs: Sequence[str]
) -> list[dict[str, Any]]:
    """The moves of the logs with these ids: of the fit, then of the validation alone."""
    own = len(found.logs)
    others = own if len(logs) > own else 0
    held_out = () if validation is None else _moves(validation.curves, logs[others:], True)
    return [*_moves(found.curves, logs, False), *held_out]


def _moves(curves: Curves, logs: Sequence[str], held_out: bool) -> Iterator[dict[str, Any]]:
    order = np.lexsort((curves.time, curves.log))
    ends = np.flatnonzero(np.diff(curves.log[order]) | np.diff(curves.move[order])) + 1
    for rows in np.split(order, ends):
        if not rows.size:
            continue
        torque, power = curves.torque[rows], curves.power[rows]
        yield {
            "log": logs[curves.log[rows[0]]],
            "held_out": held_out,
            "t": _rounded(curves.time[rows]),
            "torque": _series(torque.T, curves.modelled_torque[rows].T),
            "power": _series(power, curves.modelled_power[rows]),
        }


def _series(measured: Array, modelled: Array) -> dict[str, Any] | None:
    """The series; None without a measurement."""
    if np.isnan(measured).all():
        return None
    return {"measured": _rounded(measured), "modelled": _rounded(modelled)}


def _rounded(values: Array) -> Array:
    # The resolution exceeds that of sensors, and the document is half as long.
    return np.ascontiguousarray(values.round(_DECIMALS))
