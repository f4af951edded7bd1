"""Time-optimal motions under limits of speed, acceleration and jerk by Ruckig (Berscheid, Kröger
2021).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import ruckig

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.jerk_phases import spline_of_phases
from joulepath.optimizer.motion.quadrature import lobatto_nodes
from joulepath.optimizer.motion.spline import Spline, least_time_scale
from joulepath.optimizer.motion.time_scalings import SampledMotion, standstill


@dataclass(frozen=True)
class RuckigSettings:
    """Remedies for rounding in Ruckig's motions."""

    jerk_shares: tuple[float, ...] = (1.0, 1 - 1e-9, 1 - 1e-7, 1 - 1e-5)
    """Shares of the jerk limits for successive attempts: if a joint just reaches its greatest
    acceleration, Ruckig may find negative phase lengths by rounding.
    """
    merge_distances: tuple[float, ...] = (1e-5, 4e-5, 2e-4, 1e-3)
    """Fractions of the duration within which jumps of jerk are merged, in successive attempts."""
    largest_time_scale: float = 1 + 1e-6
    """Least time scale of a spline within the limits up to which it is accepted."""


RUCKIG = RuckigSettings()


def time_optimal(limits: Limits, q_start: Array, q_goal: Array) -> SampledMotion:
    """Ruckig's motion from rest to rest. All joints end together, after up to seven phases of
    constant jerk each.

    Raises:
        RuntimeError: Ruckig finds no motion, although one always exists between configurations at
            rest.
    """
    trajectory = _ruckig(limits, q_start, q_goal)
    if trajectory.duration == 0:
        return standstill(q_start, 0.0)
    profiles = trajectory.profiles[0]
    tau, weights = lobatto_nodes(_breaks(trajectory))
    t = tau * trajectory.duration
    q, v, a = _states(trajectory, t)
    return SampledMotion(
        t=t,
        weights=weights * trajectory.duration,
        q=q,
        v=v,
        a=a,
        peak_v=np.abs([profile.v for profile in profiles]).max(axis=1),
        peak_a=np.abs([profile.a for profile in profiles]).max(axis=1),
        peak_jerk=np.abs([profile.j for profile in profiles]).max(axis=1),
    )


def time_optimal_spline(limits: Limits, q_start: Array, q_goal: Array) -> Spline:
    """Ruckig's motion as a spline, with knots of multiplicity three at the jumps of any joint's
    jerk.

    It is exact unless jumps are close to each other; then it is the spline with the least excess
    over the limits among a few candidates. Between equal configurations Ruckig's motion takes no
    time, and the spline stands still for one second.
    """
    trajectory = _ruckig(limits, q_start, q_goal)
    if trajectory.duration == 0:
        return Spline(
            bspline.DEGREE,
            bspline.clamped(np.array([0.0, 1.0])),
            np.tile(q_start, (bspline.DEGREE + 1, 1)),
        )
    profiles = trajectory.profiles[0]
    ends = np.array([profile.t for profile in profiles]).cumsum(axis=1)
    ends[:, -1] = trajectory.duration
    jerk = np.array([profile.j for profile in profiles])
    by_time_scale = dict[float, Spline]()
    for closest in RUCKIG.merge_distances:
        spline = spline_of_phases(ends, jerk, q_start, q_goal, closest)
        by_time_scale[least_time_scale(spline, limits.rates)] = spline
        if min(by_time_scale) <= RUCKIG.largest_time_scale:
            break
    return by_time_scale[min(by_time_scale)]


def straight(limits: Limits, q_start: Array, q_goal: Array) -> SampledMotion:
    """Time-optimal motion from rest to rest along the straight line in joint space.

    It is Ruckig's motion of the joint with the largest displacement, under limits that respect the
    limits of all joints.
    """
    displacement = q_goal - q_start
    longest = np.abs(displacement).max(keepdims=True)
    law = time_optimal(_along(limits, displacement), np.zeros(1), longest)
    if law.duration == 0:
        return standstill(q_start, 0.0)
    share = displacement / longest
    return replace(
        law,
        q=q_start + law.q * share,
        v=law.v * share,
        a=law.a * share,
        peak_v=law.peak_v * np.abs(share),
        peak_a=law.peak_a * np.abs(share),
        peak_jerk=law.peak_jerk * np.abs(share),
    )


