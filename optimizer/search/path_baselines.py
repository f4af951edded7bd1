"""Baseline along a tool path: even speed with ramps of a third of the duration each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.motion.time_scalings import SampledMotion, even_speed
from joulepath.optimizer.result.baseline import Baseline
from joulepath.optimizer.search.baselines import compared, standing
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.state import SearchState


def path_baselines(state: SearchState, best: Candidate) -> list[Baseline]:
    """The `trapezoid` along the joint path of the best candidate, in its duration."""
    prepared, problem, path = (
        state.prepared,
        state.problem,
        state.prepared.followed.joint_path(best.q_start),
    )
    assert path is not None and best.energy is not None
    motion = along(path, even_speed(best.duration))
    tau = prepared.torques(motion.q, motion.v, motion.a)
    held = standing(problem.arm, best.q_goal, prepared.torques)
    (broken,) = prepared.broken_on_the_way([motion.q], [motion.v], [motion.q])
    return [
        compared(problem, "trapezoid", motion, tau, held, best.energy, prepared.potential, broken)
    ]


def along(path: Spline, law: SampledMotion) -> SampledMotion:
    """The motion along a path over [0, 1] with the fraction of the path given by `law`, one
    coordinate.
    """
    s, rate, acceleration = law.q[:, 0], law.v, law.a
    tangent, bend = path.curve(s, 1), path.curve(s, 2)
    v, a = tangent * rate, bend * rate**2 + tangent * acceleration
    peak_v, peak_a = np.abs(v).max(axis=0), np.abs(a).max(axis=0)
    return replace(
        law,
        q=path.curve(s),
        v=v,
        a=a,
        peak_v=peak_v,
        peak_a=peak_a,
        peak_jerk=np.full_like(peak_v, np.inf),
    )
