"""Newton's method for many configurations at once, with Levenberg-Marquardt damping.

The damping is the squared error, and more after a failed step. The method therefore converges at
folds of two branches, too, and on curves of solutions to a nearby point (Yamashita and Fukushima,
"On the rate of convergence of the Levenberg-Marquardt method", 2001).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain, pose_error, twist_size


@dataclass(frozen=True)
class NewtonSettings:
    """Settings of the damped Newton method."""

    exact: float = 2e-15
    """Pose error below which a step would only follow rounding [m, rad]."""
    last_digits: float = 1e-13
    """Pose error below which a failed step ends the iteration: only rounding is left [m, rad]."""
    first_damping: float = 1e-6
    """Additional damping after a first failed step, relative to the squared error."""
    damping_growth: float = 8.0
    """Factor of the additional damping after each further failed step."""
    damping_decay: float = 0.2
    """Factor of the additional damping after a successful step."""
    most_damping: float = 1e4
    """Additional damping above which a configuration is given up."""
    longest_step: float = 0.5
    """Largest joint movement of one step [rad]."""


NEWTON = NewtonSettings()


def solved(
    chain: Chain,
    q: Array,
    T: Array,
    steps: int = 60,
    hopeless: float = np.inf,
    least_damping: float = 0.0,
) -> tuple[Array, Array]:
    """Configurations that reach flange poses, found from start configurations.

    A configuration stops once a step no longer reduces its error: at the last digit, or at a local
    minimum.

    Args:
        chain: chain of the arm.
        q: start configurations (n, nq) [rad].
        T: flange pose (4, 4) of all configurations, or one pose each (n, 4, 4).
        steps: largest number of steps.
        hopeless: pose error [m, rad] above which a configuration stops after a third of the steps.
        least_damping: squared singular value below which nothing moves along the corresponding
            direction.

    Returns:
        The configurations (n, nq) [rad], and their pose errors (n,) [m, rad].
    """
    q = q.copy()
    T_reached, jacobian = chain.flange_and_jacobian(q)
    error = pose_error(T_reached, T)
    residual, extra = twist_size(error), np.zeros(len(q))
    active = np.flatnonzero(residual > NEWTON.exact)
    for step in range(steps):
        if not len(active):
            break
        squared = (error[active] ** 2).sum(axis=1)
        damping = squared + extra[active] + least_damping
        tried = q[active] + _damped_steps(jacobian[active], error[active], damping)
        T_tried, jacobian_tried = chain.flange_and_jacobian(tried)
        error_tried = pose_error(T_tried, T if T.ndim == 2 else T[active])
        residual_tried = twist_size(error_tried)
        better = (error_tried**2).sum(axis=1) < squared
        taken = active[better]
        q[taken] = tried[better]
        jacobian[taken] = jacobian_tried[better]
        error[taken] = error_tried[better]
        residual[taken] = residual_tried[better]
        extra[taken] *= NEWTON.damping_decay
        extra[active[~better]] = np.maximum(
            extra[active[~better]] * NEWTON.damping_growth, NEWTON.first_damping * squared[~better]
        )
        left = residual[active]
        stuck = ~better & ((extra[active] > NEWTON.most_damping) | (left < NEWTON.last_digits))
        given_up = (left > hopeless) & (step >= steps // 3)
        active = active[(left > NEWTON.exact) & ~stuck & ~given_up]
    return q, residual


def _damped_steps(jacobian: Array, error: Array, damping: Array) -> Array:
    """Steps (n, nq) [rad] towards errors (n, 6) with Jacobians (n, 6, nq) and dampings (n,), of at
    most `longest_step` per joint.
    """
    u, s, vt = np.linalg.svd(jacobian)
    weight = s / (s * s + damping[:, None] + 1e-300)
    in_modes = (u[:, :, : s.shape[1]].transpose(0, 2, 1) @ error[:, :, None])[:, :, 0] * weight
    step = (in_modes[:, None, :] @ vt[:, : s.shape[1]])[:, 0]
    largest = np.maximum(np.abs(step).max(axis=1), 1e-300)
    return np.asarray(step * np.minimum(1.0, NEWTON.longest_step / largest)[:, None])
