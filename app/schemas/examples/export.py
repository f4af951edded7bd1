"""Examples of POST /export/{format}, named as the formats. A client can send the id of a kept answer, too."""

from __future__ import annotations

from typing import Any

from joulepath.app.schemas.examples.files import Example
from joulepath.app.schemas.examples.values import HOME, NEAR, STANDING_STILL

_DURATION = 1.5
ANSWER: dict[str, Any] = {
    "robot": "ur5e",
    "arm": {"payload": {"mass": 2.0, "com": [0.0, 0.0, 0.05]}},
    "trajectory": {
        "t": [0.0, _DURATION],
        "q": [HOME, NEAR],
        "v": [STANDING_STILL, STANDING_STILL],
        "a": [STANDING_STILL, STANDING_STILL],
        "tau": [
            [0.0, -29.952102, -29.91256, -3.778443, 0.002784, 0.0],
            [0.0, -38.098423, -29.658574, -3.524458, 0.002777, 0.0],
        ],
        "spline": {
            "degree": 5,
            "knots": [0.0] * 6 + [_DURATION] * 6,
            "control_points": [HOME, HOME, HOME, NEAR, NEAR, NEAR],
        },
    },
}
"""What an export looks at of an answer of POST /optimize: a quintic from rest to rest."""
EXPORT_EXAMPLES: dict[str, Example] = {
    "urscript": {
        "summary": "A program for a UR5e that follows the motion at a tenth of its speed",
        "value": {"answer": ANSWER, "speed_scale": 0.1, "urscript": {"digital_output": 0}},
    },
    "ros2": {
        "summary": "A trajectory for ros2_control, for rosbridge",
        "value": {"answer": ANSWER, "ros2": {"message": "trajectory", "encoding": "json"}},
    },
    "csv": {"summary": "A table with a row every 4 ms", "value": {"answer": ANSWER, "table": {"period": 0.004}}},
}
