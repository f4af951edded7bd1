"""The picture of a cell is complete, and nothing in it is cut off."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np

from joulepath import (
    Arm,
    Attachment,
    Box,
    Cylinder,
    HalfSpace,
    Move,
    Obstacle,
    Payload,
    Program,
    Rest,
    Scene,
)
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.picture.cell_picture import cell_picture, stops_of
from joulepath.optimizer.picture.view import PictureSettings
from tests.optimizer.moves import GOAL, ROBOT, START
from tests.optimizer.placement.cells import at

SVG = "{http://www.w3.org/2000/svg}"
MIDDLE = (START + GOAL) / 2


SCENE = Scene(
    [
        Obstacle("table", Box(np.array([1.0, 0.6, 0.04])), at(0.7, 0.0, -0.1)),
        Obstacle("post", Cylinder(0.05, 0.8), at(0.2, 0.9, 0.4)),
        Obstacle("floor", HalfSpace(), at(0.0, 0.0, -0.8)),
    ]
)
ARM = Arm(robot=ROBOT, scene=SCENE)
PART = Payload(
    1.0, np.array([0.0, 0.0, 0.05]), shape=Attachment(Box(np.full(3, 0.1)), at(0, 0, 0.05))
)
LOADED = replace(ARM, payload=PART)


def program() -> Program:
    """To a stop that takes up a part, to a stop that puts it down, and back."""
    return Program(
        (
            Move(quintic_spline(START, MIDDLE, 1.0), ARM, "start to pick"),
            Rest(0.3, "dwell at pick"),
            Move(quintic_spline(MIDDLE, GOAL, 1.5), LOADED, "pick to place"),
            Move(quintic_spline(GOAL, START, 2.0), ARM, "place to start"),
        )
    )


def test_stops_are_where_the_moves_end_and_say_what_is_taken_up() -> None:
    first, second = stops_of(program())
    assert (first.number, first.t, first.takes) == (1, 1.0, True)
    assert (second.number, round(second.t, 9), second.takes) == (2, 2.8, False)
    np.testing.assert_allclose(first.place, tcp_pose(ARM, MIDDLE)[:3, 3], atol=1e-9)


def test_the_picture_has_ways_stops_and_bodies_and_all_of_it_is_inside() -> None:
    asked = PictureSettings()
    drawn = cell_picture(program())
    root = ElementTree.fromstring(drawn)
    assert root.get("viewBox") == f"0 0 {asked.width} {asked.height}"
    texts = [each.text for each in root.iter(f"{SVG}text")]
    assert texts == ["Start", "1", "2"]
    colours = {each.get("stroke") for each in root.iter(f"{SVG}path")}
    assert {asked.loaded, asked.empty} <= colours
    # the picture shows the part in hand
    fills = [each.get("fill") or "" for each in root.iter(f"{SVG}path")]
    assert any(
        fill.startswith("#") and int(fill[1:3], 16) > 2 * int(fill[5:7], 16) for fill in fills
    )
    for path in root.iter(f"{SVG}path"):
        found = np.array(re.findall(r"-?\d+\.\d", path.get("d") or ""), dtype=float)
        x, y = found[: 2 * (len(found) // 2)].reshape(-1, 2).T
        grown = float(path.get("stroke-width") or 0.0) / 2
        assert (x >= grown - 1).all() and (x <= asked.width - grown + 1).all()
        assert (y >= grown - 1).all() and (y <= asked.height - grown + 1).all()


def test_one_move_has_a_start_and_a_goal() -> None:
    move = Move(quintic_spline(START, GOAL, 1.0), Arm(robot=ROBOT))
    root = ElementTree.fromstring(cell_picture(Program((move,))))
    assert [each.text for each in root.iter(f"{SVG}text")] == ["Start", "Goal"]
