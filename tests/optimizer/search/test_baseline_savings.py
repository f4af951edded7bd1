"""Energies, savings and broken limits of baselines."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Baseline, Payload, Problem
from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.interval import MotionEnergy
from joulepath.optimizer.dynamics.losses import saving
from joulepath.optimizer.motion.ruckig_motion import straight, time_optimal
from joulepath.optimizer.motion.time_scalings import (
    SampledMotion,
    quintic,
)
from joulepath.optimizer.result.energy import Sensitivity
from joulepath.optimizer.search.baselines import (
    Broken,
    baselines,
    broken_limits,
    guesses,
    motion_energy,
    standing,
    with_savings,
)
from tests.by_pinocchio import torques_of
from tests.optimizer.search.test_baselines import (
    DURATION,
    EXACT,
    GOAL,
    NAMES,
    RATE,
    ROBOT,
    RUCKIG_POSITION,
    START,
    limits,
    one_joint,
    problem,
)

BALANCE = (
    1e-6  # relative; shaft power is smooth within panels, but for friction's steep rise near rest
)


def oracle(task: Problem) -> tuple[Callable[..., Array], Callable[[Array], float], Broken]:
    """Torques and potential energy by Pinocchio, and a path without limits."""
    load = task.arm.payload
    model = task.arm.robot.loaded_model(load.mass, load.com, load.inertia, task.arm.gravity)
    return (
        partial(torques_of, model),
        lambda q: float(pin.computePotentialEnergy(model, model.createData(), q)),
        lambda q, v, paths: [[] for _ in q],
    )


def compare(task: Problem, duration: float = DURATION, ours: float = 60.0) -> dict[str, Baseline]:
    goals = np.asarray(task.goal)[None]
    return {
        each.name: each
        for each in baselines(task, np.asarray(task.start), goals, duration, ours, *oracle(task))
    }


def test_energies_balance() -> None:
    """The total of every baseline is the sum of its parts, with payload and tilted gravity."""
    payload = Payload(mass=3.0, com=np.array([0.0, 0.05, 0.1]), inertia=np.diag([0.01, 0.01, 0.01]))
    task = problem(payload=payload, gravity=np.array([3.0, -5.0, -7.9]))
    torques, potential, _ = oracle(task)
    for motion in guesses(task, START, GOAL, DURATION).values():
        energy = motion_energy(
            task, motion, torques(motion.q, motion.v, motion.a), potential
        ).electrical
        assert energy.parts_sum == pytest.approx(energy.total, rel=BALANCE)


@pytest.mark.parametrize("friction", list(ROBOT.friction_laws))
def test_energies_are_of_the_friction_law_asked_for(friction: str) -> None:
    """The energy of a baseline contains ∫ v · friction(v) dt of the requested friction law."""
    task = problem(friction=friction)
    torques, potential, _ = oracle(task)
    motion = quintic(START, GOAL, DURATION)
    energy = motion_energy(task, motion, torques(motion.q, motion.v, motion.a), potential)
    loss = motion.weights @ (motion.v * ROBOT.friction_laws[friction].torque(motion.v))
    assert energy.per_joint.friction == pytest.approx(loss, rel=EXACT)


@pytest.mark.parametrize("objective", ["electrical", "mechanical"])
def test_report(objective: str) -> None:
    """The report has all six baselines in order, with their savings of the objective."""
    task = problem(objective=objective, duration_min=DURATION, duration_max=DURATION)
    report = compare(task)
    assert list(report) == NAMES
    for each in report.values():
        assert each.saving == pytest.approx(1 - 60.0 / getattr(each, objective), rel=EXACT)
    worse = compare(task, ours=1e6)["quintic"].saving
    assert worse is not None and worse < 0


def test_the_straight_motion_keeps_every_rate_and_uses_one_up() -> None:
    """The straight motion has one joint at one of its limits, and all joints move in step."""
    motion = straight(limits(), START, GOAL)
    way = GOAL - START
    share = (motion.q - START) / way
    assert np.ptp(share, axis=1).max() < RUCKIG_POSITION
    ratios = np.concatenate(
        [
            motion.peak_v / limits().v_max,
            motion.peak_a / limits().a_max,
            motion.peak_jerk / limits().j_max,
        ]
    )
    assert ratios.max() == pytest.approx(1.0, rel=RATE)
    assert motion.duration >= time_optimal(limits(), START, GOAL).duration * (1 - RATE)


def test_a_saving_is_claimed_in_the_same_time_against_what_keeps_every_limit() -> None:
    """The shorter of two compared motions waits, and the waiting energy counts.

    At the goal, the motors hold the arm during the wait.
    """
    task = problem()
    torques, *_ = oracle(task)
    goal = standing(task.arm, GOAL, torques)
    table = list(compare(task).values())
    nothing = np.zeros_like(compare(task)["ruckig"].sensitivity.gradient)
    ours = MotionEnergy(60.0, Sensitivity(nothing, 0.0), DURATION)
    fair = {each.name: each for each in with_savings(table, task, ours, goal)}
    for each in fair.values():
        assert (each.saving is None) == (not each.within_limits) == (each.saving_interval is None)
    ruckig, slowed = fair["ruckig"], fair["ruckig_slowed"]
    wait = (DURATION - ruckig.duration) * goal.power
    assert wait > 1.0
    assert ruckig.saving == pytest.approx(1 - 60.0 / (ruckig.electrical + wait), rel=EXACT)
    assert slowed.saving == pytest.approx(1 - 60.0 / slowed.electrical, rel=EXACT)
    # our motion waits for the longer baseline
    short = replace(ours, duration=ruckig.duration / 2)
    again = {each.name: each for each in with_savings(table, task, short, goal)}["ruckig"]
    more = ruckig.duration / 2 * goal.power
    assert again.saving == pytest.approx(1 - (60.0 + more) / ruckig.electrical, rel=EXACT)


def test_savings_keep_their_sign() -> None:
    """A saving keeps its sign if regeneration makes an energy negative.

    A baseline without duration has no energy to save.
    """
    assert saving(30.0, 60.0) == 0.5
    assert saving(-2.0, -1.0) == 1.0
    assert saving(-1.0, -2.0) == -0.5
    assert saving(5.0, 0.0) == 0.0


def test_within_limits_in_time() -> None:
    """A second or more suits every limit; below Ruckig's own time, no baseline is feasible."""
    comfortable, hasty = compare(problem()), compare(problem(), duration=0.5)
    assert [name for name in NAMES if comfortable[name].within_limits] == [
        "quintic",
        "ruckig",
        "ruckig_slowed",
        "straight",
    ]
    assert comfortable["ruckig"].duration > 0.5
    assert [name for name in NAMES if hasty[name].within_limits] == ["ruckig"]
    assert hasty["ruckig_slowed"].duration == pytest.approx(0.5, rel=EXACT)
    assert (
        comfortable["trapezoid"].reason == "unbounded jerk"
        and comfortable["quintic"].reason is None
    )
    assert all(
        name in str(hasty["quintic"].reason) for name in ("velocity", "acceleration", "jerk")
    )


