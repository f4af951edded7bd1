"""Repair of the limits that a motion exceeds between the points at which the NLP bounds them.

The NLP bounds torque at the nodes and path constraints at the path points. Between these a motion
may exceed a limit by a little. The NLP is then solved again with this limit tightened.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE, RESERVE, SCALE
from joulepath.optimizer.dynamics.limited_torque import limited_parts
from joulepath.optimizer.dynamics.torque_bound import SHARPNESS, TorqueSamples, torque_bounds
from joulepath.optimizer.kinematics.path_constraints import PathConstraints
from joulepath.optimizer.motion.bspline import in_all_spans
from joulepath.optimizer.motion.quadrature import grid
from joulepath.optimizer.motion.spline import Spline, peak_rates, retimed, sample, time_scale
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.solve.nlp.nonlinear_program import FEASIBILITY, NonlinearProgram

# the NLP's limits are tighter than the problem's by this ratio, so that its tolerance stays within
# the problem's
MARGIN = 2 * FEASIBILITY
# a limit is tightened by its excess and this ratio; it counts as exceeded within a quarter of the
# ratio
REPAIR_MARGIN = 2e-4
WITHIN = 1 - REPAIR_MARGIN / 4
# torque is tightened by this multiple of its excess: a peak lowered between two nodes rises beside
# them
TORQUE_REPAIR = 1.5
# points at which positions are compared with their limits where the control points do not bound
# them, the multiple of an excess by which these are moved inwards, and the greatest excess by
# rounding of a joint that is on its limit [rad]
POSITION_POINTS, POSITION_REPAIR, ROUNDING = 512, 1.5, 1e-9
# the greatest time scale that replaces another solve
MOST_TIME_SCALE = 1 + 5e-4
# samples at which path constraints of a motion that collides are checked, and the multiple of an
# excess by which they are tightened
PATH_SAMPLES, PATH_REPAIR = 401, 1.5


@dataclass(frozen=True)
class LimitCheck:
    """A motion and its excess over the limits between the nodes.

    `factors` are those that the limits must be multiplied by, None if no limit is exceeded.
    `collision` is the clearance that it violates, if any. `path_excess` (c,) is how much the bounds
    of the path constraints must shrink.
    """

    spline: Spline
    factors: Limits | None
    collision: Clearance | None
    path_excess: Array

    @property
    def passed(self) -> bool:
        """Whether the motion is within every limit and proven to be free of collisions."""
        return self.factors is None and self.collision is None and not self.path_excess.any()


def initial_bounds(path: PathConstraints | None) -> Array:
    """Bounds (c,) of the path constraints' ratios before any repair."""
    return np.full(0 if path is None else len(path.names), 1 - MARGIN)


def torque_peaks(prepared: PreparedProblem, spline: Spline) -> Array:
    """Greatest absolute limited torques (nq,) [N·m], bounded between samples as the certificate
    bounds them.

    Of a motion that stays far from the torque limits, they are those at the quadrature points.
    """
    # the samples of its energy, which is wanted next
    _, _, v, a, tau, lost = prepared.report_samples(spline)
    smooth, friction = limited_parts(prepared.arm, tau, v, a, lost)
    most = np.abs(smooth).max(axis=0) + np.abs(friction).max(axis=0)
    if (most <= SHARPNESS.far_below * prepared.problem.arm.active_limits.tau_max).all():
        return np.asarray(np.abs(smooth + friction).max(axis=0))
    samples = TorqueSamples.of(spline.curve, prepared.torques, grid(spline.duration)[None])
    return torque_bounds(prepared.arm, spline.curve, prepared.torques, samples)


