"""Joint path of a trace: a quintic spline within the tolerances of the course."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.kinematics import newton
from joulepath.optimizer.kinematics.tcp import flange_pose, tcp_pose
from joulepath.optimizer.kinematics.tool_path.course_tracing import TRACE, Trace, chain_of
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class JointPathSettings:
    """Settings of the spline."""

    first_spans: int = 2
    """Initial number of knot spans of the joint path on each piece of the course."""
    most_spans: int = 500
    """Largest number of knot spans of the joint path."""
    samples_in_span: int = 2
    """Smallest number of traced points in each knot span."""
    tolerance_share: float = 0.5
    """Share of the path tolerances that the spline may use."""


SETTINGS = JointPathSettings()


def joint_path(arm: Arm, course: ToolCourse, trace: Trace) -> Spline | None:
    """Joint path γ(s), s ∈ [0, 1], through a complete trace; None if it bends too sharply for the
    tolerances.

    The spline gets more knots where it deviates from the course: near corners and singularities.
    """
    course = replace(course, turning=trace.turning)
    breaks = course.grid(SETTINGS.first_spans)
    while len(breaks) <= SETTINGS.most_spans:
        checkpoint()
        denser = _denser(arm, course, trace, breaks)
        if denser is None:
            return None
        trace = denser
        knots = bspline.clamped(breaks)
        path = Spline(bspline.DEGREE, knots, bspline.fit(trace.q, trace.at, knots, resting=1))
        checked = np.sort(np.concatenate([trace.at, (trace.at[1:] + trace.at[:-1]) / 2]))
        off = course.ratios(tcp_pose(arm, path.curve(checked)), course.poses(checked))
        bad = np.unique(
            np.searchsorted(breaks, checked[off > SETTINGS.tolerance_share], side="right").clip(
                1, len(breaks) - 1
            )
        )
        if not len(bad):
            return path
        breaks = np.union1d(breaks, (breaks[bad] + breaks[bad - 1]) / 2)
    return None


def _denser(arm: Arm, course: ToolCourse, trace: Trace, breaks: Array) -> Trace | None:
    """Trace with enough points for a spline with these breaks; None if one of them is not found."""
    few = np.flatnonzero(np.histogram(trace.at, breaks)[0] < SETTINGS.samples_in_span)
    inside = (np.arange(SETTINGS.samples_in_span) + 0.5) / SETTINGS.samples_in_span
    at = (breaks[few, None] + inside * np.diff(breaks)[few, None]).ravel()
    chain, found = chain_of(arm.robot), np.empty((len(at), trace.q.shape[1]))
    guesses = np.stack([np.interp(at, trace.at, q) for q in trace.q.T], axis=1)
    for k, pose in enumerate(course.poses(at)):
        (found[k],), (residual,) = newton.solved(
            chain, guesses[k][None], flange_pose(pose, arm.T_flange_tcp)
        )
        if residual > TRACE.reached or np.abs(found[k] - guesses[k]).max() > TRACE.jump:
            return None
    order = np.argsort(np.concatenate([trace.at, at]), kind="stable")
    return replace(
        trace, q=np.concatenate([trace.q, found])[order], at=np.concatenate([trace.at, at])[order]
    )


def path_ratios(arm: Arm, course: ToolCourse, q: Array) -> dict[str, float]:
    """Largest deviations of configurations q (k, nq) [rad] from a course, relative to its
    tolerances.
    """
    position, rotation = course.deviation(tcp_pose(arm, q))
    return {
        "path_position": float(position.max()) / course.path.position_tolerance,
        "path_rotation": float(rotation.max()) / course.path.rotation_tolerance,
    }
