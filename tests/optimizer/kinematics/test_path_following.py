"""Configurations along a path of the TCP; at the deadline, the points found so far are kept."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Arm, DeadlineExceeded, load_robot
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.kinematics.tool_path.path_following import PathPoint, follow
from tests.optimizer.clocks import CountingClock
from tests.optimizer.moves import START

ARM = Arm(robot=load_robot("ur5e"))
HERE = tcp_pose(ARM, START)[:3, 3]
# a line of 9 cm with its third point 9 m away
LINE = HERE + np.linspace(0, 0.09, 10)[:, None] * np.array([0.0, 0.0, -1.0])
LINE[2] += 9.0


def followed(seconds: float) -> list[PathPoint]:
    """Result if every reading of the clock takes a second."""
    return follow(ARM, LINE, START, deadline=Deadline.after(seconds, CountingClock()))


def test_what_was_found_before_the_deadline_is_kept() -> None:
    whole, cut = followed(1000.0), followed(5.0)
    assert [point.reason for point in whole] == [None, None, "unreachable", *7 * [None]]
    assert [point.reason for point in cut] == [
        *[point.reason for point in whole[:5]],
        *5 * ["deadline"],
    ]
    for one, other in zip(whole[:5], cut[:5], strict=True):
        np.testing.assert_array_equal(one.q, other.q)
    for wanted, point in zip(LINE[5:], cut[5:], strict=True):
        assert not point.reached and not point.written
        # the point of a skipped search equals its start, with the error of the start
        np.testing.assert_array_equal(point.q, cut[4].q)
        distance = np.linalg.norm(tcp_pose(ARM, point.q)[:3, 3] - wanted)
        assert point.position_error == pytest.approx(distance, abs=1e-12)


def test_without_time_for_the_first_point_the_deadline_is_the_answer() -> None:
    with pytest.raises(DeadlineExceeded):
        followed(0.0)
    assert [point.reason for point in followed(1.0)] == [None, *9 * ["deadline"]]
