"""The MJCF of a robot: MuJoCo and the library compute equal torques."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from joulepath import Arm, Robot, load_robot, mjcf
from joulepath.models.possible_inertia import nearest_possible_inertia
from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import CollisionModel
from tests.by_pinocchio import flange
from tests.models.own_arm.arms import RICH_ARM, URDF, changed, robot
from tests.selection import long_but

# N·m: rounding of torques of some 500 N·m, and the effect of inertias adjusted for MuJoCo
TORQUE = 1e-9
MENDED = 0.02
NAMES = ("ur5e", "panda", "ur30")


@pytest.fixture(params=[*long_but(NAMES[:2], NAMES), "own"])
def arm(request: pytest.FixtureRequest) -> Robot:
    return robot(RICH_ARM) if request.param == "own" else load_robot(request.param)


def torques(model: mujoco.MjModel, q: Array, v: Array, a: Array) -> Array:
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
    mujoco.mj_inverse(model, data)
    return np.array(data.qfrc_inverse)


def test_torques_are_those_of_links_rotors_and_viscous_friction(arm: Robot) -> None:
    """MuJoCo's and Pinocchio's inverse dynamics agree at random states."""
    model, rng = mujoco.MjModel.from_xml_string(mjcf(arm)), np.random.default_rng(7)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    limits, own = arm.limits, arm.model.copy()
    own.gravity.linear = arm.gravity
    data = own.createData()
    mended = max(
        float(np.abs(nearest_possible_inertia(body.inertia) - body.inertia).max())
        for body in list(own.inertias)[1:]
    )
    accuracy = TORQUE if mended < 1e-12 else MENDED
    for _ in range(20):
        q = rng.uniform(limits.q_min, limits.q_max)
        v, a = (rng.uniform(-most, most) for most in (limits.v_max, limits.a_max))
        expected = pin.rnea(own, data, q, v, a) + model.dof_damping * v
        assert np.abs(torques(model, q, v, a) - expected).max() < accuracy


def test_friction_is_that_of_the_law(arm: Robot) -> None:
    """Exactly for Coulomb and viscous friction; within a few percent with a concave rise."""
    model, law = mujoco.MjModel.from_xml_string(mjcf(arm)), arm.friction
    v = np.linspace(0.1, 1.0, 10)[:, None] * arm.limits.v_max
    ours = law.torque(v, np.zeros_like(v))
    theirs = model.dof_frictionloss + model.dof_damping * v
    share = 0.25 if law.curved.any() else 1e-3
    assert np.abs(theirs - ours).max(axis=0) == pytest.approx(0.0, abs=share * ours.max())


def test_links_meet_as_in_the_collision_model() -> None:
    """An arm above a wide plate: a capsule around the plate would touch the forearm everywhere. The
    hulls in the file extend up to 2 mm further.
    """
    plate = '<collision><geometry><box size="1.5 1.5 0.02"/></geometry></collision>'
    rod = '<collision><origin xyz="0 0 0.15"/><geometry>{}</geometry></collision>'
    text = URDF.replace('<link name="base"/>', f'<link name="base">{plate}</link>')
    text = text.replace(
        '<link name="forearm">',
        '<link name="forearm">' + rod.format('<cylinder radius="0.03" length="0.3"/>'),
    )
    above = robot(changed(urdf=text))
    assert not above.never_in_collision and above.links_by_hulls == {0, 1, 2}
    model, compared = mujoco.MjModel.from_xml_string(mjcf(above)), CollisionModel(Arm(robot=above))
    data, rng = mujoco.MjData(model), np.random.default_rng(4)
    met = []
    for q in rng.uniform(above.limits.q_min, above.limits.q_max, (200, above.nq)):
        distance = compared.least_distance(q[None], 1.0)
        if -1e-4 < distance < 2 * 2e-3:
            continue
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        assert (data.ncon > 0) == (distance < 0)
        met.append(data.ncon > 0)
    assert 0.05 < np.mean(met) < 0.95


def test_limits_names_and_capsules(arm: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(mjcf(arm))
    assert (model.jnt_range == np.column_stack([arm.limits.q_min, arm.limits.q_max])).all()
    assert (model.actuator_ctrlrange[:, 1] == arm.limits.tau_max).all()
    assert [model.joint(k).name for k in range(arm.nq)] == list(arm.joint_names)
    capsules = [each for each in arm.capsules if each.link not in arm.links_by_hulls]
    hulls = [each for each in arm.hulls if each.link in arm.links_by_hulls]
    assert model.ngeom == len(capsules) + len(hulls)
    data = mujoco.MjData(model)
    data.qpos[:] = (arm.limits.q_min + arm.limits.q_max) / 2 + 0.1
    mujoco.mj_forward(model, data)
    expected = flange(arm, np.array(data.qpos))[:3, 3]
    assert data.site("flange").xpos == pytest.approx(expected, abs=TORQUE)


def test_a_link_without_mass_is_refused() -> None:
    light = load_robot("ur5e")
    model = light.model.copy()
    model.inertias[3] = pin.Inertia.Zero()
    with pytest.raises(ValueError, match="'forearm' has no mass"):
        mjcf(replace(light, model=model))


def test_an_impossible_inertia_is_mended() -> None:
    """Otherwise MuJoCo would refuse the file; the torques stay nearly the same."""
    bent = load_robot("ur5e")
    model = bent.model.copy()
    body = model.inertias[2]
    moments = np.array([0.01, 0.01, 0.0208])
    model.inertias[2] = pin.Inertia(body.mass, body.lever, np.diag(moments))
    text = mjcf(replace(bent, model=model))
    state = np.full(6, 0.3), np.full(6, 0.5), np.full(6, 1.0)
    simulated = mujoco.MjModel.from_xml_string(text)
    simulated.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    expected = pin.rnea(model, model.createData(), *state) + simulated.dof_damping * state[1]
    assert np.abs(torques(simulated, *state) - expected).max() < MENDED
