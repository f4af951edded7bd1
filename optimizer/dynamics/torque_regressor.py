"""Symbolic regressor of rigid-body torques in CasADi; torques are linear in ten parameters per
body.
"""

from __future__ import annotations

import casadi as ca
import pinocchio as pin

from joulepath.optimizer.dynamics.inverse_dynamics import Body, body_torques


def torque_regressor(model: pin.Model, q: ca.SX, v: ca.SX, a: ca.SX, gravity: ca.SX) -> ca.SX:
    """Matrix (nv, 10 nv) that maps the parameters of all bodies to their torques [N·m], without
    rotors.

    The parameters of a body are its mass, first moments (3) and inertia Ixx, Ixy, Iyy, Ixz, Iyz,
    Izz about the origin of its joint frame, in Pinocchio's order.

    Args:
        model: serial chain.
        q: joint positions (nv,) [rad].
        v: joint speeds (nv,) [rad/s].
        a: joint accelerations (nv,) [rad/s²].
        gravity: acceleration of gravity (3,) [m/s²] in the base frame.

    Raises:
        ValueError: a joint is not revolute about its z axis.
    """
    parameters = ca.SX.sym("parameters", 10 * model.nv)
    bodies = [_body(each) for each in ca.vertsplit(parameters, 10)]
    return ca.jacobian(ca.vertcat(*body_torques(model, q, v, a, gravity, bodies)), parameters)


def _body(parameters: ca.SX) -> Body:
    mass, x, y, z, xx, xy, yy, xz, yz, zz = ca.vertsplit(parameters)
    inertia = ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))
    return mass, ca.vertcat(x, y, z), inertia
