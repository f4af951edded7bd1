"""Curves along which the flange nearly holds its pose: starts for what solutions lie on them.

An arm whose axes nearly meet has no self-motion where the arm nearby has one, but a curve on which
the error of the pose stays small. The few configurations on it that reach the pose may be anywhere.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.newton import solved

# step along the curve [rad], and steps to each side: more than a full turn of a joint
STEP, STEPS = 0.15, 44
# Newton steps across the curve, and the squared singular value below which they do not move: along
# the curve
CORRECTIONS, ALONG = 3, 1e-4


def along_valleys(chain: Chain, q: Array, T: Array) -> Array:
    """Configurations (2 STEPS n, nq) [rad] on the curves through q (n, nq) [rad] on which the
    flange nearly stays at T (4, 4)."""
    ways = np.vstack([q, q])
    null = np.linalg.svd(chain.flange_and_jacobian(ways)[1])[2][:, -1]
    null[len(q) :] *= -1
    found = []
    for _ in range(STEPS):
        moved = solved(chain, ways + STEP * null, T, steps=CORRECTIONS, least_damping=ALONG)[0]
        ways, before = moved, null
        null = np.linalg.svd(chain.flange_and_jacobian(ways)[1])[2][:, -1]
        # the way goes on in the direction that it came in
        null = null * np.where((null * before).sum(axis=1) < 0, -1.0, 1.0)[:, None]
        found.append(ways)
    return np.vstack(found)
