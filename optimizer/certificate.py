"""Certificate of a motion: an independent check of the returned spline on a grid of at most 1 ms.

The certificate uses nothing of the solver except the spline and the reported energy. Torques,
energies and TCP poses come from Pinocchio's own recursions, not from the compiled kernel or the
kinematics of the optimiser.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.collision.clearance_proof import proven_clearance
from joulepath.optimizer.collision.close_pass import close_pass
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.dynamics.dwell import holding_power, with_dwell
from joulepath.optimizer.dynamics.losses import breakdown, friction_torque, relative_error
from joulepath.optimizer.dynamics.torque_bound import TorqueSamples, torque_bounds
from joulepath.optimizer.kinematics.orientation_tolerance import excess_angle
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.motion.limit_ratios import limit_ratios
from joulepath.optimizer.motion.passing import deviations
from joulepath.optimizer.motion.quadrature import grid, simpson_weights
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Single, single
from joulepath.optimizer.problem.tool_cone import ToolCone
from joulepath.optimizer.problem.tool_path import TOOL_PATH, ToolPath
from joulepath.optimizer.result.certificate import Certificate, EndError
from joulepath.optimizer.result.energy import Energy


@dataclass(frozen=True)
class CertificateSettings:
    """Settings of the certificate."""

    block: int = 5000
    """Instants of the grid between two checks of the deadline, some ten milliseconds."""
    most_on_path: int = 20_000
    """Most instants at which a motion is compared with its tool path."""
    time_per_instant: float = 3e-6
    """Least time of the certificate per instant [s]."""
    time_after_torques: float = 1.5e-6
    """Least time of the certificate after the torques, per instant [s]."""


CERTIFICATE = CertificateSettings()


@one_thread()
def certify(
    problem: Problem, spline: Spline, q_start: Array, q_goal: Array, reported: Energy
) -> Certificate:
    """Certificate of a motion.

    The uniform grid includes both ends. A spline that does not cover the grid gives NaN, which
    passes no tolerance.

    Args:
        problem: problem of the motion, `narrowed` to the reached targets.
        spline: the motion.
        q_start: joint positions reported for the start, shape (nq,) [rad].
        q_goal: joint positions reported for the goal, shape (nq,) [rad].
        reported: reported energy.

    Raises:
        DeadlinePassed: the watched deadline passed.
    """
    arm, replay = problem.arm, _Replay(problem.arm, spline)
    if len(replay.t) > CERTIFICATE.block:
        checkpoint(len(replay.t) * CERTIFICATE.time_after_torques)
    energy = replay.energy
    if problem.dwell is not None:
        held = replay.final_holding_power
        energy = with_dwell(energy, problem.dwell, arm, held, spline.duration)
    clearance = proven_clearance(collision_model(arm), spline) if arm.collisions else None
    return Certificate(
        worst_ratio=replay.limit_ratios | replay.path_ratios | replay.tool_path_ratios(problem),
        start_error=replay.end_error(single(problem.start), q_start, replay.q[0]),
        goal_error=replay.end_error(single(problem.goal), q_goal, replay.q[-1]),
        rest_error=replay.rest_error,
        pass_error=float(deviations(spline.curve, np.array(problem.passes)).max())
        if problem.passes
        else 0.0,
        energy_error=_worst(
            relative_error(energy.electrical.total, reported.electrical.total),
            relative_error(energy.mechanical.total, reported.mechanical.total),
        ),
        balance_error=_worst(
            *(
                relative_error(each.electrical.parts_sum, each.electrical.total)
                for each in (energy, reported)
            )
        ),
        clearance=clearance,
        close_pass=close_pass(arm, spline, clearance),
    )


class _Replay:
    """A motion on the grid, by Pinocchio.

    `t` (k,) [s]; `q`, `v`, `a`, `jerk` (k, nq) in rad and s; `tau` (k, nq) [N·m] is the torque of
    rigid bodies and rotors, without friction.
    """

    def __init__(self, arm: Arm, spline: Spline) -> None:
        self.arm, self.model, self._spline = arm, rigid_body_model(arm), spline
        self._coupling, self.data = arm.robot.coupling, self.model.createData()
        self._last, self._T_last_tcp = self.model.njoints - 1, T_last_tcp(arm)
        self.t, curve = grid(spline.duration), spline.curve
        if len(self.t) > CERTIFICATE.block:
            checkpoint(len(self.t) * CERTIFICATE.time_per_instant)
        self.q, self.v, self.a, self.jerk = (
            np.ascontiguousarray(curve(self.t, order, extrapolate=False)) for order in range(4)
        )
        self.tau = self.torques(self.q, self.v, self.a)
        self._lost = friction_torque(arm.friction_law, arm.drives, self.tau, self.v, self.a)

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        """Torques (k, nq) [N·m] of rigid bodies and rotors; Pinocchio's recursion includes armature
        · a.
        """
        q, (v, a) = self._coupling.positions(q), map(self._coupling.rates, (v, a))
        tau = np.empty((v.shape[1], len(v)), order="F")
        # Pinocchio's loop over the columns in this thread is twice as fast as single calls
        pool = pin.ModelPool(self.model, 1)
        for low in range(0, len(v), CERTIFICATE.block):
            if low:
                checkpoint()
            block = slice(low, low + CERTIFICATE.block)
            pin.rneaInParallel(
                1, pool, *(np.asfortranarray(x[block].T) for x in (q, v, a)), tau[:, block]
            )
        return self._coupling.on_arm(tau.T)

    @property
    def energy(self) -> Energy:
        """Energy of the motion by Simpson's rule, without the dwell."""
        potential, kinetic = pin.computePotentialEnergy, pin.computeKineticEnergy
        q, v = self._coupling.positions(self.q[[0, -1]]), self._coupling.rates(self.v[[0, -1]])
        ends = [
            (potential(self.model, self.data, q[k]), kinetic(self.model, self.data, q[k], v[k]))
            for k in range(2)
        ]
        gain_potential, gain_kinetic = (after - before for before, after in zip(*ends, strict=True))
        weights = simpson_weights(self.t)
        return breakdown(
            weights, self.v, self.a, self.tau, gain_potential, self.arm, gain_kinetic, self._lost
        )

    @property
    def final_holding_power(self) -> float:
        """Power of holding the arm still at the end of the motion [W]."""
        standstill = np.zeros_like(self.q[-1:])
        return float(holding_power(self.arm, self.torques(self.q[-1:], standstill, standstill))[0])

    @property
    def limit_ratios(self) -> dict[str, float]:
        """Worst ratio to the limit of position, velocity, acceleration, jerk, and a bound of the
        torque.

        Between two samples, a torque may peak where a joint reverses and friction changes sign. The
        other quantities are polynomials, whose peaks exceed the samples by less than the tolerance
        of a ratio.
        """
        samples = TorqueSamples(*(x[None] for x in (self.t, self.v, self.a, self.tau, self._lost)))
        tau = torque_bounds(self.arm, self._spline.curve, self.torques, samples)[None]
        return limit_ratios(self.arm.active_limits, self.q, self.v, self.a, self.jerk, tau)

    @property
    def rest_error(self) -> float:
        """Worst |v| / v_max and |a| / a_max at both ends."""
        limits, ends = self.arm.active_limits, [0, -1]
        v, a = np.abs(self.v[ends]), np.abs(self.a[ends])
        return float(np.max([v / limits.v_max, a / limits.a_max]))

    @property
    def path_ratios(self) -> dict[str, float]:
        """Worst ratio to the limits of the tool's cone and of the speeds of TCP and elbow."""
        arm, ratios = self.arm, {}
        if arm.tool_cone is None and arm.tcp_speed is None and arm.elbow_speed is None:
            return {}
        last, elbow = self._last, arm.robot.elbow
        moving = [last] if arm.tcp_speed is not None else []
        moving += [elbow.link] if arm.elbow_speed is not None and elbow is not None else []
        rotations, twists = self._link_motions(arm.tool_cone is not None, moving)
        if arm.tool_cone is not None:
            angles = _tool_angles(arm.tool_cone, rotations @ self._T_last_tcp[:3, :3])
            ratios["tool_cone"] = float(np.max(angles)) / arm.tool_cone.half_angle
        if arm.tcp_speed is not None:
            ratios["tcp_speed"] = (
                _greatest_speed(twists[last], self._T_last_tcp[:3, 3]) / arm.tcp_speed
            )
        if arm.elbow_speed is not None and elbow is not None:
            speeds = [_greatest_speed(twists[elbow.link], end) for end in elbow.axis]
            ratios["elbow_speed"] = _worst(*speeds) / arm.elbow_speed
        return ratios

    def tool_path_ratios(self, problem: Problem) -> dict[str, float]:
        """Worst ratio of the deviations from the tool path to their tolerances.

        Between two samples the TCP leaves their chord by at most an eighth of its acceleration
        times the squared period, and so does the path; likewise the rotation. Both are estimated by
        second differences and added.
        """
        path = problem.tool_path
        if path is None:
            return {}
        start, goal = (self._pose(single(end)) for end in (problem.start, problem.goal))
        course, last = ToolCourse.of(path, start, goal), len(self.q) - 1
        step = len(self.q) // CERTIFICATE.most_on_path + 1
        T = np.array([self.tcp_pose(self.q[k]) for k in np.append(np.arange(0, last, step), last)])
        checkpoint()
        if not np.isfinite(T).all():
            return dict.fromkeys(("path_position", "path_rotation"), np.nan)
        position, rotation = course.deviation(T)
        moving = T[:, :3]
        if path.about is not None:
            moving = moving @ np.column_stack([[*path.about, 0], [0, 0, 0, 1]])
        bends = np.linalg.norm(np.diff(moving, n=2, axis=0), axis=(1, 2))
        between = 2 * float(bends.max(initial=0.0)) / 8
        return {
            "path_position": float(position.max() + between) / path.position_tolerance,
            "path_rotation": float(rotation.max() + between) / path.rotation_tolerance,
        } | self._path_speed_ratio(path)

    def _pose(self, end: Single) -> Array | ConeOrientedPose:
        if isinstance(end, ConeOrientedPose):
            return end
        return end.T if isinstance(end, Pose) else self.tcp_pose(end)

    def _path_speed_ratio(self, path: ToolPath) -> dict[str, float]:
        """Ratio of the least speed of the path to the TCP's speed between the ramps.

        For a fixed speed: ratio of the largest deviation to its tolerance, on the ramps only of an
        excess.

        Between two samples the speed is below their chord by at most an eighth of its second
        derivative times the squared period, estimated by second differences.
        """
        if path.least_speed is None:
            return {}
        speed = _speeds(
            self._link_motions(False, [self._last])[1][self._last], self._T_last_tcp[:3, 3]
        )
        gone = np.append(0.0, np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(self.t)))
        beyond = (gone >= path.ramp) & (gone <= gone[-1] - path.ramp)
        dip = 2 * float(np.abs(np.diff(speed, n=2)[beyond[1:-1]]).max(initial=0.0)) / 8
        if path.fixed_speed is not None:
            off = speed - path.fixed_speed
            worst = float(np.where(beyond, np.abs(off), off).max()) + dip
            return {"path_speed": worst / (TOOL_PATH.speed_tolerance * path.fixed_speed)}
        least = float(speed[beyond].min(initial=np.inf)) - dip
        return {"path_speed": path.least_speed / least if least > 0 else np.inf}

    def _link_motions(self, rotating: bool, moving: list[int]) -> tuple[Array, dict[int, Array]]:
        """Rotations and velocities of links at all samples.

        Args:
            rotating: whether to return rotations of the last link.
            moving: indices of the links with velocities.

        Returns:
            Rotations (k, 3, 3) of the last link in the base frame, and by link the velocity of its
            origin and its angular velocity in its own frame (k, 6) [m/s, rad/s].
        """
        rotations = np.empty((len(self.q) if rotating else 0, 3, 3))
        twists = {joint: np.empty((len(self.q), 6)) for joint in moving}
        states = zip(self._coupling.positions(self.q), self._coupling.rates(self.v), strict=True)
        for k, (q, v) in enumerate(states):
            if k % CERTIFICATE.block == CERTIFICATE.block - 1:
                checkpoint()
            pin.forwardKinematics(self.model, self.data, q, v)
            for joint, twist in twists.items():
                twist[k] = self.data.v[joint].vector
            if rotating:
                rotations[k] = self.data.oMi[self._last].rotation
        return rotations, twists

    def end_error(self, target: Single, named: Array, reached: Array) -> EndError:
        """Error of the TCP at an end of the motion.

        Forward kinematics cannot distinguish joint positions that differ by full turns, so the
        rotation error is at least the largest joint deviation from the reported joint positions,
        and from a joint target. For a pose with an orientation tolerance it is measured from the
        nearest allowed orientation.

        Args:
            target: target of this end.
            named: reported joint positions, shape (nq,) [rad].
            reached: joint positions of the motion, shape (nq,) [rad].
        """
        joint_error = float(np.abs(reached - named).max())
        T_reached = self.tcp_pose(reached)
        if isinstance(target, ConeOrientedPose):
            position = float(np.linalg.norm(T_reached[:3, 3] - target.position))
            return EndError(position, _worst(excess_angle(target, T_reached[:3, :3]), joint_error))
        if isinstance(target, Pose):
            T_target = target.T
        else:
            T_target = self.tcp_pose(target)
            joint_error = _worst(joint_error, float(np.abs(reached - target).max()))
        position = float(np.linalg.norm(T_reached[:3, 3] - T_target[:3, 3]))
        rotation = float(np.linalg.norm(pin.log3(T_target[:3, :3].T @ T_reached[:3, :3])))
        return EndError(position, _worst(rotation, joint_error))

    def tcp_pose(self, q: Array) -> Array:
        """T_base_tcp (4, 4) at q (nq,) [rad] by Pinocchio's forward kinematics."""
        pin.forwardKinematics(self.model, self.data, self._coupling.positions(q))
        return np.asarray(self.data.oMi[self._last].homogeneous @ self._T_last_tcp)


def _greatest_speed(motions: Array, point: Array) -> float:
    """Greatest speed [m/s] of a point of a link over the link's motions; see `_speeds`."""
    return float(_speeds(motions, point).max())


def _speeds(motions: Array, point: Array) -> Array:
    """Speeds (k,) [m/s] of a point of a link.

    Args:
        motions: velocities of the link in its own frame, shape (k, 6).
        point: point in the frame of the link, shape (3,) [m].
    """
    return np.asarray(np.linalg.norm(motions[:, :3] + np.cross(motions[:, 3:], point), axis=1))


def _tool_angles(cone: ToolCone, R_base_tcp: Array) -> Array:
    """Angles (k,) [rad] between tool axis and cone direction, for orientations (k, 3, 3)."""
    tool_axis = R_base_tcp @ cone.axis
    angles: Array = np.arctan2(
        np.linalg.norm(np.cross(tool_axis, cone.direction), axis=1), tool_axis @ cone.direction
    )
    return angles


def _worst(*values: float) -> float:
    """Largest value; NaN if any value is NaN, unlike `max`."""
    return float(np.max(values))
