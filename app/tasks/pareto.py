"""POST /pareto in a worker."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from io import StringIO
from typing import Any, Literal

import orjson

from app.convert.fields import fields
from app.convert.request import to_problem
from app.convert.solution import to_optimize_response
from app.engine.reply import Reply
from app.schemas.pareto import ParetoRequest
from app.tasks.stored_answers import AnswerCollector
from app.tasks.task import answer
from optimizer.pareto import Front, pareto
from optimizer.solution import Solution


@dataclass(frozen=True)
class ParetoTask:
    """A validated request and its id; the answer's media type is `wanted`."""

    request: ParetoRequest
    request_id: str
    wanted: Literal["json", "csv"]

    def run(self, deadline: float) -> Reply:
        """The answer, or the problem, within about `deadline` seconds."""
        return answer(self.request_id, lambda: self._solve(deadline))

    def _solve(self, deadline: float) -> Reply:
        front = pareto(to_problem(self.request, deadline), self.request.points)
        shelf = AnswerCollector()
        points = [self._point(point, shelf) for point in front.points]
        if self.wanted == "csv":
            return Reply(200, _table(points).encode(), {"Content-Type": "text/csv; charset=utf-8"}, shelf.kept())
        body = orjson.dumps(self._content(front, points), option=orjson.OPT_SERIALIZE_NUMPY)
        return Reply(200, body, kept=shelf.kept())

    def _content(self, front: Front, points: list[dict[str, Any]]) -> dict[str, Any]:
        return {
            "id": self.request_id,
            **fields(self.request, "robot", "method", "objective"),
            **fields(front, "status", "shortest"),
            "points": points,
            "dropped": [fields(each, "duration", "energy", "reason") for each in front.dropped],
            "solver": fields(front, "wall_time", "nlp_solves"),
        }

    def _point(self, point: Solution, shelf: AnswerCollector) -> dict[str, Any]:
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
            "answer": shelf.add(to_optimize_response(self.request, self.request_id, point)),
        }


def _table(points: list[dict[str, Any]]) -> str:
    """CSV with one line per point; columns are named as in the JSON answer."""
    text = StringIO()
    writer = csv.DictWriter(text, points[0].keys(), lineterminator="\n")
    writer.writeheader()
    writer.writerows(points)
    return text.getvalue()
