"""Boxes of joint positions that hold every configuration of a sheet of `RedundantPose` over an interval of q7.

All bounds are of one kind: a vector that is moved by at most m from its place at a radius r about an axis has its
azimuth changed by at most asin(m / r), or by anything once m reaches r. In order:

- |v|² and v_z are waves over q7, with exact ranges. |v|² gives the range of cos θ and so of θ, exactly; θ that of c(θ).
- ψ: the range of its cosine from those of c, v_z and r. v moves by at most its radius about the last axis times the
  half interval; this bounds its azimuth about the sixth axis, and so q6.
- q5: the azimuth of S about the fifth axis, seen from both sides. On one side, S moves by ρ times the half range of θ.
  On the other, S is at the angle β from the sixth axis: fifth axis, sixth axis and v make a spherical triangle with the
  angle ψ at the sixth axis and β at the fifth, so that (v_z - e c) = s sqrt(1 - e²) cos β, with s the distance of S
  from the fifth axis, s² = |v|² - c².
- The orientation of link 3 is turned by at most H, the sum of the half ranges of q4 … q7. So is the third axis, seen
  from the first, and the first, seen from the third: this bounds q2, q1 and q3. Where the third axis is within H of
  the first, q1 and q3 may be anything: a box on a singularity holds the configurations that turn freely there, too.

Blurred boxes hold the configurations of every pose of the same orientation that is no farther from the given one than
`blur`. S, seen from the last link, and with it v may then be off by that: so may |v| and v_z, and v moves by more.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

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
    mean, size, waves = pose.range_waves
    ahead = waves @ np.array([np.ones(len(low)), np.cos(middle), np.sin(middle)])
    (distance, v_z), v = _wave_ranges(mean, size, ahead[:2], ahead[2:4], half), ahead[4:]
    if blur:
        length = np.sqrt(np.maximum(distance, 0.0))
        distance = np.array([np.maximum(length[0] - blur, 0.0), length[1] + blur]) ** 2
        v_z = v_z + np.array([[-blur], [blur]])
    cos = (form.squares - distance[::-1]) / (2 * form.rho * form.nu)
    # an angle at most this much beyond its cosine's: arccos is steepest, as a root, at 1
    theta_low, theta_high = np.arccos(to_cosine(np.array([cos[1] + COSINE, cos[0] - COSINE])))
    theta, theta_half = elbow * (theta_low + theta_high) / 2, (theta_high - theta_low) / 2
    mean, size, waves = form.range_waves
    ahead = waves @ np.array([np.ones(len(low)), np.cos(theta), np.sin(theta)])
    (along,), S = _wave_ranges(mean, size, ahead[:1], ahead[1:2], theta_half), ahead[2:]
    cos_psi = _wrist_cosine(form.fifth_in_6[2], form.inclined, along, v_z, _radii(distance, v_z))
    psi, psi_half = _angles(cos_psi)
    beta, beta_half = _angles(_wrist_cosine(form.fifth_in_6[2], form.inclined, v_z, along, _radii(distance, along)))
    v_azimuth, S_azimuth = np.arctan2(np.array([v[1], S[1]]), np.array([v[0], S[0]]))
    last = np.empty((4, len(low)))
    last[0], last[1] = form.q4_at_zero - theta, S_azimuth - form.sixth_azimuth + wrist * beta
    last[2], last[3] = wrist * psi - v_azimuth + form.fifth_azimuth, middle
    centre = pose.completed(last, side)
    moved = 2 * hypot(*pose.shoulder[:2]) * np.sin(np.minimum(half, np.pi) / 2) + blur
    turned = _turned(np.array([form.rho * theta_half, moved]), np.hypot(*np.array([[S[0], v[0]], [S[1], v[1]]])))
    sides = np.zeros((len(low), 7))
    sides[:, 3], sides[:, 4], sides[:, 5], sides[:, 6] = theta_half, beta_half + turned[0], psi_half + turned[1], half
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


def _wave_ranges(mean: Array, size: Array, ahead: Array, aside: Array, half: Array) -> Array:
    """Least and greatest (m, 2, n) of waves mean + size cos x, with mean and size (m, 1), x within `half` (n,) of where
    size cos x is `ahead` and size sin x is `aside` (m, n); widened for rounding."""
    half = np.minimum(half, np.pi)
    c, s = np.cos(half), np.sin(half)
    ends, rise, first = ahead * c, np.abs(aside) * s, size * c
    found = np.empty((len(mean), 2, len(half)))
    found[:, 0] = mean - COSINE + np.where(ahead <= -first, -size, ends - rise)
    found[:, 1] = mean + COSINE + np.where(ahead >= first, size, ends + rise)
    return found


def _angles(cosine: tuple[Array, Array]) -> tuple[Array, Array]:
    """Middles and half ranges (n,) [rad] of angles with cosines in a range, two (n,)."""
    wide, narrow = np.arccos(to_cosine(np.array(cosine)))
    return (wide + narrow) / 2, (wide - narrow) / 2


def _radii(distance: Array, along: Array) -> tuple[Array, Array]:
    """Range of sqrt(|v|² - x²) [m], the distance from an axis, by those (2, n) of |v|² and of x along the axis."""
    ends = np.abs(along)
    largest = np.maximum(ends[0], ends[1])
    smallest = np.where(along[0] * along[1] <= 0, 0.0, np.minimum(ends[0], ends[1]))
    return (
        np.sqrt(np.maximum(distance[0] - largest**2, 0.0)),
        np.sqrt(np.maximum(distance[1] - smallest**2, 0.0)),
    )


def _wrist_cosine(cosine: float, sine: float, x: Array, y: Array, radius: tuple[Array, Array]) -> tuple[Array, Array]:
    """Range (n,) of (x - e y) / (r sine), with e the given cosine, by those (2, n) of x, y and r; widened for rounding.

    With c and v_z for x and y it is that of the cosine of ψ, with v_z and c that of β.
    """
    ends = [cosine * y[0], cosine * y[1]]
    least, most = x[0] - np.maximum(*ends), x[1] - np.minimum(*ends)
    near, far = (np.maximum(each * sine, 1e-300) for each in radius)
    low = np.where(least < 0, least / near, least / far)
    high = np.where(most > 0, most / near, most / far)
    return low - COSINE, high + COSINE


def _turned(moved: Array, radius: Array) -> Array:
    """Half range (n,) [rad] of the azimuth of what is moved by at most `moved` (n,) from `radius` (n,)."""
    return np.where(moved < radius, np.arcsin(np.minimum(moved / np.maximum(radius, 1e-300), 1.0)), np.pi)
