"""Writes the paper's requests: from the home of the UR5e paper

- paper_pose_1.json to paper_pose_15.json: to each pose of its Table 1
- paper_position_1.json to paper_position_3.json: to any of the five orientations of each position
  of that table
- paper_motion_1.json to paper_motion_15.json, for `POST /evaluate`: the paper's own motion to each
  configuration of its
  Table 2 and back, at constant joint speed

    .venv/bin/python examples/make_paper_requests.py

`tests/reference/README.md` names the paper and tells what is known of its frames and joint
convention.
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
# The paper's home, all zeros, in Universal Robots' joint convention [deg].
HOME = (0, -90, 90, -90, 180, 0)
# Rows of the table that share a position.
ORIENTATIONS = 5


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
    """Table 2's joint positions in Universal Robots' convention [deg]."""
    q1, q2, q3, q4, q5, q6 = degrees
    return [q1, q2 - 90, 90 - q3, -90 - q4, 180 - q5, q6]


def text(request: dict[str, Any]) -> str:
    """A request as it stands in its file: indented, but for lists of numbers."""
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
