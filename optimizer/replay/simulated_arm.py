"""MuJoCo model of an arm: links with the inertias of the figures, rotors as armature, friction."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.uncoupled import check_uncoupled
from joulepath.optimizer.replay.shapes import add_shapes, pose
from joulepath.optimizer.replay.simulator import mujoco


@dataclass(frozen=True)
class FrictionSettings:
    """Settings of simulated friction."""

    min_speed: float = 1e-9
    """Speed up to which the ratio of friction to speed is that of standstill [rad/s]."""


FRICTION = FrictionSettings()


class SimulatedArm:
    """A MuJoCo model of an arm.

    `use_figures` changes masses and friction without a new compilation. `bodies` are the names of
    the bodies by the number of their geom.
    """

    def __init__(self, arm: Arm) -> None:
        check_uncoupled(arm.robot, "robot", "Motions are not replayed in MuJoCo")
        self._simulator = mujoco()
        spec = self._simulator.MjSpec()
        joints = arm.robot.nq
        links = [spec.worldbody]
        for k in range(1, joints + 1):
            placement = np.asarray(arm.robot.model.jointPlacements[k].homogeneous)
            link = links[-1].add_body(name=f"link {k}", explicitinertial=True, **pose(placement))
            # a placeholder: the compiler refuses inconsistent bodies, such as some published links.
            # It must not coincide with the link's frame, because a model would keep that property
            link.mass, link.inertia, link.ipos, link.iquat = (
                1.0,
                [1.0, 1.1, 1.2],
                [0.1, 0.2, 0.3],
                [0.8, 0.6, 0.0, 0.0],
            )
            link.add_joint(
                name=f"joint {k}", type=self._simulator.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0]
            )
            links.append(link)
        self.bodies = add_shapes(self._simulator, spec, links, arm)
        links[-1].add_site(name="tcp", **pose(arm.robot.T_last_flange @ arm.T_flange_tcp))
        self.model = spec.compile()
        self.data = self._simulator.MjData(self.model)
        self.model.body_sameframe[:] = 0
        self.use_figures(arm)

    def use_figures(self, arm: Arm) -> None:
        """Take masses, inertias, gravity and friction from another arm of the same robot and
        shapes."""
        self.arm = arm
        figures = rigid_body_model(arm)
        for k in range(1, figures.njoints):
            body = figures.inertias[k]
            moments, axes = np.linalg.eigh(body.inertia)
            axes[:, 2] *= np.linalg.det(axes)
            self.model.body_mass[k] = body.mass
            self.model.body_ipos[k] = body.lever
            self.model.body_inertia[k] = moments
            self.model.body_iquat[k] = Rotation.from_matrix(axes).as_quat(scalar_first=True)
        self.model.dof_armature[:] = arm.drives.rotor_inertia
        self.model.opt.gravity[:] = arm.gravity
        self._simulator.mj_setConst(self.model, self.data)

    @contextmanager
    def without(self, part: Literal["contact", "constraint"]) -> Iterator[None]:
        """Within the context, contacts, or contacts and Coulomb friction, have no effect."""
        bits, flags = self._simulator.mjtDisableBit, self.model.opt.disableflags
        self.model.opt.disableflags |= int(getattr(bits, f"mjDSBL_{part.upper()}"))
        try:
            yield
        finally:
            self.model.opt.disableflags = flags

    def set_friction(self, v: Array, tau_link: Array) -> None:
        """Set the friction for one step.

        Friction is set as damping, the torque of the law over the speed, which MuJoCo multiplies by
        the speed at the end of the step. The knee of the law is a hundred times too steep for a
        torque known at the beginning of the step.

        Args:
            v: expected speed at the end of the step (nq,) [rad/s].
            tau_link: torque that the joints carry (nq,) [N·m].
        """
        v = np.maximum(np.abs(v), FRICTION.min_speed)
        self.model.dof_damping[:] = self.arm.friction_law.torque(v, tau_link) / v

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        """Rigid-body and rotor torques (k, nq) [N·m] by MuJoCo's inverse dynamics, without friction
        and contacts.
        """
        found = np.empty_like(q)
        with self.without("constraint"):
            for k, state in enumerate(zip(q, v, a, strict=True)):
                self.data.qpos[:], self.data.qvel[:], self.data.qacc[:] = state
                self._simulator.mj_inverse(self.model, self.data)
                found[k] = self.data.qfrc_inverse
        return found


def with_changes(arm: Arm, payload: float = 1.0, friction: float = 1.0) -> Arm:
    """The arm with the payload's mass and inertia, and with its friction, multiplied by factors."""
    load, robot = arm.payload, arm.robot
    law = arm.friction_law
    scaled = replace(
        law,
        coulomb=law.coulomb * friction,
        curved=law.curved * friction,
        viscous=law.viscous * friction,
        load=None if law.load is None else law.load * friction,
    )
    return replace(
        arm,
        payload=replace(load, mass=load.mass * payload, inertia=load.inertia * payload),
        robot=robot if friction == 1 else replace(robot, friction_laws={law.name: scaled}),
        friction=arm.friction if friction == 1 else law.name,
    )
