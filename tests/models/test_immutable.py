"""Robots and results are shared: nobody changes their data by accident."""

from __future__ import annotations

import json
import pickle
from copy import deepcopy
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest
import yaml

from joulepath import (
    Arm,
    CandidateReport,
    Pose,
    Problem,
    Solution,
    evaluate,
    inverse_kinematics,
    load_robot,
    optimize,
)

HOME = np.radians([0.0, -90, 90, -90, 180, 0])
SHELF = np.radians([60.0, -70, 60, -80, 90, 0])
# top-down, in the middle of the workspace
POSE = Pose.from_rotation([0.4, 0.2, 0.4], np.diag([1.0, -1, -1]))


def arrays_in(value: Any, path: str = "") -> dict[str, np.ndarray]:
    """All arrays of a value by their paths, also those of derived fields."""
    if isinstance(value, np.ndarray):
        return {path: value}
    if is_dataclass(value) and not isinstance(value, type):
        items = {each.name: getattr(value, each.name) for each in fields(value)} | vars(value)
    elif isinstance(value, CandidateReport):
        items = value._asdict()
    elif isinstance(value, dict):
        items = value
    elif isinstance(value, list | tuple):
        items = dict(enumerate(value))
    else:
        return {}
    return {
        where: array
        for name, each in items.items()
        for where, array in arrays_in(each, f"{path}.{name}").items()
    }


def writable(value: Any) -> list[str]:
    found = arrays_in(value)
    assert found
    return [path for path, array in found.items() if array.flags.writeable]


@pytest.fixture(scope="module")
def solution(arm: Arm) -> Solution:
    return optimize(Problem(arm=arm, start=HOME, goal=SHELF))


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm(robot=load_robot("ur5e"))


def test_arrays_of_results_are_read_only(arm: Arm, solution: Solution) -> None:
    assert writable(solution) == []
    assert writable(evaluate(arm, solution.trajectory.spline, sample_period=0.05)) == []
    assert writable(list(inverse_kinematics(arm, POSE))) == []


def test_arrays_stay_read_only_after_pickling_and_copying(solution: Solution) -> None:
    for other in (pickle.loads(pickle.dumps(solution.trajectory)), deepcopy(solution.trajectory)):
        assert writable(other) == []
        assert other == solution.trajectory


def test_results_do_not_lock_the_arrays_they_are_made_of(solution: Solution) -> None:
    points = solution.trajectory.spline.control_points.copy()
    type(solution.trajectory.spline)(5, solution.trajectory.spline.knots, points)
    points[0] = 0.0


def test_the_data_of_a_robot_cannot_be_changed() -> None:
    robot = load_robot("ur5e")
    for other in (robot, pickle.loads(pickle.dumps(robot))):
        assert writable((other, other.limits.rates)) == []
        for change in (
            lambda r: r.friction_laws.clear(),
            lambda r: r.friction_laws.update(r.friction_laws),
            lambda r: r.figures.__setitem__("title", "another"),
            lambda r: r.figures["limits"]["velocity"]["value"].__setitem__(0, 9.0),
            lambda r: r.figures["limits"]["velocity"]["value"].append(9.0),
        ):
            with pytest.raises(TypeError, match=r"deepcopy"):
                change(other)


def test_figures_are_written_as_json_and_copied_to_be_changed() -> None:
    figures = load_robot("ur5e").figures
    copy = deepcopy(figures)
    assert json.loads(json.dumps(figures)) == figures == copy
    copy["limits"]["velocity"]["value"][0] = 9.0
    assert copy != load_robot("ur5e").figures


def test_figures_are_written_as_yaml() -> None:
    figures = load_robot("ur5e").figures
    assert yaml.safe_load(yaml.safe_dump(figures)) == yaml.safe_load(yaml.dump(figures)) == figures
