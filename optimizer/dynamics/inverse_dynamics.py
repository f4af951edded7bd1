"""Symbolic inverse dynamics in CasADi, built from a Pinocchio model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pinocchio as pin

from joulepath.models.coupling import UNCOUPLED, Coupling
from joulepath.models.robot import flange_placement

_Z = ca.DM([0, 0, 1])


@dataclass(frozen=True)
class SymbolicPayload:
    """Symbols of a body fixed to the flange.

    `mass` [kg], `com` (3,) [m] in the flange frame, `inertia` (6,) [kg·m²] ixx ixy ixz iyy iyz izz
    about the center of mass, in flange axes.
    """

    mass: ca.SX
    com: ca.SX
    inertia: ca.SX


def _tidy(matrix: np.ndarray) -> ca.DM:
    """The matrix with entries within 1e-12 of an integer rounded, so that CasADi drops terms that
    are zero but for the rounding of sines and cosines of right angles.
    """
    rounded = np.round(matrix)
    return ca.sparsify(ca.DM(np.where(np.abs(matrix - rounded) < 1e-12, rounded, matrix)))


def _about_origin(mass: ca.SX, com: ca.SX, inertia: ca.SX) -> ca.SX:
    """Inertia (3, 3) [kg·m²] about the frame's origin, by the parallel axis theorem."""
    return inertia + mass * (ca.dot(com, com) * ca.SX.eye(3) - com @ com.T)


def _rotation_z(angle: ca.SX) -> ca.SX:
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))


def inverse_dynamics(
    model: pin.Model,
    q: ca.SX,
    v: ca.SX,
    a: ca.SX,
    payload: SymbolicPayload,
    gravity: ca.SX,
    rotor: ca.SX,
    link_mass_scale: ca.SX | None = None,
    coupling: Coupling = UNCOUPLED,
) -> ca.SX:
    """Joint torques tau (nv,) [N·m] = M(q) a + C(q, v) v + g(q) + rotor · a, with a payload at the
    flange.

    With a `coupling`, nv is the number of joints that follow no other.

    Args:
        model: serial chain with a frame `flange`; its armature and gravity are not read.
        q: joint positions (nv,) [rad].
        v: joint speeds (nv,) [rad/s].
        a: joint accelerations (nv,) [rad/s²].
        payload: body at the frame `flange`.
        gravity: acceleration of gravity (3,) [m/s²] in the base frame.
        rotor: reflected rotor inertia (nv,) [kg·m²].
        link_mass_scale: factor (nv,) [1] on mass and inertia of the links that each joint turns,
            but not of the payload; None means 1.
        coupling: joints of the chain that follow others.

    Raises:
        ValueError: a joint is not revolute about its z axis.
    """
    _check_chain(model)
    scales: Sequence[ca.SX | int] = (
        [1] * model.nv if link_mass_scale is None else ca.vertsplit(link_mass_scale)
    )
    chain = q, v, a
    if coupling.follows:
        matrix = ca.sparsify(ca.DM(coupling.matrix))
        chain = matrix @ q + ca.DM(coupling.offset), matrix @ v, matrix @ a
        scales = [scales[leader] for leader in coupling.leaders]
    bodies = [_link(model, i, payload, scale) for i, scale in enumerate(scales, 1)]
    torques = body_torques(model, *chain, gravity, bodies)
    if coupling.follows:
        torques = ca.vertsplit(matrix.T @ ca.vertcat(*torques))
    return ca.vertcat(*(torque + rotor[j] * a[j] for j, torque in enumerate(torques)))


Body = tuple[ca.SX, ca.SX, ca.SX]
"""Mass [kg], first moment (3,) [kg·m] and inertia (3, 3) [kg·m²] of a link about the origin of its
joint frame.
"""


def body_torques(
    model: pin.Model, q: ca.SX, v: ca.SX, a: ca.SX, gravity: ca.SX, bodies: Sequence[Body]
) -> list[ca.SX]:
    """Torques [N·m] of rigid bodies on the links of a chain, one per joint; the model's inertias
    are not read.

    Recursive Newton-Euler in link frames (Luh, Walker, Paul 1980; Featherstone 2008, ch. 5). The
    torques are linear in the entries of the bodies.

    Raises:
        ValueError: a joint is not revolute about its z axis.
    """
    _check_chain(model)
    joints = range(1, model.njoints)
    rotations = {
        i: _tidy(model.jointPlacements[i].rotation) @ _rotation_z(q[i - 1]) for i in joints
    }
    offsets = {i: _tidy(model.jointPlacements[i].translation) for i in joints}
    forces: dict[int, ca.SX] = {}
    moments: dict[int, ca.SX] = {}

    omega, alpha, acceleration = ca.SX(3, 1), ca.SX(3, 1), -gravity
    for i in joints:
        R, p = rotations[i], offsets[i]
        acceleration = R.T @ (
            acceleration + ca.cross(alpha, p) + ca.cross(omega, ca.cross(omega, p))
        )
        spin = _Z * v[i - 1]
        omega_parent = R.T @ omega
        omega = omega_parent + spin
        alpha = R.T @ alpha + _Z * a[i - 1] + ca.cross(omega_parent, spin)
        mass, moment, inertia = bodies[i - 1]
        forces[i] = (
            mass * acceleration + ca.cross(alpha, moment) + ca.cross(omega, ca.cross(omega, moment))
        )
        moments[i] = (
            inertia @ alpha + ca.cross(omega, inertia @ omega) + ca.cross(moment, acceleration)
        )

    tau = [ca.SX(0)] * model.nv
    force, torque = ca.SX(3, 1), ca.SX(3, 1)
    for i in reversed(joints):
        force, torque = forces[i] + force, moments[i] + torque
        tau[i - 1] = torque[2]
        R, p = rotations[i], offsets[i]
        force = R @ force
        torque = R @ torque + ca.cross(p, force)
    return tau


def _check_chain(model: pin.Model) -> None:
    joints = range(1, model.njoints)
    if any(
        model.joints[i].shortname() != "JointModelRZ" or model.parents[i] != i - 1 for i in joints
    ):
        raise ValueError("the model must be a serial chain of joints that turn about their z axes")


def _link(model: pin.Model, i: int, payload: SymbolicPayload, scale: ca.SX | int) -> Body:
    """Body of link i. `scale` multiplies mass and inertia of the link itself; the last link
    includes the payload.
    """
    body = model.inertias[i]
    com = ca.SX(_tidy(body.lever))
    # Constants are multiplied first, so that the scale costs one product per entry.
    link_mass = ca.SX(body.mass)
    mass, moment = scale * link_mass, scale * (link_mass * com)
    inertia = scale * _about_origin(link_mass, com, ca.SX(_tidy(body.inertia)))
    if i == model.njoints - 1:
        flange = flange_placement(model)
        R = _tidy(flange.rotation)
        load_com = R @ payload.com + _tidy(flange.translation)
        ixx, ixy, ixz, iyy, iyz, izz = ca.vertsplit(payload.inertia)
        tensor = ca.vertcat(
            ca.horzcat(ixx, ixy, ixz), ca.horzcat(ixy, iyy, iyz), ca.horzcat(ixz, iyz, izz)
        )
        mass = mass + payload.mass
        moment = moment + payload.mass * load_com
        inertia = inertia + _about_origin(payload.mass, load_com, R @ tensor @ R.T)
    return mass, moment, inertia
