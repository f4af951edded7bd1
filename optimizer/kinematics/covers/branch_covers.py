"""Boxes around every configuration of a pose, for an arm that is nearly of the form
`SphericalShoulder`.

At the same q, the flange of the arm and that of the nearest simple arm (`nearby_arm`) have the same
orientation, and their positions differ by little. So every configuration of a pose is, for the
simple arm, one of a pose within this deviation: it is on one of the eight branches, in their boxes
with this `blur`. The boxes find no curve, but none is missed either: a bound over the boxes covers
what tracing overlooks.

**Deviation.** Let joint k turn by R_k about an axis through p_k, and the simple arm's joint about
one through p_k + δ_k. The images of a point then differ by (1 - R_k) δ_k, and the joints before
move this difference rigidly. So the positions of the flanges differ by

    Σ_k R_1 … R_{k-1} (1 - R_k) δ_k = δ_1 + Σ_{k≥2} R_1 … R_{k-1} (δ_k - δ_{k-1}) - R_1 … R_n δ_n.

The first term is a shift of the base, the last one of the flange: the pose of the simple arm is
shifted by both. The rest is at most Σ |δ_k - δ_{k-1}|. An axis may be shifted along itself, so δ_k
is chosen nearest to δ_{k-1}. All joints beyond the shoulder are shifted together with the third, so
that their δ_k are equal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import MOST_ROBOTS, Array, Robot
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.seven.nearby_arm import NearbyArm
from joulepath.optimizer.kinematics.seven.redundant_boxes import Cells, HeldBoxes, held_boxes
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose
from joulepath.optimizer.kinematics.seven.spherical_shoulder import SphericalShoulder


@dataclass(frozen=True)
class CoverSettings:
    """Resolution of covers, and tolerances of the simple arm."""

    parts: tuple[int, ...] = (64, 4, 4, 4)
    """Numbers of parts of a turn of the last angle, then of each part that may hold an end of a
    branch, and so on.
    """
    shoulder_joints: int = 3
    """Number of joints of the shoulder."""
    same_direction: float = 1e-12
    """Largest difference of axis directions of the two arms."""
    rounding: float = 1e-9
    """Margin of the deviation for rounding [m]."""


SETTINGS = CoverSettings()


@dataclass(frozen=True, eq=False)
class BranchCover:
    """Boxes of the configurations on one branch of the simple arm, over its last joint angle [rad]
    as parameter.

    `signs` (3,) give the branch, see `RedundantPose`. `arcs` are intervals of the parameter that
    hold all configurations. `blur` [m] is the deviation of the simple arm, and `mirrored` is as in
    `NearbyArm`.
    """

    pose: RedundantPose
    signs: Array
    blur: float
    mirrored: bool
    arcs: list[tuple[float, float]]


def boxes_on(
    covers: Sequence[BranchCover], rows: NDArray[np.intp], parameter: Array, half: Array
) -> tuple[Array, Array]:
    """Boxes around all configurations of branches near given parameters.

    Args:
        covers: covers of one pose.
        rows: cover of each box, shape (n,).
        parameter: parameters, shape (n,) [rad].
        half: half widths of the parameter intervals, shape (n,) [rad].

    Returns:
        Middles and half sides (n, 7) [rad].
    """
    one = covers[0]
    found = _boxes(
        one.pose, np.array([each.signs for each in covers])[rows], parameter, half, one.blur
    )
    if one.mirrored:
        # From the flange, the joints come in reverse order and turn the other way.
        return -found.centre[:, ::-1], found.half[:, ::-1]
    return found.centre, found.half


def branch_covers(robot: Robot, T: Array) -> list[BranchCover] | None:
    """Branch covers that hold all configurations with the flange at T (4, 4); None for an arm that
    is not nearly of this form.
    """
    near = _simple_arm(robot)
    if near is None:
        return None
    T = np.array(np.linalg.inv(T) if near.mirrored else T)
    T[:3, 3] += near.at_base + T[:3, :3] @ near.at_flange
    pose = RedundantPose(near.form, T)
    every_sign = np.array(list(product((1.0, -1.0), repeat=3)))
    arcs = _arcs(pose, every_sign, near.deviation)
    return [
        BranchCover(pose, signs, near.deviation, near.mirrored, own)
        for signs, own in zip(every_sign, arcs, strict=True)
        if own
    ]


@dataclass(frozen=True, eq=False)
class _SimpleArm:
    """Form of the simple arm, `mirrored` as in `NearbyArm`.

    At the same q, its flange is that of the arm, shifted by `at_base` (3,) [m] in the base frame
    and by `at_flange` (3,) [m] in the flange frame, up to `deviation` [m].
    """

    form: SphericalShoulder
    mirrored: bool
    at_base: Array
    at_flange: Array
    deviation: float


@lru_cache(MOST_ROBOTS)
def _simple_arm(robot: Robot) -> _SimpleArm | None:
    if robot.nq != 7 or robot.coupling.follows:
        return None
    chain = Chain.of(robot.model)
    nearby = NearbyArm.of(chain)
    if nearby is None:
        return None
    axes = JointAxes.of(chain.mirrored() if nearby.mirrored else chain)
    directions = nearby.axes.directions
    if np.abs(directions - axes.directions).max() > SETTINGS.same_direction:
        return None
    shifts = _across(nearby.axes.points - axes.points, directions)
    shifts[SETTINGS.shoulder_joints :] += shifts[SETTINGS.shoulder_joints - 1]
    form = SphericalShoulder.of_chain(
        JointAxes(directions, axes.points + shifts, axes.T_zero).chain()
    )
    if form is None:
        return None
    for k in range(1, len(shifts)):
        shifts[k] += ((shifts[k - 1] - shifts[k]) @ directions[k]) * directions[k]
    deviation = float(np.linalg.norm(np.diff(shifts, axis=0), axis=1).sum()) + SETTINGS.rounding
    return _SimpleArm(
        form, nearby.mirrored, shifts[0], -axes.T_zero[:3, :3].T @ shifts[-1], deviation
    )


def _across(v: Array, directions: Array) -> Array:
    """Components of vectors (n, 3) perpendicular to directions (n, 3)."""
    return np.asarray(v - (v * directions).sum(axis=1)[:, None] * directions)


def _boxes(
    pose: RedundantPose, signs: Array, parameter: Array, half: Array, blur: float
) -> HeldBoxes:
    return held_boxes(
        pose, Cells(np.asarray(parameter - half), np.asarray(parameter + half), signs), blur
    )


def _arcs(pose: RedundantPose, signs: Array, blur: float) -> list[list[tuple[float, float]]]:
    """Intervals of the last angle in which each of the branches with signs (m, 3) may have
    configurations.
    """
    row = np.arange(len(signs))
    low, high = np.full(len(signs), -np.pi), np.full(len(signs), np.pi)
    kept = list[Array]()
    for count in SETTINGS.parts:
        ends = low[:, None] + ((high - low) / count)[:, None] * np.arange(count + 1)
        ends[:, -1] = high
        row, low, high = np.repeat(row, count), ends[:, :-1].ravel(), ends[:, 1:].ravel()
        found = _boxes(pose, signs[row], (low + high) / 2, (high - low) / 2, blur)
        inside, open_ = found.held & found.inside, found.held & ~found.inside
        kept.append(np.array([row[inside], low[inside], high[inside]]))
        row, low, high = row[open_], low[open_], high[open_]
    kept.append(np.array([row, low, high]))
    return _joined(np.concatenate(kept, axis=1), len(signs))


def _joined(parts: Array, count: int) -> list[list[tuple[float, float]]]:
    """Arcs of `count` curves from parts (3, n): index of the curve, lower end and upper end."""
    owner, lower, upper = parts[:, np.lexsort((parts[1], parts[0]))]
    goes_on = (owner[1:] == owner[:-1]) & (lower[1:] == upper[:-1])
    starts, stops = np.append(True, ~goes_on), np.append(~goes_on, True)
    found: list[list[tuple[float, float]]] = [[] for _ in range(count)]
    if len(owner):
        for k, low, high in zip(
            owner[starts].tolist(), lower[starts].tolist(), upper[stops].tolist(), strict=True
        ):
            found[int(k)].append((low, high))
    return found
