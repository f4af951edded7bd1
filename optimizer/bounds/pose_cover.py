"""Boxes around all configurations of a pose, for any chain of revolute joints.

The cover uses no inverse kinematics, so a branch missed by inverse kinematics cannot spoil a bound.
The search splits the largest boxes first. `PoseFamily.narrowed` drops unreachable boxes and shrinks
the others around the configurations. Isolated configurations end in few small boxes. Curves and
large numbers of configurations end in larger boxes; the boxes cover all configurations at any limit
on the effort.

`PoseFamily` leaves the rotation about one axis free: the axis of the last joint. The boxes are
therefore narrowed in the other joints alone. The orientation R of the last link then determines the
last joint: Rz(q_n) = M with M = R_{n-1}ᵀ R and R_{n-1} the orientation of the last joint's frame at
q_n = 0. Every joint rotates the links behind it by its own angle. Within a box, R_{n-1} thus
deviates from its value at the middle by at most σ, the sum of the half sides of the other joints,
and Rz(q_n) is within the angle σ of M at the middle. With M = (w, x, y, z) as a unit quaternion,
the angle between both is 2 acos|w cos(q_n/2) + z sin(q_n/2)|. Hence |cos(q_n/2 - α)| ≥ cos(σ/2) /
hypot(w, z) with α = atan2(z, w): q_n is within 2 acos of this ratio around 2 α, and the box is
empty if the ratio exceeds 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from heapq import heappop, heappush

import numpy as np
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.free_ends_bound import EndBoxes
from joulepath.optimizer.bounds.free_goal_bound import (
    POSE_FAMILY,
    PoseFamily,
    halved,
    one_turn_boxes,
)
from joulepath.optimizer.bounds.least_displacement import full_turns
from joulepath.optimizer.bounds.subdivide import Boxes, SearchLimits, Subdivision
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem


@dataclass(frozen=True)
class PoseCoverSettings:
    """Settings of the cover of a pose."""

    boxes_per_round: int = 400
    """Number of boxes split in a round."""
    rounds: int = 60
    """Largest number of rounds."""
    tight_rounds: int = 160
    """Largest number of rounds of a problem with `"bound": "tight"`; the boxes of common arms are
    settled after 30 to 140.
    """
    settled: float = 0.004
    """Path of the TCP along the widest side [m] below which a box is not split."""
    narrowings: int = 3
    """Number of times that a part is narrowed: near a configuration each one squares its size."""
    rounding: float = 1e-7
    """Margin of angles for rounding [rad], as of an arc cosine near one."""
    most_boxes: int = 200
    """Number of boxes left, neighbours being united; pairs of two poses are at most its square."""


POSE_COVER = PoseCoverSettings()


@dataclass(frozen=True)
class CoveredPose:
    """A pose divided into the axis of the last joint, placed by the other joints, and its angle."""

    family: PoseFamily
    """Configurations with the last joint's frame at its pose, up to a rotation about its axis."""
    R: Array
    """Orientation (3, 3) of the last link at the pose."""

    @classmethod
    def of(cls, problem: Problem, pose: Pose, given: bool = False) -> CoveredPose:
        """Pose of the TCP of a problem's arm, at either end.

        Args:
            problem: problem of the motions, without a tool path.
            pose: pose of the TCP.
            given: whether the full turns of the starts are fixed.
        """
        T_flange_last = np.asarray(np.linalg.inv(problem.arm.robot.T_last_flange))
        arm = replace(problem.arm, T_flange_tcp=T_flange_last)
        T = pose.T @ np.linalg.inv(T_last_tcp(problem.arm))
        prepared = PreparedProblem.of(replace(problem, arm=arm))
        turned = ConeOrientedPose.about(Pose(T), np.array([0.0, 0.0, 1.0]))
        return cls(PoseFamily(prepared, turned, given), T[:3, :3])

    def boxes(self, limits: SearchLimits) -> EndBoxes:
        """Cover all configurations within the position limits, up to full turns.

        Args:
            limits: limits on the effort; less effort leaves larger boxes.

        Returns:
            Middles and half sides, shape (b, nq) [rad], of at most `most_boxes` boxes.
        """
        if not self.family.prepared.arm.robot.coupling.has_free_end:
            return cover(self.family, limits)
        parts = _PoseCover(self.family).run(limits)
        return united(*self._with_last_joint(parts.centre, parts.half), POSE_COVER.most_boxes)

    def _with_last_joint(self, centre: Array, half: Array) -> EndBoxes:
        """Narrow boxes in the last joint, and drop boxes without a configuration of the pose.

        Args:
            centre: middles, shape (b, nq) [rad].
            half: half sides, shape (b, nq) [rad].

        Returns:
            Middles and half sides of the remaining boxes.
        """
        prepared = self.family.prepared
        placements, coupling = joint_placements(prepared.model), prepared.arm.robot.coupling
        q = coupling.positions(centre)
        last = link_frames(placements[:-1], q[:, :-1])[:, -1] @ placements[-1]
        M = last[:, :3, :3].transpose(0, 2, 1) @ self.R
        _, _, z, w = Rotation.from_matrix(M).as_quat().T
        reaches = coupling.reaches(half)
        sigma = np.minimum(reaches[:, :-1].sum(axis=1), np.pi)
        least = np.cos(sigma / 2) / np.maximum(np.hypot(w, z), POSE_COVER.rounding)
        held = least <= 1 + POSE_COVER.rounding
        centre, half = centre.copy(), half.copy()
        centre[:, -1] = 2 * np.arctan2(z, w)
        half[:, -1] = 2 * np.arccos(np.minimum(least, 1.0)) + POSE_COVER.rounding
        return centre[held], half[held]


