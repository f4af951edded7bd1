"""POST /compare in a worker: the methods one after another, in the order of `METHODS`."""

from __future__ import annotations

from dataclasses import dataclass

import orjson

from joulepath.app.convert.arm_fields import arm_fields
from joulepath.app.convert.comparison import to_compare_response, to_optimize_request
from joulepath.app.convert.request import to_problem
from joulepath.app.convert.solution import to_optimize_response
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult, json_document
from joulepath.app.http.problem_details import problem_content
from joulepath.app.schemas.compare import CompareRequest
from joulepath.app.tasks.certified import certified
from joulepath.app.tasks.deadline_shares import DeadlineShares
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.methods import METHODS
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.progress import CandidatesFound, CandidateTried, Improved, forward
from joulepath.optimizer.solution import Solution


@dataclass(frozen=True)
class CompareTask:
    """A validated request and its id.

    One worker runs all methods. A comparison therefore takes one place in the queue, and its times are of one core.
    """

    request: CompareRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The table, within about `deadline` seconds. If no method finds a motion, raises the error of the first."""
        found: dict[MethodName, Solution] = {}
        errors: dict[MethodName, JoulepathError] = {}
        answers: dict[MethodName, orjson.Fragment] = {}
        methods = [method for method in METHODS if method in self.request.methods]
        shares = DeadlineShares(Deadline.after(deadline), len(methods))
        tell = forward(listener())
        tell(CandidatesFound(len(methods)))
        for k, method in enumerate(methods):
            asked, share = to_optimize_request(self.request, method), shares.next()
            if shares.used_up:
                errors[method] = DeadlineExceeded([])
                continue
            try:
                solution = found[method] = certified(optimize(to_problem(asked, share)))
            except JoulepathError as error:
                errors[method] = error
                tell(CandidateTried(k, "failed", None, None))
            else:
                energy, bound = solution.energy.of(asked.objective), solution.lower_bound
                tell(CandidateTried(k, "solved", bound, energy))
                tell(Improved(energy, solution.duration, bound, solution.goal.q))
                if self.request.answers:
                    # encoded at once: the next method gets the time that is left then
                    answer = json_document(to_optimize_response(asked, self.request_id, solution, arm_fields(asked)))
                    answers[method] = orjson.Fragment(answer)
        if not found:
            raise errors[self.request.methods[0]]
        problems = {method: problem_content(error, self.request_id) for method, error in errors.items()}
        return TaskResult.of_json(to_compare_response(self.request, self.request_id, found, problems, answers))
