"""Symbolic inverse dynamics and its regressor against Pinocchio's, value and derivatives."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.inverse_dynamics import SymbolicPayload, inverse_dynamics
from joulepath.optimizer.dynamics.torque_regressor import torque_regressor
from joulepath.optimizer.problem.robots import load_robot
from tests.optimizer.moves import ROBOT

STATES = 1000
TORQUE_TOLERANCE = 1e-9  # N·m; both recursions round at about 1e-13 of torques of some 500 N·m
# N·m per unit; derivatives reach some 1e3, and the two routes order their sums differently
DERIVATIVE_TOLERANCE = 1e-7

Load = tuple[float, Array, Array]  # mass, com, inertia


def random_payload(rng: np.random.Generator) -> Load:
    """Mass to 5 kg, com within 0.2 m of the flange, and the inertia (3, 3) of a body that can
    exist.

    The second moments of a mass distribution are any positive semidefinite S; its inertia is tr(S)
    1 - S, which keeps the triangle inequality by construction.
    """
    mass = rng.uniform(0.0, 5.0)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    S = mass * axes @ np.diag(rng.uniform(0.0, 0.1, size=3) ** 2) @ axes.T
    return mass, rng.uniform(-0.2, 0.2, size=3), np.trace(S) * np.eye(3) - S


def random_gravity(rng: np.random.Generator) -> Array:
    """Earth's gravity in any direction: the arm may hang from a wall or a ceiling."""
    direction = rng.normal(size=3)
    return 9.81 * direction / np.linalg.norm(direction)


def fresh_payload() -> SymbolicPayload:
    return SymbolicPayload(ca.SX.sym("m"), ca.SX.sym("c", 3), ca.SX.sym("I", 6))


def build(model: pin.Model) -> ca.Function:
    """(q, v, a, payload's mass, com, inertia, gravity, rotor) → torques and their Jacobians by q, v
    and a.
    """
    nq = model.nq
    q, v, a, rotor = (ca.SX.sym(name, nq) for name in ("q", "v", "a", "rotor"))
    gravity, payload = ca.SX.sym("g", 3), fresh_payload()
    tau = inverse_dynamics(model, q, v, a, payload, gravity, rotor)
    return ca.Function(
        "inverse_dynamics",
        [q, v, a, payload.mass, payload.com, payload.inertia, gravity, rotor],
        [tau, ca.jacobian(tau, q), ca.jacobian(tau, v), ca.jacobian(tau, a)],
    )


@pytest.fixture(scope="module")
def symbolic() -> ca.Function:
    return build(ROBOT.model)


