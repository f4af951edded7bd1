"""Lengths of the table of an arm of Universal Robots' form, from its axes in any convention."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.joint_axes import JointAxes, upward
from joulepath.optimizer.kinematics.six.drawing import (
    Drawing,
    angles_without_rounding,
    without_rounding,
)

SHORTEST_LINK = 1e-6
"""Length of a link [m] below which the arm has no elbow."""

NO_LENGTH = 1e-9
"""Length [m] whose sign is due to rounding."""

RIGHT_ANGLE = 0.02
"""Cosine, or sine, up to which axes may be at right angles, or parallel; `URGeometry` compares the
table itself."""


@dataclass(frozen=True)
class TableLengths:
    """Fields of `URGeometry`; the drawing has no flange frame yet."""

    d1: float
    a1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float
    tilt: float
    drawing: Drawing


def drawn_lengths(axes: JointAxes) -> TableLengths | None:
    """Lengths of the table for the axes of an arm; None for an arm of another form.

    The senses of the axes are chosen such that the first axis points upwards and d4, d5 and d6 are
    not negative, and the zero positions such that a2 and a3 are negative.
    """
    z, p = axes.directions, axes.points
    if not _is_of_form(z):
        return None
    up, n = upward(z[0]), z[1]
    crossing = _foot(p[4], z[4], p[5], z[5])
    n = n * _sense(float(n @ (crossing - p[0])))
    forward = np.cross(up, n)
    plane = np.stack([forward, up])
    upper, fore, hand = (
        plane @ (to - at) for at, to in ((p[1], p[2]), (p[2], p[3]), (p[3], crossing))
    )
    if min(hypot(*upper), hypot(*fore)) < SHORTEST_LINK:
        return None
    d5 = float(plane @ z[4] @ hand)
    fifth = z[4] * _sense(d5)
    sixth = z[5] * _sense(float(z[5] @ (axes.T_zero[:3, 3] - crossing)))
    along, above = (plane @ fifth).tolist()
    a4 = float(np.array([-above, along]) @ hand)
    tilt = atan2(a4, abs(d5)) if abs(a4) > NO_LENGTH else 0.0
    lift = atan2(-upper[1], -upper[0])
    bend = atan2(-fore[1], -fore[0])
    zeros = [
        0.0,
        lift,
        bend - lift,
        atan2(along, -above) + tilt - bend,
        atan2(float(sixth @ np.cross(fifth, n)), float(sixth @ n)),
        0.0,
    ]
    T_base_form = np.eye(4)
    T_base_form[:3, :3] = np.stack([forward, -n, up], axis=1)
    T_base_form[:3, 3] = p[0] - (p[0] @ up) * up
    chosen = np.array([up, n, n, n, fifth, sixth])
    return TableLengths(
        d1=float(up @ p[1]),
        a1=float(forward @ (p[1] - p[0])),
        a2=-hypot(*upper),
        a3=-hypot(*fore),
        d4=float(n @ (crossing - p[0])),
        d5=hypot(d5, a4),
        d6=float(sixth @ (axes.T_zero[:3, 3] - crossing)),
        tilt=tilt,
        drawing=Drawing(
            senses=np.where((chosen * z).sum(axis=1) < 0, -1.0, 1.0),
            zeros=angles_without_rounding(np.array(zeros)),
            T_form_base=without_rounding(np.linalg.inv(T_base_form)),
            T_flange_form=np.eye(4),
        ),
    )


def _is_of_form(z: Array) -> bool:
    """Whether directions (6, 3) of axes are parallel and perpendicular as in the table."""
    right = max(abs(z[i] @ z[i + 1]) for i in (0, 3, 4))
    parallel = max(float(np.linalg.norm(np.cross(z[1], z[k]))) for k in (2, 3))
    return bool(max(right, parallel) < RIGHT_ANGLE)


def _sense(length: float) -> float:
    return -1.0 if length < -NO_LENGTH else 1.0


def _foot(p: Array, u: Array, q: Array, v: Array) -> Array:
    """Point on the line through q (3,) along v nearest to the line through p along u."""
    normal = np.cross(u, v)
    return np.asarray(q + v * float(np.cross(u, p - q) @ normal) / float(normal @ normal))
