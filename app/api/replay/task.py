"""Request, answer and work of `POST /replay`."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationError

from joulepath.app.answers.envelope import Answer
from joulepath.app.convert.given_answer import Number, Part, to_program
from joulepath.app.convert.until import until
from joulepath.app.convert.warnings import replay_warnings
from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.problems import invalid_request
from joulepath.app.schemas.common import Request, described
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.given_answer import AnswerRequest
from joulepath.app.tasks.kept_answers import answer_and_moves
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.declared import NotEmpty, Seconds
from joulepath.optimizer.export.program import Move
from joulepath.optimizer.progress import Steps, TellSteps, no_listener
from joulepath.optimizer.replay.baseline_courses import ReportedBaseline, planned_baselines
from joulepath.optimizer.replay.controller import ControlName
from joulepath.optimizer.replay.planned import PlannedMotion, PlannedTorques
from joulepath.optimizer.replay.reference import course_of
from joulepath.optimizer.replay.replay import replay
from joulepath.optimizer.replay.replay_result import Quantity, Replay
from joulepath.optimizer.replay.simulator import mujoco
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.result.energy import Objective

PERTURBED_NOTHING = "The arm carries no payload: changing it has no effect."
NO_BASELINES = (
    "The motions of the baselines cannot be derived from this answer, so their savings are not "
    "replayed. This is possible for goals that are joint positions or full poses, without a "
    "path."
)
CONTROLS: dict[Literal["feed_forward", "pd", "both"], tuple[ControlName, ...]] = {
    "feed_forward": ("feed_forward",),
    "pd": ("pd",),
    "both": ("feed_forward", "pd"),
}
Fraction = Annotated[float, Field(gt=0, le=0.9)]


class Perturb(Request):
    """Uncertain quantities of the arm, unknown to the controller and changed one at a time."""

    payload: Fraction | None = described(
        "Fraction by which mass and inertia of the payload are decreased and increased. Null: "
        "unchanged.",
        "1",
        0.1,
        default=None,
    )
    friction: Fraction | None = described(
        "Fraction by which the friction of all joints is decreased and increased. Null: unchanged.",
        "1",
        0.3,
        default=None,
    )


class ReplayRequest(AnswerRequest):
    """An answer, and the settings of the simulation of its motion in MuJoCo."""

    control: Literal["feed_forward", "pd", "both"] = described(
        "Controller of the joints. `feed_forward`: torques known in advance, friction included, "
        "and a PD loop. `pd`: the loop alone, as in simple controllers.",
        None,
        "feed_forward",
        default="both",
    )
    step: float = described(
        "Step of the simulation and of its controller.",
        "s",
        2.5e-4,
        default=2.5e-4,
        ge=1e-5,
        le=1e-2,
    )
    perturb: Perturb | None = described(
        "Changes of the arm unknown to the controller, to test the robustness of the motion and "
        "its savings. Null: none.",
        None,
        {"payload": 0.1, "friction": 0.3},
        default=None,
    )
    deadline: DeadlineSeconds = described(
        "Wall time from the arrival of the request, including the wait for a worker.",
        "s",
        60.0,
        default=60.0,
    )


@dataclass(frozen=True, kw_only=True)
class _OfLeg:
    leg: int | None
    """Index in `legs` of a cycle, from 0; null for an answer of one motion."""


@dataclass(frozen=True, kw_only=True)
class ReplayedMotion(Replay, _OfLeg):
    """A motion of the answer, planned and simulated."""

    @classmethod
    def of(cls, leg: int | None, found: Replay) -> Self:
        """The replay of a motion, and of a cycle the index of its leg."""
        return cls(leg=leg, **{each.name: getattr(found, each.name) for each in fields(Replay)})


@dataclass(frozen=True, kw_only=True)
class ReplayAnswer(Answer):
    """Motions of an answer simulated in MuJoCo, compared with the figures of the answer."""

    simulator: str
    """The simulator and its version."""
    motions: Annotated[list[ReplayedMotion], NotEmpty]
    """The motions, in their order."""
    wall_time: Seconds
    """Wall time."""
    warnings: list[str]
    """Remarks, in words: joints that give all their torque, contacts, obstacles that are not
    simulated, and baselines that cannot be replayed. Empty if there are none."""


@dataclass(frozen=True)
class ReplayTask:
    """A validated request and its id."""

    asked: ReplayRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /replay`, within about `deadline` seconds.

        Raises:
            PartsNeeded: answers have to be read from the store first; errors of the parts as well.
        """
        simulator, end = f"MuJoCo {mujoco().__version__}", Deadline.after(deadline)
        began = end.clock()
        try:
            with until(end):
                planned = self._planned()
        except ValidationError as error:
            raise invalid_request(error, "body", "answer") from None
        warnings = list[str]()
        # of one motion, its simulations are the steps; of a cycle, its moves
        alone = len(planned) == 1
        inner, outer = (listener(), no_listener) if alone else (no_listener, listener())
        steps = Steps("moves", len(planned), outer)
        motions = [
            self._replayed(leg, motion, end, warnings, inner) for leg, motion in steps.each(planned)
        ]
        answer = ReplayAnswer(
            request=self.request_id,
            robot=planned[0][1].arm.robot.name,
            simulator=simulator,
            motions=motions,
            wall_time=end.clock() - began,
            warnings=warnings,
        )
        return TaskResult.of_json(answer)

    def _planned(self) -> list[tuple[int | None, PlannedMotion]]:
        """The motions of the answer, with their indices in `legs` of a cycle."""
        answer, of_moves = answer_and_moves(self.asked.answer)
        moves = to_program(answer, self.asked.arm, of_moves).moves
        legs: list[int | None] = [None]
        if of_moves:
            legs = [k for k, leg in enumerate(answer["legs"]) if leg["answer"] is not None]
        return [
            (leg, to_planned_motion(move, given))
            for leg, move, given in zip(legs, moves, of_moves or [answer], strict=True)
        ]

    def _replayed(
        self,
        leg: int | None,
        planned: PlannedMotion,
        end: Deadline,
        warnings: list[str],
        tell: TellSteps,
    ) -> ReplayedMotion:
        """The entry of one motion; adds its warnings."""
        perturb, said = _perturbation(self.asked.perturb), list[str]()
        if "payload" in perturb and planned.arm.payload.mass == 0:
            said.append(PERTURBED_NOTHING)
        if perturb and planned.compared and not planned.baselines:
            said.append(NO_BASELINES)
        found = replay(
            planned,
            CONTROLS[self.asked.control],
            self.asked.step,
            perturb,
            end.left,
            end.clock,
            tell=tell,
            progress=False,
        )
        where = "" if leg is None else f"Leg {leg}: "
        warnings += [f"{where}{words}" for words in (*said, *replay_warnings(planned, found))]
        return ReplayedMotion.of(leg, found)


