"""The baseline along a tool path: an even speed on the way, with ramps of a third of the duration each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from optimizer.energy.dwell import dwell_energy
from optimizer.search.baselines import motion_energy, saving, within_limits
from optimizer.search.candidates import Candidate
from optimizer.search.incumbent import Incumbent
from optimizer.solution import Baseline
from optimizer.trajectories.spline import Spline
from optimizer.trajectories.time_scalings import SampledMotion, even_speed


def path_baselines(incumbent: Incumbent, best: Candidate) -> list[Baseline]:
    """The `trapezoid` along the path of the best candidate's joints, in its duration."""
    prepared, problem, path = incumbent.prepared, incumbent.problem, incumbent.prepared.joint_path(best.q_start)
    assert path is not None and best.energy is not None
    motion = along(path, even_speed(best.duration))
    tau = prepared.torques(motion.q, motion.v, motion.a)
    energy = motion_energy(problem, motion, tau, prepared.potential)
    if problem.cycle is not None:
        hold = float(prepared.holding_power(best.q_goal))
        energy = energy.with_dwell(dwell_energy(problem.cycle, problem.arm, hold, motion.duration))
    held = within_limits(problem, motion, tau) and prepared.satisfies_path_constraints(motion.q, motion.v)
    return [
        Baseline(
            name="trapezoid",
            duration=motion.duration,
            electrical=energy.electrical.total,
            mechanical=energy.mechanical.total,
            within_limits=held,
            saving=saving(best.energy, energy.of(problem.objective)),
        )
    ]


def along(path: Spline, law: SampledMotion) -> SampledMotion:
    """The motion along a path over [0, 1] whose fraction of the way is that of `law`, of one coordinate."""
    s, rate, acceleration = law.q[:, 0], law.v, law.a
    tangent, bend = path.curve(s, 1), path.curve(s, 2)
    v, a = tangent * rate, bend * rate**2 + tangent * acceleration
    peak_v, peak_a = np.abs(v).max(axis=0), np.abs(a).max(axis=0)
    return replace(law, q=path.curve(s), v=v, a=a, peak_v=peak_v, peak_a=peak_a, peak_jerk=np.full_like(peak_v, np.inf))
