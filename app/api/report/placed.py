"""A placement in the documents of a report: its cycles at the best and at the nominal place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from joulepath.app.api.advice.answered import unpacked
from joulepath.app.api.placement.request import PlacementRequest
from joulepath.app.api.placement.task import PlacementTask
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.convert.fields import inside
from joulepath.app.convert.given_answer import paths_of_moves
from joulepath.app.tasks.kept_answers import kept_answers
from joulepath.optimizer.exceptions import InvalidProblem

Json = dict[str, Any]
PLACES = ("best", "nominal")


def placed(
    asked: PlacementRequest, kept: str | None, request_id: str, deadline: float
) -> tuple[Json, list[Json]]:
    """The answer of a placement, and a row for each of its cycles at the best place, then at the
    nominal one.

    A row has the `place`, the `weight`, the `request` (null if it is not in the answer), the
    `answer` and the answers of its `moves`.

    Args:
        asked: the placement.
        kept: id of the kept answer to it; None: it is answered first.
        request_id: id of the request.
        deadline: wall time [s].

    Raises:
        PartsNeeded, InvalidProblem for a kept answer to another request, and the errors of
        answering.
    """
    if kept is not None:
        answer = kept_answers([kept])[0]
        if "tolerance" not in answer or answer.get("robot") != asked.robot:
            raise InvalidProblem(
                "answer", "The stored answer belongs to another request: leave `answer` out."
            )
        return answer, _rows(asked, answer, kept_answers)
    with inside("placement"):
        result = PlacementTask(asked, request_id).run(deadline)
    answer, parts = unpacked(result)
    return answer, _rows(asked, answer, lambda names: [parts[name] for name in names])


def _rows(
    asked: PlacementRequest, answer: Json, read: Callable[[list[str]], list[Json]]
) -> list[Json]:
    weights = [each.weight for each in asked.weighted]
    different = [place for place in PLACES if answer[place] is not None]
    if len(different) == 2 and answer["best"]["cycles"] == answer["nominal"]["cycles"]:
        different = ["best"]
    named = [
        (place, weight, each)
        for place in different
        for weight, each in zip(weights, answer[place]["cycles"], strict=True)
    ]
    cycles = read([each["answer"] for _, _, each in named])
    # all at once, since every reading of kept answers begins the task anew
    paths = [paths_of_moves(cycle) for cycle in cycles]
    moves = iter(read([path for each in paths for path in each]))
    return [
        {
            "place": place,
            "weight": weight,
            "request": each["request"],
            "answer": cycle,
            "moves": [next(moves) for _ in own],
        }
        for (place, weight, each), cycle, own in zip(named, cycles, paths, strict=True)
    ]


def rows_at(bundle: Bundle, place: str) -> list[Json]:
    """The rows of a place; those of the best place where it is the nominal one."""
    return [row for row in bundle.moves if row["place"] == place] or rows_at(bundle, "best")


def of_cycle(bundle: Bundle, row: Json) -> Bundle:
    """The documents of a report on the cycle of a row alone."""
    return replace(
        bundle,
        kind="cycle",
        request=row["request"] or {},
        answer=row["answer"],
        moves=row["moves"],
    )
