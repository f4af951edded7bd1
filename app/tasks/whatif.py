"""POST /whatif in a worker: the base, then each change to it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from joulepath.app.api.evaluate.task import EvaluateAnswer, Evaluated
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.convert.arm import to_arm
from joulepath.app.convert.arm_fields import arm_fields
from joulepath.app.convert.given_motion import to_motion
from joulepath.app.convert.recorded import as_logged
from joulepath.app.convert.request import to_problem
from joulepath.app.convert.until import time_left, until
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.problems import problem_of
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.schemas.whatif import Change, WhatifRequest
from joulepath.app.tasks.answer_collector import AnswerCollector
from joulepath.app.tasks.certified import certified
from joulepath.app.tasks.differences import differences, of_base
from joulepath.optimizer.deadline import Deadline, DeadlineShares
from joulepath.optimizer.evaluate.evaluate import Evaluation, evaluate
from joulepath.optimizer.exceptions import DeadlineExceeded, InvalidProblem, OutsideLimits
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.what_if import WhatIf, what_if

R = TypeVar("R", OptimizeRequest, EvaluateRequest)
T = TypeVar("T")


@dataclass(frozen=True)
class WhatifTask:
    """A validated request and its id."""

    request: WhatifRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /whatif`, within about `deadline` seconds.

        Raises the error of the base, and InvalidProblem for an invalid change.
        """
        work = _Optimized if self.request.optimize is not None else _Evaluated
        return work(self.request, self.request_id, Deadline.after(deadline)).result()


class _Work:
    """State and rows that both kinds of base share."""

    def __init__(self, request: WhatifRequest, request_id: str, deadline: Deadline) -> None:
        self.request, self.request_id = request, request_id
        self.deadline = deadline
        self.clock, self.began = deadline.clock, deadline.clock()
        self.shares = DeadlineShares(deadline, 1 + len(request.changes))
        self.collector = AnswerCollector()

    def result_of(self, robot: str, objective: str | None, base: Any, changes: list[Any]) -> TaskResult:
        """The answer."""
        content = {
            "request": self.request_id,
            "id": None,
            "robot": robot,
            "objective": objective,
            "base": base,
            "changes": changes,
            "wall_time": self.clock() - self.began,
        }
        return TaskResult.of_json(content, self.collector.stored)

    def row(self, change: Change, error: Exception | None = None, **given: Any) -> dict[str, Any]:
        """The entry of a change in the answer: the fields in `given`, and `error` as a problem."""
        problem = None if error is None else problem_of(error, self.request_id)
        empty = dict.fromkeys(("same_motion", "reoptimised", "reoptimisation"))
        return {"name": change.name, **empty, **given, "problem": problem}


class _Optimized(_Work):
    """The base is optimised."""

    def result(self) -> TaskResult:
        """The answer. Raises the error of the base, and InvalidProblem for an invalid change."""
        asked = self.request.optimize
        assert asked is not None
        first = _located(lambda: to_problem(asked, min(asked.deadline, self.shares.next())), "optimize")
        # all of them before the first run, so that an invalid change is rejected at once
        problems = [self._problem(asked, k) for k in range(len(self.request.changes))]
        base = certified(_located(lambda: optimize(first), "optimize"))
        content = {
            "answer": self.collector.add(OptimizeAnswer.of(asked, self.request_id, base, arm_fields(asked))),
            "status": base.status,
            "holds": True,
            **of_base(base.energy, base.duration),
        }
        rows = [self._row(asked, k, base, content, problem) for k, problem in enumerate(problems)]
        return self.result_of(asked.robot, asked.objective, content, rows)

    def _problem(self, asked: OptimizeRequest, k: int) -> Problem | OutsideLimits:
        change = self.request.changes[k]
        try:
            left = min(asked.deadline, time_left(self.deadline))
            return _located(lambda: to_problem(_changed(asked, change), left), f"changes.{k}.arm", change)
        except OutsideLimits as error:
            return error

    def _row(
        self, asked: OptimizeRequest, k: int, base: Solution, content: dict[str, Any], problem: Problem | OutsideLimits
    ) -> dict[str, Any]:
        change, share = self.request.changes[k], self.shares.next()
        if isinstance(problem, OutsideLimits):
            return self.row(change, problem)
        if self.shares.used_up:
            return self.row(change, DeadlineExceeded([]))
        try:
            found = what_if(base, replace(problem, deadline=min(asked.deadline, share)))
        except DeadlineExceeded as error:
            return self.row(change, error)
        same = {
            "holds": found.certificate.valid,
            "certificate": found.certificate,
            "answer": None,
            **differences(content, found.same_motion, base.duration),
        }
        if found.reoptimised is None:
            assert found.error is not None
            return self.row(change, _moved(found.error, f"changes.{k}.arm", change), same_motion=same)
        best = certified(found.reoptimised)
        return self.row(change, same_motion=same, **self._reoptimised(asked, change, content, found, best))

    def _reoptimised(
        self, asked: OptimizeRequest, change: Change, content: dict[str, Any], found: WhatIf, best: Solution
    ) -> dict[str, Any]:
        change_of_energy = best.energy.of(asked.objective) - found.same_motion.of(asked.objective)
        changed = _changed(asked, change)
        outcome = {
            "answer": self.collector.add(OptimizeAnswer.of(changed, self.request_id, best, arm_fields(changed))),
            "status": best.status,
            **differences(content, best.energy, best.duration),
        }
        return {"reoptimised": outcome, "reoptimisation": change_of_energy}