def _perturbation(perturb: Perturb | None) -> dict[Quantity, float]:
    """Fractions of change by quantity."""
    given: dict[Quantity, float | None] = (
        {} if perturb is None else {"payload": perturb.payload, "friction": perturb.friction}
    )
    return {quantity: fraction for quantity, fraction in given.items() if fraction is not None}


class _Electrical(Part):
    total: Number
    dwell: Number = 0.0


class _Mechanical(Part):
    total: Number


class _Energy(Part):
    electrical: _Electrical
    mechanical: _Mechanical


class _Baseline(Part):
    name: BaselineName
    duration: Annotated[float, Field(ge=0, le=1e6)]
    electrical: Number
    mechanical: Number
    saving: Number | None


class _Candidate(Part):
    q_goal: Annotated[list[Number], Field(max_length=16)]


class _Optimized(Part):
    """An answer of `POST /optimize`, but for its motion."""

    objective: Objective = "electrical"
    energy: _Energy
    baselines: Annotated[list[_Baseline], Field(max_length=16)] = Field(default_factory=list)
    candidates: Annotated[list[_Candidate], Field(max_length=100_000)] = Field(default_factory=list)


class _Total(Part):
    energy: _Energy


class _Evaluated(Part):
    """An answer of `POST /evaluate`, but for its motion."""

    total: _Total


def to_planned_motion(move: Move, answer: dict[str, Any]) -> PlannedMotion:
    """The motion of an answer, whose samples are checked, with the energies that the answer
    reports.

    Raises ValidationError (of pydantic).
    """
    arm, spline = move.arm, move.spline
    if "trajectory" not in answer:
        energy = _Evaluated.model_validate(answer).total.energy
        return _planned(move, answer["samples"], energy)
    given = _Optimized.model_validate(answer)
    ends = spline.control_points[0], spline.control_points[-1]
    named = [
        np.array(each.q_goal, dtype=float)
        for each in given.candidates
        if len(each.q_goal) == arm.robot.nq
    ]
    names = ReportedBaseline.__dataclass_fields__
    reported = [
        ReportedBaseline(**{name: getattr(each, name) for name in names})
        for each in given.baselines
    ]
    return replace(
        _planned(move, answer["trajectory"], given.energy),
        objective=given.objective,
        waiting=given.energy.electrical.dwell,
        compared=bool(reported),
        baselines=planned_baselines(arm, ends[0], [ends[1], *named], spline.duration, reported),
    )


def _planned(move: Move, samples: dict[str, Any], energy: _Energy) -> PlannedMotion:
    return PlannedMotion(
        arm=move.arm,
        course=course_of(move.spline),
        duration=move.duration,
        electrical=energy.electrical.total - energy.electrical.dwell,
        mechanical=energy.mechanical.total,
        torques=PlannedTorques(
            *(np.array(samples[name], dtype=float) for name in ("q", "v", "a", "tau"))
        ),
    )
