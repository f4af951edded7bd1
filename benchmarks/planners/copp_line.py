"""copp: a time scaling of the straight line with the least idle energy, copper loss and friction,
by conic programming.
"""

from __future__ import annotations

import copp_py as copp
import numpy as np
import pinocchio as pin

from benchmarks.motion import Motion
from joulepath.models.robot import Array, Robot

_X = np.linspace(0.0, 1.0, 201)
STATIONS = 3 * _X**2 - 2 * _X**3
"""Stations of the path, denser at both ends: the motion is slow there, and even spacing would make
it slower."""
ROUNDS = 3
"""Number of linearisations of jerk limits and friction around the previous profile."""
THERMAL = 0.25
"""Weight of ThermalEnergy, which is four times ∫ Σ (normalize · tau)² dt in copp 0.2."""
TYPICAL_SPEED = 0.5
"""Speed at which concave friction is evaluated over the largest speed [1]."""
LEAST_SPEED = 1e-3
"""Smallest speed at which friction work is linearised over the largest speed [1]."""


class CoppMotion:
    """A line with the profile a = (ds/dt)², b = d²s/dt² over stations; b is linear in s between
    stations.

    In the first and the last interval, the jerk is constant over time, because the motion begins
    and ends at rest.
    """

    def __init__(self, q_start: Array, q_goal: Array, profile: copp.Profile3rd) -> None:
        self.q_start, self.travel = q_start, q_goal - q_start
        self.profile = profile
        self.duration, self.times = copp.interpolation.s_to_t_topp3(STATIONS, profile)

    def sample(self, t: Array) -> tuple[Array, Array, Array, Array | None]:
        """See `Motion.sample`."""
        inner = copp.interpolation.t_to_s_topp3_samples(STATIONS, self.profile, self.times, t[1:-1])
        at = np.concatenate([[0.0], np.clip(inner, 0.0, 1.0), [1.0]])
        v, a, jerk = (np.outer(rate, self.travel) for rate in self._rates(at, t))
        return self.q_start + np.outer(at, self.travel), v, a, jerk

    def _rates(self, at: Array, t: Array) -> tuple[Array, Array, Array]:
        """First to third derivative of s by time."""
        s, a, b = STATIONS, self.profile.a, self.profile.b
        k = np.clip(np.searchsorted(s, at, side="right") - 1, 0, len(s) - 2)
        slope = (b[k + 1] - b[k]) / (s[k + 1] - s[k])
        along = at - s[k]
        speed = np.sqrt(np.maximum(a[k] + 2 * b[k] * along + slope * along**2, 0.0))
        acceleration, jerk = b[k] + slope * along, slope * speed
        first, last = self.profile.num_stationary
        for sign, inside, distance, span, since in (
            (1.0, at < s[first], s[first], self.times[first], t),
            (
                -1.0,
                at > s[-1 - last],
                1 - s[-1 - last],
                self.duration - self.times[-1 - last],
                self.duration - t,
            ),
        ):
            if inside.any():
                constant = 6 * distance / span**3
                jerk[inside] = constant
                acceleration[inside] = sign * constant * since[inside]
                speed[inside] = constant * since[inside] ** 2 / 2
        return speed, acceleration, jerk


class CoppLine:
    """Minimises ∫ (idle power + copper loss + viscous friction) dt along the straight line.

    copp has objectives for idle power and copper loss. The work of viscous friction is concave in
    the variables of copp, and linearised around the previous profile, as copp advises. The work of
    dry friction does not depend on the time scaling; dry friction contributes to the torques only.
    """

    title = "copp, thermal line"
    packages: tuple[str, ...] = ("copp-py",)
    what = (
        "straight line in joint space, least idle energy, copper loss and friction under all "
        "limits, by cone programs"
    )

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.data = robot.model.createData()

    def plan(self, q_start: Array, q_goal: Array) -> Motion | None:
        """See `Planner.plan`."""
        travel = q_goal - q_start
        arm = self._arm(q_start, travel)
        last = (len(STATIONS) - 1, (0.0, 0.0))
        try:
            fastest = copp.solver.topp2_ra.Problem(
                arm.constraints, idx_s_interval=(0, last[0]), a_boundary=last[1]
            )
            around, slope = copp.solver.topp2_ra.solve(fastest), None
            for _ in range(ROUNDS):
                problem = copp.solver.copp3_socp.Problem(
                    arm, self._objectives(travel, around), around, b_linearization=slope
                )
                profile = copp.solver.copp3_socp.solve(problem)
                around, slope = profile.a, profile.b
        except copp.CoppError:
            return None
        return CoppMotion(q_start, q_goal, profile)

    def _objectives(self, travel: Array, around: Array) -> list[object]:
        drives, electronics = self.robot.drives, self.robot.electronics
        viscous = float(self.robot.friction.viscous @ travel**2)
        weights = np.gradient(STATIONS)
        speed = np.sqrt(np.maximum(around, LEAST_SPEED**2 * around.max()))
        return [
            copp.objective.Time(electronics.idle_power + electronics.controller_power),
            copp.objective.ThermalEnergy(THERMAL, np.sqrt(drives.copper) / drives.torque_constant),
            copp.objective.Linear(1.0, viscous * weights / (2 * speed), np.zeros(len(STATIONS))),
        ]

    def _arm(self, q_start: Array, travel: Array) -> copp.Robot:
        robot, limits, count = self.robot, self.robot.limits, len(STATIONS)
        dry = robot.friction.torque(TYPICAL_SPEED * limits.v_max * travel / np.abs(travel).max())

        def torque(q: Array, v: Array, a: Array) -> Array:
            return np.asarray(pin.rnea(robot.model, self.data, q, v, a) + dry)

        arm = copp.Robot(robot.nq, capacity=count, inverse_dynamics=torque)
        arm.append_s(STATIONS)
        none = np.zeros((count, robot.nq))
        arm.set_q(
            q_start + np.outer(STATIONS, travel), np.tile(travel, (count, 1)), none, 0, dddq=none
        )
        for add, limit in (
            (arm.add_velocity_limits, limits.v_max),
            (arm.add_acceleration_limits, limits.a_max),
            (arm.add_jerk_limits, limits.j_max),
            (arm.add_torque_limits, limits.tau_max),
        ):
            add(limit, -limit, start_idx_s=0)
        return arm
