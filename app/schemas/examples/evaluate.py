"""Examples of POST /evaluate."""

from __future__ import annotations

from fastapi.openapi.models import Example

from joulepath.app.schemas.examples.values import PAPER_HOME, PAPER_POSE

EVALUATE_EXAMPLES: dict[str, Example] = {
    "there_and_back": {
        "summary": "The paper's motion: to a configuration and back at constant joint speed",
        "description": "The velocity has a step at the turning point. The acceleration is infinite there, so its limit "
        "is violated.",
        "value": {
            "configurations": [PAPER_HOME, PAPER_POSE, PAPER_HOME],
            "time_per_segment": 1.5,
            "interpolation": "linear",
        },
    },
    "smooth_with_payload": {
        "summary": "One smooth curve through three configurations, with a payload and samples",
        "description": "The arm stands still at both ends. It passes the configuration between them without a stop.",
        "value": {
            "configurations": [PAPER_HOME, PAPER_POSE, [0.6, -1.2, 1.4, -1.8, 3.1416, 0.0]],
            "time_per_segment": [1.5, 1.2],
            "interpolation": "spline",
            "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.06]},
            "sample_period": 0.1,
        },
    },
    "log": {
        "summary": "A logged trajectory",
        "description": "A cubic spline through `q` gives the velocities and accelerations that were not logged.",
        "value": {
            "trajectory": {
                "t": [0.0, 0.4, 0.8, 1.2, 1.6],
                "q": [
                    [0.0, -1.57, 1.57, -1.57, -1.57, 0.0],
                    [0.05, -1.55, 1.55, -1.55, -1.57, 0.03],
                    [0.15, -1.49, 1.49, -1.53, -1.57, 0.1],
                    [0.25, -1.42, 1.42, -1.51, -1.57, 0.17],
                    [0.3, -1.4, 1.4, -1.5, -1.57, 0.2],
                ],
            }
        },
    },
}

CSV_EXAMPLES: dict[str, Example] = {
    "log": {
        "summary": "A log",
        "description": "The columns v1 … v6 and a1 … a6 are optional.",
        "value": "t,q1,q2,q3,q4,q5,q6\n0,0,-1.57,1.57,-1.57,-1.57,0\n0.4,0.05,-1.55,1.55,-1.55,-1.57,0.03\n"
        "0.8,0.15,-1.49,1.49,-1.53,-1.57,0.1\n",
    },
    "configurations": {
        "summary": "Configurations in degrees, with ?units=deg&interpolation=linear&time_per_segment=1.5",
        "description": "A file without a column t needs the query parameter `time_per_segment`.",
        "value": "q1,q2,q3,q4,q5,q6\n0,-90,90,-90,180,0\n-7.12,-55.23,92.62,-127.26,270,7.17\n0,-90,90,-90,180,0\n",
    },
}
CSV_TABLE = (
    "segment,start,end,electrical.total,…,balance_error\n1,0.0,1.5,53.1,…,9e-16\n2,1.5,3.0,99.8,…,7e-16\n"
    "total,0.0,3.0,152.9,…,9e-16\n"
)
"""The start of an answer as CSV."""
