"""Public functions refuse arguments of other types by their names, before they compute."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import joulepath
from joulepath import (
    Arm,
    Cycle,
    InvalidProblem,
    Places,
    PlannedMotion,
    Problem,
    Spline,
    Stop,
    UnknownRobot,
    load_robot,
)
from joulepath.optimizer.replay.reference import course_of

ROBOT = load_robot("ur5e")
ARM = Arm(robot=ROBOT)
HOME = np.radians([0.0, -90, 90, -90, 180, 0])
PROBLEM = Problem(arm=ARM, start=HOME, goal=HOME + 0.1)
CYCLE = Cycle(arm=ARM, start=HOME, stops=[Stop(name="a", target=HOME + 0.1)])
LINE = Spline(1, np.array([0.0, 0.0, 1.0, 1.0]), np.array([HOME, HOME + 0.1]))
PLANNED = PlannedMotion(ARM, course_of(LINE), 1.0, 1.0, 1.0)
ANYWHERE = Places([np.eye(4)])
POSE = joulepath.Pose(np.eye(4))
ATTACHMENT = joulepath.Attachment(joulepath.Sphere(0.1))


@pytest.mark.parametrize(
    ("function", "arguments", "options", "said"),
    [
        ("optimize", [{}], {}, "problem must be of type Problem, not dict: give Problem(arm"),
        ("compare", [[]], {}, "problem must be of type Problem"),
        ("pareto", [PROBLEM], {"points": 2.5}, "points must be a whole number from 2 to 100"),
        ("pareto", [PROBLEM], {"points": "3"}, "points must be a number, not '3'"),
        ("what_if", [1, []], {}, "solution must be of type Solution, not int: give the answer"),
        ("plan_cycle", [PROBLEM], {}, "cycle must be of type Cycle, not Problem"),
        ("place", [3, ANYWHERE], {}, "cycles must be a list of WeightedCycle, not int"),
        ("place", [[3], ANYWHERE], {}, "cycles.0 must be of type WeightedCycle, not int"),
        ("evaluate", [ROBOT, 3], {}, "arm must be of type Arm, not Robot: give Arm(robot="),
        ("evaluate", [ARM, HOME], {}, "motion must be of type "),
        ("inverse_kinematics", [ARM, HOME], {}, "pose must be of type Pose or "),
        ("inverse_kinematics", [ARM, POSE], {"deadline": "1"}, "deadline must be a number"),
        ("replay", [3], {"problem": PROBLEM}, "motion must be of type Solution or "),
        ("replay", [PLANNED], {"controls": []}, "controls must name a controller"),
        ("replay", [PLANNED], {"perturb": 0.1}, "perturb must be of type Mapping, not float"),
        ("replay", [PLANNED], {"perturb": {"payload": "1"}}, "perturb.payload must be a number"),
        ("place", [CYCLE, ANYWHERE], {"moves": "x"}, "moves must be of type Group, not str"),
        ("export", [3, "csv"], {}, "motion must be of type Solution or "),
        ("identify", [ROBOT, [3]], {}, "logs.0 must be of type Log, not int: give read_log("),
        ("read_log", ["log.csv", "ur5e"], {}, "robot must be of type Robot, not str: give load_"),
        ("even_payload", [None, ATTACHMENT], {}, "mass must be a number, not None"),
        ("even_payload", [1.0, 2], {}, "shape must be of type Attachment, not int: give load_"),
        ("load_tool", [["suction_cup"]], {}, "name must be of type str, not list"),
        ("read_log", [3, ROBOT], {}, "source must be of type str or bytes or PathLike, not int"),
        ("Client", [None], {}, "url must be of type str, not NoneType"),
        ("load_robot", [3], {}, "robot must be of type str or PathLike, not int"),
        ("load_robot", ["ur5e"], {"figures": 3}, "figures must be of type dict or str or "),
    ],
)
def test_another_type_is_refused_by_the_name_of_the_argument(
    function: str, arguments: list[Any], options: dict[str, Any], said: str
) -> None:
    call: Callable[..., Any] = getattr(joulepath, function)
    with pytest.raises(InvalidProblem) as refusal:
        call(*arguments, **options)
    assert str(refusal.value).startswith(said)
    assert str(refusal.value).startswith(refusal.value.field)


def test_missing_arguments_are_named_by_python() -> None:
    with pytest.raises(TypeError, match=r"optimize\(\) missing .* 'problem'"):
        joulepath.optimize()  # type: ignore[call-arg]


def test_an_unknown_robot_is_a_public_error() -> None:
    with pytest.raises(UnknownRobot) as error:
        load_robot("r2d2")
    assert error.value.name == "r2d2" and "ur5e" in error.value.known
