"""Motions to export: random ones within the limits, and a round with a payload."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models.registry import load_robot
from models.robot import Array
from optimizer.exports.program import Move, Program, Rest
from optimizer.problem.arm import Arm, Payload
from optimizer.trajectories.bspline import DEGREE, clamped
from optimizer.trajectories.spline import Spline, least_time_scale, retimed

LOAD = Payload(1.5, np.array([0.0, 0.01, 0.06]))


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


def arm_of(robot: str, **given: object) -> Arm:
    return Arm(robot=load_robot(robot), collisions=False, **given)  # type: ignore[arg-type]


def one_move(robot: str = "ur5e", seed: int = 0) -> Program:
    arm = arm_of(robot)
    return Program((Move(random_spline(arm, seed), arm),))


def round_with_payload(robot: str = "ur5e", label: str = "start to pick") -> Program:
    """To a grasp, a dwell, a move with the payload, and back without it."""
    arm = arm_of(robot)
    loaded = replace(arm, payload=LOAD)
    first = random_spline(arm, 1)
    second = random_spline(arm, 2, first.control_points[-1])
    third = random_spline(arm, 3, second.control_points[-1])
    return Program((
        Move(first, arm, label),
        Rest(0.35, "dwell at pick"),
        Move(second, loaded, "pick to place"),
        Move(third, arm, "place to end"),
    ))  # fmt: skip
