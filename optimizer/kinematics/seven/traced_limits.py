"""Parts of the curves of one pose within position limits, all curves at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.seven.traced_curve import TracedCurve


@dataclass(frozen=True)
class TracedLimitsSettings:
    """Settings of cutting curves to limits."""

    parts: int = 8
    """Number of parts of each segment between two points of a curve."""
    margin: float = 0.05
    """Largest joint distance of a curve from its cubics [rad]."""


SETTINGS = TracedLimitsSettings()


def cut_to_limits(curves: Sequence[TracedCurve], q_min: Array, q_max: Array) -> list[TracedCurve]:
    """Curves of one pose, cut to limits up to full turns; curves wholly outside are left out.

    The arcs hold every member within the limits, and extend beyond them by some hundredths of a
    radian.

    Args:
        curves: whole curves of one pose.
        q_min: lower limits, shape (nq,) [rad].
        q_max: upper limits, shape (nq,) [rad].
    """
    joints = np.flatnonzero(q_max - q_min < 2 * np.pi)
    if not curves or not len(joints):
        return list(curves)
    middle, half = ((q_min + q_max) / 2)[joints], ((q_max - q_min) / 2)[joints]
    stack, shares = curves[0].stack, np.linspace(0.0, 1.0, SETTINGS.parts + 1)
    n = len(stack.nodes)
    q = stack.at(np.arange(n).repeat(len(shares)), np.tile(shares, n))[:, joints]
    q = q.reshape(n, len(shares), -1)
    excess = np.abs(wrapped(q - middle)) - half
    reach = np.abs(np.diff(q, axis=1)) + SETTINGS.margin
    inside: Mask = np.all(np.minimum(excess[:, 1:], excess[:, :-1]) <= reach, axis=2)
    gaps = np.diff(stack.knots, append=0.0)
    gaps[stack.last] = 0.0
    starts = stack.knots[:, None] + shares[:-1] * gaps[:, None]
    cut = list[TracedCurve]()
    for curve in curves:
        own, ends = inside[curve.part].ravel(), starts[curve.part].ravel()
        # An arc starts at a change of the mask, and ends at the next one.
        bounds = np.append(ends, ends[-1])[np.diff(own, prepend=False, append=False)].tolist()
        arcs = list(zip(bounds[::2], bounds[1::2], strict=True))
        if curve.closed and len(arcs) > 1 and own[0] and own[-1]:
            # The last arc continues beyond the start of the curve.
            arcs = [*arcs[1:-1], (arcs[-1][0], arcs[0][1] + 2 * np.pi)]
        if arcs:
            cut.append(curve.cut(arcs))
    return cut
