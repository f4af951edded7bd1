"""POST /cycle in a worker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.convert.cycle import to_cycle, to_cycle_response
from joulepath.app.convert.cycle_arms import arms_of_moves
from joulepath.app.convert.cycle_csv import to_cycle_csv
from joulepath.app.convert.known_motions import to_kept, to_known_motions
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.cycle import CycleRequest
from joulepath.app.tasks.answer_collector import AnswerCollector
from joulepath.app.tasks.answer_figures import figures_of
from joulepath.app.tasks.certified import certified
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.cycle.known_motions import knowing
from joulepath.optimizer.plan_cycle import plan_cycle
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class CycleTask:
    """A validated request and its id; the media type of the answer is `wanted`.

    `motions` are kept ones of the same cell, see `store.known_motions`.
    """

    request: CycleRequest
    request_id: str
    wanted: Literal["json", "csv"] = "json"
    motions: Mapping[str, bytes] = field(default_factory=dict)

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /cycle`, within about `deadline` seconds."""
        motions = to_known_motions(self.motions)
        with knowing(motions):
            found = plan_cycle(to_cycle(self.request, deadline), tell=listener())
        return replace(self._result(found), motions=to_kept(motions))

    def _result(self, found: CycleSolution) -> TaskResult:
        collector = AnswerCollector()
        if self.wanted == "csv":
            return TaskResult.of_csv(to_cycle_csv(found))
        arms = iter(arms_of_moves(self.request, found))

        def store(solution: Solution) -> str:
            answer = OptimizeAnswer.of(self.request, self.request_id, certified(solution), next(arms))
            return collector.add(answer)

        content = to_cycle_response(self.request, self.request_id, found, store)
        return TaskResult.of_kept_json(content, figures_of(content), collector.stored)
