"""Request and answer of `POST /compare`, and its work in a worker."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from joulepath.app.answers.envelope import Answer
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.convert.arm import arm_fields
from joulepath.app.convert.request import to_problem
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.problems import problem_of
from joulepath.app.schemas.common import described
from joulepath.app.schemas.request import MotionRequest, OptimizeRequest
from joulepath.app.tasks.answer_collector import certified
from joulepath.optimizer.compare import Compared, Comparison, compare
from joulepath.optimizer.declared import Count, Joules, NotEmpty, Ratio, Seconds
from joulepath.optimizer.presentation.gap import optimality_gap
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.result.baseline import Baseline
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import Solution

ALL: list[MethodName] = list(get_args(MethodName))


def _different(methods: list[MethodName]) -> list[MethodName]:
    if len(set(methods)) < len(methods):
        raise PydanticCustomError("repeated", "Give each method once")
    return methods


_Methods = Annotated[list[MethodName], Field(min_length=1), AfterValidator(_different)]


class CompareRequest(MotionRequest):
    """A motion from standstill at `start` to standstill at `goal`, by several methods. `deadline`
    is for all methods together."""

    methods: _Methods = described(
        "Methods to compare, each once; the rows of the answer keep this order.",
        None,
        ["bspline", "lagrange"],
        default=ALL,
    )
    answers: bool = described(
        "Whether each row contains the complete answer of `POST /optimize`.",
        None,
        False,
        default=False,
    )

    def by(self, method: MethodName) -> OptimizeRequest:
        """The request of `POST /optimize` for the motion by one method."""
        shared = {name: getattr(self, name) for name in MotionRequest.model_fields}
        # every field was validated with the request
        return OptimizeRequest.model_construct(method=method, **shared)


@dataclass(frozen=True, kw_only=True)
class MethodResult:
    """Result of one method. If it found no motion, `problem` has the error, and all other fields
    except `method` are null."""

    method: MethodName
    """The method."""
    status: Literal["optimal", "feasible"] | None = None
    """Status as in `POST /optimize`."""
    duration: Seconds | None = None
    """Duration of the motion."""
    electrical: Joules | None = None
    """Energy drawn from the supply."""
    mechanical: Joules | None = None
    """Mechanical work."""
    excess: Ratio | None = None
    """Energy / energy of the best method - 1, of the objective."""
    optimality_gap: Ratio | None = None
    """Energy of the objective / `lower_bound` - 1: the energy is above the least possible by at
    most this share. Null if the bound is not positive."""
    wall_time: Seconds | None = None
    """Wall time of this method, on one core."""
    iterations: Count | None = None
    """Iterations, as in `solver` of `POST /optimize`."""
    nlp_solves: Count | None = None
    """Nonlinear programs solved."""
    valid: bool | None = None
    """Whether the certificate is valid; other motions are not returned."""
    worst_ratio: Ratio | None = None
    """Largest value / limit of the certificate."""
    problem: dict[str, Any] | None = None
    """The error document of `POST /optimize`; null if there is a motion."""
    answer: OptimizeAnswer | None = None
    """The complete answer of `POST /optimize` if `answers` is true; else null."""


@dataclass(frozen=True, kw_only=True)
class CompareAnswer(Answer):
    """The results of several methods, and the baselines."""

    objective: Objective
    """The minimised energy: electrical energy drawn from the supply, or mechanical work."""
    lower_bound: Joules
    """Lower bound of the objective: no motion of any shape and any allowed duration between these
    targets needs less. It is the largest bound of all methods."""
    best: MethodName
    """Method of least energy."""
    methods: Annotated[list[MethodResult], NotEmpty]
    """One row per method, in the order of the request."""
    baselines: Annotated[list[Baseline], NotEmpty]
    """Baselines of the best method."""


@dataclass(frozen=True)
class CompareTask:
    """A validated request and its id.

    One worker runs all methods, one after another. A comparison therefore takes one place in the
    queue, and its times are of one core.
    """

    request: CompareRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The table, within about `deadline` seconds.

        Raises the error of the first method if none finds a motion.
        """
        problem = to_problem(self.request.by(self.request.methods[0]), deadline)
        found = compare(problem, self.request.methods, tell=listener(), progress=False)
        answer = CompareAnswer(
            request=self.request_id,
            robot=self.request.robot,
            objective=found.objective,
            lower_bound=found.lower_bound,
            best=found.best,
            methods=list(self._rows(found)),
            baselines=found.solutions[found.best].baselines,
        )
        return TaskResult.of_json(answer)

    def _rows(self, found: Comparison) -> Iterator[MethodResult]:
        for each in found.methods:
            if each.error is None:
                yield self._row(found, each)
            else:
                problem = problem_of(each.error, self.request_id)
                yield MethodResult(method=each.method, problem=problem)

    def _row(self, found: Comparison, each: Compared) -> MethodResult:
        """The row of a method with a motion."""
        assert each.solution is not None
        solution = certified(each.solution)
        return MethodResult(
            method=each.method,
            status=solution.status,
            duration=solution.duration,
            electrical=solution.energy.electrical.total,
            mechanical=solution.energy.mechanical.total,
            excess=found.excess(each.method),
            optimality_gap=optimality_gap(found.lower_bound, solution.energy.of(found.objective)),
            wall_time=solution.solver.wall_time,
            iterations=solution.solver.iterations,
            nlp_solves=solution.solver.nlp_solves,
            valid=solution.certificate.valid,
            worst_ratio=max(solution.certificate.worst_ratio.values()),
            answer=self._whole(each.method, solution) if self.request.answers else None,
        )

    def _whole(self, method: MethodName, solution: Solution) -> OptimizeAnswer:
        """The complete answer of a method."""
        asked = self.request.by(method)
        return OptimizeAnswer.of(asked, self.request_id, solution, arm_fields(self.request))
