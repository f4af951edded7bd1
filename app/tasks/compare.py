"""What a worker does with `POST /compare`: the methods one after another, cheap ones first."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import orjson

from app.convert.comparison import to_compare_response, to_optimize_request
from app.convert.request import to_problem
from app.engine.reply import Reply
from app.http.problem_details import problem_reply
from app.schemas.compare import CompareRequest
from app.tasks.task import answer, json_reply
from optimizer.exceptions import JoulepathError
from optimizer.methods import METHODS
from optimizer.optimize import optimize
from optimizer.problem.problem import MethodName
from optimizer.solution import Solution

# a method whose share has been used up by others still says so itself [s]
LEAST_SHARE = 1e-3


@dataclass(frozen=True)
class CompareTask:
    """A validated request and its id.

    One worker does all methods, so that a comparison takes one place in the queue and its times are of the same core.
    Each may take its share of what is left of the deadline; what it leaves is for those after it.
    """

    request: CompareRequest
    request_id: str

    def run(self, deadline: float) -> Reply:
        """The table, or the problem of the first method asked for where none finds a motion."""
        return answer(self.request_id, lambda: self._compare(time.perf_counter() + deadline))

    def _compare(self, end: float) -> Reply:
        found: dict[MethodName, Solution] = {}
        replies: dict[MethodName, Reply] = {}
        waiting = [method for method in METHODS if method in self.request.methods]
        while waiting:
            share = max(end - time.perf_counter(), 0.0) / len(waiting)
            method = waiting.pop(0)
            try:
                solution = optimize(to_problem(to_optimize_request(self.request, method), max(share, LEAST_SHARE)))
            except JoulepathError as error:
                replies[method] = problem_reply(error, self.request_id)
                continue
            if not solution.certificate.valid:
                raise AssertionError(f"The optimizer returned a motion that does not hold: {solution.certificate}")
            found[method] = solution
        if not found:
            return replies[self.request.methods[0]]
        failed: dict[MethodName, dict[str, Any]] = {
            method: orjson.loads(reply.body) for method, reply in replies.items()
        }
        return json_reply(to_compare_response(self.request, self.request_id, found, failed))
