"""Boxes of joint positions that hold every configuration of a branch of `RedundantPose` over an
interval of q7.

All bounds use one lemma: if a vector moves by at most m from its position at a radius r about an
axis, its azimuth changes by at most asin(m / r), or by any angle if m >= r. In order:

- |v|² and v_z are sinusoids over q7, with exact ranges. The range of |v|² gives the range of cos θ
  and so of θ, exactly, and θ gives the range of c(θ).
- ψ: the range of its cosine follows from those of c, v_z and r. v moves by at most its radius about
  the last axis times the half interval; this bounds its azimuth about the sixth axis, and so q6.
- q5: the azimuth of S about the fifth axis, seen from both sides. On one side, S moves by ρ times
  the half range of θ. On the other side, S is at the angle β from the sixth axis: fifth axis, sixth
  axis and v make a spherical triangle with the angle ψ at the sixth axis and β at the fifth, so
  that (v_z - e c) = s sqrt(1 - e²) cos β, with the distance s of S from the fifth axis,
  s² = |v|² - c².
- q1 to q3: the orientation of link 3 turns by at most H, the sum of the half ranges of q4 … q7. So
  does the third axis, seen from the first, and the first, seen from the third: this bounds q2, q1
  and q3. If the third axis is within H of the first, q1 and q3 may be any angle: a box at a
  singularity also holds the configurations of the free turn there.

Blurred boxes hold the configurations of every pose with the same orientation and a position within
`blur` of the given one. S in the frame of the last link, and with it v, may then be off by `blur`;
so may |v| and v_z, and v moves by more.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.seven.redundant_pose import RedundantPose, harmonics
from joulepath.optimizer.kinematics.seven.spinors import Complex


@dataclass(frozen=True)
class BoxSettings:
    """Margins for rounding."""

    cosine: float = 1e-14
    """Margin of cosines, which holds under a square root."""
    rounding: float = 1e-9
    """Margin of half sides [rad]."""
    least_square: float = 1e-300
    """Smallest squared radius that divides [m²]."""
    least_radius: float = 1e-150
    """Smallest radius that divides [m]."""


SETTINGS = BoxSettings()

# A range is kept as its negative smallest value and its largest value, so that upper bounds apply
# to both.
_SIGNS = np.array([[-1.0], [1.0]])


@dataclass(frozen=True, eq=False)
class Cells:
    """Intervals `low` … `high` (n,) [rad] of q7 on branches with signs (n, 3)."""

    low: Array
    high: Array
    signs: Array


@dataclass(frozen=True, eq=False)
class HeldBoxes:
    """Boxes around the configurations of cells.

    `centre` and `half` (n, 7) [rad] are the middles and half sides. `held` (n,) marks the cells
    that may hold configurations, `inside` (n,) those with both cosines between -1 and 1 throughout.
    """

    centre: Array
    half: Array
    held: Mask
    inside: Mask


def boxes_of(pose: RedundantPose, cells: Cells) -> tuple[Array, Array]:
    """Centres and half sides (n, 7) [rad] of boxes around the configurations of cells within the
    intervals of their branches.
    """
    centre, half, _ = _boxes(pose, cells, 0.0)
    return centre.T, half.T


def held_boxes(pose: RedundantPose, cells: Cells, blur: float = 0.0) -> HeldBoxes:
    """Boxes around the configurations of all poses within `blur` [m], for cells anywhere on the
    circle.
    """
    centre, half, cosines = _boxes(pose, cells, blur)
    held = cosines.min(axis=0) >= -1
    return HeldBoxes(
        centre.T, half.T, np.asarray(held), np.asarray(held & (cosines.max(axis=0) <= 1))
    )


def _boxes(pose: RedundantPose, cells: Cells, blur: float) -> tuple[Array, Array, Array]:
    """Centres and half sides (7, n) [rad] of the boxes, and the ranges (4, n) of the cosines of θ
    and ψ.
    """
    form, (side, elbow, wrist), n = pose.form, cells.signs.T, len(cells.low)
    middle, half = (cells.low + cells.high) / 2, np.minimum((cells.high - cells.low) / 2, np.pi)
    c, s = np.cos(half / 2), np.sin(half / 2)
    chord = 2 * s
    moved = hypot(*pose.shoulder[:2].tolist()) * chord + blur
    seventh = harmonics(np.cos(middle), np.sin(middle))
    ranges, v = _harmonic_ranges(pose.range_harmonics, seventh, 1 - chord * s, chord * c)
    if blur:
        length = np.sqrt(np.maximum(ranges[0] * _SIGNS, 0.0))
        ranges[0] = _SIGNS * np.maximum(length + blur * _SIGNS, 0.0) ** 2
        ranges[1] += blur
    distance, along = ranges[0], np.empty((2, 2, n))
    cos_elbow = (distance[::-1] + form.squares * _SIGNS) / (
        2 * form.rho * form.nu
    ) + SETTINGS.cosine
    theta, theta_half = _angles(cos_elbow)
    theta *= elbow
    fourth = harmonics(np.cos(theta), np.sin(theta))
    (along[0],), S = _harmonic_ranges(
        form.range_harmonics, fourth, np.cos(theta_half), np.sin(theta_half)
    )
    along[1] = ranges[1]
    cos_wrist = _wrist_cosines(form.fifth_in_6[2], form.inclined, along, distance)
    wrist_angle, wrist_half = _angles(cos_wrist)
    wrist_angle *= wrist
    across = np.concatenate([v, S]).reshape(2, 2, n)
    azimuth = np.arctan2(across[:, 1], across[:, 0])
    last = np.empty((4, n))
    last[0], last[3] = form.q4_at_zero - theta, middle
    last[1] = azimuth[1] + wrist_angle[1] - form.sixth_azimuth
    last[2] = wrist_angle[0] - azimuth[0] + form.fifth_azimuth
    centre = pose.completed(last, _backwards(last, fourth, form.q4_at_zero, seventh), side)
    sides, moves = np.empty((7, n)), np.empty((2, n))
    moves[0], moves[1] = moved, form.rho * theta_half
    sides[3], sides[6] = theta_half, half
    np.add(_turned(moves, np.hypot(across[:, 0], across[:, 1])), wrist_half, out=sides[5:3:-1])
    sides[3:] += SETTINGS.rounding
    np.minimum(sides[3:], np.pi, out=sides[3:])
    with_shoulder(pose, centre, sides)
    return centre, sides, np.concatenate([cos_elbow, cos_wrist[0]])


def with_shoulder(pose: RedundantPose, centre: Array, sides: Array) -> None:
    """Sets the half sides of the first three joints, bounded by those of the other joints; in
    place, (7, n) [rad].
    """
    turn = np.add.reduce(sides[3:], axis=0)
    lean = np.abs(np.sin(pose.form.lean(centre[1])))
    # Once the sine of the turn is 1, the first and the third joint may have any angle.
    around = _turned(np.sin(np.minimum(turn, np.pi / 2)), lean) + SETTINGS.rounding
    sides[0], sides[1], sides[2] = around, turn, around
    np.minimum(sides[:3], np.pi, out=sides[:3])


def _backwards(last: Array, fourth: Array, at_zero: float, seventh: Array) -> Complex:
    """Complex numbers e^{-iq} (4, n) of the last four joints (4, n).

    `fourth` are the harmonics of `at_zero` minus the fourth angle, `seventh` those of the last
    angle.
    """
    found = np.empty(last.shape, dtype=complex)
    real, imag = found.real, found.imag
    real[1:3], imag[1:3] = np.cos(last[1:3]), -np.sin(last[1:3])
    real[3], imag[3] = seventh[1], -seventh[2]
    real[0], imag[0] = fourth[1], fourth[2]
    found[0] *= complex(cos(at_zero), -sin(at_zero))
    return found


def _harmonic_ranges(
    parts: tuple[Array, Array, Array], turns: Array, cos: Array, sin: Array
) -> tuple[Array, Array]:
    """Ranges (m, 2, n) of sinusoids near given angles, widened for rounding, and the values of the
    other sinusoids.

    Args:
        parts: `harmonic_parts` of the sinusoids.
        turns: `harmonics` (3, n) of the angles.
        cos: cosine (n,) of the largest distance from the angle, up to π.
        sin: sine (n,) of this distance.
    """
    mean, size, coefficients = parts
    m, now = len(mean), coefficients @ turns
    ends = now[: 2 * m].reshape(m, 2, -1)
    top = ends * cos
    top += (np.abs(now[2 * m : 3 * m]) * sin)[:, None]
    # The largest value is at the crest of the sinusoid, if the crest is near.
    np.copyto(top, size, where=ends >= size * cos)
    top += mean
    return top, now[3 * m :]


def _angles(cosine: Array) -> tuple[Array, Array]:
    """Middles and half ranges (…, n) [rad] of angles with cosines in ranges (…, 2, n)."""
    beyond = np.minimum(np.maximum(cosine, -1.0), 1.0)
    np.arccos(beyond, out=beyond)
    beyond *= 0.5
    # The first range is of the negative cosine: of the supplement to π.
    wide, narrow = np.pi / 2 - beyond[..., 0, :], beyond[..., 1, :]
    return wide + narrow, wide - narrow


def _wrist_cosines(cosine: float, sine: float, x: Array, distance: Array) -> Array:
    """Ranges (2, 2, n) of the cosines of ψ and of β, widened for rounding.

    Both have the form (x - e y) / (r sine), with the given cosine e and r = √(|v|² - y²).

    Args:
        cosine: cosine e of the angle between the fifth and sixth axes.
        sine: sine of this angle.
        x: ranges (2, 2, n) [m] of c and v_z, which serve as x and y, then as y and x.
        distance: range (2, n) [m²] of |v|².
    """
    y, radius = x[::-1], np.empty(x.shape)
    largest, smallest = np.maximum(y[:, 0], y[:, 1]), np.maximum(-np.minimum(y[:, 0], y[:, 1]), 0.0)
    near, far = radius[0], radius[1]
    np.add(distance[0], largest * largest, out=near)
    np.negative(near, out=near)
    np.subtract(distance[1], smallest * smallest, out=far)
    np.maximum(radius, SETTINGS.least_square, out=radius)
    np.sqrt(radius, out=radius)
    most = abs(cosine) * (y[:, ::-1] if cosine > 0 else y)
    most += x
    most /= sine * np.where(most > 0, near[:, None], far[:, None])
    most += SETTINGS.cosine
    return np.asarray(most)


def _turned(moved: Array, radius: Array) -> Array:
    """Half range (n,) [rad] of the azimuth of a vector that moves by at most `moved` (n,) from
    `radius` (n,).
    """
    return np.where(
        moved < radius,
        np.arcsin(np.minimum(moved / np.maximum(radius, SETTINGS.least_radius), 1.0)),
        np.pi,
    )
