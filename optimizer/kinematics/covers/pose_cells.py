"""Boxes of joint positions around all configurations of the flange poses in a cell.

A cell is a set of poses around its middle: a point of the flange is anywhere in a cylinder about
the first axis, and every direction of the tool is within an angle `h` of its direction in the
middle pose. The first joints alone determine the position of this point: it is the last axis'
origin of an arm of Universal Robots' form (`turned_pose_boxes`), or the meeting point of the
wrist's axes.

**Spherical wrist.** Let the wrist be in a cylinder of radius `across` and half height `above`. The
boxes of the first three joints follow as in `turned_pose_boxes`: the first axis sees the wrist,
and two links reach it in the arm's plane. The forearm then turns by no more than the first joint
and the second link together, and the flange by `h`; let e be the sum of both angles. In the frame
of the forearm, the axis of the flange is within e of its direction in the middle pose, and vice
versa. The angle γ between the axes of forearm and flange, the fifth joint, therefore changes by at
most e. The azimuth of one axis about the other axis changes by at most asin(sin e / sin γ); these
azimuths are the fourth and the sixth joint.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import product

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.covers.turned_pose_boxes import (
    BRANCHES,
    ROUNDING,
    Interval,
    PlanarArm,
    URCells,
    azimuth_off,
    boxed,
    seen_from_pole,
)
from joulepath.optimizer.kinematics.forward import link_frames
from joulepath.optimizer.kinematics.joint_axes import JointAxes, meeting_point
from joulepath.optimizer.kinematics.six.spherical_wrist import SphericalWrist
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm

EXACT = 1e-9
"""Deviation of an arm from its form up to which it counts as rounding [1, m]."""
SIGNS = np.array(list(product((1.0, -1.0), repeat=3)))
"""Signs of shoulder, wrist and elbow on every branch, shape (BRANCHES, 3)."""


@dataclass(frozen=True, eq=False)
class PoseCells(ABC):
    """Boxes for an arm of six joints.

    Attributes:
        point: the point of the cells' cylinders in the flange frame, shape (3,) [m].
        up: direction of the first axis, shape (3,).
        origin: point on the first axis, shape (3,) [m].
    """

    point: Array
    up: Array
    origin: Array

    @abstractmethod
    def boxes(self, T: Array, h: Array, across: Array, above: Array) -> tuple[Array, Array, Mask]:
        """Boxes that hold, up to full turns, all configurations of the poses in cells.

        Args:
            T: flange poses at the middles, shape (k, 4, 4).
            h: greatest angle from a direction of the tool to that of the middle, shape (k,) [rad].
            across: radii of the cylinders about the first axis' direction, shape (k,) [m].
            above: their half heights, shape (k,) [m].

        Returns:
            Middles and half sides (k, BRANCHES, 6) [rad], and a mask (k, BRANCHES) of the boxes
            that may hold configurations.
        """


def pose_cells_of(model: pin.Model) -> PoseCells | None:
    """Boxes for an arm; None for an arm of another form."""
    form = URClosedForm.of(model)
    return SphericalWristCells.of(model) if form is None else URPoseCells.of(form)


@dataclass(frozen=True, eq=False)
class URPoseCells(PoseCells):
    """Boxes for an arm of Universal Robots' form."""

    form: URClosedForm

    @classmethod
    def of(cls, form: URClosedForm) -> URPoseCells:
        """Boxes for a closed form."""
        T = form.drawing.T_form_base
        point = (form.drawing.T_flange_form @ [0.0, 0.0, -form.d6, 1.0])[:3]
        return cls(point, T[2, :3], -T[:3, :3].T @ T[:3, 3], form)

    def boxes(self, T: Array, h: Array, across: Array, above: Array) -> tuple[Array, Array, Mask]:
        """See `PoseCells`."""
        rows = np.repeat(np.arange(len(T)), BRANCHES)
        spread = (each[rows] + ROUNDING for each in (h, across, above))
        cells = URCells(self.form, self.form.drawing.pose(T)[rows], *spread)
        centre, half, held = cells.boxes(*np.tile(SIGNS, (len(T), 1)).T)
        return _by_cell(self.form.drawing.file(centre), half, held)


