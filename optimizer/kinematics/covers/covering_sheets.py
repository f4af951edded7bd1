"""Boxes around every configuration of a pose, of an arm that is nearly of the form
`SphericalShoulder`.

At q, the flange of the arm and that of the simplest arm nearby (`nearby_arm`) are turned alike, and
differ by little in position. So every configuration of a pose is, for the arm nearby, one of a pose
within this deviation: it is on one of the eight sheets, in their boxes with this `blur`. No curve
is found by this, but none is missed either: a bound over the boxes covers what tracing overlooks.

**Deviation.** Let joint k turn by R_k about an axis through p_k, and that of the arm nearby about
  one through p_k +
δ_k. Then a point comes to places (1 - R_k) δ_k from each other, and the joints before move this
difference rigidly. So
the flanges are apart by

    Σ_k R_1 … R_{k-1} (1 - R_k) δ_k = δ_1 + Σ_{k≥2} R_1 … R_{k-1} (δ_k - δ_{k-1}) - R_1 … R_n δ_n.

The first term is a shift of the base, the last one of the flange: the pose of the arm nearby is
shifted by both. What is left is at most Σ |δ_k - δ_{k-1}|. An axis may be shifted along itself: δ_k
is the nearest to δ_{k-1}. And all joints beyond the shoulder are shifted together with the third,
so that their δ_k are the same.
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

# parts that a turn of the last angle is cut into, then parts of those in which a sheet may end, and
# so on
PARTS = (64, 4, 4, 4)
# joints of the shoulder
SHOULDER = 3
# directions of axes are the same but for this, and so is a position [m]
SAME, ROUNDING = 1e-12, 1e-9


@dataclass(frozen=True, eq=False)
class CoveringSheet:
    """Boxes of the configurations on one sheet of the arm nearby; the parameter is the angle [rad]
    of its last joint.

    `arcs` are the intervals of the parameter with configurations, or more; `blur` [m] is the
    deviation of the arm nearby. `mirrored`: see `NearbyArm`.
    """

    pose: RedundantPose
    sheet: Array
    blur: float
    mirrored: bool
    arcs: list[tuple[float, float]]


def boxes_on(
    sheets: Sequence[CoveringSheet], rows: NDArray[np.intp], parameter: Array, half: Array
) -> tuple[Array, Array]:
    """Middles and half sides (n, 7) [rad] around all configurations within `half` (n,) of
    parameters (n,), each on the sheet of one pose whose row (n,) is given."""
    one = sheets[0]
    found = _boxes(
        one.pose, np.array([each.sheet for each in sheets])[rows], parameter, half, one.blur
    )
    if one.mirrored:
        # from the flange on, the joints come in the other order and turn the other way
        return -found.centre[:, ::-1], found.half[:, ::-1]
    return found.centre, found.half


def covering_sheets(robot: Robot, T: Array) -> list[CoveringSheet] | None:
    """Sheets that hold all configurations with the flange at T (4, 4); None of an arm that is near
    none of the form.
    """
    near = _near(robot)
    if near is None:
        return None
    T = np.array(np.linalg.inv(T) if near.mirrored else T)
    T[:3, 3] += near.at_base + T[:3, :3] @ near.at_flange
    pose = RedundantPose(near.form, T)
    signs = np.array(list(product((1.0, -1.0), repeat=3)))
    arcs = _arcs(pose, signs, near.deviation)
    return [
        CoveringSheet(pose, sheet, near.deviation, near.mirrored, own)
        for sheet, own in zip(signs, arcs, strict=True)
        if own
    ]


@dataclass(frozen=True, eq=False)
class _Near:
    """The form of an arm nearby, `mirrored` as of `NearbyArm`. Its flange at q is that of the arm,
    shifted by `at_base` (3,) [m] in the base frame and by `at_flange` (3,) [m] in its own, but for
    `deviation` [m]."""

    form: SphericalShoulder
    mirrored: bool
    at_base: Array
    at_flange: Array
    deviation: float


@lru_cache(MOST_ROBOTS)
def _near(robot: Robot) -> _Near | None:
    if robot.model.nq != 7:
        return None
    chain = Chain.of(robot.model)
    nearby = NearbyArm.of(chain)
    if nearby is None:
        return None
    axes = JointAxes.of(chain.mirrored() if nearby.mirrored else chain)
    directions = nearby.axes.directions
    if np.abs(directions - axes.directions).max() > SAME:
        return None
    shifts = _across(nearby.axes.points - axes.points, directions)
    shifts[SHOULDER:] += shifts[SHOULDER - 1]
    form = SphericalShoulder.of_chain(
        JointAxes(directions, axes.points + shifts, axes.T_zero).chain()
    )
    if form is None:
        return None
    for k in range(1, len(shifts)):
        shifts[k] += ((shifts[k - 1] - shifts[k]) @ directions[k]) * directions[k]
    deviation = float(np.linalg.norm(np.diff(shifts, axis=0), axis=1).sum()) + ROUNDING
    return _Near(form, nearby.mirrored, shifts[0], -axes.T_zero[:3, :3].T @ shifts[-1], deviation)


def _across(v: Array, directions: Array) -> Array:
    """Vectors (n, 3), less what is along directions (n, 3)."""
    return np.asarray(v - (v * directions).sum(axis=1)[:, None] * directions)


def _boxes(
    pose: RedundantPose, sheets: Array, parameter: Array, half: Array, blur: float
) -> HeldBoxes:
    return held_boxes(
        pose, Cells(np.asarray(parameter - half), np.asarray(parameter + half), sheets), blur
    )


def _arcs(pose: RedundantPose, signs: Array, blur: float) -> list[list[tuple[float, float]]]:
    """The intervals of the last angle in which each of the sheets (m, 3) may have
    configurations."""
    sheet = np.arange(len(signs))
    low, high = np.full(len(signs), -np.pi), np.full(len(signs), np.pi)
    kept = list[Array]()
    for count in PARTS:
        ends = low[:, None] + ((high - low) / count)[:, None] * np.arange(count + 1)
        ends[:, -1] = high
        sheet, low, high = np.repeat(sheet, count), ends[:, :-1].ravel(), ends[:, 1:].ravel()
        found = _boxes(pose, signs[sheet], (low + high) / 2, (high - low) / 2, blur)
        inside, open_ = found.held & found.inside, found.held & ~found.inside
        kept.append(np.array([sheet[inside], low[inside], high[inside]]))
        sheet, low, high = sheet[open_], low[open_], high[open_]
    kept.append(np.array([sheet, low, high]))
    return _joined(np.concatenate(kept, axis=1), len(signs))


def _joined(parts: Array, count: int) -> list[list[tuple[float, float]]]:
    """The arcs of each of so many curves that parts (3, n) make up: index of a curve, lower and
    upper end.
    """
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
