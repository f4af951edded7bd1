"""POST /whatif in a worker: the base, then every change made to it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import orjson

from app.convert.arm import to_arm
from app.convert.evaluation import to_evaluate_response, to_motion
from app.convert.fields import fields
from app.convert.request import to_problem
from app.convert.solution import certificate_fields, to_response
from app.engine.reply import Reply
from app.http.problem_details import problem_reply
from app.schemas.evaluate import EvaluateRequest
from app.schemas.request import OptimizeRequest
from app.schemas.whatif import Change, WhatifRequest
from app.tasks.stored_answers import AnswerCollector
from app.tasks.task import answer, json_reply
from optimizer.energy.losses import ENERGY_FLOOR
from optimizer.exceptions import DeadlineExceeded, InvalidProblem, InvalidTable, OutsideLimits
from optimizer.optimize import optimize
from optimizer.problem.arm import Arm
from optimizer.problem.problem import Problem
from optimizer.replay.evaluate import Evaluation, evaluate
from optimizer.solution import ElectricalEnergy, Energy, Solution
from optimizer.whatif import Changed, whatif

R = TypeVar("R", OptimizeRequest, EvaluateRequest)
T = TypeVar("T")

# a run whose share of the deadline has been used up by others still says so itself [s]
LEAST_SHARE = 1e-3


@dataclass(frozen=True)
class WhatifTask:
    """A validated request and its id."""

    request: WhatifRequest
    request_id: str

    def run(self, deadline: float) -> Reply:
        """The answer, or the base's problem, within about `deadline` seconds."""
        work = _Optimized if self.request.optimize is not None else _Evaluated
        return answer(self.request_id, lambda: work(self.request, self.request_id, deadline).reply())


class _Work:
    """What both kinds of base share: the clock, the shelf, and the figures."""

    def __init__(self, request: WhatifRequest, request_id: str, deadline: float) -> None:
        self.request, self.request_id = request, request_id
        self.began = time.perf_counter()
        self.end = self.began + deadline
        self.runs = 1 + len(request.changes)
        self.shelf = AnswerCollector()

    def share(self) -> float:
        """Time [s] of the next run."""
        left = self.end - time.perf_counter()
        self.runs -= 1
        return max(left / (self.runs + 1), LEAST_SHARE)

    def content(self, robot: str, objective: str | None, base: Any, changes: list[Any]) -> Reply:
        """The answer."""
        wall_time = time.perf_counter() - self.began
        content = {
            "id": self.request_id,
            "robot": robot,
            "objective": objective,
            "base": base,
            "changes": changes,
            "wall_time": wall_time,
        }
        return replace(json_reply(content), kept=self.shelf.kept())

    def row(self, change: Change, error: Exception | None = None, **given: Any) -> dict[str, Any]:
        """A change's outcome: what is given of it, and its problem."""
        problem = None if error is None else orjson.loads(problem_reply(error, self.request_id).body)
        empty = dict.fromkeys(("same_motion", "reoptimised", "reoptimisation"))
        return {"name": change.name, **empty, **given, "problem": problem}


class _Optimized(_Work):
    """The base is a motion to be optimised."""

    def reply(self) -> Reply:
        """The answer. Raises what the base does, and InvalidProblem for a change that cannot be."""
        asked = self.request.optimize
        assert asked is not None
        first = _located(lambda: to_problem(asked, min(asked.deadline, self.share())), "optimize")
        # all of them before the first is worked on: bad input is refused at once
        problems = [self._problem(asked, k) for k in range(len(self.request.changes))]
        base = _located(lambda: optimize(first), "optimize")
        _check(base)
        content = {
            "answer": self.shelf.add(to_response(asked, self.request_id, base)),
            "status": base.status,
            "holds": True,
            **_figures(base.energy, base.duration),
        }
        rows = [self._row(asked, k, base, content, problem) for k, problem in enumerate(problems)]
        return self.content(asked.robot, asked.objective, content, rows)

    def _problem(self, asked: OptimizeRequest, k: int) -> Problem | OutsideLimits:
        change = self.request.changes[k]
        try:
            return _located(lambda: to_problem(_changed(asked, change), asked.deadline), f"changes.{k}.arm", change)
        except OutsideLimits as error:
            return error

    def _row(
        self, asked: OptimizeRequest, k: int, base: Solution, content: dict[str, Any], problem: Problem | OutsideLimits
    ) -> dict[str, Any]:
        change, share = self.request.changes[k], self.share()
        if isinstance(problem, OutsideLimits):
            return self.row(change, problem)
        limited = replace(problem, deadline=min(asked.deadline, share))
        found = whatif(base, limited)
        same = {
            "holds": found.certificate.valid,
            "certificate": certificate_fields(found.certificate),
            "answer": None,
            **_against(content, found.same_motion, base.duration),
        }
        if found.reoptimised is None:
            assert found.error is not None
            return self.row(change, _moved(found.error, f"changes.{k}.arm", change), same_motion=same)
        return self.row(change, same_motion=same, **self._reoptimised(asked, change, content, found, found.reoptimised))

    def _reoptimised(
        self, asked: OptimizeRequest, change: Change, content: dict[str, Any], found: Changed, best: Solution
    ) -> dict[str, Any]:
        _check(best)
        totals = [
            energy.electrical.total if asked.objective == "electrical" else energy.mechanical.total
            for energy in (best.energy, found.same_motion)
        ]
        outcome = {
            "answer": self.shelf.add(to_response(_changed(asked, change), self.request_id, best)),
            "status": best.status,
            **_against(content, best.energy, best.duration),
        }
        return {"reoptimised": outcome, "reoptimisation": totals[0] - totals[1]}


