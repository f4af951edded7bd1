"""Answer of `POST /optimize`, and its computation in a worker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, Self

from joulepath.app.answers.envelope import AnswerFigures, MotionAnswer
from joulepath.app.convert.arm import arm_fields
from joulepath.app.convert.json_text import sent
from joulepath.app.convert.request import to_problem
from joulepath.app.convert.unlikely_units import unlikely_units
from joulepath.app.convert.warnings import certified_warnings
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.request import OptimizeRequest, WhichCandidates
from joulepath.app.tasks.answer_collector import certified
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import Solution, SolvedMotion


class Repeated(Protocol):
    """Fields of the request that its answer repeats."""

    robot: str
    method: MethodName
    candidates: WhichCandidates

    @property
    def objective(self) -> Objective:
        """The minimised energy."""
        ...


@dataclass(frozen=True, kw_only=True)
class OptimizeAnswer(SolvedMotion, MotionAnswer):
    """The motion of least energy, its energy with all parts, and a certificate."""

    method: MethodName
    """How the motion is parametrised."""
    warnings: list[str]
    """Remarks on the motion, in words; empty if there are none. If two bodies come closer than 2
    mm, one names them, their distance without margins, and the time. Others say that arm
    configurations may have been missed, that a baseline is left out, what a tool or payload
    without a shape would touch, or which figures of the request are likely in another unit."""
    answer: str | None = None
    """Path of this stored answer: `GET` returns it again. Null if it is not stored: the database
    cannot be written, the answer is larger than the service may store, or it is a part of another
    answer."""

    @classmethod
    def of(
        cls, request: Repeated, request_id: str, solution: Solution, arm: dict[str, Any] | None
    ) -> Self:
        """Build the answer from a solution; the store adds its id later.

        Args:
            request: the validated request.
            request_id: id of the request.
            solution: the certified solution.
            arm: figures of the arm, from `arm_fields`.
        """
        listed = [
            each
            for each in solution.candidates
            if request.candidates == "all" or (request.candidates == "computed" and each.tried)
        ]
        motion = vars(solution.solved_motion()) | {"candidates": listed}
        return cls(
            request=request_id,
            robot=request.robot,
            arm=arm,
            method=request.method,
            warnings=[*unlikely_units(request), *certified_warnings(solution)],
            **motion,
        )

    @property
    def figures(self) -> AnswerFigures:
        """Figures of this answer for lists of answers."""
        return AnswerFigures(self.robot, self.energy.of(self.objective), self.duration, self.status)


@dataclass(frozen=True)
class OptimizeTask:
    """A validated request and its id."""

    request: OptimizeRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /optimize`, within about `deadline` seconds."""
        answer = self.answer(deadline)
        return TaskResult.of_kept_json(answer, answer.figures, asked=sent(self.request))

    def answer(self, deadline: float) -> OptimizeAnswer:
        """The answer within about `deadline` seconds, not kept yet."""
        solution = certified(
            optimize(to_problem(self.request, deadline), tell=listener(), progress=False)
        )
        return OptimizeAnswer.of(self.request, self.request_id, solution, arm_fields(self.request))
