"""Cycles for tests: seeded poses in front of a UR5e, with a part carried on every other move."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from joulepath import Arm, Cycle, Payload, Pose, Stop
from tests.optimizer.moves import AMPLE, ROBOT

HOME = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
PART = Payload(mass=2.0, com=np.array([0.0, 0.0, 0.05]))


def poses(seed: int, count: int) -> list[Pose]:
    """Poses with the tool nearly down, within reach of every branch."""
    rng, found = np.random.default_rng(seed), list[Pose]()
    while len(found) < count:
        position = rng.uniform([-0.6, -0.6, 0.05], [0.6, 0.6, 0.4])
        if 0.35 < np.hypot(*position[:2]) < 0.7:
            tilt = rng.uniform([-0.2, -0.2, -np.pi], [0.2, 0.2, np.pi])
            found.append(
                Pose.from_rotation(position, pin.rpy.rpyToMatrix(np.pi + tilt[0], tilt[1], tilt[2]))
            )
    return found


def pick_and_place(seed: int, count: int, **given: Any) -> Cycle:
    """A cycle of `count` stops without collisions, with a part taken up and put down in turn."""
    arm = given.pop("arm", Arm(robot=ROBOT, collisions=False))
    stops = [
        Stop(name=f"stop {k}", target=pose, dwell=0.3, payload=PART if k % 2 == 0 else Payload())
        for k, pose in enumerate(poses(seed, count))
    ]
    return Cycle(**{"arm": arm, "start": HOME, "stops": stops, "deadline": AMPLE} | given)