@dataclass(frozen=True, eq=False)
class SphericalWristCells(PoseCells):
    """Boxes for an arm with an ortho-parallel base and a spherical wrist.

    Attributes:
        chain: the arm.
        wrist: its geometry.
        sense: 1 if the first joint turns about `up`, -1 if about the opposite.
    """

    chain: Chain
    wrist: SphericalWrist
    sense: float

    @classmethod
    def of(cls, model: pin.Model) -> SphericalWristCells | None:
        """Boxes for an arm; None if it is not exactly of this form."""
        chain = Chain.of(model)
        axes = JointAxes.of(chain)
        wrist, z = SphericalWrist.of(axes), axes.directions
        if wrist is None:
            return None
        off = [abs(z[i] @ z[j]) for i, j in ((0, 1), (3, 4), (4, 5))]
        off += [np.linalg.norm(np.cross(z[1], z[2])), meeting_point(z[3:], axes.points[3:])[1]]
        if max(off) > EXACT or min(wrist.upper[0], wrist.fore[0]) < EXACT:
            return None
        sense = float(np.sign(z[0] @ wrist.up))
        return cls(wrist.wrist, wrist.up, wrist.origin, chain, wrist, sense)

    def boxes(self, T: Array, h: Array, across: Array, above: Array) -> tuple[Array, Array, Mask]:
        """See `PoseCells`."""
        rows = np.repeat(np.arange(len(T)), BRANCHES)
        T, h, across, above = T[rows], h[rows], across[rows] + ROUNDING, above[rows] + ROUNDING
        shoulder, bend, elbow = np.tile(SIGNS, (len(rows) // BRANCHES, 1)).T
        wrist, links = self.wrist, self._links(T, across, above, shoulder, elbow)
        first, arm, held = links
        q = np.zeros((len(T), 6))
        q[:, 0] = self.sense * first.at
        q[:, 1] = wrist.turns[0] * (arm.first.at - wrist.upper[1])
        q[:, 2] = wrist.turns[1] * (arm.bent.at - wrist.fore[1] + wrist.upper[1])
        e = np.minimum(first.off + arm.second.off + h + ROUNDING, np.pi)
        fourth = self._frames(q)[:, 4, :3, 2]
        sixth = T[:, :3, :3] @ wrist.last_axis
        across_both = np.cross(fourth, sixth)
        gamma = np.arctan2(np.linalg.norm(across_both, axis=1), (fourth * sixth).sum(axis=1))
        q[:, 4] = bend * gamma - wrist.bend
        bent = np.cross(fourth, self._frames(q)[:, 6, :3, 2])
        q[:, 3] = np.arctan2(
            (np.cross(bent, across_both) * fourth).sum(axis=1), (bent * across_both).sum(axis=1)
        )
        reached = (self._frames(q)[:, 6] @ self.chain.T_last_flange)[:, :3, :3]
        turn = reached.transpose(0, 2, 1) @ T[:, :3, :3]
        skew = turn - turn.transpose(0, 2, 1)
        about = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1) @ wrist.last_axis
        q[:, 5] = np.arctan2(about, np.trace(turn, axis1=1, axis2=2) - 1)
        seen = seen_from_pole(e, gamma)
        fifth = Interval.between(
            *(bend * np.clip(each, 0.0, np.pi) for each in (gamma - e, gamma + e))
        )
        centre, half = boxed(
            (
                Interval(q[:, 0], first.off),
                Interval(q[:, 1], arm.first.off),
                Interval(q[:, 2], arm.bent.off),
                Interval(q[:, 3], seen),
                Interval(fifth.at - wrist.bend, fifth.off),
                Interval(q[:, 5], seen),
            )
        )
        return _by_cell(centre, half, held)

    def _links(
        self, T: Array, across: Array, above: Array, shoulder: Array, elbow: Array
    ) -> tuple[Interval, PlanarArm, Mask]:
        """Turn of the arm's plane about `up`, the links within it, and a mask of the cells within
        reach.
        """
        wrist, offset = self.wrist, self.wrist.offset
        away = T[:, :3, :3] @ self.point + T[:, :3, 3] - self.origin
        ahead_of, beside = away @ wrist.forward, away @ np.cross(self.up, wrist.forward)
        rho = np.hypot(ahead_of, beside)
        low = np.maximum(rho - across, abs(offset))
        high = np.maximum(rho + across, abs(offset))
        aside = Interval.between(
            *(np.arcsin(np.clip(offset / np.maximum(r, ROUNDING), -1, 1)) for r in (low, high))
        )
        first = Interval(
            np.arctan2(beside, ahead_of) + np.where(shoulder > 0, aside.at, np.pi - aside.at),
            np.minimum(aside.off + azimuth_off(across, rho), np.pi),
        )
        ahead = Interval.between(
            *(shoulder * np.sqrt(np.maximum(r**2 - offset**2, 0.0)) for r in (low, high))
        )
        place = np.stack([ahead.at, away @ self.up], axis=1) - wrist.shoulder
        lengths = wrist.upper[0], wrist.fore[0]
        arm = PlanarArm.reaching(place, np.hypot(ahead.off, above), lengths, elbow)
        return first, arm, arm.held & (rho + across >= abs(offset))

    def _frames(self, q: Array) -> Array:
        return link_frames(self.chain.placements, q)


def _by_cell(centre: Array, half: Array, held: Mask) -> tuple[Array, Array, Mask]:
    shape = -1, BRANCHES, centre.shape[1]
    return centre.reshape(shape), half.reshape(shape), held.reshape(shape[:2])
