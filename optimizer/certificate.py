"""The certificate: a motion replayed by Pinocchio on a fine grid, apart from the optimiser's basis and dynamics.

Nothing is taken from the solver but the spline that is returned to the caller and the energies claimed for it.
"""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from scipy.interpolate import BSpline

from models.robot import Array
from optimizer.collision.clearance_proof import clearance
from optimizer.collision.model import collision_model
from optimizer.energy.dwell import dwell_energy, holding_power
from optimizer.energy.losses import breakdown
from optimizer.kinematics.orientation_tolerance import excess_angle
from optimizer.kinematics.rigid_body_model import rigid_body_model
from optimizer.linear_algebra import one_thread
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.problem.pose import Pose
from optimizer.problem.problem import Problem
from optimizer.problem.targets import Single, single
from optimizer.solution import Certificate, Energy
from optimizer.trajectories.limit_ratios import limit_ratios
from optimizer.trajectories.quadrature import grid, simpson_weights
from optimizer.trajectories.spline import Spline

ENERGY_FLOOR = 1e-6  # J; below it a relative error says nothing


@one_thread()
def certify(problem: Problem, spline: Spline, q_start: Array, q_goal: Array, reported: Energy) -> Certificate:
    """Replay `spline` and hold it against everything that was asked and reported.

    Of several targets, the problem must be `narrowed` to those reached. q_start, q_goal (nq,) [rad] are the joint
    positions that the answer names as its ends. The grid is uniform, of at most 1 ms, and includes both ends. Motions
    that leave the spline's own knots give NaN, which no tolerance passes.
    """
    model = rigid_body_model(problem.arm)
    data = model.createData()

    t = grid(spline.duration)
    curve = BSpline(spline.knots, spline.control_points, spline.degree, extrapolate=False)
    q, v, a, jerk = (np.ascontiguousarray(curve(t, order)) for order in range(4))
    tau = _inverse_dynamics(model, data, q, v, a)
    tau_motor = tau + problem.arm.friction_law.torque(v)

    energy = breakdown(
        simpson_weights(t),
        v,
        tau,
        potential=_change([pin.computePotentialEnergy(model, data, q[i]) for i in (0, -1)]),
        kinetic=_change([pin.computeKineticEnergy(model, data, q[i], v[i]) for i in (0, -1)]),
        arm=problem.arm,
    )
    if problem.cycle is not None:
        still = np.zeros_like(q[-1:])
        hold = float(holding_power(problem.arm, _inverse_dynamics(model, data, q[-1:], still, still))[0])
        energy = energy.with_dwell(dwell_energy(problem.cycle, problem.arm, hold, spline.duration))
    limits = problem.arm.active_limits
    return Certificate(
        worst_ratio=limit_ratios(limits, q, v, a, jerk, tau_motor) | _path_ratios(problem, model, data, q, v),
        start_error=_end_error(problem, single(problem.start), q_start, q[0], model, data),
        goal_error=_end_error(problem, single(problem.goal), q_goal, q[-1], model, data),
        rest_error=float(np.max([np.abs(v[[0, -1]]) / limits.v_max, np.abs(a[[0, -1]]) / limits.a_max])),
        energy_error=_worst(
            _relative(energy.electrical.total, reported.electrical.total),
            _relative(energy.mechanical.total, reported.mechanical.total),
        ),
        balance_error=_worst(
            *(_relative(each.electrical.parts_sum, each.electrical.total) for each in (energy, reported))
        ),
        clearance=clearance(collision_model(problem.arm), spline) if problem.arm.collisions else None,
    )


