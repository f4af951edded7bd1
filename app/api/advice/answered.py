"""The answer to a motion or a cycle: a kept one, or a new one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import orjson

from joulepath.app.api.advice.request import AnsweredRequest
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.cycle.task import CycleTask
from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.convert.fields import inside
from joulepath.app.convert.given_answer import paths_of_moves
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.tasks.kept_answers import answer_and_moves
from joulepath.optimizer.exceptions import InvalidProblem

Json = dict[str, Any]


def as_asked(body: Any) -> Json:
    """A request as it was sent, without defaults."""
    content: Json = body.model_dump(mode="json", exclude_unset=True)
    return content


def answered(asked: AnsweredRequest, request_id: str, deadline: float) -> tuple[Json, list[Json]]:
    """The answer to a request, and the answers of its moves.

    Raises PartsNeeded, InvalidProblem for a kept answer to another request, and the errors of
    answering.
    """
    task = asked.task
    assert task is not None
    if asked.answer is None:
        with inside("cycle" if isinstance(task, CycleRequest) else "optimize"):
            return documents_of(result_of(task, request_id, deadline))
    answer, moves = answer_and_moves(asked.answer)
    if not _fits(answer, task):
        raise InvalidProblem(
            "answer",
            "The stored answer belongs to another request: leave `answer` out, or "
            "send that request.",
        )
    return answer, moves


def _fits(answer: Json, task: OptimizeRequest | CycleRequest) -> bool:
    """Whether an answer can be that of a request."""
    is_cycle = isinstance(task, CycleRequest)
    same = (
        answer.get("robot") == task.robot
        and ("legs" in answer) == is_cycle
        and ("trajectory" in answer) != is_cycle
        and answer.get("objective") == task.objective
    )
    if not same or not isinstance(task, CycleRequest):
        return same
    names = {str(k) if stop.name is None else stop.name for k, stop in enumerate(task.stops, 1)}
    return names == set(answer["order"])


def result_of(
    task: OptimizeRequest | CycleRequest,
    request_id: str,
    deadline: float,
    motions: Mapping[str, bytes] | None = None,
) -> TaskResult:
    """The result of a request; `motions` are known motions of the cell of a cycle."""
    if isinstance(task, CycleRequest):
        return CycleTask(task, request_id, motions=motions or {}).run(deadline)
    return OptimizeTask(task, request_id).run(deadline)


def documents_of(result: TaskResult) -> tuple[Json, list[Json]]:
    """The answer in a result, and the answers of its moves."""
    answer, parts = unpacked(result)
    return answer, [parts[path] for path in paths_of_moves(answer)]


def unpacked(result: TaskResult) -> tuple[Json, dict[str, Json]]:
    """The answer in a result, and the answers to which it refers, by their paths."""
    parts = {each.path: orjson.loads(each.body) for each in result.stored}
    return orjson.loads(result.not_kept().document), parts