class _Evaluated(_Work):
    """The base is a given motion."""

    def reply(self) -> Reply:
        """The answer. Raises what the base does, and InvalidProblem for a change that cannot be."""
        asked = self.request.evaluate
        assert asked is not None
        arm = _located(lambda: to_arm(asked), "evaluate")
        arms = [self._arm(asked, k) for k in range(len(self.request.changes))]
        base = _located(lambda: self._evaluate(arm, asked), "evaluate")
        content = {
            "answer": self.shelf.add(to_evaluate_response(self.request_id, asked.robot, base)),
            "status": None,
            "holds": _holds(base),
            **_figures(base.total.energy, base.total.duration),
        }
        rows = [self._row(asked, k, content, arm) for k, arm in enumerate(arms)]
        return self.content(asked.robot, None, content, rows)

    def _arm(self, asked: EvaluateRequest, k: int) -> Arm:
        change = self.request.changes[k]
        return _located(lambda: to_arm(_changed(asked, change)), f"changes.{k}.arm", change)

    def _evaluate(self, arm: Arm, asked: EvaluateRequest) -> Evaluation:
        return evaluate(arm, to_motion(asked), asked.sample_period, self.share())

    def _row(self, asked: EvaluateRequest, k: int, content: dict[str, Any], arm: Arm) -> dict[str, Any]:
        change = self.request.changes[k]
        try:
            found = _located(lambda: self._evaluate(arm, asked), f"changes.{k}.arm", change)
        except DeadlineExceeded as error:
            return self.row(change, error)
        same = {
            "holds": _holds(found),
            "certificate": None,
            "answer": self.shelf.add(to_evaluate_response(self.request_id, asked.robot, found)),
            **_against(content, found.total.energy, found.total.duration),
        }
        return self.row(change, same_motion=same)


def _located(work: Callable[[], T], where: str, change: Change | None = None) -> T:
    """What the work returns. Raises what it raises, `_moved`."""
    try:
        return work()
    except InvalidProblem as error:
        raise _moved(error, where, change) from None


def _moved(error: Exception, where: str, change: Change | None = None) -> Exception:
    """The error with its field told as the request has it: under `where`, and there no deeper than what the change
    names. Those that tell of the motion, not of a field, stay as they are."""
    if not isinstance(error, InvalidProblem) or isinstance(error, OutsideLimits | InvalidTable):
        return error
    named = change is None or error.field.partition(".")[0] in change.arm.model_fields_set
    return InvalidProblem(f"{where}.{error.field}" if named else where, str(error))


def _changed(asked: R, change: Change) -> R:
    """The base's request with the change made."""
    return asked.model_copy(update={name: getattr(change.arm, name) for name in change.arm.model_fields_set})


def _check(solution: Solution) -> None:
    if not solution.certificate.valid:
        raise AssertionError(f"The optimizer returned a motion that does not hold: {solution.certificate}")


def _holds(result: Evaluation) -> bool:
    free = result.nearest is None or result.nearest.distance >= 0
    return free and all(report.held for report in result.limits)


def _figures(energy: Energy, duration: float) -> dict[str, Any]:
    """What base and changes are compared by."""
    return {
        "duration": duration,
        "electrical": fields(energy.electrical, *ElectricalEnergy.__dataclass_fields__),
        "mechanical": energy.mechanical.total,
        **fields(energy, "mean_power", "peak_power"),
    }


def _against(base: dict[str, Any], energy: Energy, duration: float) -> dict[str, Any]:
    """The figures of a changed arm's motion against those of the base."""
    figures = _figures(energy, duration)
    return {
        name: {part: _delta(base[name][part], value[part]) for part in value}
        if isinstance(value, dict)
        else _delta(base[name], value)
        for name, value in figures.items()
    }


def _delta(base: float, value: float) -> dict[str, Any]:
    difference = value - base
    return {
        "value": value,
        "difference": difference,
        "relative": difference / abs(base) if abs(base) > ENERGY_FLOOR else None,
    }
