"""Speed scales of the curved term of friction.

The torque is not linear in this scale, so the best of several candidates is chosen per joint.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from joulepath.models.robot import Array
from joulepath.optimizer.identify.estimates.estimate import Estimate, Name, join_estimates
from joulepath.optimizer.identify.fits.block import (
    JointBlock,
    TorqueData,
    joint_block,
    weighted_solution,
)
from joulepath.optimizer.identify.options import Coupling


@dataclass(frozen=True)
class CurveSpeedSettings:
    """Candidates for the speed of the curved term."""

    smallest: float = 0.05
    """Smallest candidate [rad/s]."""
    largest: float = 3.0
    """Largest candidate [rad/s]."""
    count: int = 12
    """Number of candidates, evenly spaced in the logarithm."""


CURVE_SPEED = CurveSpeedSettings()


def _best_speeds(data: TorqueData) -> Array | None:
    """Best speeds (nq,) [rad/s] of the curved terms; None if these are not fitted."""
    robot, options = data.robot, data.options
    if "curved" not in options.terms or "friction" not in options.targets:
        return None
    found = np.array(robot.friction.speed)
    candidates = np.geomspace(CURVE_SPEED.smallest, CURVE_SPEED.largest, CURVE_SPEED.count)
    for joints in coupled_joints(robot.nq, options.couplings):
        errors = [
            _squared_error(joint_block(data, joints, np.full(robot.nq, speed)), data)
            for speed in candidates.tolist()
        ]
        if max(errors) > min(errors):
            found[joints] = candidates[int(np.argmin(errors))]
    return found


def _squared_error(block: JointBlock, data: TorqueData) -> float:
    found, _ = weighted_solution(block, data)
    residuals = block.values - block.columns @ found
    return float(residuals @ residuals)


def coupled_joints(nq: int, couplings: Sequence[Coupling]) -> list[list[int]]:
    """Connected sets of coupled joints; an uncoupled joint is a set of its own."""
    graph = np.eye(nq)
    for coupling in couplings:
        graph[np.ix_(coupling.joints, coupling.joints)] = 1
    labels = connected_components(graph, directed=False)[1]
    return [np.flatnonzero(labels == label).tolist() for label in np.unique(labels)]


def with_curve_speeds(fit: Callable[[Array | None], Estimate], data: TorqueData) -> Estimate:
    """Fit with the best speeds of the curved terms as further figures.

    A curved term kept at the robot's own value also keeps the robot's own speed scale.

    Args:
        fit: fit for given speeds (nq,) [rad/s]; for None if the curved terms are not fitted.
        data: data of the fit; coupled joints share a speed.
    """
    speeds = _best_speeds(data)
    while True:
        found = fit(speeds)
        if speeds is None:
            return found
        curved = [
            (joint, bool(reason))
            for (name, joint), reason in zip(found.names, found.reasons, strict=True)
            if name == "curved" and joint is not None
        ]
        own = data.robot.friction.speed
        kept = [joint for joint, is_kept in curved if is_kept and speeds[joint] != own[joint]]
        if not kept:
            joints = [joint for joint, is_kept in curved if not is_kept]
            return join_estimates([found, _speeds_of(joints, speeds, len(found.replicates))])
        speeds = speeds.copy()
        speeds[kept] = own[kept]


def _speeds_of(joints: list[int], speeds: Array, clusters: int) -> Estimate:
    """Speed scales [rad/s] of some joints; their errors are part of the errors of the terms."""
    names: tuple[Name, ...] = tuple(("speed", joint) for joint in joints)
    value = speeds[joints]
    none = np.zeros((len(value),) * 2)
    return Estimate(names, value, np.tile(value, (clusters, 1)), ("",) * len(value), none)
