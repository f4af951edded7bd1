"""Friction that grows with a joint's load torque follows one law in all modules."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import Payload, RecordedRows, Recording, Robot, evaluate, load_robot, optimize
from joulepath.models.from_figures import robot_of
from joulepath.models.registry import load_figures
from joulepath.models.robot import Array
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.dynamics.kernel import Kernel
from joulepath.optimizer.dynamics.kernel_expressions import build
from joulepath.optimizer.dynamics.kernel_functions import Interpreted
from joulepath.optimizer.dynamics.limited_torque import greatest_smooth_part, limited_torque
from joulepath.optimizer.dynamics.losses import drawn_power, power_flow
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.by_pinocchio import torques_of
from tests.optimizer.dynamics.kernel_states import LOSSY, TORQUE, left_out, places, states
from tests.optimizer.moves import PAYLOAD, ROBOT, TILTED, problem, torques

LOAD = np.array([0.08, 0.2, 0.1, 0.05, 0.0, 0.15])
# relative to the largest: central differences with a step of 1e-6
DIFFERENCE = 2e-6
STEP = 1e-6
FORMULA = 1e-9  # relative; the same formula by another route
HEAVY = Payload(mass=5.0, com=np.array([0.0, 0.05, 0.1]))


def loaded(robot: Robot = ROBOT, load: Any = LOAD, **given: Any) -> Robot:
    """The robot with friction laws that grow with the load."""
    share = np.broadcast_to(np.asarray(load, dtype=float), robot.nq)
    return replace(
        robot,
        friction_laws={n: replace(law, load=share) for n, law in robot.friction_laws.items()},
        **given,
    )


def by_hand(task: Any, q: Array, v: Array, a: Array) -> Array:
    """Friction (k, nq) by the formula, with Pinocchio's torques of an arm without rotors."""
    arm, law = task.arm, task.arm.friction_law
    body = arm.payload
    model = arm.robot.loaded_model(body.mass, body.com, body.inertia, arm.gravity)
    model.armature = np.zeros(model.nv)
    carried = np.abs(torques_of(model, q, v, a))
    step = v / np.sqrt(v**2 + law.knee**2)
    return np.asarray(
        (law.coulomb + law.load * carried) * step + law.unloaded.torque(v) - law.coulomb * step
    )


def test_the_law_takes_what_the_links_ask_for() -> None:
    """The rotor's torque is left out: it does not pass through the gear."""
    task = problem(robot=loaded(), payload=PAYLOAD, gravity=TILTED)
    y = states(21)
    q, v, a = y[:, :6], y[:, 6:12], y[:, 12:]
    tau = torques(task, q, v, a)
    flow = power_flow(tau, v, a, task.arm.drives, task.arm.friction_law)
    assert flow.tau_motor - tau == pytest.approx(by_hand(task, q, v, a), abs=TORQUE)
    assert limited_torque(task.arm, tau, v, a) == pytest.approx(flow.tau_motor, abs=TORQUE)
    assert (
        flow.friction
        >= power_flow(tau, v, a, task.arm.drives, task.arm.friction_law.unloaded).friction
    ).all()


def test_a_load_of_zero_is_no_load() -> None:
    """Bitwise, in the report and in the kernel with the term."""
    y, none = states(22), problem(payload=PAYLOAD)
    zero = problem(payload=PAYLOAD, robot=loaded(load=0.0))
    q, v, a = y[:, :6], y[:, 6:12], y[:, 12:]
    tau = torques(none, q, v, a)
    flows = [
        power_flow(tau, v, a, each.arm.drives, each.arm.friction_law).joints
        for each in (none, zero)
    ]
    assert (flows[0] == flows[1]).all()
    kernels = [Kernel(each.arm.robot, Interpreted(build(each.arm.robot))) for each in (none, zero)]
    p = PreparedProblem.of(none).parameters(electrical=1.0)
    assert (PreparedProblem.of(zero).parameters(electrical=1.0) == p).all()
    assert (kernels[0].value(y, p)[0] == kernels[1].value(y, p)[0]).all()


