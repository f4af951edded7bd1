"""Baselines along the joint path of the answer to a tool path.

- `even_speed`: an even speed between two smooth ramps, like the linear motion of a controller
- `quintic`: the rest-to-rest polynomial of degree 5

Both are as fast as speed, acceleration and jerk of the joints and the speeds of TCP and elbow
allow, but not faster than our motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline, quintic, ramped
from joulepath.optimizer.motion.spline import least_time_scale, retimed
from joulepath.optimizer.motion.time_scalings import SampledMotion
from joulepath.optimizer.result.baseline import Baseline, BaselineName
from joulepath.optimizer.search.baselines import compared, standing
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.search.waypoint_baselines import samples_of, slowed
from joulepath.optimizer.solve.methods.duration_intervals import fastest
from joulepath.optimizer.solve.methods.retimed_path import RetimedPath


@dataclass(frozen=True)
class PathBaselineSettings:
    """Settings of the baselines along a tool path."""

    ramps: tuple[float, ...] = (0.2, 1 / 3, 0.5)
    """Shares of the time that a ramp of an even speed may take, from the shortest: the fastest
    motion counts. Jerk asks for long ramps, and bends of the path for short ones."""

    points_per_point: int = 3
    """Control points of a motion per control point of its path: the tool leaves the path by less
    than its tolerance."""

    instants: int = 1000
    """Instants at which a law of time is sampled."""


PATH_BASELINES = PathBaselineSettings()


def path_baselines(state: SearchState, best: Candidate) -> list[Baseline]:
    """Compute the baselines along the joint path of the best candidate.

    Args:
        state: state of the search.
        best: the solved candidate of least energy.

    Returns:
        The baselines with an admissible duration.
    """
    prepared, problem, settings = state.prepared, state.problem, PATH_BASELINES
    path = prepared.followed.joint_path(best.q_start)
    assert path is not None and best.energy is not None
    space = bspline.uniform(settings.points_per_point * len(path.control_points))
    along, t = (
        RetimedPath(prepared, path, fastest(prepared), space),
        np.linspace(0.0, 1.0, settings.instants),
    )

    def motion(s: Array) -> SampledMotion:
        unit = along.motion(along.variables(s, t))
        fast = retimed(unit, least_time_scale(unit, problem.arm.active_limits.rates))
        return slowed(prepared, samples_of(fast), best.duration)

    even = [motion(ramped.fraction(t, ramp)) for ramp in settings.ramps]
    motions: dict[BaselineName, SampledMotion] = {
        # rounded, so that among equal durations the first has the shortest ramps
        "even_speed": min(even, key=lambda each: round(each.duration, 9)),
        "quintic": motion(quintic.fraction(t)),
    }
    held, found = standing(problem.arm, best.q_goal, prepared.torques), list[Baseline]()
    for name, each in motions.items():
        if state.allows(each.duration):
            tau = prepared.torques(each.q, each.v, each.a)
            (broken,) = prepared.broken_on_the_way([each.q], [each.v], [each.q])
            ours, oracle = best.energy, (prepared.potential, broken)
            found.append(compared(problem, name, each, tau, held, ours, *oracle))
    return found
