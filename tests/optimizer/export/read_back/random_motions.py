"""Random motions from rest to rest within the limits of a robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath import Arm, Move, Program, Spline, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import DEGREE, clamped
from joulepath.optimizer.motion.spline import least_time_scale, retimed

OWN = "own_arm"


def random_spline(arm: Arm, seed: int, q_start: Array | None = None, inner: int = 4) -> Spline:
    """A motion from rest to rest as fast as the limits of speed, acceleration and jerk allow."""
    rng, limits = np.random.default_rng(seed), arm.active_limits
    lower, upper = np.maximum(limits.q_min, -2.0), np.minimum(limits.q_max, 2.0)
    low, high = np.maximum(lower, np.minimum(upper - 0.2, lower)), upper
    ends = [rng.uniform(low, high) if q_start is None else q_start, rng.uniform(low, high)]
    breaks = np.sort(np.concatenate([[0.0, 1.0], rng.uniform(0.1, 0.9, inner + 1)]))
    knots = clamped(breaks)
    n = len(knots) - DEGREE - 1
    shares = np.sort(rng.uniform(0, 1, n - 6))[:, None]
    middle = ends[0] + shares * (ends[1] - ends[0])
    spline = Spline(DEGREE, knots, np.concatenate([[ends[0]] * 3, middle, [ends[1]] * 3]))
    return retimed(spline, least_time_scale(spline, limits.rates) * 1.001)


def arm_of(robot: str) -> Arm:
    """The arm, without collision checks. OWN is an arm of six joints without a known maker."""
    if robot == OWN:
        return Arm(robot=replace(load_robot("ur5e"), name=OWN, maker=None), collisions=False)
    return Arm(robot=load_robot(robot), collisions=False)


def one_move(robot: str = "ur5e", seed: int = 0) -> Program:
    """A program of one random motion."""
    arm = arm_of(robot)
    return Program((Move(random_spline(arm, seed), arm),))
