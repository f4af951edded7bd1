"""Poses, bounds and limits on their way from the schema to the optimizer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from joulepath import InvalidProblem, load_robot
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from tests.app.requests import move


def problem(**fields: Any) -> Any:
    request = OptimizeRequest.model_validate(move(**fields))
    return to_problem(request, request.deadline)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({}, (None, 160.0)),
        ({"duration": None, "sample_period": 1e-4}, (None, 2.0)),
        ({"duration": 2}, (2, 2)),
        ({"duration": {"min": 2.0}, "sample_period": 0.1}, (2.0, 600.0)),
        ({"duration": {"min": 1.0, "max": 2.0}}, (1.0, 2.0)),
        ({"duration": {"max": 2.0}, "objective": "mechanical"}, (None, 2.0)),
    ],
)
def test_durations_are_bounded(
    fields: dict[str, Any], expected: tuple[float | None, float | None]
) -> None:
    converted = problem(**fields)
    assert (converted.duration_min, converted.duration_max) == expected


def test_one_number_holds_for_every_joint() -> None:
    limits = problem(
        limits={"velocity": 2, "position": {"lower": -3, "upper": [3, 3, 2, 3, 3, 3]}}
    ).arm.active_limits
    robot = load_robot("ur5e").limits
    assert limits.v_max.tolist() == [2.0] * 6
    assert limits.q_min.tolist() == [-3.0] * 6
    assert limits.q_max[2] == 2.0
    assert limits.tau_max is robot.tau_max


def test_limits_must_fit_the_robot() -> None:
    with pytest.raises(InvalidProblem, match="one number or a list of 6"):
        problem(limits={"torque": [1.0, 2.0]})


def test_payload_inertia_is_symmetric() -> None:
    payload = problem(
        payload={"mass": 1, "com": [0, 0, 0.1], "inertia": [3, 0.1, 0.2, 4, 0.3, 5]}
    ).arm.payload
    assert payload.inertia.tolist() == [[3, 0.1, 0.2], [0.1, 4, 0.3], [0.2, 0.3, 5]]
    assert (
        problem(payload={"mass": 1, "com": [0, 0, 0.1]}).arm.payload.inertia.tolist()
        == np.zeros((3, 3)).tolist()
    )


def test_a_payload_of_known_size_needs_no_inertia() -> None:
    shape = {"shape": "box", "size": [0.1, 0.2, 0.3], "pose": {"position": [0, 0, 0.2]}}
    shape["pose"]["rotvec"] = [0, 0, 0]
    even = problem(payload={"mass": 6, "shape": shape}).arm.payload
    assert even.com.tolist() == [0, 0, 0.2]
    np.testing.assert_allclose(even.inertia, np.diag([0.065, 0.05, 0.025]), rtol=1e-12)
    point = problem(payload={"mass": 6, "shape": shape, "com": [0, 0, 0.1]}).arm.payload
    assert point.com.tolist() == [0, 0, 0.1] and not point.inertia.any()
    own = problem(payload={"mass": 6, "shape": shape, "inertia": [3, 0, 0, 4, 0, 5]}).arm.payload
    assert own.com.tolist() == [0, 0, 0.2]
    assert own.inertia.tolist() == np.diag([3.0, 4.0, 5.0]).tolist()


def test_a_payload_of_unknown_size_needs_its_centre() -> None:
    with pytest.raises(ValidationError, match=r"payload\.com"):
        problem(payload={"mass": 1})
    assert problem(payload={"mass": 0}).arm.payload.mass == 0
