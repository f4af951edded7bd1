"""Programs to export: moves along splines with rests between them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.motion.spline import Spline, retimed, sample
from joulepath.optimizer.problem.arm import Arm, Payload
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.scalars import check_number


@dataclass(frozen=True)
class ProgramSettings:
    """Settings of programs."""

    max_jump: float = 1e-6
    """Largest jump of a joint from the end of a move to the start of the next [rad]."""


PROGRAM = ProgramSettings()


@dataclass(frozen=True)
class Move:
    """A motion of `arm` from standstill to standstill; comments contain the `label`."""

    spline: Spline
    arm: Arm
    label: str = "move"

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.spline.duration


@dataclass(frozen=True)
class Rest:
    """The arm stands still for `duration` [s] with `payload`; None stands for the payload of the
    next move, or of the last one."""

    duration: float
    label: str = "rest"
    payload: Payload | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        check_number("duration", self.duration, "seconds")


@dataclass(frozen=True)
class Timed:
    """A step of a program with its start."""

    step: Move | Rest
    t0: float
    """Start of the step [s]."""
    carried: Payload
    """Payload during the step."""
    payload: Payload | None = None
    """Payload that the arm has from the start of the step on; None if it does not change."""
    grasps: bool = False
    """Whether the arm takes something up rather than puts it down."""


@dataclass(frozen=True)
class Program:
    """Steps for one robot, the first of them a move.

    Moves are already slowed down by `speed_scale`; rests are not.

    Raises:
        InvalidProblem: the steps do not fit together.
    """

    steps: tuple[Move | Rest, ...]
    speed_scale: float = 1.0

    def __post_init__(self) -> None:
        check_fields(self)
        if not self.steps or isinstance(self.steps[0], Rest):
            raise InvalidProblem(
                "answer", "The answer has no motion: export one that begins with a move."
            )
        if any(move.arm.robot is not self.robot for move in self.moves):
            raise InvalidProblem(
                "answer", "The moves are those of several robots: export them one by one."
            )
        jumps = [
            np.abs(a.spline.control_points[-1] - b.spline.control_points[0])
            for a, b in pairwise(self.moves)
        ]
        if max((float(jump.max()) for jump in jumps), default=0.0) > PROGRAM.max_jump:
            raise InvalidProblem(
                "answer",
                "A move does not begin where the previous one ends: compute the cycle again.",
            )

    @cached_property
    def moves(self) -> tuple[Move, ...]:
        """The moves in order."""
        return tuple(step for step in self.steps if isinstance(step, Move))

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        first = self.steps[0]
        assert isinstance(first, Move)
        return first.arm.robot

    @property
    def start(self) -> Array:
        """Joint positions (nq,) [rad] at the start."""
        first: Array = self.moves[0].spline.control_points[0]
        return first

    @property
    def payload(self) -> Payload:
        """Payload at the start."""
        return self.moves[0].arm.payload

    @property
    def changes_payload(self) -> bool:
        """Whether moves have different payloads."""
        return any(not _same(move.arm.payload, self.payload) for move in self.moves)

    @property
    def duration(self) -> float:
        """Duration [s], with rests."""
        return sum((step.duration for step in self.steps), 0.0)

    @cached_property
    def timed(self) -> tuple[Timed, ...]:
        """Steps with their starts. The payload changes as soon as the arm stands at the place."""
        timed, t, carried = list[Timed](), 0.0, self.payload
        for k, step in enumerate(self.steps):
            held = next(
                (each for each in map(_payload, self.steps[k:]) if each is not None), carried
            )
            payload = None if _same(held, carried) else held
            timed.append(
                Timed(step, t, held, payload, payload is not None and payload.mass > carried.mass)
            )
            carried, t = held, t + step.duration
        return tuple(timed)

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """q [rad], v [rad/s], a [rad/s²], (k, nq) each, at times t (k,) [s] in order."""
        q, v, a = (np.zeros((len(t), self.robot.nq)) for _ in range(3))
        place = self.start
        for each in self.timed:
            inside = (t >= each.t0) & (t <= each.t0 + each.step.duration)
            if isinstance(each.step, Move):
                own = np.clip(t[inside] - each.t0, 0.0, each.step.duration)
                q[inside], v[inside], a[inside] = sample(each.step.spline, own)
                place = each.step.spline.control_points[-1]
            else:
                q[inside], v[inside], a[inside] = place, 0.0, 0.0
        beyond = t > self.duration
        q[beyond] = place
        return q, v, a

    def slowed(self, speed_scale: float) -> Program:
        """The program with every move slowed down to a share of its speed, and unchanged rests."""
        steps = tuple(
            replace(step, spline=retimed(step.spline, 1 / speed_scale))
            if isinstance(step, Move)
            else step
            for step in self.steps
        )
        return Program(steps, self.speed_scale * speed_scale)


def with_payload_at_end(steps: list[Move | Rest], payload: Payload) -> list[Move | Rest]:
    """The steps with the payload that the arm has after the last move, as where a part is put down
    at the end; without a rest after it, in a rest of no duration."""
    *before, last = steps
    if isinstance(last, Move):
        return [*steps, Rest(0.0, "end", payload)]
    return [*before, replace(last, payload=payload)]


def program_of_cycle(found: CycleSolution) -> Program:
    """The moves of a cycle, its dwells and waits."""
    steps = list[Move | Rest]()
    for move in found.moves:
        planned = move.planned
        steps.append(
            Move(move.solution.trajectory.spline, planned.arm, f"{planned.start} to {planned.goal}")
        )
        for label, length in (("dwell", planned.dwell), ("wait", move.wait)):
            if length > 0:
                steps.append(Rest(length, f"{label} at {planned.goal}"))
    last = found.moves[-1].planned
    if not _same(last.arm_after.payload, last.arm.payload):
        steps = with_payload_at_end(steps, last.arm_after.payload)
    return Program(tuple(steps))


def _payload(step: Move | Rest) -> Payload | None:
    return step.arm.payload if isinstance(step, Move) else step.payload


def _same(one: Payload, other: Payload) -> bool:
    return (
        one.mass == other.mass
        and np.array_equal(one.com, other.com)
        and np.array_equal(one.inertia, other.inertia)
    )
