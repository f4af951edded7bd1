"""The angle at which the tool ends where its path leaves it free: angles all around, then near the
best of these.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

# angles [rad] that are tried at first, and the step between them
STEP = np.pi / 4
ALL_AROUND = tuple(STEP * k for k in (-3, -2, -1, 1, 2, 3, 4))
# near the best one: a step [rad] that tells nothing, and most angles that are tried
NEAR, MOST = 0.02, 8
# cost of an angle without a motion, as a multiple of the least one at first
FAR = 10.0


def try_angles(cost: Callable[[float], float], known: float) -> None:
    """Ask for the `cost` [J] of angles [rad] until no other seems to be less; inf: none. It is
    `known` at zero.
    """
    found = {0.0: known} | {angle: cost(angle) for angle in ALL_AROUND}
    middle = min(found, key=lambda angle: found[angle])
    if not np.isfinite(found[middle]):
        return
    most = found[middle] + FAR * abs(found[middle])
    minimize_scalar(
        lambda angle: min(cost(float(angle)), most),
        bounds=(middle - STEP, middle + STEP),
        method="bounded",
        options={"xatol": NEAR, "maxiter": MOST},
    )
