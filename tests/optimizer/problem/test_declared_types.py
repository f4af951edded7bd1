"""Parts of other types are refused by the name of their field, where they are given."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from joulepath import Arm, Box, Cycle, InvalidProblem, Obstacle, Payload, Problem, Scene, load_robot

ROBOT = load_robot("ur5e")
HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
BOX = Box(np.ones(3))


def problem(**fields: Any) -> Problem:
    return Problem(**{"arm": Arm(robot=ROBOT), "start": HOME, "goal": HOME} | fields)


def cycle(**fields: Any) -> Cycle:
    return Cycle(**{"arm": Arm(robot=ROBOT), "start": HOME} | fields)


def arm(**fields: Any) -> Arm:
    return Arm(**{"robot": ROBOT} | fields)


@pytest.mark.parametrize(
    ("make", "fields", "said"),
    [
        (problem, {"arm": ROBOT}, "arm must be of type Arm, not Robot: give Arm(robot="),
        (arm, {"robot": "ur5e"}, "robot must be of type Robot, not str: give load_robot(name)."),
        (arm, {"tool": "suction_cup"}, "tool.0 must be of type Attachment, not str: give load_t"),
        (arm, {"scene": [BOX]}, "scene must be of type Scene, not list."),
        (arm, {"payload": 2.0}, "payload must be of type Payload, not float."),
        (cycle, {"stops": [HOME]}, "stops.0 must be of type Stop, not list."),
        (cycle, {"stops": 1}, "stops must be a sequence, not int."),
        (Scene, {"obstacles": [BOX]}, "scene.obstacles.0 must be of type Obstacle, not Box."),
        (Obstacle, {"name": "post", "shape": [1, 1, 1]}, "shape must be of type "),
        (Payload, {"shape": BOX}, "payload.shape must be of type Attachment, not Box"),
    ],
)
def test_another_type_is_refused_with_the_field(
    make: Callable[..., object], fields: dict[str, Any], said: str
) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        make(**fields)
    assert said in str(refusal.value) and str(refusal.value).startswith(refusal.value.field)
