"""Answer of `POST /placement`, and its work in a worker."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from joulepath.app.answers.envelope import Answer, AnswerFigures
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.cycle.task import cycle_answer
from joulepath.app.api.placement.problem import request_at, to_placement
from joulepath.app.api.placement.request import PlacementRequest
from joulepath.app.convert.arm import LARGEST
from joulepath.app.convert.json_text import sent
from joulepath.app.convert.warnings import AT_EDGE, JOINT_POSITIONS
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult, json_document
from joulepath.app.schemas.request import JointTarget
from joulepath.app.tasks.answer_collector import AnswerCollector
from joulepath.optimizer.declared import NotEmpty
from joulepath.optimizer.placement.place import place_robot
from joulepath.optimizer.placement.placement_solution import (
    FoundPlace,
    PlacementSolution,
    SolvedPlacement,
)

CYCLE = "cycle"
"""Kind of the kept answers of whole cycles."""


@dataclass(frozen=True, kw_only=True)
class PlacedCycle:
    """A cycle at a place."""

    answer: str
    """Path of its complete answer of `POST /cycle`."""
    request: dict[str, Any] | None
    """The body of `POST /cycle` with this answer: poses, obstacles and `gravity` in the frame of
    the base at this place. Null above 64 KiB of JSON."""


@dataclass(frozen=True, kw_only=True)
class PlacedCycles(FoundPlace):
    """A place, and the cycles at this place."""

    cycles: Annotated[list[PlacedCycle], NotEmpty]
    """The cycles, in the order of the request."""


@dataclass(frozen=True, kw_only=True)
class PlacementAnswer(SolvedPlacement, Answer):
    """The placement of least energy: best place, nominal place and the map of the region."""

    best: PlacedCycles
    nominal: PlacedCycles | None
    warnings: list[str]
    """Remarks on the placement. Empty if there are none."""
    answer: str | None = None
    """Path of this answer: `GET` returns it again. Null if it could not be stored."""

    @property
    def figures(self) -> AnswerFigures:
        """Figures of this answer for lists of answers: the ones of the best place."""
        return AnswerFigures(self.robot, self.best.energy, self.best.duration, self.status)


@dataclass(frozen=True)
class PlacementTask:
    """A validated request and its id."""

    request: PlacementRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /placement`, within about `deadline` seconds."""
        found = place_robot(to_placement(self.request, deadline), tell=listener(), progress=False)
        collector = AnswerCollector()
        best = self._placed(found.best, collector)
        same = found.nominal is not None and found.nominal.solutions is found.best.solutions
        nominal = best if same else None
        if found.nominal is not None and not same:
            nominal = self._placed(found.nominal, collector)
        answer = PlacementAnswer(
            request=self.request_id,
            robot=self.request.robot,
            warnings=_warnings(self.request, found),
            **vars(found) | {"best": best, "nominal": nominal},
        )
        stored, asked = collector.stored, sent(self.request)
        return TaskResult.of_kept_json(answer, answer.figures, stored, asked)

    def _placed(self, found: FoundPlace, collector: AnswerCollector) -> PlacedCycles:
        """A place, with the answers of its cycles collected."""
        placed = list[PlacedCycle]()
        asked = [each.cycle for each in self.request.weighted]
        for own, cycle, solution in zip(asked, found.placed_cycles, found.solutions, strict=True):
            request = request_at(own, cycle)
            answer = cycle_answer(request, self.request_id, solution, collector)
            path = collector.add(answer, CYCLE, sent(request))
            body = request.model_dump(mode="json", exclude_unset=True)
            short = len(json_document(body)) <= LARGEST
            placed.append(PlacedCycle(answer=path, request=body if short else None))
        return PlacedCycles(**vars(found) | {"cycles": placed})


def _warnings(request: PlacementRequest, found: PlacementSolution) -> list[str]:
    said = [AT_EDGE.format(", ".join(found.edges))] if found.edges else []
    names = _joint_positions([each.cycle for each in request.weighted])
    moves_base = request.moves == "base" or (
        isinstance(request.moves, list) and any(each.moves == "base" for each in request.moves)
    )
    if names and moves_base:
        said.append(JOINT_POSITIONS.format(", ".join(names)))
    return said


def _joint_positions(cycles: Sequence[CycleRequest]) -> list[str]:
    """Names of the stops given by joint positions."""
    return [
        stop.name or str(k)
        for cycle in cycles
        for k, stop in enumerate(cycle.stops, 1)
        if isinstance(stop.target, JointTarget)
    ]
