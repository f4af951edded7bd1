"""What a worker process does with a request."""

from __future__ import annotations

from dataclasses import dataclass

from app.convert.request import to_problem
from app.convert.solution import to_optimize_response
from app.engine.reply import Reply
from app.schemas.request import OptimizeRequest
from app.tasks.task import answer, json_reply
from optimizer.optimize import optimize


@dataclass(frozen=True)
class OptimizeTask:
    """A validated request and its id."""

    request: OptimizeRequest
    request_id: str

    def run(self, deadline: float) -> Reply:
        """The answer, or the problem, within about `deadline` seconds."""
        return answer(self.request_id, lambda: self._solve(deadline))

    def _solve(self, deadline: float) -> Reply:
        solution = optimize(to_problem(self.request, deadline))
        if not solution.certificate.valid:
            raise AssertionError(f"The optimizer returned a motion that does not hold: {solution.certificate}")
        return json_reply(to_optimize_response(self.request, self.request_id, solution))