@pytest.mark.parametrize("side", ["motor", "link"])
def test_the_kernels_cost_and_its_derivatives(side: Any) -> None:
    """With almost sharp corners the cost is the reported power; with smoothing, derivatives are the
    slopes.
    """
    robot = loaded(
        drives=LOSSY, torque_side=side, electronics=replace(ROBOT.electronics, regeneration=0.3)
    )
    prepared = PreparedProblem.of(problem(robot=robot, payload=PAYLOAD, gravity=TILTED))
    kernel, y, arm = Kernel(robot, Interpreted(build(robot))), states(23, 12), prepared.arm
    p = prepared.parameters(electrical=1.0)
    exact = p.copy()
    for name, value in {"knee": arm.friction_law.knee, "width": 1e-9, "bend": 0.0}.items():
        exact[places(name)] = value
    q, v, a = y[:, :6], y[:, 6:12], y[:, 12:]
    tau = torques(prepared.problem, q, v, a)
    net = arm.base_power + power_flow(tau, v, a, arm.drives, arm.friction_law).joints.sum(axis=1)
    cost, limited = (x.copy() for x in kernel.value(y, exact))
    assert cost == pytest.approx(drawn_power(net, 0.3), rel=FORMULA, abs=1e-7)
    assert limited == pytest.approx(limited_torque(arm, tau, v, a), abs=TORQUE)

    multiplier, weight = (
        np.random.default_rng(3).normal(size=(len(y), 6)),
        np.linspace(0.5, 1.5, len(y)),
    )
    _, _, gradient, jacobian, hessian = (x.copy() for x in kernel.node(y, multiplier, weight, p))
    rigid = tau - arm.drives.rotor_inertia * a
    dry = arm.friction_law.coulomb + arm.friction_law.load * np.sqrt(
        rigid**2 + p[places("bend")] ** 2
    )
    hessian += left_out(kernel, y, weight, p, dry)
    for i in range(18):
        up, down = (y + sign * STEP * np.eye(18)[i] for sign in (1, -1))
        values = [[x.copy() for x in kernel.value(each, p)] for each in (up, down)]
        slope, tau_slope = ((high - low) / (2 * STEP) for high, low in zip(*values, strict=True))
        assert np.abs(gradient[:, i] - slope).max() < DIFFERENCE * np.abs(gradient).max()
        assert np.abs(jacobian[:, :, i] - tau_slope).max() < DIFFERENCE * np.abs(jacobian).max()
        sides = [
            [x.copy() for x in kernel.node(each, 0 * multiplier, weight, p)] for each in (up, down)
        ]
        pull = [
            weight[:, None] * g + np.einsum("nj,njk->nk", multiplier, rows)
            for _, _, g, rows, _ in sides
        ]
        row = (pull[0] - pull[1]) / (2 * STEP)
        assert np.abs(hessian[:, i] - row).max() < DIFFERENCE * np.abs(hessian).max()


@pytest.mark.parametrize("method", ["bspline", "time_scaling", "lagrange"])
def test_an_answer_holds_whoever_looks_at_it(method: Any) -> None:
    """Certificate and replay agree with the energy, its parts add up, and the bounds lie below
    it."""
    task = problem(robot=loaded(), payload=HEAVY, method=method, bound="tight")
    found = optimize(task)
    assert found.certificate.valid
    electrical = found.energy.electrical
    assert electrical.parts_sum == pytest.approx(electrical.total, rel=1e-5)
    assert 0 < found.lower_bound <= electrical.total
    path = found.trajectory
    assert path.tau_motor - path.tau == pytest.approx(
        by_hand(task, path.q, path.v, path.a), abs=1e-6
    )
    replayed = evaluate(
        task.arm, Recording([RecordedRows(path.t, path.q, path.v, path.a)])
    ).total.energy
    assert replayed.electrical.total == pytest.approx(electrical.total, rel=2e-3)  # of samples
    # an arm without load friction needs less for the same motion, and the certificate distinguishes
    # the two
    dry = problem(payload=HEAVY, method=method)
    assert path.spline is not None
    assert (
        PreparedProblem.of(dry).energy(path.spline).electrical.friction < 0.98 * electrical.friction
    )
    assert not certify(dry, path.spline, found.start.q, found.goal.q, found.energy).valid


def test_friction_that_is_known_saves() -> None:
    """Under the law with load friction, its own optimum is better than the optimum of the plain
    law.
    """
    heavy = {"payload": HEAVY, "robot": loaded(load=0.2)}
    ours, blind = optimize(problem(**heavy)), optimize(problem(payload=HEAVY))
    assert blind.trajectory.spline is not None
    theirs = PreparedProblem.of(problem(**heavy)).energy(blind.trajectory.spline).electrical.total
    assert ours.energy.electrical.total < theirs


def test_no_torque_within_the_limits_is_beyond_the_relaxed_one() -> None:
    """Friction helps to hold a load: the states have motor torques within the limit, for any share
    below one.
    """
    rng = np.random.default_rng(5)
    for load in (0.0, 0.05, 0.2, 0.9):
        arm = problem(robot=loaded(load=load), payload=PAYLOAD).arm
        limits = arm.active_limits
        v, a = (
            rng.uniform(-1, 1, (4000, 6)) * limits.v_max,
            rng.uniform(-1, 1, (4000, 6)) * limits.a_max,
        )
        tau = rng.uniform(-12, 12, (4000, 6)) * limits.tau_max
        inside = np.abs(limited_torque(arm, tau, v, a)) <= limits.tau_max
        assert inside.any(axis=0).all()
        assert (np.abs(tau) <= greatest_smooth_part(arm))[inside].all()


@pytest.mark.parametrize("share", [-0.01, 1.0, 2.0])
def test_a_share_that_no_gear_has_is_refused(share: float) -> None:
    figures = load_figures("ur5e")
    law = dict(figures["friction_laws"]["curved"]) | {"load": {"value": [share] + 5 * [0.1]}}
    with pytest.raises(
        ValueError, match=r"friction_laws\.curved\.load must be at least 0 and below 1"
    ):
        robot_of("ur5e", figures | {"friction_laws": {"curved": law}})


def test_figures_say_the_load() -> None:
    figures = load_figures("ur5e")
    law = dict(figures["friction_laws"]["curved"]) | {"load": {"value": LOAD.tolist()}}
    robot = robot_of("ur5e", figures | {"friction_laws": {"curved": law}})
    assert robot.friction.load is not None and robot.has_load_friction
    assert robot.friction.load.tolist() == LOAD.tolist()
    assert not load_robot("ur5e").has_load_friction