class _Evaluated(_Work):
    """The base is a given motion."""

    def result(self) -> TaskResult:
        """The answer. Raises the error of the base, and InvalidProblem for an invalid change."""
        assert self.request.evaluate is not None
        given = self.request.evaluate
        with until(self.deadline):
            asked = _located(lambda: as_logged(given), "evaluate")
            arm = _located(lambda: to_arm(asked), "evaluate")
            arms = [self._arm(asked, k) for k in range(len(self.request.changes))]
        base = _located(lambda: self._evaluate(arm, asked), "evaluate")
        content = {
            "answer": self.collector.add(EvaluateAnswer.of(self.request_id, Evaluated(asked, base))),
            "status": None,
            "holds": _holds(base),
            **of_base(base.total.energy, base.total.duration),
        }
        rows = [self._row(asked, k, content, arm) for k, arm in enumerate(arms)]
        return self.result_of(asked.robot, None, content, rows)

    def _arm(self, asked: EvaluateRequest, k: int) -> Arm:
        change = self.request.changes[k]
        return _located(lambda: to_arm(_changed(asked, change)), f"changes.{k}.arm", change)

    def _evaluate(self, arm: Arm, asked: EvaluateRequest) -> Evaluation:
        deadline = min(asked.deadline or math.inf, self.shares.next())
        return evaluate(arm, to_motion(asked), asked.sample_period, deadline)

    def _row(self, asked: EvaluateRequest, k: int, content: dict[str, Any], arm: Arm) -> dict[str, Any]:
        change = self.request.changes[k]
        if self.shares.used_up:
            return self.row(change, DeadlineExceeded([]))
        try:
            found = _located(lambda: self._evaluate(arm, asked), f"changes.{k}.arm", change)
        except DeadlineExceeded as error:
            return self.row(change, error)
        same = {
            "holds": _holds(found),
            "certificate": None,
            "answer": self.collector.add(EvaluateAnswer.of(self.request_id, Evaluated(_changed(asked, change), found))),
            **differences(content, found.total.energy, found.total.duration),
        }
        return self.row(change, same_motion=same)


def _located(work: Callable[[], T], where: str, change: Change | None = None) -> T:
    """What `work` returns. Raises what it raises; an InvalidProblem with its field path changed by `_moved`."""
    try:
        return work()
    except InvalidProblem as error:
        raise _moved(error, where, change) from None


def _moved(error: Exception, where: str, change: Change | None = None) -> Exception:
    """The error with its field path prefixed by `where`.

    If the change does not set that field, the path is `where` alone. Other errors are returned unchanged.
    """
    if not isinstance(error, InvalidProblem):
        return error
    is_set = change is None or error.field.partition(".")[0] in change.arm.model_fields_set
    return InvalidProblem(f"{where}.{error.field}" if is_set else where, str(error))


def _changed(asked: R, change: Change) -> R:
    """The base's request with the fields that the change sets."""
    return asked.model_copy(update={name: getattr(change.arm, name) for name in change.arm.model_fields_set})


def _holds(result: Evaluation) -> bool:
    """Whether the motion is within all limits and free of collisions."""
    free = result.nearest is None or result.nearest.distance >= 0
    return free and all(report.held for report in result.limits)
