"""Repair of limits that a motion exceeds between the nodes of the NLP.

The NLP bounds torque at the nodes and path constraints at the path points. In between, a motion may
exceed a limit slightly. The NLP is then solved again with the limit tightened.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE, CLEARANCE_CONSTRAINT
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.dynamics.limited_torque import limited_parts
from joulepath.optimizer.dynamics.torque_bound import TORQUE_BOUND, TorqueSamples, torque_bounds
from joulepath.optimizer.kinematics.path_constraints import PathConstraints
from joulepath.optimizer.motion.bspline import in_all_spans
from joulepath.optimizer.motion.quadrature import grid
from joulepath.optimizer.motion.spline import Spline, peak_rates, retimed, sample, time_scale
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.solve.nlp.nonlinear_program import FEASIBILITY, NonlinearProgram


@dataclass(frozen=True)
class LimitRepairSettings:
    """Settings of the repair of limits exceeded between the nodes."""

    margin: float = 2 * FEASIBILITY
    """Relative reduction of the limits in the NLP, so that its feasibility tolerance stays within
    the limits of the problem."""

    tightening: float = 2e-4
    """Relative amount by which a limit is tightened beyond its excess."""

    torque_factor: float = 1.5
    """Multiple of the excess by which torque is tightened: a peak lowered between two nodes rises
    beside them."""

    position_samples: int = 512
    """Instants at which positions are checked where control points do not bound them."""

    position_factor: float = 1.5
    """Multiple of the excess by which position limits move inwards."""

    position_rounding: float = 1e-9
    """Excess of a joint on its position limit by rounding [rad]."""

    largest_time_scale: float = 1 + 5e-4
    """Largest time scale applied instead of another solve."""

    path_samples: int = 401
    """Instants at which path constraints of a colliding motion are checked."""

    block: int = 5000
    """Instants at which path constraints are checked at a time: the frames of all links at 1 ms
    would take a gigabyte for ten minutes."""

    path_factor: float = 1.5
    """Multiple of the excess by which the bounds of path constraints are tightened."""

    @property
    def within(self) -> float:
        """Ratio to a limit above which the limit counts as exceeded."""
        return 1 - self.tightening / 4


LIMIT_REPAIR = LimitRepairSettings()


@dataclass(frozen=True)
class LimitCheck:
    """A motion and its excess over the limits between the nodes."""

    spline: Spline

    factors: Limits | None
    """Factors by which the limits must be multiplied; None if no limit is exceeded."""

    collision: Clearance | None
    """The clearance that the motion violates; None if it violates none."""

    path_excess: Array
    """Reduction of the bounds of the path constraints, shape (c,)."""

    @property
    def passed(self) -> bool:
        """Whether the motion is within every limit and proven to be free of collisions."""
        return self.factors is None and self.collision is None and not self.path_excess.any()


def initial_bounds(path: PathConstraints | None) -> Array:
    """Bounds (c,) of the path constraints' ratios before any repair."""
    return np.full(0 if path is None else len(path.names), 1 - LIMIT_REPAIR.margin)


def torque_peaks(prepared: PreparedProblem, spline: Spline) -> Array:
    """Largest absolute limited torques of a motion, shape (nq,) [N·m].

    Between samples, they are bounded as by the certificate. Far from the torque limits, the
    torques at the quadrature points are taken.
    """
    # the energy of the motion is needed next, from the same samples
    _, _, v, a, tau, tau_friction = prepared.report_samples(spline)
    smooth, friction = limited_parts(prepared.arm, tau, v, a, tau_friction)
    most = np.abs(smooth).max(axis=0) + np.abs(friction).max(axis=0)
    if (most <= TORQUE_BOUND.far_below * prepared.problem.arm.active_limits.tau_max).all():
        return np.asarray(np.abs(smooth + friction).max(axis=0))
    samples = TorqueSamples.of(spline.curve, prepared.torques, grid(spline.duration)[None])
    return torque_bounds(prepared.arm, spline.curve, prepared.torques, samples)


