"""The MuJoCo model of an arm: torques, accelerations and poses against Pinocchio, and the shapes of
its bodies.
"""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import (
    Arm,
    Attachment,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Mesh,
    Obstacle,
    Payload,
    Points,
    Robot,
    Scene,
    Sphere,
    load_robot,
    robot_names,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.problem.scene import Shape
from joulepath.optimizer.replay.shapes import unsimulated
from joulepath.optimizer.replay.simulated_arm import SimulatedArm, with_changes
from joulepath.optimizer.replay.simulator import mujoco
from tests.app.forks import run
from tests.by_pinocchio import torques_of
from tests.impossible_links import with_impossible_link
from tests.models.own_arm.arms import RICH_ARM
from tests.models.own_arm.arms import robot as own_arm
from tests.optimizer.moves import PAYLOAD, START, TILTED
from tests.selection import ROBOTS

# two recursions over the same figures: rounding
ROUNDING = 1e-9
# MuJoCo stops searching the depth of two convex bodies here [m]
DEPTH = 1e-5


def states(robot: Robot, count: int = 10) -> tuple[Array, Array, Array]:
    """Random q, v, a (count, nq)."""
    rng = np.random.default_rng(7)
    q, v, a = (rng.uniform(-2.0, 2.0, (count, robot.nq)) for _ in range(3))
    return q, v, a


def loaded(robot: Robot) -> Arm:
    """An arm in a tilted mounting, with a payload, lighter links and a tool centre point."""
    T = np.eye(4)
    T[:3, 3] = [0.02, -0.01, 0.12]
    scale = np.linspace(0.6, 1.4, robot.nq)
    return Arm(robot=robot, payload=PAYLOAD, gravity=TILTED, link_mass_scale=scale, T_flange_tcp=T)


def accelerations(simulated: SimulatedArm, q: Array, v: Array, tau: Array) -> Array:
    """Accelerations (k, nq) [rad/s²] under torques tau (k, nq) [N·m], friction and contacts left
    out.
    """
    found = np.empty_like(q)
    with simulated.without("constraint"):
        for k, state in enumerate(zip(q, v, tau, strict=True)):
            simulated.data.qpos[:], simulated.data.qvel[:], simulated.data.qfrc_applied[:] = state
            mujoco().mj_forward(simulated.model, simulated.data)
            found[k] = simulated.data.qacc
    return found


def tcp_position(simulated: SimulatedArm, q: Array) -> Array:
    """Position (3,) [m] of the TCP in the base frame at q (nq,) [rad]."""
    simulated.data.qpos[:] = q
    mujoco().mj_kinematics(simulated.model, simulated.data)
    return np.array(simulated.data.site_xpos[0])


@pytest.mark.parametrize("name", [*ROBOTS, "own"])
def test_dynamics_and_poses_are_those_of_pinocchio(name: str) -> None:
    arm = loaded(own_arm(RICH_ARM) if name == "own" else load_robot(name))
    simulated, (q, v, a) = SimulatedArm(arm), states(arm.robot)
    tau = torques_of(rigid_body_model(arm), q, v, a)
    assert (np.abs(simulated.torques(q, v, a) - tau) <= ROUNDING * arm.active_limits.tau_max).all()
    # the third opinion: Featherstone's forward dynamics
    model = rigid_body_model(arm)
    data = model.createData()
    theirs = np.array([pin.aba(model, data, *state) for state in zip(q, v, tau, strict=True)])
    assert accelerations(simulated, q, v, tau) == pytest.approx(theirs, rel=ROUNDING, abs=ROUNDING)
    for each in q:
        assert tcp_position(simulated, each) == pytest.approx(
            tcp_pose(arm, each)[:3, 3], abs=ROUNDING
        )


def test_another_payload_needs_no_new_model() -> None:
    arm = loaded(load_robot("ur5e"))
    simulated, (q, v, a) = SimulatedArm(arm), states(arm.robot)
    model = simulated.model
    for changed in (with_changes(arm, payload=1.4), replace(arm, payload=Payload()), arm):
        simulated.use_figures(changed)
        assert simulated.model is model
        tau = torques_of(rigid_body_model(changed), q, v, a)
        assert (
            np.abs(simulated.torques(q, v, a) - tau) <= ROUNDING * arm.active_limits.tau_max
        ).all()


def test_an_inertia_that_no_body_has_is_taken_as_it_is() -> None:
    """The largest moment exceeds the sum of the others."""
    arm = Arm(robot=with_impossible_link(load_robot("panda")))
    body = arm.robot.model.inertias[4]
    moments = np.linalg.eigvalsh(body.inertia)
    assert moments[2] > moments[0] + moments[1]
    found = SimulatedArm(arm).model
    assert found.body_inertia[4] == pytest.approx(moments, rel=1e-12)
    assert (found.body_mass[4], found.body_ipos[4]) == (body.mass, pytest.approx(body.lever))


def test_rotors_are_in_the_torques() -> None:
    """Without armature, some torques would be off by more than a tenth of the limit."""
    arm = Arm(robot=load_robot("ur5e"))
    simulated, (q, v, a) = SimulatedArm(arm), states(arm.robot)
    with_rotors = simulated.torques(q, v, a)
    simulated.model.dof_armature[:] = 0.0
    assert with_rotors - simulated.torques(q, v, a) == pytest.approx(
        arm.drives.rotor_inertia * a, abs=1e-12
    )


SHAPES: dict[str, Shape] = {
    "sphere": Sphere(0.07),
    "capsule": Capsule(0.04, 0.2),
    "cylinder": Cylinder(0.06, 0.15),
    "box": Box(np.array([0.1, 0.14, 0.2])),
    "half-space": HalfSpace(),
    "mesh": Mesh(np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.25, 0], [0, 0, 0.3], [0.1, 0.1, 0.2]])),
}


