"""From answers to planned motions."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from joulepath.app.convert.given_answer import Number, Part
from joulepath.optimizer.export.program import Move
from joulepath.optimizer.replay.baseline_courses import ReportedBaseline, planned_baselines
from joulepath.optimizer.replay.planned import PlannedMotion, PlannedTorques
from joulepath.optimizer.replay.reference import course_of
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.result.energy import Objective


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
