"""Writes the requests of the paper, from its home configuration:

- paper_pose_1.json to paper_pose_15.json: to the poses of Table 1
- paper_position_1.json to paper_position_3.json: to a position of Table 1, with any of its five
  orientations
- paper_motion_1.json to paper_motion_15.json, for `POST /evaluate`: the motions of the paper at
  constant joint speed, to the configurations of Table 2 and back

    .venv/bin/python examples/make_paper_requests.py

`tests/reference/README.md` names the paper, and describes its frames and joint convention.
"""

from __future__ import annotations

import csv
import json
import re
from math import radians
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
POSES = FOLDER.parent / "tests" / "reference" / "paper_table1_poses.csv"
CONFIGURATIONS = POSES.with_name("paper_table2_configurations.csv")
HOME = (0, -90, 90, -90, 180, 0)
"""Home configuration of the paper, all zeros, in the joint convention of Universal Robots [deg]."""
ORIENTATIONS = 5
"""Number of consecutive rows of the table with the same position."""


def requests() -> dict[str, dict[str, Any]]:
    """Requests to `POST /optimize` by file name, in the order of the table."""
    start = {"q": [radians(angle) for angle in HOME]}
    with POSES.open(newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    goals = [
        {
            "pose": {
                "position": [row["x_m"], row["y_m"], row["z_m"]],
                "rpy": [row["roll_rad"], row["pitch_rad"], row["yaw_rad"]],
            }
        }
        for row in rows
    ]
    by_name: dict[str, Any] = {
        f"paper_pose_{number}.json": goal for number, goal in enumerate(goals, start=1)
    }
    positions = range(0, len(goals), ORIENTATIONS)
    for number, first in enumerate(positions, start=1):
        by_name[f"paper_position_{number}.json"] = {"any_of": goals[first : first + ORIENTATIONS]}
    return {name: {"robot": "ur5e", "start": start, "goal": goal} for name, goal in by_name.items()}


def motions() -> dict[str, dict[str, Any]]:
    """Requests to `POST /evaluate` by file name, in the order of Table 2."""
    with CONFIGURATIONS.open(newline="") as file:
        rows = [[float(value) for value in row.values()] for row in csv.DictReader(file)]
    home = [radians(angle) for angle in HOME]
    return {
        f"paper_motion_{number}.json": {
            "configurations": [home, [radians(angle) for angle in to_ur(row)], home],
            "time_per_segment": 1.5,
            "interpolation": "linear",
        }
        for number, row in enumerate(rows, start=1)
    }


def to_ur(degrees: list[float]) -> list[float]:
    """Joint positions of Table 2 in the convention of Universal Robots [deg]."""
    q1, q2, q3, q4, q5, q6 = degrees
    return [q1, q2 - 90, 90 - q3, -90 - q4, 180 - q5, q6]


def text(request: dict[str, Any]) -> str:
    """The text of a request in its file: indented, with lists of numbers on one line."""
    indented = json.dumps(request, indent=2)
    return (
        re.sub(
            r"\[\s+([^\[\]{}]*?)\s+\]", lambda found: f"[{' '.join(found[1].split())}]", indented
        )
        + "\n"
    )


if __name__ == "__main__":
    for endpoint, made in (("optimize", requests()), ("evaluate", motions())):
        for name, request in made.items():
            (FOLDER / endpoint / name).write_text(text(request))
