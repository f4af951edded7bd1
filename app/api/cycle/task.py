"""Answer of `POST /cycle`, and its work in a worker."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal, Self

from joulepath.app.answers.envelope import Answer, AnswerFigures
from joulepath.app.api.cycle.problem import to_cycle
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.convert.arm import arm_fields
from joulepath.app.convert.json_text import sent
from joulepath.app.convert.known_motions import to_kept, to_known_motions
from joulepath.app.convert.unlikely_units import unlikely_units
from joulepath.app.convert.warnings import DIVIDED, MISSED, NO_DEFAULT_MOTION, certified_warnings
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.arm import Payload
from joulepath.app.tasks.answer_collector import AnswerCollector, certified
from joulepath.optimizer.cycle.cycle_move import CycleMove
from joulepath.optimizer.cycle.cycle_solution import CycleSolution, SolvedCycle
from joulepath.optimizer.cycle.known_motions import knowing
from joulepath.optimizer.declared import NotEmpty
from joulepath.optimizer.plan_cycle import plan_cycle
from joulepath.optimizer.problem.arm import LIMIT_NAMES, Arm
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.result.cycle import LegReport


@dataclass(frozen=True, kw_only=True)
class CycleLeg(LegReport):
    """A move from one place to the next, the dwell at a stop, or a wait."""

    answer: str | None = None
    """Path of the complete answer of `POST /optimize` for this move; null for a rest."""


@dataclass(frozen=True, kw_only=True)
class CycleAnswer(SolvedCycle, Answer):
    """The cycle of least energy, its moves, and its certificate."""

    method: MethodName
    """How the moves are parametrised."""
    legs: Annotated[list[CycleLeg], NotEmpty]
    payload_at_end: dict[str, Any] | None
    """What the arm carries after the last move, in the form of a request, if it takes something up
    or puts something down there; else null."""
    warnings: list[str]
    """Remarks on the cycle and on its moves, as in `POST /optimize`, with the ends of the move.
    Empty if there are none."""
    answer: str | None = None
    """Path of this answer: `GET` returns it again. Null if it could not be stored."""

    @classmethod
    def of(
        cls, request: CycleRequest, request_id: str, found: CycleSolution, legs: list[CycleLeg]
    ) -> Self:
        """The answer to a request, not kept yet; `legs` name the answers of their moves."""
        cycle = vars(found.solved_cycle()) | {"legs": legs}
        return cls(
            request=request_id,
            robot=request.robot,
            method=request.method,
            payload_at_end=_payload_at_end(request, found),
            warnings=[*unlikely_units(request), *_warnings(found)],
            **cycle,
        )

    @property
    def figures(self) -> AnswerFigures:
        """The figures of this answer in lists."""
        return AnswerFigures(self.robot, self.energy.of(self.objective), self.duration, self.status)


@dataclass(frozen=True)
class CycleTask:
    """A validated request and its id; the media type of the answer is `wanted`.

    `motions` are known motions of the same cell, see `store.known_motions`.
    """

    request: CycleRequest
    request_id: str
    wanted: Literal["json", "csv"] = "json"
    motions: Mapping[str, bytes] = field(default_factory=dict)

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /cycle`, within about `deadline` seconds."""
        motions = to_known_motions(self.motions)
        with knowing(motions):
            found = plan_cycle(to_cycle(self.request, deadline), tell=listener(), progress=False)
        return replace(self._result(found), motions=to_kept(motions))

    def _result(self, found: CycleSolution) -> TaskResult:
        if self.wanted == "csv":
            return TaskResult.of_csv(cycle_rows(found))
        collector = AnswerCollector()
        answer = cycle_answer(self.request, self.request_id, found, collector)
        stored, asked = collector.stored, sent(self.request)
        return TaskResult.of_kept_json(answer, answer.figures, stored, asked)


def cycle_answer(
    request: CycleRequest, request_id: str, found: CycleSolution, collector: AnswerCollector
) -> CycleAnswer:
    """The answer to a request, not kept yet; the answers of its moves are collected."""
    legs = list[CycleLeg]()
    for move, arm in zip(found.moves, arms_of_moves(request, found), strict=True):
        solution = certified(move.solution)
        path = collector.add(OptimizeAnswer.of(request, request_id, solution, arm))
        first, *rests = (CycleLeg(**vars(leg)) for leg in move.legs(found.objective))
        legs += [replace(first, answer=path), *rests]
    return CycleAnswer.of(request, request_id, found, legs)