def repair_factors(
    prepared: PreparedProblem, spline: Spline, overshoot: tuple[Array, Array]
) -> Limits | None:
    """Factors ≤ 1 by which the limits must be multiplied.

    Args:
        prepared: the problem.
        spline: the motion.
        overshoot: excess below and above the position limits, shapes (nq,) [rad].

    Returns:
        The factors, with the overshoot as q_min and q_max; None if the motion exceeds no limit.
    """
    settings, within = LIMIT_REPAIR, LIMIT_REPAIR.within
    limits, (below, above) = prepared.problem.arm.active_limits, overshoot
    rates = peak_rates(spline)
    ratios = {
        "v_max": rates[0] / limits.v_max,
        "a_max": rates[1] / limits.a_max,
        "j_max": rates[2] / limits.j_max,
        "tau_max": torque_peaks(prepared, spline) / limits.tau_max,
    }
    if max(float(ratio.max()) for ratio in ratios.values()) <= within and not (
        below.any() or above.any()
    ):
        return None
    excess = {
        name: np.where(ratio > within, ratio + settings.tightening, 1.0)
        for name, ratio in ratios.items()
    }
    excess["tau_max"] = 1 + settings.torque_factor * (excess["tau_max"] - 1)
    return Limits(q_min=below, q_max=above, **{name: 1 / factor for name, factor in excess.items()})


def sampled_overshoot(prepared: PreparedProblem, spline: Spline) -> tuple[Array, Array]:
    """Distances (nq,) [rad] by which the lower and upper position limits must move inwards.

    The excess of the motion is measured at samples.
    """
    settings = LIMIT_REPAIR
    q = spline.curve(np.linspace(0.0, spline.duration, settings.position_samples))
    limits = prepared.problem.arm.active_limits
    excess = limits.q_min - q.min(axis=0), q.max(axis=0) - limits.q_max
    below, above = (
        np.where(each > settings.position_rounding, settings.position_factor * each, 0.0)
        for each in excess
    )
    return below, above


def tightened(limits: Limits, factors: Limits) -> Limits:
    """Limits on rates and torque times their factors, and position limits moved inwards."""
    inner = limits.scaled(factors)
    return replace(inner, q_min=inner.q_min + factors.q_min, q_max=inner.q_max - factors.q_max)


def slightly_retimed(spline: Spline, factors: Limits, t_max: float) -> Spline:
    """The motion retimed to within its limits on rates.

    The motion is unchanged if that needs a time scale above `largest_time_scale` of the settings,
    or a duration above t_max [s].
    """
    needed = time_scale(1 / factors.rates)
    return (
        spline
        if needed > LIMIT_REPAIR.largest_time_scale or spline.duration * needed > t_max
        else retimed(spline, needed)
    )


def path_excess(
    prepared: PreparedProblem,
    spline: Spline,
    path: PathConstraints | None,
    collision: Clearance | None,
) -> Array:
    """Reduction of the bounds of path constraints exceeded between the path points.

    Args:
        prepared: the problem.
        spline: the motion.
        path: path constraints of the NLP; clearance constraints come last.
        collision: the clearance that the motion violates; None if it violates none.

    Returns:
        The reductions, shape (c,).
    """
    settings = LIMIT_REPAIR
    if path is None:
        return np.zeros(0)
    # without a violated clearance, clearance constraints need no check
    checked = path if collision is not None else prepared.path
    ratio = np.zeros(len(path.names))
    if checked is not None:
        # a colliding motion is solved again anyway; others are checked as by the certificate
        instants = (
            grid(spline.duration)
            if collision is None
            else in_all_spans(spline.knots, settings.path_samples)
        )
        for block in np.array_split(instants, math.ceil(len(instants) / settings.block)):
            checkpoint()
            q, v, _ = sample(spline, block)
            found = checked.ratios(q, v).max(axis=0)
            ratio[: len(found)] = np.maximum(ratio[: len(found)], found)
    excess = ratio - 1
    return np.where(
        excess > -settings.tightening / 4,
        settings.path_factor * np.maximum(excess, 0.0) + settings.tightening,
        0.0,
    )


def with_repaired_path(
    prepared: PreparedProblem,
    program: NonlinearProgram,
    pairs: Indices,
    nearby: Indices,
    check: LimitCheck,
) -> NonlinearProgram:
    """The NLP with tighter bounds of its path constraints, and further clearance constraints.

    Args:
        prepared: the problem.
        program: the NLP solved before.
        pairs: pairs of bodies with a clearance constraint in `program`.
        nearby: pairs of bodies with a clearance constraint in the next NLP; a superset of `pairs`.
        check: the motion found, with its excess.
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
        # no sample collides, but the clearance is not proven: more of it at the path points
        bounds -= np.where(
            np.array(program.path.names) == CLEARANCE,
            CLEARANCE_CONSTRAINT.reserve / CLEARANCE_CONSTRAINT.ratio_range,
            0.0,
        )
    return replace(program, path_bounds=bounds)
