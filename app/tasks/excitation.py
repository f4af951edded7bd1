"""POST /excitation in a worker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from joulepath.app.convert.excitation import to_excitation_csv, to_excitation_problem, to_excitation_response
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.excitation import ExcitationRequest
from joulepath.optimizer.excitation.excite import excite


@dataclass(frozen=True)
class ExcitationTask:
    """A validated request, the format of its answer, and its id."""

    request: ExcitationRequest
    wanted: Literal["json", "csv"]
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /excitation`, within about `deadline` seconds."""
        found = excite(to_excitation_problem(self.request, deadline))
        if self.wanted == "csv":
            return TaskResult.of_csv(to_excitation_csv(found))
        return TaskResult.of_json(to_excitation_response(self.request, self.request_id, found))
