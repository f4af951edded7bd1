"""Memo of one tool path as an arm follows it from its configurations at the start."""

from __future__ import annotations

from collections.abc import Callable

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace, traces
from joulepath.optimizer.kinematics.tool_path.joint_path import joint_path
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm

EvenMotion = tuple[Spline | None, bool]
"""A motion at the fixed speed of a tool path, and whether it is within the limits."""


class FollowedPaths:
    """Traces and joint paths along a tool path, by the joint positions at its start.

    A trace is computed by the default rotation of the tool unless `keep` or `select_turning`
    supplied another one. The methods of this class are the only way to change the memo.

    Args:
        arm: arm on the path.
        course: course of the TCP.
    """

    def __init__(self, arm: Arm, course: ToolCourse) -> None:
        self._arm, self._course = arm, course
        self._traces: dict[bytes, Trace] = {}
        self._joint_paths: dict[bytes, Spline | None] = {}
        self._turnings_searched: set[bytes] = set()
        self._even_motions: dict[tuple[bytes, float, float], EvenMotion] = {}

    def keep(self, trace: Trace) -> None:
        """Store a trace under its first configuration."""
        self._traces[trace.q[0].tobytes()] = trace

    def known_trace(self, q_start: Array) -> Trace | None:
        """Stored trace from q_start (nq,) [rad]; None if there is none."""
        return self._traces.get(q_start.tobytes())

    def joint_path(self, q_start: Array) -> Spline | None:
        """Path of the joints over [0, 1] from q_start (nq,) [rad]; None if the arm cannot follow
        the tool path from there.
        """
        key = q_start.tobytes()
        if key not in self._joint_paths:
            if key not in self._traces:
                (self._traces[key],) = traces(self._arm, self._course, q_start[None])
            trace = self._traces[key]
            self._joint_paths[key] = (
                joint_path(self._arm, self._course, trace) if trace.obstacle is None else None
            )
        return self._joint_paths[key]

    def mark_turnings_searched(self, q_start: Array) -> None:
        """Record a finished search for other rotations of the tool from q_start (nq,) [rad]."""
        self._turnings_searched.add(q_start.tobytes())

    def are_turnings_searched(self, q_start: Array) -> bool:
        """Whether other rotations of the tool have been searched from q_start (nq,) [rad]."""
        return q_start.tobytes() in self._turnings_searched

    def select_turning(self, q_start: Array, trace: Trace, path: Spline) -> None:
        """Replace the trace and the joint path from q_start by those of another rotation.

        Args:
            q_start: joint positions at the start, shape (nq,) [rad].
            trace: trace with the better rotation of the tool.
            path: path of the joints along this trace.
        """
        self.mark_turnings_searched(q_start)
        self._traces[q_start.tobytes()] = trace
        self._joint_paths[q_start.tobytes()] = path

    def even_motion(
        self, path: Spline, first: float, last: float, compute: Callable[[], EvenMotion]
    ) -> EvenMotion:
        """Motion at the fixed speed of the tool path, computed once.

        Args:
            path: path of the joints.
            first: duration of the ramp at the start [s].
            last: duration of the ramp at the end [s].
            compute: computes the motion if it is not known yet.
        """
        key = path.control_points.tobytes(), first, last
        if key not in self._even_motions:
            self._even_motions[key] = compute()
        return self._even_motions[key]
