"""Boxes of joint positions that hold every configuration of a sheet of `RedundantPose` over an interval of q7.

All bounds are of one kind: a vector that is moved by at most m from its place at a radius r about an axis has its
azimuth changed by at most asin(m / r), or by anything once m reaches r. In order:

- |v|² and v_z are waves over q7, with exact ranges. |v|² gives the range of cos θ and so of θ, exactly; θ that of c(θ).
- ψ: the range of its cosine from those of c, v_z and r. v moves by at most its radius about the last axis times the
  half interval; this bounds its azimuth about the sixth axis, and so q6.
- q5: the azimuth of S about the fifth axis seen from both sides; S moves by ρ times the half range of θ on one side,
  and by that of v and r times the half range of q6 on the other.
- The orientation of link 3 is turned by at most H, the sum of the half ranges of q4 … q7. So is the third axis, seen
  from the first, and the first, seen from the third: this bounds q2, q1 and q3. Where the third axis is within H of
  the first, q1 and q3 may be anything: a box on a singularity holds the configurations that turn freely there, too.

Blurred boxes hold the configurations of every pose of the same orientation that is no farther from the given one than
`blur`. S, seen from the last link, and with it v may then be off by that: so may |v| and v_z, and v moves by more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.robot import Array, Mask
from optimizer.kinematics.redundant_pose import RedundantPose, to_cosine

# what cosines [1] and half sides [rad] are widened by, for rounding; the former is a root's
COSINE, ROUNDING = 1e-14, 1e-9


@dataclass(frozen=True, eq=False)
class Cells:
    """Intervals `low` … `high` (n,) [rad] of q7 on sheets (n, 3)."""

    low: Array
    high: Array
    sheet: Array


@dataclass(frozen=True, eq=False)
class HeldBoxes:
    """Middles and half sides (n, 7) [rad] of boxes around the configurations of cells, which (n,) may hold any, and of
    which (n,) both cosines are between -1 and 1 throughout."""

    centre: Array
    half: Array
    held: Mask
    inside: Mask


def boxes_of(pose: RedundantPose, cells: Cells) -> tuple[Array, Array]:
    """Middles and half sides (n, 7) [rad] of boxes around the configurations of cells, which are in the intervals of
    their sheets."""
    found = held_boxes(pose, cells)
    return found.centre, found.half


def held_boxes(pose: RedundantPose, cells: Cells, blur: float = 0.0) -> HeldBoxes:
    """The boxes around the configurations that cells, anywhere on the circle, have of all poses within `blur` [m]."""
    form = pose.form
    low, high, (side, elbow, wrist) = cells.low, cells.high, cells.sheet.T
    middle, half = (low + high) / 2, (high - low) / 2
    distance, v_z = np.stack(_wave_range(np.array(pose.waves).T[:, :, None], low, high), axis=1)
    if blur:
        length = np.sqrt(np.maximum(distance, 0.0))
        distance = np.array([np.maximum(length[0] - blur, 0.0), length[1] + blur]) ** 2
        v_z = v_z + np.array([[-blur], [blur]])
    cos = (form.squares - distance[::-1]) / (2 * form.rho * form.nu)
    # an angle at most this much beyond its cosine's: arccos is steepest, as a root, at 1
    theta_low, theta_high = np.arccos(to_cosine(np.array([cos[1] + COSINE, cos[0] - COSINE])))
    theta, theta_half = elbow * (theta_low + theta_high) / 2, (theta_high - theta_low) / 2
    along = _wave_range(np.array(form.along_fifth), theta - theta_half, theta + theta_half)
    radius = _radii(distance, v_z)
    cos_psi = _wrist_cosine(form.fifth_in_6[2], form.inclined, along, v_z, radius)
    wide, narrow = np.arccos(to_cosine(np.array(cos_psi)))
    psi, psi_half = (wide + narrow) / 2, (wide - narrow) / 2
    last, (v_from_6, S_from_5, seen_from_5) = pose.wrist(middle, theta, wrist * psi)
    centre = pose.completed(last, side)
    moved = 2 * np.hypot(*pose.shoulder[:2]) * np.sin(np.minimum(half, np.pi) / 2) + blur
    q6_half = psi_half + _turned(moved, v_from_6)
    far = moved + 2 * radius[1] * np.sin(np.minimum(q6_half, np.pi) / 2)
    q5_half = _turned(form.rho * theta_half, S_from_5) + _turned(far, seen_from_5)
    sides = np.zeros((len(low), 7))
    sides[:, 3], sides[:, 4], sides[:, 5], sides[:, 6] = theta_half, q5_half, q6_half, half
    sides = with_shoulder(pose, centre, np.minimum(sides + ROUNDING, np.pi))
    held = (cos[0] <= 1 + COSINE) & (cos[1] >= -1 - COSINE) & (cos_psi[0] <= 1) & (cos_psi[1] >= -1)
    inside = (np.abs(np.array([*cos, *cos_psi])) <= 1).all(axis=0)
    return HeldBoxes(centre, sides, np.asarray(held), np.asarray(inside))


def with_shoulder(pose: RedundantPose, centre: Array, sides: Array) -> Array:
    """The half sides (n, 7) [rad] with those of the first three joints, which those of the others bound."""
    turn = sides[:, 3:].sum(axis=1)
    chi = pose.form.lean(centre[:, 1])
    sides[:, 1] = np.minimum(turn, np.pi)
    sides[:, 0] = sides[:, 2] = _turned(np.sin(np.minimum(turn, np.pi / 2)), np.abs(np.sin(chi))) + ROUNDING
    sides[:, [0, 2]] = np.where(turn[:, None] < np.pi / 2, np.minimum(sides[:, [0, 2]], np.pi), np.pi)
    return sides


def _wave_range(wave: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Least and greatest of a + b cos x + c sin x over [low, high] (n,); widened for rounding.

    Of a wave (3,) they are (n,), of waves (3, m, 1) they are (m, n).
    """
    a, b, c = wave
    size, phase = np.hypot(b, c), np.arctan2(c, b)
    start, length = (low - phase) % (2 * np.pi), high - low
    ends = np.cos(start), np.cos(start + length)
    most = np.where(start + length >= 2 * np.pi, 1.0, np.maximum(*ends))
    opposite = (start <= np.pi) & (start + length >= np.pi) | (start + length >= 3 * np.pi)
    least = np.where(opposite, -1.0, np.minimum(*ends))
    return a + size * least - COSINE, a + size * most + COSINE