def straight_spline(limits: Limits, q_start: Array, q_goal: Array) -> Spline:
    """The motion of `straight` as a spline; see `time_optimal_spline`."""
    displacement = q_goal - q_start
    longest = np.abs(displacement).max(keepdims=True)
    law = time_optimal_spline(_along(limits, displacement), np.zeros(1), longest)
    share = displacement / (longest or 1.0)
    return replace(law, control_points=q_start + law.control_points * share)


def _along(limits: Limits, displacement: Array) -> Limits:
    """Limits of the joint with the largest displacement if all joints move synchronously over
    displacements (nq,) [rad].
    """
    size = np.abs(displacement)
    share = size / (size.max() or 1.0)
    rates = {
        name: np.divide(
            getattr(limits, name), share, out=np.full(len(displacement), np.inf), where=share > 0
        ).min(keepdims=True)
        for name in ("v_max", "a_max", "j_max")
    }
    none = np.full(1, np.inf)
    return Limits(q_min=-none, q_max=none, tau_max=none, **rates)


def time_optimal_positions(
    limits: Limits, q_start: Array, q_goal: Array, fractions: Array
) -> Array:
    """Positions (k, nq) [rad] of Ruckig's motion at fractions (k,) of its duration."""
    trajectory = _ruckig(limits, q_start, q_goal)
    return _states(trajectory, fractions * trajectory.duration)[0]


def _states(trajectory: ruckig.Trajectory, t: Array) -> tuple[Array, Array, Array]:
    """q [rad], v [rad/s] and a [rad/s²] (k, nq) at times t (k,) [s], from the phases of constant
    jerk.

    Equal to `found.at_time`, a method for one instant at a time.
    """
    profiles = trajectory.profiles[0]
    length, jerk = np.array([(profile.t, profile.j) for profile in profiles]).transpose(1, 0, 2)
    at_start = np.array([(profile.p[:-1], profile.v[:-1], profile.a[:-1]) for profile in profiles])
    ends = length.cumsum(axis=1)
    phase = (t[:, None, None] >= ends[:, :-1]).sum(axis=2)
    joint = np.arange(len(profiles))
    q, v, a = at_start.transpose(1, 0, 2)[:, joint, phase]
    j, dt = jerk[joint, phase], t[:, None] - (ends - length)[joint, phase]
    return q + dt * (v + dt * (a / 2 + dt * j / 6)), v + dt * (a + dt * j / 2), a + dt * j


def _ruckig(limits: Limits, q_start: Array, q_goal: Array) -> ruckig.Trajectory:
    parameters = ruckig.InputParameter(len(q_start))
    parameters.current_position, parameters.target_position = q_start.tolist(), q_goal.tolist()
    parameters.max_velocity, parameters.max_acceleration = (
        limits.v_max.tolist(),
        limits.a_max.tolist(),
    )
    for share in RUCKIG.jerk_shares:
        parameters.max_jerk = (share * limits.j_max).tolist()
        trajectory = ruckig.Trajectory(len(q_start))
        try:
            result = ruckig.Ruckig(len(q_start)).calculate(parameters, trajectory)
        except ruckig.RuckigError as error:
            result = error
        if result in (ruckig.Result.Working, ruckig.Result.Finished):
            return trajectory
    raise RuntimeError(f"Ruckig found no motion: {result}")


def _breaks(trajectory: ruckig.Trajectory) -> Array:
    """Fractions (b,) of the duration at which the jerk of any joint jumps, with 0 and 1,
    ascending.
    """
    phases = np.array([profile.t for profile in trajectory.profiles[0]])
    ends = np.append(phases.cumsum(axis=1), [0.0, trajectory.duration]) / trajectory.duration
    return np.asarray(np.unique(np.round(ends, 12)))
