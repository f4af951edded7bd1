"""Parts of other types are refused by the name of their field, where they are given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import (
    AnyOf,
    Arm,
    Attachment,
    Box,
    Cycle,
    FreeOrder,
    Group,
    InvalidProblem,
    LogOptions,
    Obstacle,
    Payload,
    Places,
    Problem,
    Region,
    Rest,
    Scene,
    Stop,
    ToolPath,
    Voxels,
    load_robot,
)

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
        (arm, {"tool": "suction_cup"}, "tool must be a list of Attachment, not str: give load_t"),
        (arm, {"scene": [BOX]}, "scene must be of type Scene, not list."),
        (arm, {"payload": 2.0}, "payload must be of type Payload, not float."),
        (cycle, {"stops": [HOME]}, "stops.0 must be of type Stop, not list."),
        (cycle, {"stops": 1}, "stops must be a list of Stop, not int."),
        (cycle, {"stops": [], "closed": "no"}, "closed must be of type bool, not str."),
        (cycle, {"stops": [], "unsolved_excess": "no"}, "unsolved_excess must be a number"),
        (problem, {"windings": 2}, "windings must be of type bool, not int."),
        (problem, {"passes": 3}, "passes must be a list of values, not int."),
        (arm, {"friction": ["warm"]}, "friction must be of type str, not list."),
        (Stop, {"name": "a", "target": HOME, "obstacles_ignored": "table"}, "obstacles_ignored mu"),
        (Attachment, {"shape": BOX, "touches": "tool0"}, "touches must be a list of str, not str."),
        (AnyOf, {"targets": 3}, "targets must be a list of "),
        (FreeOrder, {"before": ("a", "b")}, "before.0 must be a list of str, not str."),
        (ToolPath, {"via": 3}, "path.via must be a list of Pose, not int: give the pose of "),
        (Group, {"stops": "pick"}, "moves.stops must be a list of str, not str."),
        (Region, {"x": 1.0}, "region.x must be a list of float, not float."),
        (Region, {"mounts": ["roof"]}, "region.mounts.0 must be one of floor, wall, ceiling"),
        (Places, {"poses": 3}, "region.poses must be a list of "),
        (Voxels, {"size": 0.1, "cells": [[0.5, 0, 0]]}, "cells must be integers within "),
        (Rest, {"duration": "1"}, "duration must be a number of seconds"),
        (LogOptions, {"columns": 3}, "columns must be of type Mapping, not int."),
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


def test_numbers_in_lists_make_limits() -> None:
    """Limits may be given as lists; anything but numbers is refused by the name of the limit."""
    slow = replace(ROBOT.limits, v_max=[1.0] * 6)
    assert arm(limits=slow).active_limits.v_max.tolist() == [1.0] * 6
    with pytest.raises(ValueError, match=r"^v_max must be numbers\.$"):
        replace(ROBOT.limits, v_max="fast")
    with pytest.raises(InvalidProblem, match="velocity must be a positive, finite number"):
        arm(limits=replace(ROBOT.limits, v_max=1.0))


def test_truth_values_of_numpy_are_truth_values() -> None:
    assert problem(windings=np.bool_(False)).windings == False  # noqa: E712
