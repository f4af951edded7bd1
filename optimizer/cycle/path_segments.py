"""Segments of a tool path: curves in joint space along which an arm can follow part of the path.

Every configuration at some points of the path is followed in both directions while the arm reaches
the path, no joint jumps and none leaves its range. At the end of a segment, the arm can go on along
another one after a reconfiguration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import NoConfigurationFound, SingularPose, UnreachablePose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.full_turns import full_turn_alternatives
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.tool_path.course_tracing import traces
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchFilter


@dataclass(frozen=True)
class SegmentSettings:
    """Settings of the search for path segments."""

    seeds: int = 17
    """Number of even fractions of the path at which segments are sought."""
    same_configuration: float = 1e-4
    """Distance of every joint within which a configuration is on a segment [rad]."""
    clearance: float = 0.02
    """Part of the path cut off before a singularity or the end of the reach."""


SEGMENTS = SegmentSettings()


@dataclass(frozen=True, eq=False)
class PathSegment:
    """Configurations q (k, nq) [rad] at rising fractions `at` (k,) of a path."""

    at: Array
    q: Array

    def covers(self, at: Array) -> Mask:
        """Mask (n,) of the fractions on the segment."""
        return np.asarray((at >= self.at[0]) & (at <= self.at[-1]), dtype=bool)

    def configurations(self, at: Array) -> Array:
        """Configurations (n, nq) [rad] at fractions (n,) of the path."""
        return np.stack([np.interp(at, self.at, q) for q in self.q.T], axis=1)


def path_segments(arm: Arm, course: ToolCourse, branch: BranchFilter | None) -> list[PathSegment]:
    """Segments of a course through configurations of allowed branches."""
    kinematics, limits, segments = (
        required_inverse_kinematics(arm.robot, "path"),
        arm.active_limits,
        list[PathSegment](),
    )
    for seed in np.linspace(0.0, 1.0, SEGMENTS.seeds).tolist():
        checkpoint()
        (T,) = course.poses(np.array([seed]))
        try:
            solutions = kinematics.solve(T, arm.T_flange_tcp, limits, windings=False)
        except (UnreachablePose, NoConfigurationFound, SingularPose):
            continue
        allowed = [
            each.q
            for each in solutions
            if branch is None or branch.allows(each.label, each.singular)
        ]
        fresh = [q for q in allowed if not _is_on_segment(segments, seed, q)]
        if fresh:
            segments += _segments_through(arm, course, seed, np.array(fresh))
    return segments


def _is_on_segment(segments: list[PathSegment], at: float, q: Array) -> bool:
    here = np.array([at])
    return any(
        each.covers(here)[0]
        and np.abs(wrapped(each.configurations(here)[0] - q)).max() < SEGMENTS.same_configuration
        for each in segments
    )


def _segments_through(arm: Arm, course: ToolCourse, seed: float, q: Array) -> list[PathSegment]:
    """Segments through configurations q (n, nq) [rad] at one fraction of a course."""
    limits = arm.active_limits
    sides = []
    for end in (0.0, 1.0):
        if end == seed:
            sides.append([(np.zeros(0), np.zeros((0, q.shape[1])))] * len(q))
            continue
        followed = traces(arm, course.part(seed, end), q)
        sides.append(
            [
                _without_end(seed + (end - seed) * each.at[1:], each.q[1:], each.obstacle is None)
                for each in followed
            ]
        )
    segments = list[PathSegment]()
    for start, (before, q_before), (after, q_after) in zip(q, *sides, strict=True):
        at = np.concatenate([before[::-1], [seed], after])
        segments.append(
            _within_limits(limits, at, np.vstack([q_before[::-1], start, q_after]), len(before))
        )
    return segments


def _without_end(at: Array, q: Array, whole: bool) -> tuple[Array, Array]:
    """One side of a segment, without its last part if the arm cannot go on from there."""
    if whole or not len(at):
        return at, q
    kept = np.abs(at - at[-1]) >= SEGMENTS.clearance
    return at[kept], q[kept]


def _within_limits(limits: Limits, at: Array, q: Array, seed: int) -> PathSegment:
    """Part of a segment around its seed within the joint ranges, with the full turns that make it
    longest.
    """
    first, last, shift = 0, len(at) - 1, np.zeros(q.shape[1])
    for joint, course in enumerate(q.T):
        reaches = []
        for value in full_turn_alternatives(q[seed], limits.q_min, limits.q_max)[joint]:
            turned = course + (value - course[seed])
            outside = np.flatnonzero(
                (turned < limits.q_min[joint]) | (turned > limits.q_max[joint])
            )
            low = int(outside[outside < seed].max(initial=-1)) + 1
            high = int(outside[outside > seed].min(initial=len(at))) - 1
            reaches.append((high - low, -abs(value), low, high, value - course[seed]))
        _, _, low, high, shift[joint] = max(reaches)
        first, last = max(first, low), min(last, high)
    return PathSegment(at[first : last + 1], q[first : last + 1] + shift)
