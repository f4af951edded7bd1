"""Spline of a rest-to-rest motion with phases of constant jerk in every joint."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline


def spline_of_phases(
    ends: Array, jerk: Array, q_start: Array, q_goal: Array, closest: float
) -> Spline:
    """Motion from rest to rest with phases of constant jerk.

    Knots have multiplicity three at jumps of the jerk of any joint. Jumps closer than `closest` are
    merged, since rounding would cause jerk of its own between them; the jerk then changes slightly,
    so that the motion still ends at rest at its goal.

    Args:
        ends: ends of the phases (nq, p) [s]; the last end is the duration.
        jerk: jerk in the phases (nq, p) [rad/s³].
        q_start: start (nq,) [rad].
        q_goal: goal (nq,) [rad].
        closest: distance of merged jumps as a fraction of the duration.
    """
    duration = float(ends.max())
    breaks, ends = _joined(ends / duration, closest)
    breaks, ends = breaks * duration, ends * duration
    middle = (breaks[1:] + breaks[:-1]) / 2
    spans = np.array(
        [own[np.searchsorted(end, middle)] for end, own in zip(ends, jerk, strict=True)]
    ).T
    spans = _ending(np.diff(breaks), spans, np.abs(jerk).max(axis=1), q_goal - q_start)
    knots = (
        bspline.clamped(np.concatenate([[0.0], np.repeat(breaks[1:-1], 3), [duration]]) / duration)
        * duration
    )
    points = _control_points(knots, breaks, _states(breaks, spans, q_start), spans)
    points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = q_start, q_goal
    return Spline(bspline.DEGREE, knots, points)


def _joined(ends: Array, closest: float) -> tuple[Array, Array]:
    """Breaks (b,) in [0, 1] with close ones merged and both ends included, and the ends of the
    phases at these breaks.
    """
    every, where = np.unique(np.append(ends, [0.0, 1.0]), return_inverse=True)
    group = np.append(0, np.cumsum(np.diff(every) > closest))
    breaks = np.bincount(group, every) / np.bincount(group)
    breaks[0], breaks[-1] = 0.0, 1.0
    return breaks, breaks[group[where[: ends.size]]].reshape(ends.shape)


def _ending(
    lengths: Array,
    spans: Array,
    greatest: Array,
    step: Array,
    weight_without_jerk: float = 1e-3,
) -> Array:
    """Jerks (b - 1, nq) near `spans` for a motion from rest to rest.

    Args:
        lengths: lengths of the spans (b - 1,) [s].
        spans: jerks (b - 1, nq) [rad/s³].
        greatest: greatest jerk of every joint (nq,) [rad/s³].
        step: displacement (nq,) [rad].
        weight_without_jerk: change of the jerk in spans without jerk, relative to its change in
            spans with the greatest jerk. Those spans then change only if the others do not suffice.
    """
    remaining = lengths.sum() - np.cumsum(lengths)
    speed = lengths * (lengths / 2 + remaining)
    travel = lengths * (lengths**2 / 6 + lengths * remaining / 2 + remaining**2 / 2)
    rows = np.array([lengths, speed, travel])
    missing = np.outer([0.0, 0.0, 1.0], step) - rows @ spans
    changed = spans.copy()
    for joint, weight in enumerate((np.abs(spans) + weight_without_jerk * greatest).T):
        joint_rows = rows * weight
        scale = np.maximum(np.linalg.norm(joint_rows, axis=1), 1e-300)
        scaled = joint_rows / scale[:, None], missing[:, joint] / scale
        changed[:, joint] += weight * np.linalg.lstsq(*scaled, rcond=None)[0]
    return changed


def _states(breaks: Array, spans: Array, q_start: Array) -> tuple[Array, Array, Array]:
    """Positions, speeds and accelerations (b - 1, nq) at the beginning of every span, for jerks
    `spans` (b - 1, nq).
    """
    length = np.diff(breaks)[:, None]

    def summed(steps: Array) -> Array:
        return np.concatenate([np.zeros((1, spans.shape[1])), np.cumsum(steps, axis=0)[:-1]])

    a = summed(spans * length)
    v = summed(a * length + spans * length**2 / 2)
    q = q_start + summed(v * length + a * length**2 / 2 + spans * length**3 / 6)
    return q, v, a


def _control_points(
    knots: Array, breaks: Array, states: tuple[Array, Array, Array], spans: Array
) -> Array:
    """Control points (n, nq): blossom, at the inner knots of every control point, of the cubic in
    the widest span of its support.

    The blossom of t^m at u_1 … u_5 is the mean of all products of m of these arguments (Ramshaw
    1989).
    """
    q, v, a = states
    points = np.empty((len(knots) - bspline.DEGREE - 1, q.shape[1]))
    length = np.diff(breaks)
    for i in range(len(points)):
        first = int(np.searchsorted(breaks, knots[i], side="right")) - 1
        last = int(np.searchsorted(breaks, knots[i + bspline.DEGREE + 1], side="left"))
        k = first + int(length[first:last].argmax())
        u = knots[i + 1 : i + bspline.DEGREE + 1] - breaks[k]
        _, one, two, three, *_ = np.poly(-u)
        points[i] = q[k] + v[k] * one / 5 + a[k] * two / 20 + spans[k] * three / 60
    return points
