"""Boxes of joint positions that hold all configurations of a pose turned about an axis of the tool,
for arms of Universal Robots' form.

The turn is divided into cells of half width h [rad] about their middles. Within a cell, a direction
of the tool is within h of its direction for the middle, and a point of the tool within δ = 2 r
sin(h / 2), r its distance from the axis. The closed form (`ur_closed_form`) is evaluated with these
bounds. For two unit vectors at an angle e, one of them at the angle a from a pole, the azimuths
about the pole differ by at most asin(sin e / sin a), as a cap of radius e is seen from the pole;
with e ≥ a, or e ≥ π - a, they may differ by any angle. In the plane the same holds with lengths:
asin(δ / ρ).

- The last axis' origin is at the distance ρ from the first axis, with ρ within δ: q1 = φ +
  asin(d4 / ρ), or φ + π - asin(d4 / ρ), with φ its azimuth. asin is monotone. So q1 is within r1 of
  its middle.
- The second axis n turns by r1. So the angle between n and the last axis z, which is abs(q5), is
  within e = r1 + h. q6 is the azimuth of n about z, and ψ = q2 + q3 + q4 the azimuth of z about n,
  from the arm's plane: both are within asin(sin e / sin a).
- The fourth axis is at (ahead - a1, height) - d5 (sin ψ, -cos ψ) in the arm's plane, with
  ahead = ±sqrt(ρ² - d4²), and ψ counted from the tilt of `URGeometry`: within r4 of its position
  for the middles, from the bounds of ahead, height and ψ. If ψ is unbounded, the fourth axis is on
  the whole circle.
- D is the distance of the fourth axis from the second: cos q3 = (D² - a2² - a3²) / (2 a2 a3), which
  is monotone in D. With q2 = η - β(q3), η the azimuth of the fourth axis:
  dβ / dq3 = 1 / 2 + (a3² - a2²) / (2 D²), with its extrema at the ends of the interval of D. So q2
  changes by no more than η plus this rate times q3, and q4 = ψ - η + β - q3 likewise, with the rate
  1 - dβ / dq3.

An interval of ρ or D that leaves the reach is clipped; if it lies outside, the cell has no
configuration on this branch. So branches that begin or end within a cell are in its boxes, and so
are singular configurations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.orientation_tolerance import sample_orientations
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose

ROUNDING = 2e-7
"""Margin of intervals for rounding, as of an arc cosine near one [rad, m]."""

BRANCHES = 8
"""Largest number of configurations of an arm at one angle of the turn."""


@dataclass(frozen=True)
class Interval:
    """Intervals with middles `at` and half widths `off` (k,)."""

    at: Array
    off: Array

    @staticmethod
    def between(a: Array, b: Array) -> Interval:
        """Intervals between two values (k,), in either order."""
        return Interval((a + b) / 2, np.abs(b - a) / 2)


@dataclass(frozen=True)
class _Wrist:
    """Bounds of the wrist in each cell (k,).

    `held` marks the cells that may hold a configuration. `place` (k, 2) [m] is the fourth axis in
    the arm's plane, within `off` (k,) [m], and `heading` is q2 + q3 + q4.
    """

    held: Mask
    q1: Interval
    q5: Interval
    q6: Interval
    place: Array
    off: Array
    heading: Interval


@dataclass(frozen=True)
class TurnedPose:
    """Configurations of a pose with a free rotation about its axis, over the angle [rad] of this
    rotation from the orientation R (3, 3).
    """

    form: URClosedForm
    arm: Arm
    pose: ConeOrientedPose
    R: Array

    @classmethod
    def of(cls, arm: Arm, pose: ConeOrientedPose, given: Pose | None = None) -> TurnedPose | None:
        """Turned pose, with the angle measured from a `given` pose, or from an arbitrary one.

        None for an arm of another form, or with joints that follow others, or a pose with more
        freedom.
        """
        form = URClosedForm.of(arm.robot.model)
        if form is None or arm.robot.coupling.follows or pose.half_angle > 0:
            return None
        return cls(
            form, arm, pose, sample_orientations(pose, 1)[0] if given is None else given.T[:3, :3]
        )

    def boxes(
        self, angle: Array, h: Array, branch: npt.NDArray[np.intp]
    ) -> tuple[Array, Array, Mask]:
        """Boxes that hold, up to full turns, all configurations of branches near given angles.

        Args:
            angle: middles of the cells, shape (k,) [rad].
            h: half widths of the cells, shape (k,) [rad].
            branch: index of the branch, below BRANCHES, shape (k,).

        Returns:
            Middles and half sides (k, 6) [rad], and a mask (k,) of the boxes that may hold
            configurations.
        """
        T = np.tile(np.eye(4), (len(angle), 1, 1))
        T[:, :3, :3] = self.R @ Rotation.from_rotvec(angle[:, None] * self.pose.axis).as_matrix()
        T[:, :3, 3] = self.pose.position
        signs = np.array(list(product((1.0, -1.0), repeat=3)))[branch]
        drawing = self.form.drawing
        flange = drawing.pose(flange_pose(T, self.arm.T_flange_tcp))
        R, shift = drawing.T_form_base[:3, :3], drawing.T_form_base[:3, 3]
        position, direction = R @ self.pose.position + shift, R @ self.pose.direction
        h = h + ROUNDING
        # The last axis' origin moves on a circle about the tool's axis.
        beside = flange[:, :3, 3] - self.form.d6 * flange[:, :3, 2] - position
        radius = np.linalg.norm(np.cross(beside, direction), axis=1)
        moved = 2 * np.sin(h / 2) * radius + ROUNDING
        centre, half, held = URCells(self.form, flange, h, moved, moved).boxes(*signs.T)
        return drawing.file(centre), half, held


@dataclass(frozen=True)
class URCells:
    """Cells of flange poses, whose middles are T (k, 4, 4) of the table.

    Within a cell, a direction of the tool is within `h` (k,) [rad] of its direction for the middle,
    and the last axis' origin within `across` (k,) [m] across the first axis, and `above` (k,) [m]
    along it.
    """

    form: URClosedForm
    T: Array
    h: Array
    across: Array
    above: Array

    def boxes(self, shoulder: Array, wrist: Array, elbow: Array) -> tuple[Array, Array, Mask]:
        """Boxes (k, 6) of the cells on branches given by their signs (k,), and a mask (k,) of the
        possible ones.
        """
        at = self._wrist(shoulder, wrist)
        links = PlanarArm.reaching(at.place, at.off, (self.form.a2, self.form.a3), elbow)
        q4 = Interval(at.heading.at - links.second.at, at.heading.off + links.second.off)
        centre, half = boxed((at.q1, links.first, links.bent, q4, at.q5, at.q6))
        return centre, half, at.held & links.held

    def _wrist(self, shoulder: Array, wrist: Array) -> _Wrist:
        form, T, h, moved = self.form, self.T, self.h, self.across
        x_axis, y_axis, z_axis = (T[:, :3, k] for k in range(3))
        centre = T[:, :3, 3] - form.d6 * z_axis
        rho = np.hypot(centre[:, 0], centre[:, 1])
        low, high = np.maximum(rho - moved, abs(form.d4)), rho + moved
        held = high >= abs(form.d4)
        high = np.maximum(high, abs(form.d4))
        with np.errstate(divide="ignore", invalid="ignore"):
            aside = Interval.between(
                *(np.arcsin(np.clip(form.d4 / each, -1.0, 1.0)) for each in (low, high))
            )
        towards = np.arctan2(centre[:, 1], centre[:, 0])
        q1_at = towards + np.where(shoulder > 0, aside.at, np.pi - aside.at)
        q1 = Interval(q1_at, np.minimum(aside.off + azimuth_off(moved, rho), np.pi))
        ahead = Interval.between(
            *(shoulder * np.sqrt(np.maximum(each**2 - form.d4**2, 0.0)) for each in (low, high))
        )
        c1, s1, zero = np.cos(q1.at), np.sin(q1.at), np.zeros_like(q1.at)
        n, outward = np.stack([s1, -c1, zero], axis=1), np.stack([c1, s1, zero], axis=1)
        u, v, w = ((each * n).sum(axis=1) for each in (x_axis, y_axis, z_axis))
        angle, off = np.arctan2(np.hypot(u, v), w), q1.off + h
        q5 = Interval.between(
            *(wrist * np.clip(each, 0.0, np.pi) for each in (angle - off, angle + off))
        )
        seen = seen_from_pole(off, angle)
        q6 = Interval(np.arctan2(-wrist * v, wrist * u), seen)
        fifth = -(np.sin(q6.at)[:, None] * x_axis + np.cos(q6.at)[:, None] * y_axis)
        along, above = form.tilted((fifth * outward).sum(axis=1), fifth[:, 2])
        heading = Interval(np.arctan2(along, -above), seen)
        anywhere = seen >= np.pi
        arm = np.where(anywhere, 0.0, form.d5)[:, None]
        level = np.stack([ahead.at - form.a1, centre[:, 2] - form.d1], axis=1)
        place = level - arm * np.stack([np.sin(heading.at), -np.cos(heading.at)], axis=1)
        swung = np.where(anywhere, abs(form.d5), 2 * abs(form.d5) * np.sin(seen / 2))
        return _Wrist(held, q1, q5, q6, place, np.hypot(ahead.off, self.above) + swung, heading)


@dataclass(frozen=True)
class PlanarArm:
    """Angles of two links of an arm in its plane, in each cell (k,).

    Attributes:
        held: mask of the cells within reach.
        first: angle of the first link.
        bent: angle from the first link to the second.
        second: angle of the second link, which changes less than the sum of both.
    """

    held: Mask
    first: Interval
    bent: Interval
    second: Interval

    @classmethod
    def reaching(
        cls, place: Array, off: Array, lengths: tuple[float, float], elbow: Array
    ) -> PlanarArm:
        """The links of given lengths [m] that end within `off` (k,) of a place (k, 2) [m]; `elbow`
        (k,) is the sign of `bent`.
        """
        a, b = lengths
        reach = abs(abs(a) - abs(b)), abs(a) + abs(b)
        distance = np.linalg.norm(place, axis=1)
        near, far = distance - off - ROUNDING, distance + off + ROUNDING
        held = (far >= reach[0]) & (near <= reach[1])
        near, far = (np.clip(each, *reach) for each in (near, far))
        cosines = [
            np.clip((each**2 - a**2 - b**2) / (2 * a * b), -1.0, 1.0) for each in (near, far)
        ]
        bent = Interval.between(*(elbow * np.arccos(each) for each in cosines))
        towards = Interval(np.arctan2(place[:, 1], place[:, 0]), azimuth_off(off, distance))
        with np.errstate(divide="ignore"):
            rates = [0.5 + (b**2 - a**2) / (2 * each**2) for each in (near, far)]
        first, second = (
            np.maximum(*np.abs([offset - each for each in rates])) for offset in (0.0, 1.0)
        )
        inner = np.arctan2(b * np.sin(bent.at), a + b * np.cos(bent.at))
        return cls(
            held,
            Interval(towards.at - inner, towards.off + _times(first, bent.off)),
            bent,
            Interval(towards.at - inner + bent.at, towards.off + _times(second, bent.off)),
        )


def boxed(joints: Sequence[Interval]) -> tuple[Array, Array]:
    """Middles and half sides (k, nq) [rad] of boxes with given intervals of the joints."""
    centre = np.stack([each.at for each in joints], axis=1)
    half = np.stack([np.minimum(each.off + ROUNDING, np.pi) for each in joints], axis=1)
    return centre, half


def seen_from_pole(off: Array, angle: Array) -> Array:
    """Largest change (k,) [rad] of the azimuth of a unit vector at an `angle` from a pole that
    moves by `off`.
    """
    inside = off < np.minimum(angle, np.pi - angle)
    sine = np.sin(np.minimum(off, np.pi / 2)) / np.where(inside, np.sin(angle), 1.0)
    return np.where(inside, np.arcsin(np.minimum(sine, 1.0)), np.pi)


def azimuth_off(off: Array, distance: Array) -> Array:
    """Largest change (k,) [rad] of the azimuth of a point at a `distance` from an axis that moves
    by `off` [m].
    """
    inside = off < distance
    return np.where(
        inside, np.arcsin(np.where(inside, off / np.maximum(distance, ROUNDING), 1.0)), np.pi
    )


def _times(rate: Array, off: Array) -> Array:
    """Products (k,), zero for a constant, whatever its rate."""
    return np.where(
        off > 0, np.where(np.isfinite(rate), rate, np.inf) * np.maximum(off, ROUNDING), 0.0
    )
