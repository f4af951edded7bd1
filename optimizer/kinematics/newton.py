"""Newton's method for n configurations at once, of one pose or of one each, damped after Levenberg
and Marquardt.

The damping is the squared error, and more where a step fails: so the method converges on curves of
solutions, too, to a point nearby, and at a fold of two branches (Yamashita and Fukushima, "On the
rate of convergence of the Levenberg-Marquardt method", 2001).
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain, miss, pose_error

# error [m, rad] below which a step tells nothing but rounding
EXACT = 2e-15
# damping after a failed step, its growth and its decay
_FIRST, _GROWTH, _DECAY, _MOST = 1e-6, 8.0, 0.2, 1e4
# longest step of any joint [rad]
_LONGEST_STEP = 0.5


def solved(
    chain: Chain,
    q: Array,
    T: Array,
    steps: int = 60,
    hopeless: float = np.inf,
    least_damping: float = 0.0,
) -> tuple[Array, Array]:
    """Configurations (n, nq) [rad] from starts q (n, nq), and by how much each misses (n,) the
    flange pose T (4, 4), or one of its own (n, 4, 4).

    A start ends once a step no longer helps: at the last digit, or at a local minimum of the error.
    With `hopeless`, a start whose error is larger after a third of the steps ends there. With
    `least_damping`, nothing moves along directions whose squared singular value is smaller.
    """
    q = q.copy()
    T_reached, jacobian = chain.flange_and_jacobian(q)
    error = pose_error(T_reached, T)
    missed, extra = miss(error), np.zeros(len(q))
    going = np.flatnonzero(missed > EXACT)
    for step in range(steps):
        if not len(going):
            break
        u, s, vt = np.linalg.svd(jacobian[going])
        squared = (error[going] ** 2).sum(axis=1)
        weight = s / (s * s + (squared + extra[going] + least_damping)[:, None] + 1e-300)
        move = ((u.transpose(0, 2, 1) @ error[going][:, :, None])[:, :, 0] * weight)[
            :, None, :
        ] @ vt[:, : s.shape[1]]
        move = move[:, 0]
        move *= np.minimum(1.0, _LONGEST_STEP / np.maximum(np.abs(move).max(axis=1), 1e-300))[
            :, None
        ]
        tried = q[going] + move
        T_tried, jacobian_tried = chain.flange_and_jacobian(tried)
        error_tried = pose_error(T_tried, T if T.ndim == 2 else T[going])
        missed_tried = miss(error_tried)
        better = (error_tried**2).sum(axis=1) < squared
        taken = going[better]
        q[taken], jacobian[taken], error[taken] = (
            tried[better],
            jacobian_tried[better],
            error_tried[better],
        )
        missed[taken] = missed_tried[better]
        extra[taken] *= _DECAY
        extra[going[~better]] = np.maximum(
            extra[going[~better]] * _GROWTH, _FIRST * squared[~better]
        )
        stuck = (~better) & ((extra[going] > _MOST) | (missed[going] < 1e-13))
        late = (
            (missed[going] > hopeless) if step >= steps // 3 else np.zeros(len(going), dtype=bool)
        )
        going = going[(missed[going] > EXACT) & ~stuck & ~late]
    return q, missed
