"""Names given by a caller are plain text, unique, and different from the names of the arm's own
bodies.
"""

from __future__ import annotations

import pytest

from joulepath import (
    Arm,
    InvalidProblem,
    Obstacle,
    Robot,
    Scene,
    Sphere,
    capsule_between,
    load_robot,
)
from joulepath.optimizer.collision.bodies import bodies_of
from joulepath.optimizer.problem.names import LONGEST_NAME, first_repeated, is_plain, normalized
from tests.optimizer.chains import serial_chain

ROBOTS: list[Robot] = [*map(load_robot, ("ur5e", "kr10_r1100", "panda")), serial_chain(4)]


def scene(*names: str) -> Scene:
    return Scene([Obstacle(name, Sphere(0.1)) for name in names])


def refused(error: pytest.ExceptionInfo[InvalidProblem], field: str, name: str) -> None:
    assert error.value.field == field
    assert "name" in str(error.value)
    # a message repeats nothing of a request except names of the arm itself
    assert len(name) < 8 or name not in str(error.value) or name.isidentifier()


@pytest.mark.parametrize(
    "name",
    [
        "",
        " ",
        "   ",
        "\x7fstored/0\x7f",
        "\x7fkept/0\x7f",
        "line\nbreak",
        "null\0",
        "escape\x1b[31m",
        "next\x85line",
        "zero\u200bwidth",
        "right\u202eto left",
        "line\u2028separator",
        "no\u00a0break",
        "lone\ud800surrogate",
        "private\ue000use",
        "\ufeffmark",
        "x" * (LONGEST_NAME + 1),
    ],
)
def test_text_that_does_not_show_is_refused(name: str) -> None:
    with pytest.raises(InvalidProblem) as error:
        Obstacle(name, Sphere(0.1))
    refused(error, "name", name)


@pytest.mark.parametrize("name", [None, 5, b"post", ["post"]])
def test_what_is_no_text_is_refused(name: object) -> None:
    with pytest.raises(InvalidProblem) as error:
        Obstacle(name, Sphere(0.1))  # type: ignore[arg-type]
    refused(error, "name", "")


@pytest.mark.parametrize(
    "name",
    ["table", "Tisch Nr. 4", "größte", "机器", "a" * LONGEST_NAME, "{0}/%s\\\"'<&>", "é", "🤖"],
)
def test_plain_text_is_kept_as_it_is(name: str) -> None:
    assert is_plain(name)
    assert scene(name).names == [name]


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_arms_own_names_are_taken(robot: Robot) -> None:
    tool = [capsule_between([0, 0, 0.03], [0, 0, 0.1], 0.03)]  # type: ignore[arg-type]
    own = (
        {body.name for body in bodies_of(Arm(robot=robot, tool=tool))}
        | set(robot.link_names)
        | {"tool", "payload"}
    )
    assert len(own) == robot.nq + 3
    for name in own:
        for written in (name, name.upper(), f" {name} ", name.replace("t", "\uff54")):
            with pytest.raises(InvalidProblem) as error:
                Arm(robot=robot, scene=scene("post", written))
            refused(error, "scene.obstacles.1.name", written)
            assert "another name" in str(error.value)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_every_name_of_an_answer_means_one_body(robot: Robot) -> None:
    """Accepted names of obstacles are unique among the names of all bodies."""
    names = ["tool rack", "wrist", "payload 2", "base plate", "link"]
    bodies = [body.name for body in bodies_of(Arm(robot=robot, scene=scene(*names)))]
    assert all(bodies.count(name) == 1 for name in names)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("post", "post"),
        ("post", "Post"),
        ("a b", "a  b"),
        ("post", "post "),
        ("é", "e\u0301"),
        ("ß", "SS"),
    ],
)
def test_names_that_read_alike_are_refused(first: str, second: str) -> None:
    with pytest.raises(InvalidProblem) as error:
        scene("other", first, second)
    refused(error, "scene.obstacles.2.name", first)
    assert normalized(first) == normalized(second)


def test_names_that_differ_are_accepted() -> None:
    assert first_repeated(["post", "post 1", "post-1", "posts"]) is None