def test_within_limits_of_torque() -> None:
    """A torque limit just below the peak of Ruckig's motion excludes it, one just above does not.

    Ruckig itself ignores torque.
    """
    free = problem()
    torques, *_ = oracle(free)
    motion = time_optimal(free.arm.active_limits, START, GOAL)
    tau = torques(motion.q, motion.v, motion.a)
    peaks = np.abs(tau + ROBOT.friction.torque(motion.v)).max(axis=0)
    for factor, inside in ((1 - 1e-5, False), (1 + 1e-5, True)):
        broken = broken_limits(problem(limits=limits(tau_max=peaks * factor)), motion, tau)
        assert not broken if inside else broken[0].startswith("torque") and len(broken) == 1


def test_trapezoids_pass_without_a_jerk_limit() -> None:
    """Without a jerk limit, trapezoids are feasible, and Ruckig moves without jerk phases."""
    robot = replace(ROBOT, limits=limits(j_max=math.inf))
    report = compare(problem(robot=robot))
    assert all(each.within_limits for each in report.values())
    bang_bang = time_optimal(problem(robot=robot).arm.active_limits, START, one_joint(0.4))
    assert bang_bang.duration == pytest.approx(2 * math.sqrt(0.4 / 10.0), rel=RATE)


def test_no_travel() -> None:
    """Without travel, baselines in our duration hold the arm; the others are instant and free."""
    task = problem(goal=START)
    report = compare(task)
    torques, *_ = oracle(task)
    none = np.zeros((1, 6))
    current = torques(START[None], none, none)[0] / ROBOT.drives.torque_constant
    holding = DURATION * (36.7 + ROBOT.drives.copper @ current**2)
    for name in ("trapezoid", "quintic", "ruckig_slowed", "straight"):
        assert report[name].duration == pytest.approx(DURATION, rel=EXACT)
        assert report[name].electrical == pytest.approx(holding, rel=EXACT)
        assert report[name].mechanical == 0
    for name in ("ruckig", "controller_default"):
        assert (report[name].duration, report[name].electrical, report[name].saving) == (0, 0, 0)
    assert all(each.within_limits for each in report.values())


def test_next_to_no_travel() -> None:
    """Displacements as small as rounding errors give finite figures."""
    for displacement in (1e-6, 1e-9, 1e-12, 1e-15):
        goal = START + displacement
        for motion in guesses(problem(goal=goal), START, goal, DURATION).values():
            assert isinstance(motion, SampledMotion)
            assert all(
                np.isfinite(part).all()
                for part in (motion.t, motion.weights, motion.q, motion.v, motion.a)
            )
        assert all(
            math.isfinite(each.saving or 0.0) for each in compare(problem(goal=goal)).values()
        )