def cover(family: PoseFamily, limits: SearchLimits) -> EndBoxes:
    """Boxes of a pose with a free rotation, see `CoveredPose.boxes`."""
    parts = _PoseCover(family).run(limits)
    return united(parts.centre, parts.half, POSE_COVER.most_boxes)


class _PoseCover(Subdivision[Boxes]):
    """Subdivision of the boxes of a pose; the value of a box is its negative size."""

    def __init__(self, family: PoseFamily) -> None:
        self.family = family

    def first(self) -> Boxes:
        """Boxes over one turn of every joint."""
        nq = self.family.prepared.arm.robot.nq
        return self._narrowed(*one_turn_boxes(nq, POSE_FAMILY.boxes_per_joint[0]))

    def chosen(self, parts: Boxes, number: int) -> Indices:
        """The largest boxes above the size at which a box is final."""
        return np.flatnonzero(parts.value[: POSE_COVER.boxes_per_round] < -POSE_COVER.settled)

    def divided(self, parts: Boxes, rows: Indices) -> Boxes:
        """Both halves of boxes."""
        return self._narrowed(*halved(self.family, parts.centre[rows], parts.half[rows]))

    def _narrowed(self, centre: Array, half: Array) -> Boxes:
        """Narrow boxes, and drop boxes without configurations within the position limits."""
        limits = self.family.prepared.arm.active_limits
        for _ in range(POSE_COVER.narrowings):
            centre, half, reached = self.family.narrowed(centre, half)
            turned = [allowed for _, allowed in full_turns(centre, half, limits)]
            inside = np.any(turned, axis=0).all(axis=1)
            centre, half = centre[reached & inside], half[reached & inside]
        return Boxes(-self.family.sizes(half).max(axis=1, initial=0.0), centre, half)


def united(centre: Array, half: Array, most: int) -> tuple[Array, Array]:
    """Cover boxes by at most `most` boxes.

    All boxes form one group at first; the group with the widest side is bisected repeatedly.

    Args:
        centre: middles, shape (b, nq) [rad].
        half: half sides, shape (b, nq) [rad].
        most: largest number of boxes.

    Returns:
        Middles and half sides of the covering boxes [rad].
    """
    if len(centre) <= most:
        return centre, half
    groups = [(-np.inf, -1, np.arange(len(centre)))]
    while len(groups) < most and groups[0][0] < 0:
        _, _, rows = heappop(groups)
        joint = int(np.ptp(centre[rows], axis=0).argmax())
        middle = (centre[rows, joint].min() + centre[rows, joint].max()) / 2
        for part in (rows[centre[rows, joint] <= middle], rows[centre[rows, joint] > middle]):
            # the first row tells groups of equal width apart
            width = float(np.ptp(centre[part], axis=0).max())
            heappush(groups, (-width, int(part[0]), part))
    low = np.array([(centre[rows] - half[rows]).min(axis=0) for *_, rows in groups])
    high = np.array([(centre[rows] + half[rows]).max(axis=0) for *_, rows in groups])
    return (low + high) / 2, (high - low) / 2
