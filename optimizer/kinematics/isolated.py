"""Configurations of one pose: which are the same, and which lie on a curve of them."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.newton import solved

# configurations that differ by less are one [rad]: on a fold of two branches, rounding parts them
# by 1e-7
SAME = 1e-6
# what rounding leaves open in the error of a pose [m, rad]: over the smallest singular value, in
# the configuration
ROUNDED = 2e-14
# where two branches meet, an error e [m, rad] moves a configuration by less than this times its
# root [rad]
FOLD = 3.0
# smallest singular value below which a configuration may lie on a curve
SINGULAR_VALUE = 1e-7
# step [rad] along the null direction, the damping that keeps it, and the error [m, rad] of what is
# a curve: half of what is promised of a solution
_STEP, _DAMPING, _ON_CURVE = 0.3, 1e-12, 5e-10


def distinct(q: Array, missed: Array, smallest: Array | None = None) -> list[int]:
    """Indices of configurations q (n, nq) [rad], one of each that are the same: those that miss the
    pose least.

    `missed` (n,) [m, rad] is by how much. With their smallest singular values (n,), near a
    singularity more counts as the same.
    """
    # at a fold, an error moves the configuration by its root
    same = np.maximum(SAME, FOLD * np.sqrt(missed))
    if smallest is not None:
        same = np.maximum(same, ROUNDED / np.maximum(smallest, 1e-12))
    # a wave changes by no more than the sum of what its joints do: few pairs are left
    wave, near = np.sin(q + np.arange(q.shape[1])).sum(axis=1), q.shape[1] * same.max(initial=0.0)
    if np.diff(np.sort(wave)).min(initial=np.inf) > near:
        return list(range(len(q)))
    i, j = np.nonzero(np.triu(np.abs(wave[:, None] - wave) <= near, 1))
    alike = np.abs(wrapped(q[i] - q[j])).max(axis=1) <= np.maximum(same[i], same[j])
    if not alike.any():
        return list(range(len(q)))
    others: list[set[int]] = [set() for _ in q]
    for first, second in zip(i[alike].tolist(), j[alike].tolist(), strict=True):
        others[first].add(second)
        others[second].add(first)
    chosen = set[int]()
    for k in np.argsort(missed, kind="stable").tolist():
        if not others[k] & chosen:
            chosen.add(k)
    return sorted(chosen)


def lies_on_a_curve(chain: Chain, q: Array, T: Array) -> bool:
    """Whether a singular configuration (nq,) [rad] can move while the flange stays at T (4, 4).

    A step along the null direction, corrected across it, is tried on both sides: on a curve it
    reaches the pose, too.
    """
    null = np.linalg.svd(chain.flange_and_jacobian(q[None])[1][0])[2][-1]
    tried, missed = solved(
        chain, q + np.array([[_STEP], [-_STEP]]) * null, T, steps=25, least_damping=_DAMPING
    )
    far = np.abs(wrapped(tried - q)).max(axis=1) > _STEP / 10
    return bool((far & (missed < _ON_CURVE)).any())
