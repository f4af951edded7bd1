"""Recently used models: every arm has its own model, however many arms there are."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.problem.arm import Arm, Payload
from tests.optimizer.moves import ROBOT

BARE = sum(body.mass for body in ROBOT.model.inertias)


def added_mass(payload: float) -> float:
    """Mass [kg] of a new arm's model beyond the robot's.

    The arm is deleted afterwards, and its id may be reused.
    """
    model = rigid_body_model(Arm(robot=ROBOT, payload=Payload(mass=payload, com=np.zeros(3))))
    return sum(body.mass for body in model.inertias) - BARE


def test_an_arm_keeps_its_model() -> None:
    arm = Arm(robot=ROBOT)
    assert rigid_body_model(arm) is rigid_body_model(arm)
    assert rigid_body_model(arm) is not rigid_body_model(Arm(robot=ROBOT))


def test_no_arm_gets_the_model_of_another() -> None:
    payloads = np.linspace(0.1, 5.0, 400).tolist()
    assert [added_mass(each) for each in payloads] == pytest.approx(payloads)
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(added_mass, payloads)) == pytest.approx(payloads)
