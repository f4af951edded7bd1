"""Ranges of figures without identification: `default_ranges.yaml`."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
import yaml

from joulepath.models.robot import Array, Mask, Robot

P95 = 1.6448536269514722
"""Quantile of the standard normal distribution at 95 %."""
LARGE = 0.5
"""Least torque limit of a large joint over the greatest torque limit of the arm."""
ENGINEERING = "E"
"""The trust letter of figures without a source."""


@cache
def default_ranges() -> dict[str, Any]:
    """The entries of the file, by name."""
    text = (files("joulepath.models.uncertainty") / "default_ranges.yaml").read_text(
        encoding="utf-8"
    )
    ranges: dict[str, Any] = yaml.safe_load(text)
    return ranges


def range_of(name: str, letters: AbstractSet[str] = frozenset()) -> tuple[float, float]:
    """P5 and P95 of a factor on the robot's figure, or of its value, for given trust letters."""
    entry = default_ranges()[name]
    if ENGINEERING in letters:
        entry = entry.get("engineering_default", entry)
    low, high = entry["factor"] if "factor" in entry else entry["value"]
    return float(low), float(high)


def lognormal(low: float, high: float) -> tuple[float, float]:
    """Mean and standard deviation of the logarithm of a figure with P5 `low` and P95 `high`."""
    return float(np.log([low, high]).mean()), float(np.log(high / low) / (2 * P95))


def large_joints(robot: Robot) -> Mask:
    """The joints (nq,) with large motors, by their torque limits."""
    limits: Array = robot.limits.tau_max
    return np.asarray(limits >= LARGE * limits.max())
