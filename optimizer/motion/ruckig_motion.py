"""Ruckig's time-optimal motion under limits of speed, acceleration and jerk (Berscheid, Kröger
2021).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import ruckig

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.jerk_phases import spline_of_phases
from joulepath.optimizer.motion.quadrature import lobatto_nodes
from joulepath.optimizer.motion.spline import Spline, least_time_scale
from joulepath.optimizer.motion.time_scalings import SampledMotion, standstill

# shares of the jerk limits with which a motion is asked for in turn: where a joint just reaches its
# greatest acceleration, Ruckig may find the lengths of its phases negative by rounding
JERKS = (1.0, 1 - 1e-9, 1 - 1e-7, 1 - 1e-5)
# fractions of the duration within which jumps of jerk become one, as long as the motion exceeds its
# limits by more
CLOSEST, WITHIN = (1e-5, 4e-5, 2e-4, 1e-3), 1 + 1e-6


def time_optimal(limits: Limits, q_start: Array, q_goal: Array) -> SampledMotion:
    """Ruckig's motion from rest to rest. All joints end together, each after up to seven phases of
    constant jerk.

    Raises RuntimeError if Ruckig finds no motion; between configurations at rest one always exists.
    """
    found = _ruckig(limits, q_start, q_goal)
    if found.duration == 0:
        return standstill(q_start, 0.0)
    profiles = found.profiles[0]
    tau, weights = lobatto_nodes(_breaks(found))
    t = tau * found.duration
    q, v, a = _states(found, t)
    return SampledMotion(
        t=t,
        weights=weights * found.duration,
        q=q,
        v=v,
        a=a,
        peak_v=np.abs([profile.v for profile in profiles]).max(axis=1),
        peak_a=np.abs([profile.a for profile in profiles]).max(axis=1),
        peak_jerk=np.abs([profile.j for profile in profiles]).max(axis=1),
    )


def time_optimal_spline(limits: Limits, q_start: Array, q_goal: Array) -> Spline:
    """Ruckig's motion as a spline, with threefold knots where the jerk of a joint jumps.

    It is exact, but where jumps are close to each other: then that of a few splines which exceeds
    the limits least. Between equal configurations Ruckig's motion takes no time: the spline stands
    still for one second.
    """
    found = _ruckig(limits, q_start, q_goal)
    if found.duration == 0:
        return Spline(
            bspline.DEGREE,
            bspline.clamped(np.array([0.0, 1.0])),
            np.tile(q_start, (bspline.DEGREE + 1, 1)),
        )
    profiles = found.profiles[0]
    ends = np.array([profile.t for profile in profiles]).cumsum(axis=1)
    ends[:, -1] = found.duration
    jerk = np.array([profile.j for profile in profiles])
    found_at = dict[float, Spline]()
    for closest in CLOSEST:
        spline = spline_of_phases(ends, jerk, q_start, q_goal, closest)
        found_at[least_time_scale(spline, limits.rates)] = spline
        if min(found_at) <= WITHIN:
            break
    return found_at[min(found_at)]


def straight(limits: Limits, q_start: Array, q_goal: Array) -> SampledMotion:
    """The time-optimal motion from rest to rest along the straight line in joints.

    It is Ruckig's motion of the joint with the longest way, under the limits of the joint that
    allows least.
    """
    way = q_goal - q_start
    longest = np.abs(way).max(keepdims=True)
    law = time_optimal(_along(limits, way), np.zeros(1), longest)
    if law.duration == 0:
        return standstill(q_start, 0.0)
    share = way / longest
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
    way = q_goal - q_start
    longest = np.abs(way).max(keepdims=True)
    law = time_optimal_spline(_along(limits, way), np.zeros(1), longest)
    return replace(law, control_points=q_start + law.control_points * (way / (longest or 1.0)))


def _along(limits: Limits, way: Array) -> Limits:
    """The limits of the joint with the longest way, if all joints go ways (nq,) [rad] in step."""
    size = np.abs(way)
    share = size / (size.max() or 1.0)
    rates = {
        name: np.divide(
            getattr(limits, name), share, out=np.full(len(way), np.inf), where=share > 0
        ).min(keepdims=True)
        for name in ("v_max", "a_max", "j_max")
    }
    none = np.full(1, np.inf)
    return Limits(q_min=-none, q_max=none, tau_max=none, **rates)


def time_optimal_positions(limits: Limits, q_start: Array, q_goal: Array, at: Array) -> Array:
    """Positions (k, nq) [rad] of Ruckig's motion at the fractions `at` (k,) of its duration."""
    found = _ruckig(limits, q_start, q_goal)
    return _states(found, at * found.duration)[0]


def _states(found: ruckig.Trajectory, t: Array) -> tuple[Array, Array, Array]:
    """q [rad], v [rad/s] and a [rad/s²] (k, nq) at times t (k,) [s], from the phases of constant
    jerk: those of `found.at_time`, which takes an instant at a time."""
    profiles = found.profiles[0]
    length, jerk = np.array([(profile.t, profile.j) for profile in profiles]).transpose(1, 0, 2)
    at_start = np.array([(profile.p[:-1], profile.v[:-1], profile.a[:-1]) for profile in profiles])
    ends = length.cumsum(axis=1)
    phase = (t[:, None, None] >= ends[:, :-1]).sum(axis=2)
    joint = np.arange(len(profiles))
    q, v, a = at_start.transpose(1, 0, 2)[:, joint, phase]
    j, dt = jerk[joint, phase], t[:, None] - (ends - length)[joint, phase]
    return q + dt * (v + dt * (a / 2 + dt * j / 6)), v + dt * (a + dt * j / 2), a + dt * j


def _ruckig(limits: Limits, q_start: Array, q_goal: Array) -> ruckig.Trajectory:
    given = ruckig.InputParameter(len(q_start))
    given.current_position, given.target_position = q_start.tolist(), q_goal.tolist()
    given.max_velocity, given.max_acceleration = limits.v_max.tolist(), limits.a_max.tolist()
    for share in JERKS:
        given.max_jerk = (share * limits.j_max).tolist()
        found = ruckig.Trajectory(len(q_start))
        try:
            result = ruckig.Ruckig(len(q_start)).calculate(given, found)
        except ruckig.RuckigError as error:
            result = error
        if result in (ruckig.Result.Working, ruckig.Result.Finished):
            return found
    raise RuntimeError(f"Ruckig found no motion: {result}")


def _breaks(found: ruckig.Trajectory) -> Array:
    """Fractions in [0, 1] of the duration at which the jerk of any joint jumps, with both ends,
    ascending.
    """
    phases = np.array([profile.t for profile in found.profiles[0]])
    ends = np.append(phases.cumsum(axis=1), [0.0, found.duration]) / found.duration
    return np.asarray(np.unique(np.round(ends, 12)))
