"""A round with a payload, to export."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath import Move, Payload, Program, Rest
from tests.optimizer.export.read_back.random_motions import arm_of, random_spline

LOAD = Payload(1.5, np.array([0.0, 0.01, 0.06]))


def cycle_with_payload(robot: str = "ur5e", label: str = "start to pick") -> Program:
    """A move to a grasp, a dwell, a move with the payload, and a return without it."""
    arm = arm_of(robot)
    loaded = replace(arm, payload=LOAD)
    first = random_spline(arm, 1)
    second = random_spline(arm, 2, first.control_points[-1])
    third = random_spline(arm, 3, second.control_points[-1])
    return Program(
        (
            Move(first, arm, label),
            Rest(0.35, "dwell at pick"),
            Move(second, loaded, "pick to place"),
            Move(third, arm, "place to end"),
        )
    )
