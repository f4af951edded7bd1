"""Torques between samples: the bound is never below a dense sampling, and hardly above it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Payload, Problem, Spline, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.dynamics.torque_bound import TorqueSamples, torque_bounds
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.quadrature import grid
from joulepath.optimizer.motion.spline import sample, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.selection import long_but

# relative; the bound stops at 1e-6 of the limit, and these motions use a third of a limit or more
SHARP = 4e-6
# N·m; of a joint without load
ROUNDING = 1e-9
# relative; a sampling of 1 ms misses the peak at a reversal by the slope of the torque times half a
# millisecond
MISSED = 1e-3
# s; coarse samples, and dense ones next to the largest of them: at 10 rad/s², friction's step
# (1e-3 rad/s) spans ten coarse samples
COARSE = 1e-5
DENSE = 1e-7


def motion(arm: Arm, seed: int) -> Spline:
    """A wild motion from rest to rest, with reversals of all joints."""
    rng, limits = np.random.default_rng(seed), arm.robot.limits
    space = bspline.uniform(int(rng.integers(8, 40)))
    steps = rng.normal(size=(space.n, arm.robot.nq)) * 0.15
    points = (limits.q_min + limits.q_max) / 2 + np.cumsum(steps, axis=0)
    points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = points[0], points[-1]
    return spline_of(space, points, rng.uniform(0.3, 1.0))


def sizes(prepared: PreparedProblem, spline: Spline, t: Array) -> Array:
    """Absolute limited torques (k, nq) [N·m] at times t (k,) [s]."""
    q, v, a = sample(spline, t)
    return np.abs(limited_torque(prepared.arm, prepared.torques(q, v, a), v, a))


def densely(prepared: PreparedProblem, spline: Spline) -> Array:
    """Largest absolute limited torques (nq,) [N·m] of a dense sampling."""
    t = np.arange(0.0, spline.duration, COARSE)
    peaks = t[sizes(prepared, spline, t).argmax(axis=0)]
    near = peaks[:, None] + np.arange(-COARSE, COARSE, DENSE)
    return sizes(prepared, spline, np.clip(near.ravel(), 0.0, spline.duration)).max(axis=0)


def bounds(prepared: PreparedProblem, spline: Spline) -> Array:
    samples = TorqueSamples.of(spline.curve, prepared.torques, grid(spline.duration)[None])
    return torque_bounds(prepared.arm, spline.curve, prepared.torques, samples)


def prepared_for(robot: str, side: str = "motor") -> PreparedProblem:
    loaded = replace(load_robot(robot), torque_side=side)
    arm = Arm(robot=loaded, payload=Payload(mass=1.0, com=np.array([0, 0, 0.05])), collisions=False)
    middle = (loaded.limits.q_min + loaded.limits.q_max) / 2
    return PreparedProblem.of(Problem(arm=arm, start=middle, goal=middle + 0.1))


SIDES = [("ur5e", "motor"), ("ur5e", "link"), ("panda", "motor"), ("ur20", "motor")]


@pytest.mark.parametrize(("robot", "side"), long_but(SIDES[1:2], SIDES))
def test_no_torque_between_samples_is_above_the_bound(robot: str, side: str) -> None:
    prepared, missed = prepared_for(robot, side), []
    for seed in range(2):
        spline = motion(prepared.arm, seed)
        limit = prepared.arm.active_limits.tau_max
        dense = densely(prepared, spline)
        bound, joint = bounds(prepared, spline), int(np.argmax(dense / limit))
        assert (bound >= dense).all()
        assert bound[joint] <= dense[joint] * (1 + SHARP)
        missed.append(
            1 - sizes(prepared, spline, grid(spline.duration)).max(axis=0)[joint] / dense[joint]
        )
    if side == "motor":
        assert max(missed) > MISSED / 10  # else these motions would not need a bound


def test_the_certificate_refuses_a_peak_between_its_samples() -> None:
    prepared = prepared_for("ur5e")
    for seed in range(40):
        spline = motion(prepared.arm, seed)
        sampled = sizes(prepared, spline, grid(spline.duration)).max(axis=0)
        missed = bounds(prepared, spline) / sampled - 1
        if missed.max() > MISSED:
            break
    joint = int(np.argmax(missed))
    # torques at all samples are within the limits, but this joint's peak between two samples is not
    tau_max = np.full(6, 1e6)
    tau_max[joint] = sampled[joint] * (1 + missed[joint] / 2)
    robot = replace(prepared.arm.robot, limits=replace(prepared.arm.robot.limits, tau_max=tau_max))
    ends = spline.control_points[[0, -1]]
    task = Problem(
        arm=Arm(robot=robot, payload=prepared.arm.payload, collisions=False),
        start=ends[0],
        goal=ends[1],
    )
    certificate = certify(task, spline, *ends, prepared.energy(spline))
    assert 1 + missed[joint] / 4 < certificate.worst_ratio["torque"] < 1 + missed[joint]


def test_a_resting_arm_and_a_constant_torque() -> None:
    prepared = prepared_for("ur5e")
    rest = np.broadcast_to(np.array([0.3, -1.0, 1.2, -0.5, 0.4, 0.0]), (8, 6))
    spline = spline_of(bspline.uniform(8), rest, 2.0)
    held = sizes(prepared, spline, np.array([0.0]))[0]
    assert bounds(prepared, spline) == pytest.approx(held, rel=SHARP, abs=ROUNDING)


def test_a_spline_that_is_not_a_number_has_no_bound() -> None:
    prepared = prepared_for("ur5e")
    spline = motion(prepared.arm, 0)
    points = np.where(np.arange(len(spline.control_points))[:, None] == 4, np.nan, 1.0)
    spline = replace(spline, control_points=spline.control_points * points)
    assert np.isnan(bounds(prepared, spline)).any()
