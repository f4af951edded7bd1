"""Request and work of `POST /whatif`: the base, then its changes one by one."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Annotated, Self, TypeVar

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.api.evaluate.task import EvaluateAnswer, Evaluated
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.api.whatif.answer import (
    ChangeResult,
    Reoptimised,
    SameMotion,
    WhatifAnswer,
    WhatifBase,
)
from joulepath.app.convert.arm import arm_fields, to_arm
from joulepath.app.convert.fields import inside, moved
from joulepath.app.convert.given_motion import to_motion
from joulepath.app.convert.recorded import as_logged
from joulepath.app.convert.request import to_problem
from joulepath.app.convert.until import time_left, until
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.problems import problem_of
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.common import Request, described
from joulepath.app.schemas.deadline import DeadlineSeconds, WithBodies
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.schemas.examples.values import EVALUATE, OPTIMIZE
from joulepath.app.schemas.queries import Name
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.tasks.answer_collector import AnswerCollector, certified
from joulepath.optimizer.deadline import Deadline, DeadlineShares
from joulepath.optimizer.evaluate.evaluate import evaluate
from joulepath.optimizer.evaluate.evaluation import Evaluation
from joulepath.optimizer.exceptions import (
    DeadlineExceeded,
    OutsideLimits,
)
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.names import first_repeated
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.progress import Steps
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.what_if import what_if

R = TypeVar("R", OptimizeRequest, EvaluateRequest)
MOST_CHANGES = 16


def _changes_something(arm: ArmRequest) -> ArmRequest:
    if not arm.model_fields_set:
        raise PydanticCustomError("empty", "Give at least one field of the arm")
    if "robot" in arm.model_fields_set:
        raise PydanticCustomError("robot", "A change cannot replace the robot: leave `robot` out")
    if "figures" in arm.model_fields_set:
        message = "A change cannot replace the robot's figures: leave `figures` out"
        raise PydanticCustomError("figures", message)
    return arm


class Change(Request):
    """A changed arm: its fields replace fields of the base."""

    name: Name = described("Name of the change.", None, "links of half the mass")
    arm: Annotated[ArmRequest, AfterValidator(_changes_something)] = described(
        "Fields of the arm. A given field replaces the whole field of the base. An omitted field "
        "keeps the value of the base.",
        None,
        {"link_mass_scale": 0.5},
    )


def _different(changes: list[Change]) -> list[Change]:
    if first_repeated([change.name for change in changes]) is not None:
        message = "Give each change a different name; case and spaces make no difference"
        raise PydanticCustomError("repeated", message)
    return changes


_Changes = Annotated[
    list[Change],
    Field(min_length=1, max_length=MOST_CHANGES),
    AfterValidator(_different),
]


class WhatifRequest(WithBodies):
    """A motion, as exactly one of `optimize` and `evaluate`, and changes of its arm."""

    optimize: OptimizeRequest | None = described(
        "The base, if a motion is optimised: a body of `POST /optimize`. Its `deadline` applies to "
        "each run.",
        None,
        OPTIMIZE,
        default=None,
    )
    evaluate: EvaluateRequest | None = described(
        "The base, if a motion is given: a body of `POST /evaluate`. Its `deadline` applies to "
        "each run.",
        None,
        EVALUATE,
        default=None,
    )
    changes: _Changes = described(
        "Changes of the arm; each is applied separately to the base.",
        None,
        [{"name": "links of half the mass", "arm": {"link_mass_scale": 0.5}}],
    )
    deadline: DeadlineSeconds = described(
        "Wall time for all runs together, including the wait for a worker. Each run gets an equal "
        "share of the time that is left.",
        "s",
        30.0,
        default=30.0,
    )

    @model_validator(mode="after")
    def _one_base(self) -> Self:
        if (self.optimize is None) == (self.evaluate is None):
            message = "Give exactly one of `optimize` and `evaluate`"
            raise PydanticCustomError("exactly_one", message)
        return self


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
    """State and rows of both kinds of base."""

    def __init__(self, request: WhatifRequest, request_id: str, deadline: Deadline) -> None:
        self.request, self.request_id = request, request_id
        self.deadline = deadline
        self.clock, self.began = deadline.clock, deadline.clock()
        self.shares = DeadlineShares(deadline, 1 + len(request.changes))
        self.collector = AnswerCollector()
        self.steps = Steps("arms", 1 + len(request.changes), listener())

    def result_of(
        self, robot: str, objective: Objective | None, base: WhatifBase, changes: list[ChangeResult]
    ) -> TaskResult:
        """The answer."""
        answer = WhatifAnswer(
            request=self.request_id,
            robot=robot,
            objective=objective,
            base=base,
            changes=changes,
            wall_time=self.clock() - self.began,
        )
        return TaskResult.of_json(answer, self.collector.stored)

    def failed(
        self,
        change: Change,
        error: Exception,
        same: SameMotion | None = None,
    ) -> ChangeResult:
        """The entry of a change without a motion, or without a better one than the `same`."""
        problem = problem_of(error, self.request_id)
        return ChangeResult(name=change.name, same_motion=same, problem=problem)


class _Optimized(_Work):
    """The base is optimised."""

    def result(self) -> TaskResult:
        """The answer. Raises the error of the base, and InvalidProblem for an invalid change."""
        asked = self.request.optimize
        assert asked is not None
        share = min(asked.deadline, self.shares.next())
        with inside("optimize"):
            first = to_problem(asked, share)
        # all problems are built before the first run, so an invalid change is rejected at once
        problems = [self._problem(asked, k) for k in range(len(self.request.changes))]
        with inside("optimize"):
            best = certified(optimize(first, progress=False))
        self.steps.add()
        base = WhatifBase.of(best, self._kept(asked, best), best.status, holds=True)
        rows = [
            self._row(asked, k, best, problem)
            for k, problem in enumerate(self.steps.each(problems))
        ]
        return self.result_of(asked.robot, asked.objective, base, rows)

    def _problem(self, asked: OptimizeRequest, k: int) -> Problem | OutsideLimits:
        change = self.request.changes[k]
        try:
            left = min(asked.deadline, time_left(self.deadline))
            with _inside_change(k, change):
                return to_problem(_changed(asked, change), left)
        except OutsideLimits as error:
            return error

    def _row(
        self,
        asked: OptimizeRequest,
        k: int,
        base: Solution,
        problem: Problem | OutsideLimits,
    ) -> ChangeResult:
        change, share = self.request.changes[k], self.shares.next()
        if isinstance(problem, OutsideLimits):
            return self.failed(change, problem)
        if self.shares.used_up:
            return self.failed(change, DeadlineExceeded([]))
        try:
            found = what_if(
                base, replace(problem, deadline=min(asked.deadline, share)), progress=False
            )
        except DeadlineExceeded as error:
            return self.failed(change, error)
        certificate = found.certificate
        same = SameMotion.of(
            base,
            found.same_motion,
            base.duration,
            holds=certificate.valid,
            certificate=certificate,
            answer=None,
        )
        if found.reoptimised is None:
            assert found.error is not None
            return self.failed(
                change, moved(found.error, f"changes.{k}.arm", change.arm.model_fields_set), same
            )
        best = certified(found.reoptimised)
        path = self._kept(_changed(asked, change), best)
        better = Reoptimised.of(base, best.energy, best.duration, answer=path, status=best.status)
        return ChangeResult(
            name=change.name,
            same_motion=same,
            reoptimised=better,
            reoptimisation=best.energy.of(asked.objective) - found.same_motion.of(asked.objective),
        )

    def _kept(self, asked: OptimizeRequest, motion: Solution) -> str:
        """The path of the complete answer to a request."""
        whole = OptimizeAnswer.of(asked, self.request_id, motion, arm_fields(asked))
        return self.collector.add(whole)


class _Evaluated(_Work):
    """The base is a given motion."""

    def result(self) -> TaskResult:
        """The answer. Raises the error of the base, and InvalidProblem for an invalid change."""
        assert self.request.evaluate is not None
        given = self.request.evaluate
        with until(self.deadline):
            with inside("evaluate"):
                asked = as_logged(given)
                arm = to_arm(asked)
            arms = [self._arm(asked, k) for k in range(len(self.request.changes))]
        with inside("evaluate"):
            found = self._evaluate(arm, asked)
        self.steps.add()
        base = WhatifBase.of(found.total, self._kept(asked, found), None, _holds(found))
        rows = [self._row(asked, k, found, arm) for k, arm in enumerate(self.steps.each(arms))]
        return self.result_of(asked.robot, None, base, rows)

    def _arm(self, asked: EvaluateRequest, k: int) -> Arm:
        change = self.request.changes[k]
        with _inside_change(k, change):
            return to_arm(_changed(asked, change))

    def _evaluate(self, arm: Arm, asked: EvaluateRequest) -> Evaluation:
        deadline = min(asked.deadline or math.inf, self.shares.next())
        return evaluate(arm, to_motion(asked), asked.sample_period, deadline, progress=False)

    def _row(self, asked: EvaluateRequest, k: int, base: Evaluation, arm: Arm) -> ChangeResult:
        change = self.request.changes[k]
        if self.shares.used_up:
            return self.failed(change, DeadlineExceeded([]))
        try:
            with _inside_change(k, change):
                found = self._evaluate(arm, asked)
        except DeadlineExceeded as error:
            return self.failed(change, error)
        total, path = found.total, self._kept(_changed(asked, change), found)
        same = SameMotion.of(
            base.total,
            total.energy,
            total.duration,
            holds=_holds(found),
            certificate=None,
            answer=path,
        )
        return ChangeResult(name=change.name, same_motion=same)

    def _kept(self, asked: EvaluateRequest, found: Evaluation) -> str:
        """The path of the complete answer to a request."""
        return self.collector.add(EvaluateAnswer.of(self.request_id, Evaluated(asked, found)))


def _inside_change(k: int, change: Change) -> AbstractContextManager[None]:
    """A context that adds the field of change `k` to an InvalidProblem."""
    return inside(f"changes.{k}.arm", change.arm.model_fields_set)


def _changed(asked: R, change: Change) -> R:
    """The request of the base with the fields of the change."""
    arm = change.arm
    return asked.model_copy(update={name: getattr(arm, name) for name in arm.model_fields_set})


def _holds(result: Evaluation) -> bool:
    """Whether the motion is within all limits and free of collisions."""
    free = result.nearest is None or result.nearest.distance >= 0
    return free and all(report.held for report in result.limits)