def repair_factors(
    prepared: PreparedProblem, spline: Spline, overshoot: tuple[Array, Array]
) -> Limits | None:
    """The factors ≤ 1 that the limits must be multiplied by, None if the motion exceeds none.

    `overshoot` are the excesses (nq,) [rad] below and above the position limits; the factors hold
    them as q_min, q_max.
    """
    limits, (below, above) = prepared.problem.arm.active_limits, overshoot
    rates = peak_rates(spline)
    ratios = {
        "v_max": rates[0] / limits.v_max,
        "a_max": rates[1] / limits.a_max,
        "j_max": rates[2] / limits.j_max,
        "tau_max": torque_peaks(prepared, spline) / limits.tau_max,
    }
    if max(float(ratio.max()) for ratio in ratios.values()) <= WITHIN and not (
        below.any() or above.any()
    ):
        return None
    excess = {
        name: np.where(ratio > WITHIN, ratio + REPAIR_MARGIN, 1.0) for name, ratio in ratios.items()
    }
    excess["tau_max"] = 1 + TORQUE_REPAIR * (excess["tau_max"] - 1)
    return Limits(q_min=below, q_max=above, **{name: 1 / factor for name, factor in excess.items()})


def sampled_overshoot(prepared: PreparedProblem, spline: Spline) -> tuple[Array, Array]:
    """How far (nq,) [rad] the position limits below and above move inwards for the excess of a
    motion at samples.
    """
    q = spline.curve(np.linspace(0.0, spline.duration, POSITION_POINTS))
    limits = prepared.problem.arm.active_limits
    excess = limits.q_min - q.min(axis=0), q.max(axis=0) - limits.q_max
    below, above = (np.where(each > ROUNDING, POSITION_REPAIR * each, 0.0) for each in excess)
    return below, above


def tightened(limits: Limits, factors: Limits) -> Limits:
    """Limits on speed, acceleration, jerk and torque times the factors, and position limits moved
    inwards by theirs.
    """
    inner = limits.scaled(factors)
    return replace(inner, q_min=inner.q_min + factors.q_min, q_max=inner.q_max - factors.q_max)


def slightly_retimed(spline: Spline, factors: Limits, t_max: float) -> Spline:
    """The motion retimed to within the limits on speed, acceleration and jerk.

    It is unchanged if that needs a time scale above MOST_TIME_SCALE or a duration above t_max [s].
    """
    needed = time_scale(1 / factors.rates)
    return (
        spline
        if needed > MOST_TIME_SCALE or spline.duration * needed > t_max
        else retimed(spline, needed)
    )


def path_excess(
    prepared: PreparedProblem,
    spline: Spline,
    path: PathConstraints | None,
    collision: Clearance | None,
) -> Array:
    """By how much the bound (c,) of each of the path constraints must shrink, since they are
    exceeded between points.

    `collision` is the clearance that the motion violates.
    """
    if path is None:
        return np.zeros(0)
    # clearance constraints come last; without a violated clearance they need no check
    checked = path if collision is not None else prepared.path
    ratio = np.zeros(len(path.names))
    if checked is not None:
        # what collides is solved again; any other motion is checked where the certificate checks it
        instants = (
            grid(spline.duration) if collision is None else in_all_spans(spline.knots, PATH_SAMPLES)
        )
        q, v, _ = sample(spline, instants)
        ratio[: len(checked.names)] = checked.ratios(q, v).max(axis=0)
    excess = ratio - 1
    return np.where(
        excess > -REPAIR_MARGIN / 4, PATH_REPAIR * np.maximum(excess, 0.0) + REPAIR_MARGIN, 0.0
    )


def with_repaired_path(
    prepared: PreparedProblem,
    program: NonlinearProgram,
    pairs: Indices,
    nearby: Indices,
    check: LimitCheck,
) -> NonlinearProgram:
    """The NLP with tighter bounds of its path constraints, and clearance constraints of `nearby`
    instead of `pairs`.
    """
    bounds = program.path_bounds - check.path_excess
    if len(nearby) > len(pairs):
        path = prepared.surroundings.with_clearance(nearby)
        widened = initial_bounds(path)
        widened[
            np.append(np.ones(len(bounds) - len(pairs), dtype=bool), np.isin(nearby, pairs))
        ] = bounds
        return replace(program, path=path, path_bounds=widened)
    if check.collision is not None and program.path is not None and not check.path_excess.any():
        # no sample collides, but the clearance is not proven: a little more of it at the path
        # points
        bounds -= np.where(np.array(program.path.names) == CLEARANCE, RESERVE / SCALE, 0.0)
    return replace(program, path_bounds=bounds)
