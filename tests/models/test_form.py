"""The form in which arms are drawn: at the joints, about their axes, where the collision capsules
are.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.form import link_bodies
from joulepath.models.registry import load_robot, robot_names
from joulepath.models.robot import Array

# m; sums of some ten products in double precision
ROUNDING = 1e-9
# of the radius: how far the middle of a body may be outside of the capsules; one of the xArm is by
# 0.33
OUTSIDE = 0.35


def distance(point: Array, capsule: Array) -> float:
    """Distance [m] from a point (3,) to the surface of a capsule (7,); negative inside."""
    start, axis = capsule[:3], capsule[3:6] - capsule[:3]
    share = np.clip((point - start) @ axis / max(axis @ axis, 1e-12), 0, 1)
    return float(np.linalg.norm(point - start - share * axis) - capsule[6])


@pytest.mark.parametrize("name", robot_names())
def test_housings_meet_on_the_axis_of_each_joint(name: str) -> None:
    robot = load_robot(name)
    bodies = link_bodies(robot.figures)
    assert len(bodies) == robot.nq + 1
    for joint, row in enumerate(robot.figures["kinematics"]["joint_origin"]["value"]):
        T = pin.SE3(pin.rpy.rpyToMatrix(*row[3:]), np.array(row[:3]))
        (ring,) = (body for body in bodies[joint] if body.kind == "ring")
        middle = (np.array(ring.start) + ring.end) / 2
        assert T.actInv(middle)[:2] == pytest.approx(0, abs=ROUNDING), "on the axis"
        # in the frame of the next link, whose own housing begins there
        ends = [T.act(np.array(body.start)) for body in bodies[joint + 1] if body.kind == "housing"]
        assert min(np.linalg.norm(end - middle) for end in ends) == pytest.approx(0, abs=ROUNDING)


@pytest.mark.parametrize("name", robot_names())
def test_what_is_drawn_is_where_collision_checks_see_the_arm(name: str) -> None:
    robot = load_robot(name)
    names = ["base", *robot.figures["kinematics"]["link_names"]["value"]]
    for link, own in zip(names, link_bodies(robot.figures), strict=True):
        capsules = np.array(robot.figures["collision"].get(link, {}).get("value", [])).reshape(
            -1, 7
        )
        for body in own:
            assert body.radius > 0
            if len(capsules) and body.kind in ("housing", "tube"):
                middle = (np.array(body.start) + body.end) / 2
                assert min(distance(middle, each) for each in capsules) <= OUTSIDE * body.radius, (
                    link,
                    body,
                )
