"""Check that samples of a motion belong to a spline on an arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.evaluate.errors import NotCertified
from joulepath.optimizer.motion.spline import Spline, sample
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class SampleCheckSettings:
    """Settings of the check of samples."""

    tolerance: float = 1e-6
    """Largest difference of positions [rad], and of velocities, accelerations and torques over
    their limits [1]: rounding errors of a file."""


SAMPLE_CHECK = SampleCheckSettings()


def check_samples(arm: Arm, spline: Spline, t: Array, samples: Sequence[Array]) -> None:
    """Compare given samples of a motion with its spline on an arm.

    The torques reveal another payload, mounting or robot.

    Args:
        arm: claimed arm of the motion.
        spline: motion of the arm.
        t: times of the samples, shape (k,) [s].
        samples: q [rad], v [rad/s], a [rad/s²], and tau [N·m] of rigid bodies and rotors, all
            of shape (k, nq).

    Raises:
        NotCertified: samples and spline differ by more than rounding errors.
    """
    limits, duration = arm.active_limits, spline.duration
    if len(t) and not (
        t[0] >= 0 and t[-1] <= duration * (1 + SAMPLE_CHECK.tolerance) and np.isfinite(t).all()
    ):
        raise NotCertified(0, "its samples are not of its own time", {})
    q, v, a = sample(spline, np.minimum(t, duration))
    own = (q, v, a, Plant(arm).torques(q, v, a))
    scales = (np.ones_like(limits.v_max), limits.v_max, limits.a_max, limits.tau_max)
    names = ("joint positions", "velocities", "accelerations", "torques")
    for name, computed, given, scale in zip(names, own, samples, scales, strict=True):
        if (
            given.shape != computed.shape
            or not (np.abs(given - computed) <= SAMPLE_CHECK.tolerance * scale).all()
        ):
            raise NotCertified(
                0, f"the {name} of its samples are not those of its spline on this arm", {}
            )
