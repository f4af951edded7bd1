"""Search for the angle of the tool at an end of its path with a free angle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar


@dataclass(frozen=True)
class EndAngleSettings:
    """Settings of the search for the angle of least cost."""

    steps_per_turn: int = 8
    """Evenly spaced angles of a full turn at which the cost is evaluated first."""

    tolerance: float = 0.02
    """Absolute tolerance of the angle in the line search [rad]."""

    line_search_iterations: int = 8
    """Largest number of iterations of the line search around the best of the first angles."""

    missing_cost: float = 10.0
    """Cost of an angle without a motion in the line search, as a multiple of the least cost."""

    @property
    def step(self) -> float:
        """Distance between the first angles [rad]."""
        return 2 * np.pi / self.steps_per_turn


END_ANGLE = EndAngleSettings()


def try_angles(
    cost: Callable[[float], float], known: float, settings: EndAngleSettings = END_ANGLE
) -> None:
    """Evaluate the cost of angles: evenly spaced ones, then by line search around the best.

    The caller keeps the motions found by `cost`.

    Args:
        cost: cost of an angle [rad] relative to the present one [J]; infinite without a motion.
        known: cost of the angle 0 [J].
        settings: settings of the search.
    """
    half = settings.steps_per_turn // 2
    angles = (settings.step * k for k in range(1 - half, half + 1) if k)
    found = {0.0: known} | {angle: cost(angle) for angle in angles}
    middle = min(found, key=lambda angle: found[angle])
    if not np.isfinite(found[middle]):
        return
    most = found[middle] + settings.missing_cost * abs(found[middle])
    minimize_scalar(
        lambda angle: min(cost(float(angle)), most),
        bounds=(middle - settings.step, middle + settings.step),
        method="bounded",
        options={"xatol": settings.tolerance, "maxiter": settings.line_search_iterations},
    )
