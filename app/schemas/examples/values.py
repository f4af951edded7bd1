"""Values shared by the examples of several schemas, and examples of jobs and studies."""

from __future__ import annotations

from typing import Any

from joulepath.app.schemas.examples.files import Example, body_examples

HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
"""Joint positions [rad] with the tool pointing down."""
NEAR = [0.3, -1.4, 1.4, -1.5, -1.57, 0.2]
"""Joint positions [rad] near `HOME`."""
PAPER_HOME = [0.0, -1.5708, 1.5708, -1.5708, 3.1416, 0.0]
PAPER_POSE = [-0.1243, -0.9639, 1.6165, -2.2211, 4.7124, 0.1251]
"""Joint positions [rad] of the founding paper: its home, and the first configuration of its Table
2.
"""
LABEL = "left/up/no_flip"
REQUEST_ID = "0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55"
ANSWER_ID = "7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11"
ANSWER_PATH = f"/answers/{ANSWER_ID}"
JOB_ID = "9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60"
STUDY_ID = "5c0a0e0f-8d1f-4f1c-9a43-2f4a3ad0d1b7"
LOG_ID = "1f4e6a0b-52f7-4c9e-9a0c-6f1d2e3b4a59"
OTHER_LOG_ID = "8c2d7e15-0b3a-4f6d-8e41-2a9b5c7d6e30"
IDENTIFICATION_ID = "3d0b7c55-8e0a-4a6b-b1f0-7a5d9c2e4f18"
CREATED = "2025-03-14T09:26:53.589793Z"

POSE = {"position": [-0.35, 0.4, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}
TURNED = {"position": [-0.35, 0.4, 0.3], "rotvec": [0.0, 3.14, 0.0]}
"""The same pose with a rotation vector, as on the teach pendant."""
OPTIMIZE: dict[str, Any] = {"start": {"q": HOME}, "goal": {"pose": POSE}}
"""A body of POST /optimize."""
EVALUATE: dict[str, Any] = {"configurations": [HOME, NEAR], "time_per_segment": 1.5}
"""A body of POST /evaluate."""
BOX = {
    "shape": "box",
    "size": [0.1, 0.1, 0.2],
    "pose": {"position": [0.0, 0.0, 0.2], "rotvec": [0.0, 0.0, 0.0]},
}
"""A shape in the flange frame."""
TOOL = {"capsules": [{"start": [0.0, 0.0, 0.03], "end": [0.0, 0.0, 0.12], "radius": 0.04}]}

MESH_FILE = (
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAEAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAyEIAAAAAAADIQgAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAMhCAAAAAAAAAAAAAAAAAAAAAAAAyEIAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAADIQgAAAAAAAMhCAAAAAAAAAAAAAAAAAAAAAAAAAADIQgAAAAAAAAAAAAAAAAAAyEIAAAAAAAAAAAAA"
    "AAAAAMhCAAA="
)
"""Base64 of a binary STL: a tetrahedron with edges of 100 mm along the axes."""


def at(x: float, y: float, z: float) -> dict[str, list[float]]:
    """A pose at a position [m], not rotated."""
    return {"position": [x, y, z], "rotvec": [0.0, 0.0, 0.0]}


RESULTS_CSV = (
    "index,name,kind,state,attempt,wall_time_s,energy_J,duration_s,status,answer,problem\n"
    f"0,bin to shelf,optimize,done,1,0.21,57.5,1.33,optimal,{ANSWER_PATH},\n"
    "1,shelf to bin,optimize,failed,1,0.02,,,,,duration-too-short\n"
)
"""Results as CSV."""
RESULTS_LINES = (
    '{"index":0,"name":"bin to shelf","kind":"optimize","state":"done","attempt":1,'
    '"wall_time":0.21,"energy":57.5,"duration":1.33,'
    f'"status":"optimal","answer":"{ANSWER_PATH}","problem":null,"result":{{"robot":"ur5e"}}}}\n'
)
"""Results as lines of JSON; the answer is abridged."""


_OPTIMIZE = body_examples("/optimize")["application/json"]
ITERATION_EXAMPLES: dict[str, Example] = {
    "evaluate": {
        "summary": "The energy of the present motion",
        "value": {
            "evaluate": {
                "configurations": [HOME, [1.2, -1.1, 1.9, -2.2, -1.3, 0.4]],
                "time_per_segment": 3.0,
            }
        },
    }
}
ITERATION_EXAMPLES |= {
    name: {"summary": _OPTIMIZE[name]["summary"], "value": {"optimize": _OPTIMIZE[name]["value"]}}
    for name in ("time_scaling", "joint_to_pose")
}

STUDY_CSV = (
    "iteration,created,kind,energy_J,electrical_J,mechanical_J,duration_s,change_from_last_J,"
    "change_from_best_J,threshold_met,answer\n"
    f"1,2025-03-14T09:26:53.589793Z,optimize,96.1,96.1,31.9,1.33,,,false,{ANSWER_ID}\n"
)
"""The history of a study as CSV."""
