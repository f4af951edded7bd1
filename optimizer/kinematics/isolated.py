"""Comparison of the configurations of one pose: duplicates, and membership in a self-motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.newton import solved


@dataclass(frozen=True)
class IsolatedSettings:
    """Tolerances that tell configurations of one pose apart."""

    same: float = 1e-6
    """Joint distance below which two configurations are one [rad]; at a fold of two branches,
    rounding separates them by 1e-7 rad.
    """
    rounding: float = 2e-14
    """Pose error due to rounding [m, rad]; divided by the smallest singular value, it is the
    uncertainty of the configuration.
    """
    fold: float = 3.0
    """Factor of √e, the joint displacement [rad] due to a pose error e [m, rad] at a fold of two
    branches.
    """
    singular_value: float = 1e-7
    """Smallest singular value below which a configuration may lie on a self-motion."""
    probe_step: float = 0.3
    """Step along the null direction that tests for a self-motion [rad]."""
    probe_newton_steps: int = 25
    """Newton steps back onto the pose after this step."""
    least_probe_share: float = 0.1
    """Smallest joint distance of the result from the configuration, relative to the step."""
    probe_damping: float = 1e-12
    """Damping that keeps the component of the step along the null direction."""
    probe_tolerance: float = 5e-10
    """Largest pose error of a member of a self-motion [m, rad]: half the promised accuracy."""


ISOLATED = IsolatedSettings()


def distinct(q: Array, residual: Array, smallest: Array | None = None) -> list[int]:
    """Indices of distinct configurations of one pose; of duplicates, the one with the least pose
    error.

    Args:
        q: configurations (n, nq) [rad].
        residual: pose error of each, shape (n,) [m, rad].
        smallest: smallest singular value of each, shape (n,); if given, near a singularity the
            tolerance grows.
    """
    # At a fold, an error e moves the configuration by about √e.
    same = np.maximum(ISOLATED.same, ISOLATED.fold * np.sqrt(residual))
    if smallest is not None:
        same = np.maximum(same, ISOLATED.rounding / np.maximum(smallest, 1e-12))
    # The sum of shifted sines changes by no more than the sum of the joint distances, and leaves
    # few pairs to compare.
    sine_sum = np.sin(q + np.arange(q.shape[1])).sum(axis=1)
    near = q.shape[1] * same.max(initial=0.0)
    if np.diff(np.sort(sine_sum)).min(initial=np.inf) > near:
        return list(range(len(q)))
    i, j = np.nonzero(np.triu(np.abs(sine_sum[:, None] - sine_sum) <= near, 1))
    same_pair = np.abs(wrapped(q[i] - q[j])).max(axis=1) <= np.maximum(same[i], same[j])
    if not same_pair.any():
        return list(range(len(q)))
    others: list[set[int]] = [set() for _ in q]
    for first, second in zip(i[same_pair].tolist(), j[same_pair].tolist(), strict=True):
        others[first].add(second)
        others[second].add(first)
    chosen = set[int]()
    for k in np.argsort(residual, kind="stable").tolist():
        if not others[k] & chosen:
            chosen.add(k)
    return sorted(chosen)


def lies_on_a_curve(chain: Chain, q: Array, T: Array) -> bool:
    """Whether a singular configuration q (nq,) [rad] belongs to a self-motion of the flange pose T
    (4, 4).

    A step along the null direction and back onto the pose, across this direction, is tried to both
    sides; on a self-motion it reaches the pose again.
    """
    null = np.linalg.svd(chain.flange_and_jacobian(q[None])[1][0])[2][-1]
    tried, residual = solved(
        chain,
        q + np.array([[ISOLATED.probe_step], [-ISOLATED.probe_step]]) * null,
        T,
        steps=ISOLATED.probe_newton_steps,
        least_damping=ISOLATED.probe_damping,
    )
    far = np.abs(wrapped(tried - q)).max(axis=1) > ISOLATED.least_probe_share * ISOLATED.probe_step
    return bool((far & (residual < ISOLATED.probe_tolerance)).any())
