"""Reference of a controller: a motion on the time grid of the simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.motion.spline import Spline, sample
from joulepath.optimizer.presentation import bounds_in_words

Course = Callable[[Array], tuple[Array, Array, Array]]
"""A motion as a function of time: q [rad], v [rad/s], a [rad/s²], (k, nq) each, at times (k,)
[s]."""


@dataclass(frozen=True)
class TimeGridSettings:
    """Settings of the time grid of a simulation."""

    max_steps: int = 400_000
    """Largest number of steps of a motion; its states take some 100 MB."""
    step_tolerance: float = 1e-9
    """Last step over a step, up to which it is a rounding error [1]."""


TIME_GRID = TimeGridSettings()


@dataclass(frozen=True)
class Reference:
    """A motion on n instants.

    `v_before` is the speed half a step before each instant: a step of MuJoCo changes the speed by
    the acceleration at an instant, and the position by the new speed, so its speeds lie in the
    middle between the instants.
    """

    step: float
    q: Array
    v: Array
    a: Array
    v_before: Array


def reference(course: Course, duration: float, step: float) -> Reference:
    """Divide a motion into equal steps.

    Args:
        course: the motion.
        duration: duration > 0 of the motion [s].
        step: largest step [s].

    Raises:
        InvalidProblem: there are too many steps.
    """
    count = math.ceil(duration / step * (1 - TIME_GRID.step_tolerance))
    if count > TIME_GRID.max_steps:
        raise InvalidProblem(
            "step",
            f"The motion takes {count} steps, but at most {TIME_GRID.max_steps} are possible: "
            f"give a step of at least {bounds_in_words.least(duration / TIME_GRID.max_steps)} s.",
        )
    t = np.linspace(0.0, duration, count + 1)
    q, v, a = course(t)
    v_before = course(np.maximum(t - duration / count / 2, 0.0))[1]
    return Reference(duration / count, q, v, a, v_before)


def course_of(spline: Spline) -> Course:
    """A spline as a function of time."""
    return lambda t: sample(spline, t)
