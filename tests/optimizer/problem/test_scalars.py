"""Numbers and choices of the library's requests: a wrong one is refused, and the error names it."""

import numpy as np
import pytest

from joulepath import (
    Arm,
    BranchFilter,
    Bus,
    Cycle,
    Dwell,
    InvalidProblem,
    Payload,
    Problem,
    Sphere,
    Stop,
    load_robot,
)
from joulepath.optimizer.problem.scalars import check_number

ARM = Arm(robot=load_robot("ur5e"))
START = np.array([0.0, -1.2, 1.2, -1.5, -1.5, 0.0])
GOAL = START + 0.2
NO_NUMBERS = (10**400, None, "1", [1.0], np.ones(3), np.nan, np.inf, 1j, object())


def problem(**fields):
    return Problem(arm=ARM, start=START, goal=GOAL, **fields)


def cycle(**fields):
    return Cycle(arm=ARM, start=START, stops=[Stop(name="a", target=GOAL)], **fields)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda value: Payload(mass=value), "payload.mass"),
        (lambda value: Dwell(time=value), "dwell.time"),
        (lambda value: Bus(efficiency=value), "bus.efficiency"),
        (lambda value: Sphere(radius=value), "radius"),
        (lambda value: problem(deadline=value), "deadline"),
        (lambda value: cycle(sample_period=value), "sample_period"),
    ],
)
def test_what_is_no_number_is_refused(make, field):
    for value in NO_NUMBERS:
        with pytest.raises(InvalidProblem, match=f"{field} must be") as caught:
            make(value)
        assert caught.value.field == field


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda value: problem(objective=value), "objective"),
        (lambda value: problem(method=value), "method"),
        (lambda value: problem(bound=value), "bound"),
        (lambda value: cycle(objective=value), "objective"),
        (lambda value: cycle(hold=value), "hold"),
        (lambda value: Bus(mode=value), "bus.mode"),
        (lambda value: BranchFilter(elbow=value), "branch.elbow"),
    ],
)
def test_an_unknown_choice_is_refused(make, field):
    for value in ("electric", "", 1, np.ones(2)):
        with pytest.raises(InvalidProblem, match="must be one of") as caught:
            make(value)
        assert caught.value.field == field


@pytest.mark.parametrize(
    ("limits", "allowed", "refused", "text"),
    [
        ({}, (0, 3, np.int64(2), np.float32(0.5)), (-1e-9,), "a number of metres, 0 or more"),
        ({"positive": True}, (1e-300,), (0.0, -1.0), "a positive number of metres"),
        ({"least": 0.1}, (0.1,), (0.0999,), "a number of metres, 0.1 or more"),
        ({"most": 2.0}, (0.0, 2.0), (2.0001,), "a number of metres from 0 to 2"),
        ({"most": 2.0, "positive": True}, (2.0,), (0.0,), "a number of metres above 0 to 2"),
        ({"optional": True}, (None,), ("",), "a number of metres, 0 or more"),
    ],
)
def test_a_number_within_its_range(limits, allowed, refused, text):
    for value in allowed:
        check_number("size", value, "metres", **limits)
    for value in refused:
        with pytest.raises(InvalidProblem, match=f"size must be {text}, not"):
            check_number("size", value, "metres", **limits)
