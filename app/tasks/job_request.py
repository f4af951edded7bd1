"""One request of a job in a worker: the task of its endpoint, and the figures of its answer."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import orjson

from joulepath.app.api.compare.task import CompareRequest, CompareTask
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.cycle.task import CycleTask
from joulepath.app.api.evaluate.task import EvaluateAnswer, evaluated
from joulepath.app.api.figures.task import replacing
from joulepath.app.api.identifications.request import IdentifyRequest
from joulepath.app.api.identifications.task import IdentifyTask
from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.api.pareto.task import ParetoRequest, ParetoTask
from joulepath.app.api.placement.request import PlacementRequest
from joulepath.app.api.placement.task import PlacementTask
from joulepath.app.api.whatif.task import WhatifRequest, WhatifTask
from joulepath.app.convert.packed import packed, unpacked
from joulepath.app.convert.recorded import GivenLog
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.store.answers import packed_answer
from joulepath.app.store.leases import FoundFigures
from joulepath.app.tasks.answer_collector import figures_of
from joulepath.optimizer.deadline import Deadline

IDENTIFY = "identify"
"""Kind of requests with stored logs."""
CYCLE = "cycle"
"""Kind of requests with known motions."""
RESIDUALS = "residuals"
"""Kind of the second answer of an identification: its curves."""


@dataclass(frozen=True)
class JobResult(TaskResult):
    """An answer with its figures. Documents are compressed; `parts` is the kind of `stored`.

    `wall_time` [s] is the time of the work. `identified` are figures found for an arm, if any.
    """

    wall_time: float = field(kw_only=True)
    parts: str = field(kw_only=True)
    identified: FoundFigures | None = field(kw_only=True, default=None)


@dataclass(frozen=True)
class JobRequestTask:
    """A validated request to the endpoint `kind`: its compressed JSON, and its id."""

    kind: str
    body: bytes
    request_id: str
    logs: tuple[GivenLog, ...] = ()
    """Logs of an identification."""
    motions: Mapping[str, bytes] = field(default_factory=dict)
    """Known motions of the cell of a cycle."""

    def run(self, deadline: float) -> TaskResult:
        """The answer of the endpoint, within about `deadline` seconds."""
        began = time.perf_counter()
        body = unpacked(self.body)
        if self.kind == IDENTIFY:
            asked = IdentifyRequest.model_validate_json(body)
            result = IdentifyTask(asked, self.logs, self.request_id).run(deadline)
        elif self.kind == CYCLE:
            cycle = CycleRequest.model_validate_json(body)
            result = CycleTask(cycle, self.request_id, motions=self.motions).run(deadline)
        else:
            result = _RUN[self.kind](body, self.request_id, deadline)
        result = result if result.kept_as is not None else result.kept()
        answer = orjson.loads(result.document)
        figures = figures_of(answer)
        # Compression runs in the worker; no client waits, so that size matters more than time.
        return JobResult(
            packed(result.document),
            result.media_type,
            tuple(map(packed_answer, result.stored)),
            result.kept_as,
            figures,
            result.is_optimal,
            motions=result.motions,
            wall_time=time.perf_counter() - began,
            parts=_parts_of(self.kind, answer),
            identified=_identified(answer) if self.kind == IDENTIFY else None,
        )


def _parts_of(kind: str, answer: dict[str, Any]) -> str:
    """Kind of the stored parts of an answer of the endpoint `kind`."""
    if kind == IDENTIFY:
        return RESIDUALS
    return "evaluate" if kind == "whatif" and answer["objective"] is None else "optimize"


def _identified(answer: dict[str, Any]) -> FoundFigures:
    document = {name: value for name, value in answer["document"].items() if name != "robot"}
    return FoundFigures(answer["robot"], replacing(answer["robot"], document))


def _evaluate(body: bytes, request_id: str, deadline: float) -> TaskResult:
    request = EvaluateRequest.model_validate_json(body)
    return TaskResult.of_json(
        EvaluateAnswer.of(request_id, evaluated(request, Deadline.after(deadline)))
    )


_RUN: dict[str, Callable[[bytes, str, float], TaskResult]] = {
    "optimize": lambda body, own, left: OptimizeTask(
        OptimizeRequest.model_validate_json(body), own
    ).run(left),
    "placement": lambda body, own, left: PlacementTask(
        PlacementRequest.model_validate_json(body), own
    ).run(left),
    "pareto": lambda body, own, left: ParetoTask(
        ParetoRequest.model_validate_json(body), own, "json"
    ).run(left),
    "compare": lambda body, own, left: CompareTask(
        CompareRequest.model_validate_json(body), own
    ).run(left),
    "whatif": lambda body, own, left: WhatifTask(WhatifRequest.model_validate_json(body), own).run(
        left
    ),
    "evaluate": _evaluate,
}
