"""Seeds for the branches of an arm with deviations next to a singularity.

Where the nearest simple arm has a self-motion, an arm with deviations has a curve on which the pose
error stays small. The few configurations that reach the pose may lie anywhere on this curve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.isolated import distinct
from joulepath.optimizer.kinematics.newton import solved


@dataclass(frozen=True)
class SeedSettings:
    """Settings of the seeds near singularities."""

    nearly_singular: float = 0.1
    """Smallest singular value below which more seeds are tried: the nearest simple arm need not
    have a branch near the exact one there.
    """
    pose_shifts: tuple[float, ...] = (1e-6, 1e-3)
    """Shifts of the pose for more seeds [m, rad]."""
    strides: tuple[float, ...] = (1e-5, 1e-3, 0.03, 0.2, 0.7, 1.4, 2.1, 2.8, 3.1)
    """Steps along the null direction of nearly singular seeds [rad]."""
    curve_singular_value: float = 0.01
    """Smallest singular value below which seeds follow the curve of least pose error."""

    step: float = 0.15
    """Length of a step along this curve [rad]."""
    steps: int = 44
    """Number of steps to each side, together more than a full turn of a joint."""
    corrections: int = 3
    """Newton steps back onto the curve after each step."""
    least_damping: float = 1e-4
    """Squared singular value below which corrections leave a direction alone: the one along the
    curve.
    """


SEEDS = SeedSettings()


def seeds_around(
    chain: Chain, rows: Callable[[Array], Array], weak: Array, on_curve: Array, T: Array
) -> Array:
    """Seeds of shifted poses, along null directions, and along curves of small pose error.

    Args:
        chain: chain of the arm.
        rows: function that returns the configurations (n, 6) of the nearest simple arm at a pose.
        weak: nearly singular seeds, shape (n, 6) [rad].
        on_curve: seeds on curves of small pose error, shape (n, 6) [rad].
        T: flange pose (4, 4).
    """
    seeds = [weak]
    if len(on_curve):
        seeds.append(
            along_null_curves(chain, on_curve[distinct(on_curve, np.zeros(len(on_curve)))], T)
        )
    for shift in SEEDS.pose_shifts:
        for axis in range(6):
            for side in (shift, -shift):
                twist = np.zeros(6)
                twist[axis] = side
                seeds.append(rows(T @ pin.exp6(twist).homogeneous))
    null = np.linalg.svd(chain.flange_and_jacobian(weak)[1])[2][:, -1]
    seeds += [weak + side * stride * null for stride in SEEDS.strides for side in (1, -1)]
    q = np.vstack(seeds)
    # The seeds of shifted poses are mostly the same.
    return q[np.unique(np.round(q, 4), axis=0, return_index=True)[1]]


def along_null_curves(chain: Chain, q: Array, T: Array) -> Array:
    """Configurations on the curves of small pose error through nearly singular configurations.

    Args:
        chain: chain of the arm.
        q: nearly singular configurations, shape (n, nq) [rad].
        T: flange pose (4, 4).

    Returns:
        Seeds, shape (2 · steps · n, nq) [rad].
    """
    front = np.vstack([q, q])
    null = np.linalg.svd(chain.flange_and_jacobian(front)[1])[2][:, -1]
    null[len(q) :] *= -1
    found = []
    for _ in range(SEEDS.steps):
        front, _ = solved(
            chain,
            front + SEEDS.step * null,
            T,
            steps=SEEDS.corrections,
            least_damping=SEEDS.least_damping,
        )
        before = null
        null = np.linalg.svd(chain.flange_and_jacobian(front)[1])[2][:, -1]
        # A null vector has either sign: continue in the previous direction.
        null = null * np.where((null * before).sum(axis=1) < 0, -1.0, 1.0)[:, None]
        found.append(front)
    return np.vstack(found)
