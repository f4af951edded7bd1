"""Boxes of joint positions that hold every configuration of a sheet of `RedundantPose` over an
interval of q7.

All bounds are of one kind: a vector that is moved by at most m from its place at a radius r about
an axis has its azimuth changed by at most asin(m / r), or by anything once m reaches r. In order:

- |v|² and v_z are waves over q7, with exact ranges. |v|² gives the range of cos θ and so of θ,
  exactly; θ that of c(θ).
- ψ: the range of its cosine from those of c, v_z and r. v moves by at most its radius about the
  last axis times the
  half interval; this bounds its azimuth about the sixth axis, and so q6.
- q5: the azimuth of S about the fifth axis, seen from both sides. On one side, S moves by ρ times
  the half range of θ.
  On the other, S is at the angle β from the sixth axis: fifth axis, sixth axis and v make a
  spherical triangle with the
  angle ψ at the sixth axis and β at the fifth, so that (v_z - e c) = s sqrt(1 - e²) cos β, with s
  the distance of S
  from the fifth axis, s² = |v|² - c².
- The orientation of link 3 is turned by at most H, the sum of the half ranges of q4 … q7. So is the
  third axis, seen
  from the first, and the first, seen from the third: this bounds q2, q1 and q3. Where the third
  axis is within H of
  the first, q1 and q3 may be anything: a box on a singularity holds the configurations that turn
  freely there, too.

Blurred boxes hold the configurations of every pose of the same orientation that is no farther from
the given one than `blur`. S, seen from the last link, and with it v may then be off by that: so may
|v| and v_z, and v moves by more.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose, angle_waves
from joulepath.optimizer.kinematics.seven.spinors import Complex

# what cosines [1] and half sides [rad] are widened by, for rounding; the former is a root's
COSINE, ROUNDING = 1e-14, 1e-9
# a range is kept as its least value, negative, and its greatest: what bounds one from above does so
# with the other
_SIGNS = np.array([[-1.0], [1.0]])
# a squared radius [m²] and a radius [m] that divide nothing by zero
_NO_SQUARE, _NO_RADIUS = 1e-300, 1e-150


@dataclass(frozen=True, eq=False)
class Cells:
    """Intervals `low` … `high` (n,) [rad] of q7 on sheets (n, 3)."""

    low: Array
    high: Array
    sheet: Array


@dataclass(frozen=True, eq=False)
class HeldBoxes:
    """Middles and half sides (n, 7) [rad] of boxes around the configurations of cells, which (n,)
    may hold any, and of which (n,) both cosines are between -1 and 1 throughout."""

    centre: Array
    half: Array
    held: Mask
    inside: Mask


def boxes_of(pose: RedundantPose, cells: Cells) -> tuple[Array, Array]:
    """Middles and half sides (n, 7) [rad] of boxes around the configurations of cells, which are in
    the intervals of their sheets."""
    centre, half, _ = _boxes(pose, cells, 0.0)
    return centre.T, half.T


def held_boxes(pose: RedundantPose, cells: Cells, blur: float = 0.0) -> HeldBoxes:
    """The boxes around the configurations that cells, anywhere on the circle, have of all poses
    within `blur` [m].
    """
    centre, half, cosines = _boxes(pose, cells, blur)
    held = cosines.min(axis=0) >= -1
    return HeldBoxes(
        centre.T, half.T, np.asarray(held), np.asarray(held & (cosines.max(axis=0) <= 1))
    )


def _boxes(pose: RedundantPose, cells: Cells, blur: float) -> tuple[Array, Array, Array]:
    """Middles and half sides (7, n) [rad] of the boxes of `held_boxes`, and the ranges (4, n) of
    the cosines of θ and ψ."""
    form, (side, elbow, wrist), n = pose.form, cells.sheet.T, len(cells.low)
    middle, half = (cells.low + cells.high) / 2, np.minimum((cells.high - cells.low) / 2, np.pi)
    c, s = np.cos(half / 2), np.sin(half / 2)
    chord = 2 * s
    moved = hypot(*pose.shoulder[:2].tolist()) * chord + blur
    seventh = angle_waves(np.cos(middle), np.sin(middle))
    ranges, v = _wave_ranges(pose.range_waves, seventh, 1 - chord * s, chord * c)
    if blur:
        length = np.sqrt(np.maximum(ranges[0] * _SIGNS, 0.0))
        ranges[0] = _SIGNS * np.maximum(length + blur * _SIGNS, 0.0) ** 2
        ranges[1] += blur
    distance, along = ranges[0], np.empty((2, 2, n))
    cos_elbow = (distance[::-1] + form.squares * _SIGNS) / (2 * form.rho * form.nu) + COSINE
    theta, theta_half = _angles(cos_elbow)
    theta *= elbow
    fourth = angle_waves(np.cos(theta), np.sin(theta))
    (along[0],), S = _wave_ranges(form.range_waves, fourth, np.cos(theta_half), np.sin(theta_half))
    along[1] = ranges[1]
    cos_wrist = _wrist_cosines(form.fifth_in_6[2], form.inclined, along, distance)
    wrist_angle, wrist_half = _angles(cos_wrist)
    wrist_angle *= wrist
    across = np.concatenate([v, S]).reshape(2, 2, n)
    azimuth = np.arctan2(across[:, 1], across[:, 0])
    last = np.empty((4, n))
    last[0], last[3] = form.q4_at_zero - theta, middle
    last[1], last[2] = (
        azimuth[1] + wrist_angle[1] - form.sixth_azimuth,
        wrist_angle[0] - azimuth[0] + form.fifth_azimuth,
    )
    centre = pose.completed(last, _backwards(last, fourth, form.q4_at_zero, seventh), side)
    sides, moves = np.empty((7, n)), np.empty((2, n))
    moves[0], moves[1] = moved, form.rho * theta_half
    sides[3], sides[6] = theta_half, half
    np.add(_turned(moves, np.hypot(across[:, 0], across[:, 1])), wrist_half, out=sides[5:3:-1])
    sides[3:] += ROUNDING
    np.minimum(sides[3:], np.pi, out=sides[3:])
    with_shoulder(pose, centre, sides)
    return centre, sides, np.concatenate([cos_elbow, cos_wrist[0]])


def with_shoulder(pose: RedundantPose, centre: Array, sides: Array) -> None:
    """Sets the half sides of the first three joints, which those of the others bound; all (7, n)
    [rad].
    """
    turn = np.add.reduce(sides[3:], axis=0)
    lean = np.abs(np.sin(pose.form.lean(centre[1])))
    # once the sine of the turn is 1, the first and the third joint may have any angle
    around = _turned(np.sin(np.minimum(turn, np.pi / 2)), lean) + ROUNDING
    sides[0], sides[1], sides[2] = around, turn, around
    np.minimum(sides[:3], np.pi, out=sides[:3])


def _backwards(last: Array, fourth: Array, at_zero: float, seventh: Array) -> Complex:
    """e^{-iq} (4, n) of the last four joints (4, n), with `angle_waves` of `at_zero` less the
    fourth, and of the seventh."""
    found = np.empty(last.shape, dtype=complex)
    real, imag = found.real, found.imag
    real[1:3], imag[1:3] = np.cos(last[1:3]), -np.sin(last[1:3])
    real[3], imag[3] = seventh[1], -seventh[2]
    real[0], imag[0] = fourth[1], fourth[2]
    found[0] *= complex(cos(at_zero), -sin(at_zero))
    return found


def _wave_ranges(
    parts: tuple[Array, Array, Array], turns: Array, cos: Array, sin: Array
) -> tuple[Array, Array]:
    """Ranges (m, 2, n) of the waves of `parts`, as `wave_ranges` has them, with the angle off that
    of `angle_waves` (3, n) by at most one of these cosines and sines (n,), up to π; widened for
    rounding. And the other waves there."""
    mean, size, waves = parts
    m, now = len(mean), waves @ turns
    ends = now[: 2 * m].reshape(m, 2, -1)
    top = ends * cos
    top += (np.abs(now[2 * m : 3 * m]) * sin)[:, None]
    # the greatest value is at the crest of the wave, if that is near
    np.copyto(top, size, where=ends >= size * cos)
    top += mean
    return top, now[3 * m :]


def _angles(cosine: Array) -> tuple[Array, Array]:
    """Middles and half ranges (…, n) [rad] of angles with cosines in ranges (…, 2, n)."""
    beyond = np.minimum(np.maximum(cosine, -1.0), 1.0)
    np.arccos(beyond, out=beyond)
    beyond *= 0.5
    # the first is of the negative cosine: of what is left to π
    wide, narrow = np.pi / 2 - beyond[..., 0, :], beyond[..., 1, :]
    return wide + narrow, wide - narrow


def _wrist_cosines(cosine: float, sine: float, x: Array, distance: Array) -> Array:
    """Ranges (2, 2, n) of (x - e y) / (r sine), with e the given cosine and r the root of |v|² -
    y², by those of c and v_z as x and as y, and those (2, n) of |v|²; widened for rounding. First
    that of the cosine of ψ, then of β."""
    y, radius = x[::-1], np.empty(x.shape)
    largest, smallest = np.maximum(y[:, 0], y[:, 1]), np.maximum(-np.minimum(y[:, 0], y[:, 1]), 0.0)
    near, far = radius[0], radius[1]
    np.add(distance[0], largest * largest, out=near)
    np.negative(near, out=near)
    np.subtract(distance[1], smallest * smallest, out=far)
    np.maximum(radius, _NO_SQUARE, out=radius)
    np.sqrt(radius, out=radius)
    most = abs(cosine) * (y[:, ::-1] if cosine > 0 else y)
    most += x
    most /= sine * np.where(most > 0, near[:, None], far[:, None])
    most += COSINE
    return np.asarray(most)


def _turned(moved: Array, radius: Array) -> Array:
    """Half range (n,) [rad] of the azimuth of what is moved by at most `moved` (n,) from `radius`
    (n,).
    """
    return np.where(
        moved < radius, np.arcsin(np.minimum(moved / np.maximum(radius, _NO_RADIUS), 1.0)), np.pi
    )
