"""Serial chains of any number of revolute joints, made by numpy: not commercial arms."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from joulepath.models.robot import (
    Array,
    DefaultMotion,
    Drives,
    Electronics,
    FrictionLaw,
    Limits,
    LinkCapsule,
    Robot,
)

# distance of neighbouring joints [m], radius of the capsule around a link [m], mass of a link [kg]
LENGTH = 0.22
RADIUS = 0.03
MASS = 1.6


def serial_chain(nq: int, capsules: bool = True) -> Robot:
    """A chain with alternately perpendicular axes, exactly or nearly, and with the strongest joints
    at the base.
    """
    rng = np.random.default_rng(nq)
    model = pin.Model()
    model.name = f"chain_{nq}"
    model.addFrame(pin.Frame("base", 0, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    along = np.array([0.0, 0.0, LENGTH])
    for k in range(1, nq + 1):
        # alternately a roll about the chain's direction and a pitch across it, off by some degrees
        axis = pin.rpy.rpyToMatrix(
            *(np.array([np.pi / 2 if k % 2 else -np.pi / 2, 0, 0]) + rng.normal(0, 0.05, 3))
        )
        placement = pin.SE3(np.eye(3) if k == 1 else axis, along if k == 1 else axis @ along)
        joint = model.addJoint(k - 1, pin.JointModelRZ(), placement, f"joint_{k}")
        lever = rng.uniform(-0.3, 0.3, 3) * LENGTH
        body = pin.Inertia(MASS, lever, np.diag(rng.uniform(0.8, 1.2, 3)) * MASS * LENGTH**2 / 12)
        model.appendBodyToJoint(joint, body, pin.SE3.Identity())
        model.addFrame(pin.Frame(f"link_{k}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.addFrame(pin.Frame("flange", nq, 0, pin.SE3(np.eye(3), along / 2), pin.FrameType.BODY))
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    rotor_inertia = 0.4 / np.arange(1, nq + 1)
    model.armature = rotor_inertia
    ones, zeros = np.ones(nq), np.zeros(nq)
    strength = np.linspace(160.0, 40.0, nq)
    return Robot(
        name=model.name,
        title=f"A chain of {nq} joints",
        model=model,
        limits=Limits(-3.0 * ones, 3.0 * ones, 2.5 * ones, 8.0 * ones, 150.0 * ones, strength),
        rated_payload=2.0,
        drives=Drives(
            100 * ones, 9.0 * ones, rotor_inertia, 0.5 * ones, 0.2 * ones, 0.05 * ones, zeros
        ),
        electronics=Electronics(idle_power=25.0, controller_power=5.0, regeneration=0.3),
        friction_laws={
            "coulomb_viscous": FrictionLaw(
                "coulomb_viscous", 0.02 * strength, zeros, ones, 0.05 * strength
            )
        },
        default_motion=DefaultMotion(1.0, 1.5),
        capsules=_capsules(model) if capsules else (),
        never_in_collision=frozenset(),
        figures={},
    )


def _capsules(model: pin.Model) -> tuple[LinkCapsule, ...]:
    """One capsule around every link, from its joint to the next joint or to the flange."""
    flange = model.frames[model.getFrameId("flange")].placement.translation
    ends = [placement.translation for placement in list(model.jointPlacements)[1:]] + [flange]
    # short of the joints at both ends, so links with one link between them do not touch at every
    # position
    return tuple(
        LinkCapsule(k, np.array([0.2 * end, 0.8 * end]), RADIUS) for k, end in enumerate(ends)
    )


def move(nq: int) -> tuple[Array, Array]:
    """Start and goal (nq,) [rad] of a motion of the chain without self-collision."""
    start = np.linspace(0.3, 0.6, nq)
    return start, start + 0.7 * np.cos(np.arange(nq))