def _path_ratios(problem: Problem, model: pin.Model, data: pin.Data, q: Array, v: Array) -> dict[str, float]:
    """The worst value / limit of where the tool points and how fast TCP and elbow move, of those that are limited."""
    cone, elbow = problem.arm.tool_cone, problem.arm.robot.elbow
    values: dict[str, list[float]] = {}
    limited = [name for name in ("tool_cone", "tcp_speed", "elbow_speed") if getattr(problem.arm, name) is not None]
    if not limited:
        return {}
    for q_k, v_k in zip(q, v, strict=True):
        pin.forwardKinematics(model, data, q_k, v_k)
        T_base_tcp = (
            data.oMi[model.njoints - 1].homogeneous @ problem.arm.robot.T_last_flange @ problem.arm.T_flange_tcp
        )
        if cone is not None:
            pointing = T_base_tcp[:3, :3] @ cone.axis
            angle = math.atan2(float(np.linalg.norm(np.cross(pointing, cone.direction))), pointing @ cone.direction)
            values.setdefault("tool_cone", []).append(angle / cone.half_angle)
        if problem.arm.tcp_speed is not None:
            speed = _speed(data, model.njoints - 1, T_base_tcp[:3, 3])
            values.setdefault("tcp_speed", []).append(speed / problem.arm.tcp_speed)
        if problem.arm.elbow_speed is not None and elbow is not None:
            points = elbow.axis @ data.oMi[elbow.link].rotation.T + data.oMi[elbow.link].translation
            speed = max(_speed(data, elbow.link, point) for point in points)
            values.setdefault("elbow_speed", []).append(speed / problem.arm.elbow_speed)
    return {name: float(np.max(each)) for name, each in values.items()}


def _speed(data: pin.Data, joint: int, x: Array) -> float:
    """Speed [m/s] of a point at x (3,) in the base frame that a joint's link carries."""
    motion = data.oMi[joint].act(data.v[joint])
    return float(np.linalg.norm(motion.linear + np.cross(motion.angular, x)))


def _inverse_dynamics(model: pin.Model, data: pin.Data, q: Array, v: Array, a: Array) -> Array:
    """Rigid body and rotor torques (k, nv): Pinocchio's recursion adds armature · a."""
    tau = np.empty_like(v)
    rnea = pin.rnea
    for k, (q_k, v_k, a_k) in enumerate(zip(q, v, a, strict=True)):
        tau[k] = rnea(model, data, q_k, v_k, a_k)
    return tau


def _end_error(
    problem: Problem, target: Single, named: Array, reached: Array, model: pin.Model, data: pin.Data
) -> tuple[float, float]:
    """(position [m], rotation [rad]) between the TCP reached and the target.

    Forward kinematics cannot tell joint positions a full turn apart: the rotation is the largest joint's deviation
    from the joints named (and from those asked for) where that is more. Where the orientation is free in part, it is
    the angle to the nearest orientation allowed.
    """
    T_reached = _tcp(problem, reached, model, data)
    if isinstance(target, ConeOrientedPose):
        position = float(np.linalg.norm(T_reached[:3, 3] - target.position))
        return position, _worst(excess_angle(target, T_reached[:3, :3]), float(np.abs(reached - named).max()))
    if isinstance(target, Pose):
        T_asked, joints = target.T, [named]
    else:
        T_asked, joints = _tcp(problem, target, model, data), [named, target]
    position = float(np.linalg.norm(T_reached[:3, 3] - T_asked[:3, 3]))
    rotation = float(np.linalg.norm(pin.log3(T_asked[:3, :3].T @ T_reached[:3, :3])))
    return position, _worst(rotation, *(float(np.abs(reached - each).max()) for each in joints))


def _tcp(problem: Problem, q: Array, model: pin.Model, data: pin.Data) -> Array:
    """T_base_tcp (4, 4) by forward kinematics."""
    pin.forwardKinematics(model, data, q)
    T_base_flange = pin.updateFramePlacement(model, data, model.getFrameId("flange"))
    return np.asarray(T_base_flange.homogeneous @ problem.arm.T_flange_tcp)


def _change(ends: list[float]) -> float:
    return ends[1] - ends[0]


def _relative(value: float, reference: float) -> float:
    return abs(value - reference) / max(abs(reference), ENERGY_FLOOR)


def _worst(*values: float) -> float:
    """The largest; NaN if any is NaN, unlike `max`."""
    return float(np.max(values))
