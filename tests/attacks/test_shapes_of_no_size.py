"""Shapes without a size: no collision check would ever find them hit, so they are refused."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest

from joulepath.app.convert.arm import to_arm
from joulepath.app.convert.robots import own_robot_of
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.examples.own_arm import URDF
from joulepath.models.own_arm.description import Collision, InvalidArm
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.upright import turn_onto
from joulepath.optimizer.problem.scene import Mesh
from tests.models.own_arm.arms import BLOCK, PLAIN, SHAPE, changed, meshed, obj
from tests.refusals import refusal_of


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ('<cylinder radius="-0.2" length="0.3"/>', "<cylinder>, whose `radius` .* not -0.2"),
        ('<cylinder radius="0.05" length="0"/>', "<cylinder>, whose `length`"),
        ('<cylinder radius="0.05" length="-0.3"/>', "<cylinder>, whose `length`"),
        ('<capsule radius="0" length="0.3"/>', "<capsule>, whose `radius`"),
        ('<sphere radius="1e-9"/>', "<sphere>, whose `radius`"),
        ('<sphere radius="1e9"/>', "<sphere>, whose `radius`"),
        ('<sphere radius="nan"/>', "`radius` that is not a finite number"),
        ('<sphere radius="inf"/>', "`radius` that is not a finite number"),
        ('<box size="0.1 0 0.1"/>', "<box>, whose `size`"),
        ('<box size="0.1 -0.1 0.1"/>', "<box>, whose `size`"),
    ],
)
def test_a_shape_of_no_size_makes_no_robot(shape: str, words: str) -> None:
    with pytest.raises(
        InvalidArm,
        match=f"A <collision> of link 'upper_arm' has a {words}" if "<" in words else words,
    ):
        own_figures("mine", changed(urdf=URDF.replace(SHAPE, shape)))


@pytest.mark.parametrize(
    ("scale", "points", "words"),
    [
        ('scale="0 0 0"', BLOCK, "flatten the mesh"),
        ('scale="0.001 0.001 0"', BLOCK, "flatten the mesh"),
        ('scale="0.001 0.001 1e-9"', BLOCK, "flatten the mesh"),
        ('scale="1e-9 1e-9 1e-9"', BLOCK, "extend over 0.0001 m"),
        ('scale="1e-308 1e-308 1e-308"', BLOCK, "extend over 0.0001 m"),
        ('scale="nan 1 1"', BLOCK, "finite numbers"),
        ('scale="1e308 1e308 1e308"', BLOCK, "extend over 0.0001 m"),
        ("", np.full((6, 3), 0.2), "extend over 0.0001 m"),
        ("", np.outer(np.arange(6.0), [0.1, 0.1, 0.0]), "on one line"),
    ],
)
def test_a_mesh_of_no_size_makes_no_robot(scale: str, points: Any, words: str) -> None:
    with (
        pytest.raises(InvalidArm, match=f"link 'upper_arm' .*{words}"),
        np.errstate(over="ignore", invalid="ignore"),
    ):
        own_figures("mine", changed(urdf=meshed(scale), meshes={"link.obj": obj(points)}))


def test_a_mirrored_mesh_and_a_flat_one_keep_their_size() -> None:
    """A negative scale mirrors, as for left and right hands; a sheet of metal is flat but has an
    area.
    """
    for scale, points in (("0.001 -0.001 0.001", BLOCK), ("0.001 0.001 0.001", BLOCK * [1, 1, 0])):
        files = {"link.obj": obj(points)}
        figures, _ = own_figures("mine", changed(urdf=meshed(f'scale="{scale}"'), meshes=files))
        (row,) = figures["collision"]["upper_arm"]["value"]
        # in the frame of the figures, whose z axis is the joint's y axis
        placed = (
            points * np.array([float(each) for each in scale.split()]) + [0, 0, 0.2]
        ) @ turn_onto(np.eye(3)[1])
        begin, along = np.array(row[:3]), np.array(row[3:6]) - row[:3]
        share = np.clip((placed - begin) @ along / max(along @ along, 1e-30), 0, 1)
        assert (
            np.linalg.norm(placed - begin - share[:, None] * along, axis=1).max() <= row[6] + 1e-9
        )  # rounding


@pytest.mark.parametrize(
    "collision",
    [
        Collision(radius=1e-9),
        Collision(radius=float("nan")),
        Collision({"forearm": ((0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 1e-9),)}),
        Collision({"forearm": ((0.0, 0.0, 0.0, 0.0, 0.0, 0.3, -0.1),)}),
    ],
)
def test_a_users_capsule_has_a_size(collision: Collision) -> None:
    with pytest.raises(InvalidArm, match=r"between 0\.0001 and 1 m"):
        own_figures("mine", changed(collision=collision))


def test_an_arm_whose_joints_are_in_one_place_needs_a_radius() -> None:
    """The radius by the rule is a share of the arm's length, which is zero here."""
    urdf = URDF
    for part in ("0 0 0.4", "0 0 0.3", "0 0 0.2"):
        urdf = urdf.replace(f'<origin xyz="{part}"/>', "")
    with pytest.raises(InvalidArm, match=r"between 0\.0001 and 1 m") as found:
        own_figures("mine", changed(urdf=urdf))
    assert found.value.field == "collision.radius"


def test_a_stored_robot_with_a_shape_of_no_size_is_refused() -> None:
    figures, _ = own_figures("mine", PLAIN)
    figures["collision"]["upper_arm"]["value"][0][6] = -0.2
    with refusal_of("robot", match="'upper_arm' must be between .* Add it again"):
        own_robot_of("mine", figures)


@pytest.mark.parametrize(
    ("field", "shape"),
    [
        ("vertices", {"shape": "mesh", "vertices": (1e-6 * np.eye(4, 3)).tolist()}),
        (
            "data",
            {
                "shape": "mesh_file",
                "format": "obj",
                "data": base64.b64encode(obj(np.eye(4, 3))).decode(),
                "scale": 1e-6,
            },
        ),
    ],
)
def test_an_obstacle_of_no_size_is_refused(field: str, shape: dict[str, Any]) -> None:
    request = ArmRequest.model_validate(
        {"robot": "ur5e", "scene": {"obstacles": [{"name": "box", **shape}]}}
    )
    with refusal_of(f"scene.obstacles.0.{field}", match="extend over 0\\.0001 m or more"):
        to_arm(request)


def test_a_hull_of_a_tenth_of_a_millimetre_is_a_body() -> None:
    assert len(Mesh(1.01e-4 * np.eye(4, 3)).vertices) == 4
