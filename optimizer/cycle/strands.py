"""The strands of a tool path: in joint space, the curves along which an arm can follow some part of
it.

Every configuration at some points of the path is followed in both directions, as far as the arm
reaches, no joint has to jump and none leaves its range. Where one strand ends, the arm can go on
along another one after a reconfiguration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import SingularPose, UnreachablePose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.full_turns import full_turn_alternatives
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.tool_path.course_tracing import traces
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchFilter

# fractions of the path at which strands are looked for
SEEDS = np.linspace(0.0, 1.0, 17)
# rad: a configuration is on a strand that comes so near to it
SAME = 1e-4
# share of the path that is kept from where a strand ends at a singularity, or where the arm no
# longer reaches
KEPT = 0.02


@dataclass(frozen=True, eq=False)
class Strand:
    """Configurations q (k, nq) [rad] at rising fractions `at` (k,) of a path."""

    at: Array
    q: Array

    def covers(self, at: Array) -> Mask:
        """Which fractions (n,) are on the strand."""
        return np.asarray((at >= self.at[0]) & (at <= self.at[-1]), dtype=bool)

    def configurations(self, at: Array) -> Array:
        """Configurations (n, nq) [rad] at fractions (n,) of the strand."""
        return np.stack([np.interp(at, self.at, q) for q in self.q.T], axis=1)


def strands_of(arm: Arm, course: ToolCourse, branch: BranchFilter | None) -> list[Strand]:
    """The strands of a course that begin in allowed branches."""
    kinematics, limits, found = (
        required_inverse_kinematics(arm.robot, "path"),
        arm.active_limits,
        list[Strand](),
    )
    for seed in SEEDS.tolist():
        checkpoint()
        (T,) = course.poses(np.array([seed]))
        try:
            solutions = kinematics.solve(T, arm.T_flange_tcp, limits, windings=False)
        except (UnreachablePose, SingularPose):
            continue
        allowed = [
            each.q
            for each in solutions
            if branch is None or branch.allows(each.label, each.singular)
        ]
        fresh = [q for q in allowed if not _is_on_any(found, seed, q)]
        if fresh:
            found += _through(arm, course, seed, np.array(fresh))
    return found


def _is_on_any(found: list[Strand], at: float, q: Array) -> bool:
    here = np.array([at])
    return any(
        each.covers(here)[0] and np.abs(wrapped(each.configurations(here)[0] - q)).max() < SAME
        for each in found
    )


def _through(arm: Arm, course: ToolCourse, seed: float, q: Array) -> list[Strand]:
    """The strands through configurations q (n, nq) [rad] at one fraction of a course."""
    limits = arm.active_limits
    sides = []
    for end in (0.0, 1.0):
        if end == seed:
            sides.append([(np.zeros(0), np.zeros((0, q.shape[1])))] * len(q))
            continue
        followed = traces(arm, course.part(seed, end), q)
        sides.append(
            [
                _kept(seed + (end - seed) * each.at[1:], each.q[1:], each.obstacle is None)
                for each in followed
            ]
        )
    strands = list[Strand]()
    for start, (before, q_before), (after, q_after) in zip(q, *sides, strict=True):
        at = np.concatenate([before[::-1], [seed], after])
        strands.append(
            _within(limits, at, np.vstack([q_before[::-1], start, q_after]), len(before))
        )
    return strands


def _kept(at: Array, q: Array, whole: bool) -> tuple[Array, Array]:
    """What is kept of a side of a strand: not its last part, if the arm cannot go on from there."""
    if whole or not len(at):
        return at, q
    kept = np.abs(at - at[-1]) >= KEPT
    return at[kept], q[kept]


def _within(limits: Limits, at: Array, q: Array, seed: int) -> Strand:
    """The part of a strand around its point `seed` that is within the joints' range, with the full
    turns of each joint with which this part is longest."""
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
    return Strand(at[first : last + 1], q[first : last + 1] + shift)
