"""POST /optimize in a worker."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.app.convert.arm_fields import arm_fields
from joulepath.app.convert.request import to_problem
from joulepath.app.convert.solution import to_optimize_response
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.tasks.answer_figures import figures_of
from joulepath.app.tasks.certified import certified
from joulepath.optimizer.optimize import optimize


@dataclass(frozen=True)
class OptimizeTask:
    """A validated request and its id."""

    request: OptimizeRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /optimize`, within about `deadline` seconds."""
        solution = certified(optimize(to_problem(self.request, deadline), tell=listener()))
        content = to_optimize_response(self.request, self.request_id, solution, arm_fields(self.request))
        return TaskResult.of_kept_json(content, figures_of(content))