def _warnings(found: CycleSolution) -> list[str]:
    """Warnings of the cycle, then warnings of moves with their names."""
    of_all = [] if found.complete else [MISSED]
    if found.moves[0].planned.arm.robot.default_motion is None:
        of_all.append(NO_DEFAULT_MOTION)
    of_all += [DIVIDED.format(name, last) for name, last in _divided(found)]
    return of_all + [
        f"{move.planned.start} to {move.planned.goal}: {words}"
        for move in found.moves
        for words in certified_warnings(move.solution)
        if words != NO_DEFAULT_MOTION
    ]


def _divided(found: CycleSolution) -> list[tuple[str, float]]:
    """Divisions of paths: the stop at the end of a part, and the share of the path until there."""
    paths = [(move.planned.goal, move.planned.tool_path) for move in found.moves]
    parts = [
        (name, path.section)
        for name, path in paths
        if path is not None and path.section is not None
    ]
    return [(name, section.last) for name, section in parts if section.last < 1]


Row = list[float | str]


def cycle_rows(found: CycleSolution) -> Iterator[Row]:
    """Rows with the columns t, leg, kind, then q, v, a, tau_motor of every joint, and power.

    Units as in the JSON answer. A rest has its mean power, and no torques: motors or brakes may
    hold the arm.
    """
    joints = range(1, found.moves[0].planned.arm.robot.nq + 1)
    names = ("q", "v", "a", "tau_motor")
    yield ["t", "leg", "kind", *(f"{name}{joint}" for name in names for joint in joints), "power"]
    legs = ((move, leg) for move in found.moves for leg in move.legs(found.objective))
    for number, (move, leg) in enumerate(legs):
        rests = leg.kind in ("dwell", "wait")
        yield from _of_rest(leg, number) if rests else _of_move(move, number)


def _of_move(move: CycleMove, number: int) -> list[Row]:
    samples, kind = move.solution.trajectory, move.planned.kind
    table = zip(
        (samples.t + move.t0).tolist(),
        *(getattr(samples, name).tolist() for name in ("q", "v", "a", "tau_motor")),
        samples.power.tolist(),
        strict=True,
    )
    return [[t, number, kind, *q, *v, *a, *tau, power] for t, q, v, a, tau, power in table]


def _of_rest(leg: LegReport, number: int) -> list[Row]:
    q, power = leg.goal.q.tolist(), leg.electrical / leg.duration
    still: Row = [0.0] * len(q)
    ends = (leg.t0, leg.t0 + leg.duration)
    return [[t, number, leg.kind, *q, *still, *still, *[""] * len(q), power] for t in ends]


def arms_of_moves(request: CycleRequest, found: CycleSolution) -> list[dict[str, Any] | None]:
    """The result of `arm_fields` for every move as a request of its own."""
    return [
        _arm(request, move.planned.arm, carried)
        for move, carried in zip(found.moves, _payloads(request, found), strict=False)
    ]


def _payloads(request: CycleRequest, found: CycleSolution) -> list[Payload | None]:
    """Payloads of the request on every move and after the last one."""
    stops = {stop.name or str(k): stop for k, stop in enumerate(request.stops, 1)}
    carried = [request.payload]
    for move in found.moves:
        stop = stops.get(move.planned.goal) if move.planned.at_stop else None
        changes = stop is not None and "payload" in stop.model_fields_set
        carried.append(stop.payload if stop is not None and changes else carried[-1])
    return carried


def _payload_at_end(request: CycleRequest, found: CycleSolution) -> dict[str, Any] | None:
    """The payload after the last move, if it is not that of the last move."""
    *_, before, after = _payloads(request, found)
    if before == after:
        return None
    return {"mass": 0.0} if after is None else after.model_dump(mode="json", exclude_unset=True)


def _arm(request: CycleRequest, arm: Arm, carried: Payload | None) -> dict[str, Any] | None:
    limits, own = arm.active_limits, arm.robot.limits
    given = request.limits.model_dump(mode="json", exclude_unset=True)
    for public, name in LIMIT_NAMES.items():
        value = getattr(limits, name)
        if (value < getattr(own, name)).any():
            given[public] = value.tolist()
    # A storage begins a move with the final charge of the previous one.
    stored = request.bus.mode == "storage" and {
        "bus": request.bus.model_dump(mode="json", exclude_unset=True)
        | {"initial": arm.bus.initial}
    }
    given |= {"tcp_speed": arm.tcp_speed, "elbow_speed": arm.elbow_speed}
    counted = [each for each in request.scene.obstacles if each.name in arm.scene.names]
    return arm_fields(
        request,
        limits=given,
        payload=None if carried is None else carried.model_dump(mode="json", exclude_unset=True),
        scene=request.scene.model_dump(mode="json", exclude_unset=True)
        | {"obstacles": [each.model_dump(mode="json", exclude_unset=True) for each in counted]},
        **(stored or {}),
    )
