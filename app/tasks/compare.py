"""POST /compare in a worker: the methods one after another."""

from __future__ import annotations

from dataclasses import dataclass

import orjson

from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.convert.arm_fields import arm_fields
from joulepath.app.convert.comparison import to_compare_response, to_optimize_request
from joulepath.app.convert.request import to_problem
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult, json_document
from joulepath.app.http.problems import problem_of
from joulepath.app.schemas.compare import CompareRequest
from joulepath.app.tasks.certified import certified
from joulepath.optimizer.compare import compare
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class CompareTask:
    """A validated request and its id.

    One worker runs all methods. A comparison therefore takes one place in the queue, and its times are of one core.
    """

    request: CompareRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The table, within about `deadline` seconds. If no method finds a motion, raises the error of the first."""
        problem = to_problem(to_optimize_request(self.request, self.request.methods[0]), deadline)
        found = compare(problem, self.request.methods, tell=listener())
        problems = {
            each.method: problem_of(each.error, self.request_id) for each in found.methods if each.error is not None
        }
        answers = {method: self._answer(method, certified(each)) for method, each in found.solutions.items()}
        return TaskResult.of_json(to_compare_response(self.request, self.request_id, found, problems, answers))

    def _answer(self, method: MethodName, solution: Solution) -> orjson.Fragment | None:
        """The complete answer of a method, if the request asks for it."""
        if not self.request.answers:
            return None
        asked = to_optimize_request(self.request, method)
        content = OptimizeAnswer.of(asked, self.request_id, solution, arm_fields(asked))
        return orjson.Fragment(json_document(content))
