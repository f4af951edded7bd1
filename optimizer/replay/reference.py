"""What a controller follows: a motion on the grid of the simulation's steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.motion.spline import Spline, sample

Course = Callable[[Array], tuple[Array, Array, Array]]
"""A motion as a function of time: q [rad], v [rad/s], a [rad/s²], (k, nq) each, at times (k,)
[s]."""
# most steps of a motion: its states take some 100 MB
MOST_STEPS = 400_000
# a last step shorter than this fraction of a step is rounding
ROUNDING = 1e-9


@dataclass(frozen=True)
class Reference:
    """A motion on n instants, `step` [s] apart: q [rad], v [rad/s], a [rad/s²], (n, nq) each.

    `v_before` (n, nq) is the speed half a step before each instant. A step of MuJoCo changes the
    speed by the acceleration at an instant, and the position by the new speed: its speeds lie in
    the middle between the instants.
    """

    step: float
    q: Array
    v: Array
    a: Array
    v_before: Array


def reference(course: Course, duration: float, step: float) -> Reference:
    """The motion of `duration` > 0 [s] in equal steps of at most `step` [s]. Raises InvalidProblem
    if they are many.
    """
    count = math.ceil(duration / step * (1 - ROUNDING))
    if count > MOST_STEPS:
        raise InvalidProblem(
            "step",
            f"The motion takes {count} steps, of at most {MOST_STEPS}: give a step of at least "
            f"{duration / MOST_STEPS:.3g} s.",
        )
    t = np.linspace(0.0, duration, count + 1)
    q, v, a = course(t)
    v_before = course(np.maximum(t - duration / count / 2, 0.0))[1]
    return Reference(duration / count, q, v, a, v_before)


def course_of(spline: Spline) -> Course:
    """A spline as a function of time."""
    return lambda t: sample(spline, t)
