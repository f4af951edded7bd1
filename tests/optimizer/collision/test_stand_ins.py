"""Stand-ins for tools and payloads without a shape: size, depth in obstacles, and absence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import (
    Arm,
    Attachment,
    Box,
    Clearance,
    HalfSpace,
    Mesh,
    Obstacle,
    Payload,
    Problem,
    Scene,
    Sphere,
    Waypoints,
    capsule_between,
    evaluate,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.stand_ins import StandIns, StandInSettings
from joulepath.optimizer.kinematics.tcp import tcp_pose
from tests.optimizer.cells import at
from tests.optimizer.moves import AMPLE, HOME, ROBOT

# m: a depth from frames against the depth from the pose of the TCP
ROUNDED = 1e-9
LENGTH = 0.15
MASS = 4.0
SETTINGS = StandInSettings()
BALL = np.cbrt(3 * MASS / (4 * np.pi * SETTINGS.payload_density))
T_FLANGE_TCP = at([0.0, 0.0, LENGTH])
# the tool points straight down
DOWN = np.array([0.0, -1.2, 1.5, 1.2 - 1.5 - np.pi / 2, -np.pi / 2, 0.0])


def floor(height: float, **fields: float) -> Scene:
    return Scene([Obstacle("floor", HalfSpace(), at([0.0, 0.0, height]), **fields)])


def arm(scene: Scene, **fields: object) -> Arm:
    payload = Payload(MASS, np.array([0.0, 0.0, LENGTH]))
    given: dict[str, object] = {"T_flange_tcp": T_FLANGE_TCP, "payload": payload}
    return Arm(robot=ROBOT, scene=scene, **(given | fields))  # type: ignore[arg-type]


def lowest(q: Array) -> float:
    """Height of the TCP [m]."""
    return float(tcp_pose(arm(Scene()), q)[2, 3])


def contacts(asked: Arm, *q: Array) -> dict[str, Clearance]:
    """Contacts at configurations a second apart, by the name of the carried body."""
    found = StandIns.of(asked)
    assert found is not None
    return {
        each.pair[1]: each for each in found.contacts(np.arange(len(q), dtype=float), np.array(q))
    }


def test_the_rod_ends_at_the_tcp_and_the_ball_has_the_mass() -> None:
    depth = 0.05
    found = contacts(arm(floor(lowest(DOWN) + depth, margin=0.0)), HOME, DOWN)
    assert tcp_pose(arm(Scene()), DOWN)[2, 2] == pytest.approx(-1.0), "straight down"
    assert -found["tool"].sampled == pytest.approx(depth, abs=ROUNDED)
    assert -found["payload"].sampled == pytest.approx(depth + BALL, abs=ROUNDED)
    assert {each.time for each in found.values()} == {1.0} and {
        each.pair[0] for each in found.values()
    } == {"floor"}
    assert 4 / 3 * np.pi * BALL**3 * SETTINGS.payload_density == pytest.approx(MASS)


def test_the_margin_does_not_count() -> None:
    """Margins apply between shapes; a stand-in only reports contact."""
    assert contacts(arm(floor(lowest(DOWN) - BALL - 0.01, margin=0.2)), DOWN) == {}


def test_a_tcp_that_is_set_down_touches_nothing() -> None:
    assert "tool" not in contacts(arm(floor(lowest(DOWN))), DOWN)
    assert "tool" not in contacts(arm(floor(lowest(DOWN) + SETTINGS.contact / 2)), DOWN)


def test_a_tilted_rod_touches_with_its_side() -> None:
    tilted = DOWN + np.array([0.0, 0.0, 0.0, 0.6, 0.0, 0.0])
    along = tcp_pose(arm(Scene()), tilted)[:3, 2]
    # its last ball touches the TCP, from a radius above it along the rod
    height = lowest(tilted) - SETTINGS.tool_radius * along[2] - SETTINGS.tool_radius
    found = contacts(arm(floor(lowest(tilted) + 0.02)), tilted)
    assert -found["tool"].sampled == pytest.approx(lowest(tilted) + 0.02 - height, abs=ROUNDED)


def test_the_deepest_obstacle_is_named() -> None:
    """A box beside the TCP, a ball around the payload, and a floor out of reach."""
    T = tcp_pose(arm(Scene()), DOWN)
    beside = T[:3, 3] + [SETTINGS.tool_radius + 0.1 - 0.004, 0.0, SETTINGS.tool_radius]
    scene = Scene(
        [
            *floor(-2.0).obstacles,
            Obstacle("box", Box(np.array([0.2, 0.2, 0.01])), at(beside)),
            Obstacle("ball", Sphere(0.1), at(T[:3, 3])),
        ]
    )
    found = contacts(arm(scene), DOWN)
    assert found["payload"].pair == ("ball", "payload")
    assert -found["payload"].sampled == pytest.approx(BALL + 0.1, abs=ROUNDED), (
        "the centres are at the same place"
    )
    assert found["tool"].pair == ("ball", "tool")
    alone = contacts(arm(Scene(scene.obstacles[:2]), payload=Payload()), DOWN)
    assert alone["tool"].pair == ("box", "tool")
    # of the box, an edge is 4 mm inside the rod's last ball
    assert -alone["tool"].sampled == pytest.approx(0.004, abs=1e-6)


def test_nothing_stands_in_for_what_has_a_shape() -> None:
    deep = floor(lowest(DOWN) + 0.05)
    tool = (capsule_between(np.zeros(3), np.array([0.0, 0.0, 0.05]), 0.01),)
    shaped = Payload(MASS, np.array([0.0, 0.0, LENGTH]), shape=Attachment(Sphere(0.01)))
    assert set(contacts(arm(deep, tool=tool), DOWN)) == {"payload"}
    assert set(contacts(arm(deep, payload=shaped), DOWN)) == {"tool"}
    assert StandIns.of(arm(deep, tool=tool, payload=shaped)) is None


@pytest.mark.parametrize(
    "fields",
    [
        {"scene": Scene()},
        {"collisions": False},
        {"T_flange_tcp": np.eye(4), "payload": Payload()},
        {"T_flange_tcp": at([0.0, 0.0, 1e-5]), "payload": Payload(1e-15)},
        {
            "T_flange_tcp": at([0.0, 0.0, 150.0]),
            "payload": Payload(1.0, np.array([0.0, 0.0, 500.0])),
        },
    ],
    ids=["no obstacles", "not checked", "nothing carried", "too small for a body", "too far away"],
)
def test_nothing_stands_in(fields: dict[str, object]) -> None:
    assert StandIns.of(arm(**({"scene": floor(0.0)} | fields))) is None  # type: ignore[arg-type]


def test_a_short_tcp_has_a_slim_rod() -> None:
    short = arm(floor(0.0), T_flange_tcp=at([0.0, 0.0, 0.01]), payload=Payload())
    height = float(tcp_pose(short, DOWN)[2, 3])
    found = contacts(replace(short, scene=floor(height + 0.003)), DOWN)
    assert -found["tool"].sampled == pytest.approx(0.003, abs=ROUNDED)


def test_a_mesh_is_an_obstacle_like_any_other() -> None:
    corners = np.array(np.meshgrid(*3 * [[-0.1, 0.1]])).reshape(3, -1).T
    top = lowest(DOWN) + 0.03
    x, y = tcp_pose(arm(Scene()), DOWN)[:2, 3]
    scene = Scene([Obstacle("block", Mesh(corners), at([x, y, top - 0.1]))])
    assert -contacts(arm(scene), DOWN)["tool"].sampled == pytest.approx(0.03, abs=1e-6)


def test_an_answer_and_a_given_motion_tell_the_same() -> None:
    end = tcp_pose(arm(Scene()), DOWN)[:3, 3]
    table = Obstacle("table", Box(np.array([0.2, 0.2, 0.1])), at(end))
    asked = arm(Scene([table]))
    solution = optimize(Problem(arm=asked, start=HOME, goal=DOWN, deadline=AMPLE))
    given = evaluate(asked, Waypoints(np.array([HOME, DOWN]), np.array(1.0), "quintic"))
    for found in (solution.unmodelled, given.unmodelled):
        depths = {each.pair: -each.sampled for each in found}
        assert depths.keys() == {("table", "tool"), ("table", "payload")}
        assert depths["table", "tool"] >= 0.05 - ROUNDED
        assert depths["table", "payload"] >= 0.05 + BALL - ROUNDED
    assert solution.certificate.valid, "it constrains nothing"
