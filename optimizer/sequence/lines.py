"""The layers of a stop with lines: its configurations from which both lines can be followed, and their outer ends.

A line leads from each configuration of the stop to one other, so a node of the stop has one node at each outer end.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models.robot import Array, Mask
from optimizer.exceptions import PathAttempt, PathInfeasible
from optimizer.kinematics.course_tracing import Trace, traces
from optimizer.kinematics.tcp import tcp_pose
from optimizer.kinematics.tool_course import ToolCourse
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.line import Line
from optimizer.problem.problem import Problem
from optimizer.problem.stops import APPROACH, RETREAT, Stop
from optimizer.problem.tool_path import ToolPath
from optimizer.problem.work_round import WorkRound
from optimizer.search.end_feasibility import check_configurations
from optimizer.search.ends import EndConfiguration, label_of
from optimizer.sequence.layers import Layer


def layers_with_lines(asked: WorkRound, stop: Stop, at: Layer) -> list[Layer]:
    """The layers of the places of a stop in their order, from that of the stop itself, `at`.

    Raises PathInfeasible if no configuration is left.
    """
    layers, kept = {stop.name: at}, np.ones(len(at.q), dtype=bool)
    for line, suffix, sign in ((stop.approach, APPROACH, -1.0), (stop.retreat, RETREAT, 1.0)):
        if line is None:
            continue
        found = _traces(asked, line, sign, at.ends)
        outer = _outer(asked, at, stop.name + suffix, found)
        attempts, follows = _followed(asked, stop, at, outer, found)
        if not (kept & follows).any():
            raise PathInfeasible(line.distance, attempts, outer.name)
        layers[stop.name + suffix] = outer
        kept &= follows
    return [_only(layers[place], kept) for place in stop.places]


def _traces(asked: WorkRound, line: Line, sign: float, ends: list[EndConfiguration]) -> list[Trace]:
    """The lines from configurations of the stop to their outer ends, on the side of the `sign`.

    Those that reach the same target have the same course.
    """
    found: dict[int, Trace] = {}
    for target in {end.target for end in ends}:
        own = [k for k, end in enumerate(ends) if end.target == target]
        q = np.array([ends[k].q for k in own])
        T_stop = tcp_pose(asked.arm, q[0])
        T_outer = T_stop.copy()
        T_outer[:3, 3] += sign * line.shift(T_stop)
        course = ToolCourse.of(ToolPath(), T_stop, T_outer)
        found |= dict(zip(own, traces(asked.arm, course, q), strict=True))
    return [found[k] for k in range(len(ends))]


def _outer(asked: WorkRound, at: Layer, place: str, found: list[Trace]) -> Layer:
    """The layer of the outer end of a line; a configuration whose line ends early has that of its last point."""
    q = np.array([trace.q[-1] for trace in found])
    ends = [
        EndConfiguration(label_of(asked.arm.robot, outer), outer, [], True, end.target)
        for outer, end in zip(q, at.ends, strict=True)
    ]
    moved = (q - np.array([end.q for end in at.ends]))[at.end]
    return replace(at, name=f"stops/{place}", ends=ends, q=at.q + moved, complete=at.complete and not at.sampled)


def _followed(
    asked: WorkRound, stop: Stop, at: Layer, outer: Layer, found: list[Trace]
) -> tuple[list[PathAttempt], Mask]:
    """What stops the line of each configuration, and the nodes (n,) that lead along all of it."""
    limits, place = asked.arm.active_limits, outer.name.removeprefix("stops/")
    reach = np.array([[(trace.q - trace.q[0]).min(axis=0), (trace.q - trace.q[0]).max(axis=0)] for trace in found])
    low, high = at.q + reach[at.end, 0], at.q + reach[at.end, 1]
    inside = ((low >= limits.q_min) & (high <= limits.q_max)).all(axis=1)
    blocked = _blocked(asked, stop, place, np.array([end.q for end in outer.ends]))
    whole = np.array([trace.obstacle is None for trace in found])
    attempts = [
        PathAttempt(end.label, trace.followed, trace.obstacle or ("in_collision" if hit else "outside_limits"))
        for end, trace, hit in zip(at.ends, found, blocked, strict=True)
    ]
    return attempts, inside & (whole & ~blocked)[at.end]


def _blocked(asked: WorkRound, stop: Stop, place: str, q: Array) -> Mask:
    """Which of the configurations q (n, nq) the arm cannot rest in at a place of a stop."""
    arms = {id(move.arm): move.arm for move in asked.moves if place in (move.start, move.goal)}
    problems = [Problem(arm=arm, start=stop.target, goal=stop.target) for arm in arms.values()]
    ruled = [check_configurations(PreparedProblem.of(problem), q) for problem in problems]
    return np.array([any(cause is not None for cause in causes) for causes in zip(*ruled, strict=True)])


def _only(layer: Layer, kept: Mask) -> Layer:
    return replace(layer, q=layer.q[kept], end=layer.end[kept], turns=layer.turns[kept])
