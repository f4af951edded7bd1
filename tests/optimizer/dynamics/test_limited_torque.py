"""The side of a torque limit: for a limit of the link, all modules leave out rotor and friction."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import Problem, RecordedRows, Recording, evaluate, load_robot, optimize
from joulepath.models.from_figures import robot_of
from joulepath.models.robot import Array
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.dynamics.kernel import Kernel
from joulepath.optimizer.dynamics.kernel_expressions import build
from joulepath.optimizer.dynamics.kernel_functions import Interpreted
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.by_pinocchio import torques_of
from tests.optimizer.dynamics.kernel_states import LOSSY, TORQUE, left_out, states
from tests.optimizer.moves import GOAL, PAYLOAD, ROBOT, START, TILTED, limits, problem, torques

LINK = replace(ROBOT, torque_side="link", drives=LOSSY)
# relative to the largest: central differences with a step of 1e-6
DIFFERENCE = 2e-6
STEP = 1e-6
# a little less than the motion without limits puts on the links
TIGHT = limits(tau_max=[25, 70, 36, 6, 6, 4])


def at_link(task: Problem, q: Array, v: Array, a: Array) -> Array:
    """Torques (k, nq) of the bodies alone, by Pinocchio without rotors."""
    load = task.arm.payload
    model = task.arm.robot.loaded_model(load.mass, load.com, load.inertia, task.arm.gravity)
    model.armature = np.zeros(model.nv)
    return torques_of(model, q, v, a)


def test_the_link_bears_the_bodies_alone() -> None:
    task = problem(robot=LINK, payload=PAYLOAD, gravity=TILTED)
    y = states(11)
    q, v, a = y[:, :6], y[:, 6:12], y[:, 12:]
    assert (
        np.abs(
            limited_torque(task.arm, torques(task, q, v, a), v, a) - at_link(task, q, v, a)
        ).max()
        < TORQUE
    )
    prepared = PreparedProblem.of(task)
    kernel = Kernel(LINK, Interpreted(build(LINK)))
    assert (
        np.abs(
            kernel.value(y, prepared.parameters(electrical=1.0))[1] - at_link(task, q, v, a)
        ).max()
        < TORQUE
    )


def test_the_energy_is_that_of_the_motor_all_the_same() -> None:
    costs = []
    y = states(12)
    for robot in (LINK, replace(LINK, torque_side="motor")):
        prepared = PreparedProblem.of(problem(robot=robot, payload=PAYLOAD))
        costs.append(
            Kernel(robot, Interpreted(build(robot))).value(y, prepared.parameters(electrical=1.0))[
                0
            ]
        )
    assert (costs[0] == costs[1]).all()


def test_derivatives_are_the_slopes() -> None:
    """As in test_kernel, for the torque at the link: first derivatives against values, second
    derivatives against first ones.
    """
    kernel = Kernel(LINK, Interpreted(build(LINK)))
    p = PreparedProblem.of(problem(robot=LINK, payload=PAYLOAD, gravity=TILTED)).parameters(
        electrical=1.0
    )
    y = states(13)
    multiplier, weight = (
        np.random.default_rng(3).normal(size=(len(y), 6)),
        np.linspace(0.5, 1.5, len(y)),
    )
    _, _, _, jacobian, hessian = (array.copy() for array in kernel.node(y, multiplier, weight, p))
    hessian += left_out(kernel, y, weight, p, LINK.friction.coulomb)
    for i in range(18):
        up, down = (y + side * STEP * np.eye(18)[i] for side in (1, -1))
        tau = [kernel.value(each, p)[1].copy() for each in (up, down)]
        slope = (tau[0] - tau[1]) / (2 * STEP)
        assert np.abs(jacobian[:, :, i] - slope).max() < DIFFERENCE * np.abs(jacobian).max()
        sides = [
            [x.copy() for x in kernel.node(each, 0 * multiplier, weight, p)] for each in (up, down)
        ]
        pull = [
            weight[:, None] * gradient + np.einsum("nj,njk->nk", multiplier, rows)
            for _, _, gradient, rows, _ in sides
        ]
        row = (pull[0] - pull[1]) / (2 * STEP)
        assert np.abs(hessian[:, i] - row).max() < DIFFERENCE * np.abs(hessian).max()


@pytest.mark.parametrize("method", ["bspline", "time_scaling"])
def test_a_limit_of_the_link_lets_the_motor_do_more(method: Any) -> None:
    """The same number on both sides: the motion with the limit at the link uses it, and is
    faster."""
    given = {"limits": TIGHT, "method": method, "payload": PAYLOAD}
    tasks = [
        problem(START, GOAL, robot=robot, **given)
        for robot in (LINK, replace(LINK, torque_side="motor"))
    ]
    link, motor = (optimize(task) for task in tasks)
    assert link.certificate.valid and motor.certificate.valid
    assert link.duration < 0.97 * motor.duration
    assert link.energy.electrical.total <= motor.energy.electrical.total
    path = link.trajectory
    at_joint = np.abs(at_link(tasks[0], path.q, path.v, path.a)).max(axis=0) / TIGHT.tau_max
    assert 0.95 < at_joint.max() <= 1 + 1e-6
    assert (np.abs(path.tau_motor).max(axis=0) > 1.05 * TIGHT.tau_max).any()
    # another evaluation of the motion agrees
    assert link.certificate.worst_ratio["torque"] == pytest.approx(at_joint.max(), abs=0.01)
    assert path.spline is not None
    ends = link.start.q, link.goal.q, link.energy
    assert not certify(tasks[1], path.spline, *ends).valid
    logs = [Recording([RecordedRows(path.t, path.q, path.v, path.a)]) for _ in tasks]
    replayed = [evaluate(task.arm, log) for task, log in zip(tasks, logs, strict=True)]
    reports = [{each.limit: each.worst_ratio for each in found.limits} for found in replayed]
    assert reports[0]["torque"] == pytest.approx(at_joint.max(), abs=0.02)
    assert reports[1]["torque"] > 1.05


def test_another_word_is_refused() -> None:
    figures = dict(load_robot("panda").figures)
    assert load_robot("panda").torque_side == "link"
    figures["limits"] = figures["limits"] | {"torque_side": {"value": "both"}}
    with pytest.raises(ValueError, match="'both': it must be one of motor, link"):
        robot_of("panda", figures)
