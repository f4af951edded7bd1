"""POST /pareto in a worker."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from io import StringIO
from typing import Any, Literal

from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.convert.arm_fields import arm_fields
from joulepath.app.convert.fields import fields
from joulepath.app.convert.request import to_problem
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.pareto import ParetoRequest
from joulepath.app.tasks.answer_collector import AnswerCollector
from joulepath.optimizer.pareto import Front, pareto
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class ParetoTask:
    """A validated request and its id; the media type of the answer is `wanted`."""

    request: ParetoRequest
    request_id: str
    wanted: Literal["json", "csv"]

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /pareto`, within about `deadline` seconds."""
        front = pareto(to_problem(self.request, deadline), self.request.points, tell=listener())
        collector = AnswerCollector()
        arm = arm_fields(self.request)
        points = [self._point(point, collector, arm) for point in front.points]
        if self.wanted == "csv":
            return TaskResult.of_csv(_table(points), collector.stored)
        return TaskResult.of_json(self._content(front, points), collector.stored)

    def _content(self, front: Front, points: list[dict[str, Any]]) -> dict[str, Any]:
        return {
            "request": self.request_id,
            "id": None,
            **fields(self.request, "robot", "method", "objective"),
            **fields(front, "status", "shortest"),
            "points": points,
            "dropped": [fields(each, "duration", "energy", "reason") for each in front.dropped],
            "solver": fields(front, "wall_time", "nlp_solves"),
        }

    def _point(self, point: Solution, collector: AnswerCollector, arm: dict[str, Any] | None) -> dict[str, Any]:
        energy = point.energy
        totals = {"electrical": energy.electrical.total, "mechanical": energy.mechanical.total}
        return {
            "duration": point.duration,
            "energy": totals[self.request.objective],
            "start": point.start.label,
            "goal": point.goal.label,
            **totals,
            **fields(energy, "mean_power", "peak_power"),
            **fields(point, "lower_bound", "status"),
            "certified": point.certificate.valid,
            "worst_ratio": max(point.certificate.worst_ratio.values()),
            "answer": collector.add(OptimizeAnswer.of(self.request, self.request_id, point, arm)),
        }


def _table(points: list[dict[str, Any]]) -> str:
    """CSV with one line per point; columns are named as in the JSON answer."""
    text = StringIO()
    writer = csv.DictWriter(text, points[0].keys(), lineterminator="\n")
    writer.writeheader()
    writer.writerows(points)
    return text.getvalue()
