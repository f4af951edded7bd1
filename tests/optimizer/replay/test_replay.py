"""Motions played in MuJoCo: agreement with the plan, friction at its knee, contacts, changed arms,
savings, memory.
"""

from __future__ import annotations

import os
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from joulepath import (
    Arm,
    Box,
    DeadlineExceeded,
    InvalidProblem,
    Obstacle,
    Payload,
    PlannedMotion,
    PlannedTorques,
    Replay,
    Scene,
    Solution,
    Spline,
    load_robot,
    optimize,
    replay,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.replay.reference import TIME_GRID, course_of, reference
from joulepath.optimizer.replay.replay import planned_motion
from tests.optimizer.clocks import CountingClock
from tests.optimizer.moves import GOAL, PAYLOAD, START, problem, tcp_pose
from tests.refusals import refusal_of

# accuracy of feed-forward with PD at 0.25 ms, as promised by the documentation: rad, m, and shares
# of the energies
JOINT = 3e-4
TCP = 2.5e-4
ELECTRICAL = 5e-4
MECHANICAL = 1e-3
# of savings
POINT = 1e-3
FAST = 1e-3
ARM = Arm(robot=load_robot("ur5e"), payload=PAYLOAD)


def planned(arm: Arm, spline: Spline, **given: Any) -> PlannedMotion:
    """A spline as a planned motion, with the energies of our own quadrature."""
    energy, course = Plant(arm).energy(spline), course_of(spline)
    torques = None
    if arm.robot.nq:
        q, v, a = course(np.linspace(0.0, spline.duration, 20))
        torques = PlannedTorques(q, v, a, Plant(arm).torques(q, v, a))
    totals = energy.electrical.total, energy.mechanical.total
    return PlannedMotion(arm, course, spline.duration, *totals, torques=torques, **given)


def quintic(
    arm: Arm, start: Array = START, goal: Array = GOAL, duration: float = 1.2
) -> PlannedMotion:
    return planned(arm, quintic_spline(start, goal, duration))


@cache
def solution() -> Solution:
    return optimize(problem(goal=tcp_pose(GOAL), payload=PAYLOAD, windings=False))


def answer() -> PlannedMotion:
    """An optimised motion with its baselines."""
    return planned_motion(solution(), ARM, "electrical")


def holds_promise(found: Replay, plan: PlannedMotion) -> None:
    """Feed-forward with PD follows the plan, at its energy."""
    run = found.under("feed_forward")
    assert run.joint_error.max() <= JOINT
    assert run.tcp_error <= TCP
    assert run.energy.electrical.total == pytest.approx(plan.electrical, rel=ELECTRICAL)
    assert run.energy.mechanical.total == pytest.approx(plan.mechanical, rel=MECHANICAL)
    assert not run.collides
    assert found.torque_error is not None and found.torque_error <= 1e-9


@pytest.mark.parametrize("name", ["ur5e", "panda", "kr10_r1100"])
def test_the_plan_is_what_happens(name: str) -> None:
    """Also for a robot with torque limits of the links, and for one with large friction."""
    arm = Arm(
        robot=load_robot(name),
        payload=Payload(mass=1.0, com=np.array([0.0, 0.02, 0.06])),
        collisions=False,
    )
    middle = (arm.active_limits.q_min + arm.active_limits.q_max) / 2
    plan = quintic(arm, middle, middle + np.resize([0.5, -0.4, 0.3], arm.robot.nq), 1.5)
    found = replay(plan, ("feed_forward",))
    holds_promise(found, plan)
    assert (found.under("feed_forward").saturated == 0).all()


def test_an_optimised_motion_is_what_happens() -> None:
    plan = answer()
    found = replay(plan)
    holds_promise(found, plan)
    worst = solution().certificate.worst_ratio["torque"]
    assert found.under("feed_forward").limit_ratio.max() == pytest.approx(worst, rel=1e-2)
    # the loop alone sags under gravity and lags behind friction
    assert found.under("pd").joint_error.max() > 10 * JOINT
    assert found.changes == found.savings == []


def test_joints_at_the_knee_of_friction_follow() -> None:
    """At a milliradian per second, friction is most of the torque, and differs by half between
    joints.
    """
    goal = START + 1e-3 * np.array([1.0, -1.0, 0.5, 2.0, -0.2, 3.0])
    plan = quintic(ARM, START, goal, 1.0)
    found = replay(plan, ("feed_forward",))
    holds_promise(found, plan)


def test_an_arm_at_rest_stays_there() -> None:
    """There is neither chatter nor creep at the steepest part of the friction law."""
    plan = quintic(ARM, START, START, 0.5)
    run = replay(plan, ("feed_forward",)).under("feed_forward")
    assert run.joint_error.max() < 1e-9
    assert run.energy.electrical.total == pytest.approx(plan.electrical, rel=1e-6)


def in_the_way(margin: float = 0.0, above: float = 0.0) -> Arm:
    """The arm with a box at the middle of the way of its flange."""
    T = np.eye(4)
    T[:3, 3] = tcp_pose((START + GOAL) / 2).T[:3, 3] + [0.0, 0.0, above]
    return replace(ARM, scene=Scene([Obstacle("box", Box(np.full(3, 0.08)), T, margin)]))


def test_an_obstacle_in_the_way_is_touched() -> None:
    arm = in_the_way()
    run = replay(quintic(arm), ("feed_forward",), FAST).under("feed_forward")
    assert run.contact is not None and run.collides
    assert run.contact.pair[0] == "box" or run.contact.pair[1] == "box"
    assert 0 < run.contact.time < 1.2
    # the obstacle pushes the arm off its path, at a cost of energy
    assert run.tcp_error > TCP
    # our own distances say so, too
    q = quintic(arm).course(np.array([0.6]))[0]
    assert collision_model(arm).least_distance(q, np.inf) < 0
    free = replay(quintic(replace(arm, collisions=False)), ("feed_forward",), FAST).under(
        "feed_forward"
    )
    assert free.contact is None and free.tcp_error <= TCP


def test_a_margin_is_no_body() -> None:
    arm = in_the_way(margin=0.5, above=0.5)
    q = quintic(arm).course(np.linspace(0.0, 1.2, 50))[0]
    assert (
        collision_model(arm).least_distance(q, np.inf)
        < 0
        < collision_model(in_the_way(0.0, 0.5)).least_distance(q, 1)
    )
    assert replay(quintic(arm), ("feed_forward",), FAST).under("feed_forward").contact is None


def test_the_savings_persist_as_planned() -> None:
    """Without a change of the arm, the simulated saving is the planned one; friction and payload
    move it.
    """
    plan = answer()
    claimed = {
        each.name
        for each in solution().baselines
        if each.saving is not None and each.duration == pytest.approx(plan.duration)
    }
    assert {each.name for each in plan.baselines} == claimed and len(claimed) > 1
    found = replay(plan, ("feed_forward",), FAST, {"payload": 0.1, "friction": 0.3})
    assert [(each.quantity, each.factor) for each in found.changes] == [
        ("payload", 0.9),
        ("payload", 1.1),
        ("friction", 0.7),
        ("friction", 1.3),
    ]
    for each in found.savings:
        assert each.simulated == pytest.approx(each.planned, abs=POINT)
        assert each.least <= each.simulated <= each.most
        assert each.persists == (each.least > 0 if each.planned > 0 else None)
    assert {each.name for each in found.savings} == {each.name for each in plan.baselines}
    lighter, heavier, smooth, rough = found.changes
    own = found.under("feed_forward").energy.electrical
    assert lighter.energy.electrical.total < own.total < heavier.energy.electrical.total
    assert smooth.energy.electrical.friction < 0.8 * own.friction < rough.energy.electrical.friction
    # the controller does not know
    assert min(each.joint_error.max() for each in (lighter, heavier, smooth, rough)) > JOINT


def test_a_payload_that_is_none_is_not_changed() -> None:
    found = replay(
        quintic(replace(ARM, payload=Payload())), ("feed_forward",), FAST, {"payload": 0.1}
    )
    assert found.changes == []


def test_a_joint_at_its_limit_saturates() -> None:
    """A motion planned at nearly all the torque of a joint: a heavier payload asks for more than
    there is.
    """
    plan = quintic(ARM)
    tight = (
        plan.arm.active_limits.tau_max
        * replay(plan, ("feed_forward",), FAST).under("feed_forward").limit_ratio
        / 0.99
    )
    arm = replace(
        ARM, limits=replace(ARM.active_limits, tau_max=np.minimum(tight, ARM.active_limits.tau_max))
    )
    found = replay(quintic(arm), ("feed_forward",), FAST, {"payload": 0.1})
    as_planned, (lighter, heavier) = found.under("feed_forward"), found.changes
    assert as_planned.limit_ratio.max() == pytest.approx(0.99, abs=5e-3)
    assert (as_planned.saturated == 0).all() and (lighter.saturated == 0).all()
    assert heavier.saturated.max() > 0
    assert heavier.limit_ratio.max() == pytest.approx(1.0)


def test_a_velocity_step_is_not_followed() -> None:
    """A motion at an even speed from standstill: no torque is large enough."""
    line = Spline(1, np.array([0.0, 0.0, 1.0, 1.0]), np.array([START, GOAL]))
    found = replay(PlannedMotion(ARM, course_of(line), 1.0, 1.0, 1.0), ("pd",), FAST)
    assert found.torque_error is None
    assert found.under("pd").joint_error.max() > 10 * JOINT


def test_friction_that_grows_with_the_load() -> None:
    """The controller knows it, and the losses count it."""
    law = ARM.friction_law
    loaded = replace(
        ARM.robot, friction_laws={"loaded": replace(law, name="loaded", load=np.full(6, 0.05))}
    )
    arm = replace(ARM, robot=loaded)
    plan, plain = quintic(arm), quintic(ARM)
    found = replay(plan, ("feed_forward",))
    holds_promise(found, plan)
    assert plan.electrical > plain.electrical * (1 + 10 * ELECTRICAL)
    rough = replay(plan, ("feed_forward",), FAST, {"friction": 0.3}).changes[1]
    assert (
        rough.energy.electrical.friction
        > 1.2 * found.under("feed_forward").energy.electrical.friction
    )


def test_a_motion_of_too_many_steps_is_refused() -> None:
    with refusal_of("step", match=f"but at most {TIME_GRID.max_steps} are possible"):
        replay(quintic(ARM, duration=300.0), step=1e-5)


def test_the_least_step_that_a_refusal_names_is_accepted() -> None:
    with pytest.raises(InvalidProblem) as refusal:
        reference(lambda t: (t, t, t), duration=300.001, step=1e-5)
    named = float(re.findall(r"[0-9.]+(?= s)", str(refusal.value))[-1])
    reference(lambda t: (t, t, t), duration=300.001, step=named)


def test_the_deadline_ends_a_replay() -> None:
    with pytest.raises(DeadlineExceeded):
        replay(quintic(ARM), deadline=5.0, clock=CountingClock())


def memory() -> int:
    """Memory of this process [byte]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.long
def test_no_model_leaks() -> None:
    """A model with its data has more than a hundred kilobytes: a hundred leaked models would be
    visible."""
    plan = quintic(in_the_way(above=0.5), duration=0.2)
    for _ in range(20):
        replay(plan, step=1e-2, perturb={"payload": 0.1})
    before = memory()
    for _ in range(100):
        replay(plan, step=1e-2, perturb={"payload": 0.1})
    assert memory() - before < 5e6