def _radii(distance: Array, v_z: Array) -> tuple[Array, Array]:
    """Range of r = sqrt(|v|² - v_z²) [m]."""
    largest = np.maximum(np.abs(v_z[0]), np.abs(v_z[1]))
    smallest = np.where(v_z[0] * v_z[1] <= 0, 0.0, np.minimum(np.abs(v_z[0]), np.abs(v_z[1])))
    return (
        np.sqrt(np.maximum(distance[0] - largest**2, 0.0)),
        np.sqrt(np.maximum(distance[1] - smallest**2, 0.0)),
    )


def _wrist_cosine(
    cosine: float, sine: float, along: tuple[Array, Array], v_z: Array, radius: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Range (n,) of the cosine of ψ, (c - e v_z) / (r sine) with e the given cosine; widened for rounding."""
    ends = [cosine * v_z[0], cosine * v_z[1]]
    least, most = along[0] - np.maximum(*ends), along[1] - np.minimum(*ends)
    near, far = (np.maximum(each * sine, 1e-300) for each in radius)
    low = np.where(least < 0, least / near, least / far)
    high = np.where(most > 0, most / near, most / far)
    return low - COSINE, high + COSINE


def _turned(moved: Array, radius: Array) -> Array:
    """Half range (n,) [rad] of the azimuth of what is moved by at most `moved` (n,) from `radius` (n,)."""
    return np.where(moved < radius, np.arcsin(np.minimum(moved / np.maximum(radius, 1e-300), 1.0)), np.pi)
