"""Published planning problems: a file of one problem, its requests, and the table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import orjson
import pytest

from benchmarks.foreign import KINDS, chosen, main, problems_of, run, summary

POST = {
    "name": "base",
    "shape": "box",
    "size": [0.05, 0.05, 0.4],
    "pose": {"position": [0.5, 0.5, 0.2]},
}
CAPSULE = {"start": [0, 0, 0], "end": [0, 0, 0.1], "radius": 0.03}
START = [-0.8, -1.4, 1.6, -1.7, -1.57, 0.0]
AMPLE = 60.0  # s


def written(folder: Path, families: tuple[str, ...] = ("posts",)) -> Path:
    """A file of problems of each family, with a near joint goal and the pose of another
    configuration.
    """
    upright: Any = {**POST["pose"], "quaternion": [0.0, 0.0, 0.0, 1.0]}  # type: ignore[dict-item]
    problem = {
        "start": START,
        "goal": [-0.4, *START[1:]],
        "goal_pose": {"position": [-0.4, -0.3, 0.4], "quaternion": [0.0, 1.0, 0.0, 0.0]},
        "obstacles": [{**POST, "pose": upright}],
    }
    problems = [
        {**problem, "name": f"{family}/{k}", "family": family}
        for family in families
        for k in range(3)
    ]
    tcp = {"position": [0, 0, 0.15], "quaternion": [0.0, 0.0, 0.0, 1.0]}
    file = folder / "problems.json"
    file.write_bytes(
        orjson.dumps({"tool": {"capsules": [CAPSULE]}, "tcp": tcp, "problems": problems})
    )
    return file


def test_a_problem_is_asked_with_both_kinds_of_goal(tmp_path: Path) -> None:
    (problem, *_) = problems_of(written(tmp_path))
    outcomes = [run(problem, kind, AMPLE) for kind in KINDS]
    assert [each.problem for each in outcomes] == [None, None]
    assert [each.collisions for each in outcomes] == [0, 0]
    rows = summary(outcomes)["rows"]
    assert [(row["kind"], row["family"], row["answered"]) for row in rows] == [
        (kind, family, 1) for kind in KINDS for family in ("posts", "all")
    ]


def test_an_obstacle_has_no_margin_and_no_name_of_the_arm(tmp_path: Path) -> None:
    (problem, *_) = problems_of(written(tmp_path))
    (obstacle,) = problem.requests["joint"]["scene"]["obstacles"]
    assert obstacle["margin"] == 0 and obstacle["name"] == "scene base"


def test_the_tool_touches_the_last_two_links_of_the_robot(tmp_path: Path) -> None:
    (problem, *_) = problems_of(written(tmp_path), "panda")
    assert problem.requests["pose"]["robot"] == "panda"
    (capsule,) = problem.requests["pose"]["tool"]["capsules"]
    assert capsule["touches"] == ["link6", "link7"]


def test_problems_are_drawn_by_the_seed(tmp_path: Path) -> None:
    problems = problems_of(written(tmp_path, ("posts", "walls")))
    first, again = ([each.name for each in chosen(problems, ["posts"], 2, 1)] for _ in range(2))
    assert first == again and len(first) == 2
    assert len(chosen(problems, ["posts", "walls"], 0, 1)) == 6


def test_an_unknown_family_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([str(written(tmp_path)), "--families", "forests"])
    assert "forests" in capsys.readouterr().err