def beside(shape: Shape, gap: float, margin: float) -> Arm:
    """An arm at START with an obstacle `gap` [m] from a ball at its flange, or as deep in it."""
    ball = Attachment(Sphere(0.05), _moved(np.eye(4), [0, 0, 0.1]))
    bare = Arm(robot=load_robot("ur5e"), tool=[ball])
    centre = tcp_pose(bare, START) @ _moved(np.eye(4), [0, 0, 0.1])

    def arm_at(height: float) -> Arm:
        turned = np.eye(4)
        turned[:3, :3] = pin.rpy.rpyToMatrix(0.4, -0.3, 1.0)
        turned[:3, 3] = centre[:3, 3] - [0.0, 0.0, height]
        return replace(bare, scene=Scene([Obstacle("thing", shape, turned, margin)]))

    low, high = 0.0, 0.6
    for _ in range(50):
        middle = (low + high) / 2
        distance = ball_distance(arm_at(middle)) + margin
        low, high = (middle, high) if distance < gap else (low, middle)
    return arm_at(low)


def _moved(T: Array, by: Any) -> Array:
    T = T.copy()
    T[:3, 3] += by
    return T


def ball_distance(arm: Arm) -> float:
    """Signed distance [m] of the ball and the obstacle by our own collision model, margin
    subtracted.
    """
    model = collision_model(arm)
    names = [set(model.names(k)) for k in range(len(model.pairs))]
    return float(model.signed_distances(START[None])[0][0, names.index({"tool", "thing"})])


@pytest.mark.parametrize("name", SHAPES)
def test_bodies_touch_where_our_distances_say(name: str) -> None:
    """Margins are no bodies: a contact is a touch."""
    simulator = mujoco()
    for gap in (1e-3, -1e-3):
        arm = beside(SHAPES[name], gap, margin=0.02)
        simulated = SimulatedArm(arm)
        simulated.data.qpos[:] = START
        simulator.mj_forward(simulated.model, simulated.data)
        found = [
            -contact.dist
            for contact in simulated.data.contact
            if {simulated.bodies[int(k)] for k in contact.geom} == {"tool", "thing"}
        ]
        assert bool(found) == (gap < 0)
        assert found == pytest.approx([-gap] * len(found), abs=DEPTH)


def test_the_arm_does_not_touch_itself_where_links_meet() -> None:
    simulator = mujoco()
    for name in robot_names():
        arm = Arm(robot=load_robot(name))
        simulated, model = SimulatedArm(arm), collision_model(arm)
        rng = np.random.default_rng(3)
        for _ in range(20):
            q = rng.uniform(arm.active_limits.q_min, arm.active_limits.q_max)
            simulated.data.qpos[:] = q
            simulator.mj_forward(simulated.model, simulated.data)
            # listed contacts are real, and real contacts are listed
            assert (simulated.data.ncon > 0) == (model.signed_distances(q[None])[0].min() < 0), name


def test_obstacles_of_many_parts_are_named() -> None:
    cloud = Obstacle("scan", Points(np.array([[0.5, 0.0, 0.5]]), 0.01))
    arm = Arm(
        robot=load_robot("ur5e"),
        scene=Scene([cloud, Obstacle("ball", Sphere(0.1), _moved(np.eye(4), [1, 1, 1]))]),
    )
    assert unsimulated(arm) == ["scan"]
    assert "ball" in SimulatedArm(arm).bodies
    assert "scan" not in SimulatedArm(arm).bodies
    assert (
        unsimulated(replace(arm, collisions=False))
        == SimulatedArm(replace(arm, collisions=False)).bodies
        == []
    )


def test_only_a_replay_imports_mujoco() -> None:
    """It takes 20 MB of memory per process, which other requests do not need."""
    code = (
        "import sys, joulepath.app.main, joulepath.app.server, joulepath.app.api.replay.task\n"
        "import joulepath.optimizer.replay.replay\n"
        "from tests.optimizer.moves import problem; from joulepath import optimize\n"
        "optimize(problem()); print('mujoco' in sys.modules)\n"
        "from joulepath.optimizer.replay.simulator import mujoco; mujoco(); print('mujoco' in "
        "sys.modules)\n"
    )
    ended = run(("-c", code), os.environ, patience=120.0)
    assert (ended.stdout.split(), ended.stderr) == ([b"False", b"True"], b"")