def evaluate(
    symbolic: ca.Function, q: Array, v: Array, a: Array, load: Load, gravity: Array
) -> list[Array]:
    """The function's outputs as arrays for one state."""
    mass, com, inertia = load
    six = inertia[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
    outputs = symbolic(q, v, a, mass, com, six, gravity, ROBOT.drives.rotor_inertia)
    return [np.asarray(output.full()) for output in outputs]


def test_torques_and_derivatives_agree_with_pinocchio(symbolic: ca.Function) -> None:
    """Over random states, payloads and gravities; Pinocchio's armature is the reflected rotor
    inertia.
    """
    rng = np.random.default_rng(1)
    limits = ROBOT.limits
    worst_torque, worst_derivative = 0.0, 0.0
    for _ in range(STATES):
        q = rng.uniform(limits.q_min, limits.q_max)
        v = rng.uniform(-limits.v_max, limits.v_max)
        a = rng.uniform(-limits.a_max, limits.a_max)
        load, gravity = random_payload(rng), random_gravity(rng)
        model = ROBOT.loaded_model(*load, gravity)
        data = model.createData()
        tau, dq, dv, da = evaluate(symbolic, q, v, a, load, gravity)
        worst_torque = max(worst_torque, np.abs(tau[:, 0] - pin.rnea(model, data, q, v, a)).max())
        pin.computeRNEADerivatives(model, data, q, v, a)
        M = (
            np.triu(data.M) + np.triu(data.M, 1).T
        )  # Pinocchio fills the upper triangle only, armature included
        for ours, theirs in ((dq, data.dtau_dq), (dv, data.dtau_dv), (da, M)):
            worst_derivative = max(worst_derivative, np.abs(ours - theirs).max())
    assert worst_torque < TORQUE_TOLERANCE
    assert worst_derivative < DERIVATIVE_TOLERANCE


def test_payload_hangs_from_the_flange(symbolic: ca.Function) -> None:
    """Holding a point mass costs the moment of its weight: m (p - o_j) × (-g) along joint j's axis,
    by hand from FK.
    """
    rng = np.random.default_rng(2)
    q, z = rng.uniform(-3.0, 3.0, ROBOT.nq), np.zeros(ROBOT.nq)
    mass, com, gravity = 3.0, np.array([0.1, -0.05, 0.2]), random_gravity(rng)
    loaded = evaluate(symbolic, q, z, z, (mass, com, np.zeros((3, 3))), gravity)[0][:, 0]
    empty = evaluate(symbolic, q, z, z, (0.0, com, np.zeros((3, 3))), gravity)[0][:, 0]
    model = ROBOT.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    p = data.oMf[model.getFrameId("flange")].act(com)
    for j, oMj in enumerate(list(data.oMi)[1:]):
        lever = p - oMj.translation
        assert loaded[j] - empty[j] == pytest.approx(
            oMj.rotation[:, 2] @ np.cross(lever, -mass * gravity), abs=TORQUE_TOLERANCE
        )


def test_the_flange_may_be_turned() -> None:
    """The UR5e's flange is parallel to its last link; with another flange, com and inertia turn
    with it.
    """
    rng = np.random.default_rng(4)
    model = ROBOT.model.copy()
    flange = model.frames[model.getFrameId("flange")]
    flange.placement = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.8, 1.1), np.array([0.02, 0.01, 0.05]))
    turned, symbolic = replace(ROBOT, model=model), build(model)
    for _ in range(20):
        q, v, a = rng.uniform(-3.0, 3.0, (3, ROBOT.nq))
        load, gravity = random_payload(rng), random_gravity(rng)
        oracle = turned.loaded_model(*load, gravity)
        expected = pin.rnea(oracle, oracle.createData(), q, v, a)
        assert (
            np.abs(evaluate(symbolic, q, v, a, load, gravity)[0][:, 0] - expected).max()
            < TORQUE_TOLERANCE
        )


def test_refuses_a_joint_of_another_kind() -> None:
    """A joint about x would silently be treated as one about z."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "joint")
    one = ca.SX.sym("x")
    with pytest.raises(ValueError, match="z axes"):
        inverse_dynamics(model, one, one, one, fresh_payload(), ca.SX.sym("g", 3), one)


# entries reach some 100; both recursions round at 1e-13
TOLERANCE = 1e-10


@pytest.mark.parametrize("name", ["ur5e", "panda", "kr10_r1100"])
def test_regressor_is_pinocchios(name: str) -> None:
    random = np.random.default_rng(1)
    gravity = random.normal(size=3) * 5
    model = load_robot(name).loaded_model(2.0, np.array([0.0, 0.1, 0.1]), 0.01 * np.eye(3), gravity)
    nv, data = model.nv, model.createData()
    q, v, a, g = (
        ca.SX.sym(each, size) for each, size in (("q", nv), ("v", nv), ("a", nv), ("g", 3))
    )
    function = ca.Function("regressor", [q, v, a, g], [torque_regressor(model, q, v, a, g)])
    for _ in range(50):
        state = random.uniform(-3, 3, nv), random.uniform(-3, 3, nv), random.uniform(-10, 10, nv)
        expected = pin.computeJointTorqueRegressor(model, data, *state)
        assert np.abs(np.array(function(*state, gravity)) - expected).max() < TOLERANCE
