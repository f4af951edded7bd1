"""Motions that show what `POST /evaluate` takes; each runs as it is."""

from __future__ import annotations

from fastapi.openapi.models import Example

_HOME = [0.0, -1.5708, 1.5708, -1.5708, 3.1416, 0.0]
_THERE = [-0.1243, -0.9639, 1.6165, -2.2211, 4.7124, 0.1251]

EVALUATE_EXAMPLES: dict[str, Example] = {
    "there_and_back": {
        "summary": "The paper's motion: there and back at constant joint speed",
        "description": "Speed jumps at the turning point: acceleration is not finite there, and its limit is broken.",
        "value": {"configurations": [_HOME, _THERE, _HOME], "time_per_segment": 1.5, "interpolation": "linear"},
    },
    "smooth_with_payload": {
        "summary": "One smooth curve with a payload, and samples",
        "description": "At rest at both ends, passing the point between at speed.",
        "value": {
            "configurations": [_HOME, _THERE, [0.6, -1.2, 1.4, -1.8, 3.1416, 0.0]],
            "time_per_segment": [1.5, 1.2],
            "interpolation": "spline",
            "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.06]},
            "sample_period": 0.1,
        },
    },
    "log": {
        "summary": "A logged trajectory",
        "description": "Velocities and accelerations come from a cubic spline where they were not logged.",
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
        "description": "Columns v1 … v6 and a1 … a6 may follow.",
        "value": "t,q1,q2,q3,q4,q5,q6\n0,0,-1.57,1.57,-1.57,-1.57,0\n0.4,0.05,-1.55,1.55,-1.55,-1.57,0.03\n"
        "0.8,0.15,-1.49,1.49,-1.53,-1.57,0.1\n",
    },
    "configurations": {
        "summary": "Configurations in degrees: ?units=deg&interpolation=linear&time_per_segment=1.5",
        "value": "q1,q2,q3,q4,q5,q6\n0,-90,90,-90,180,0\n-7.12,-55.23,92.62,-127.26,270,7.17\n0,-90,90,-90,180,0\n",
    },
}
CSV_TABLE = (
    "segment,start,end,electrical.total,…,balance_error\n1,0.0,1.5,53.1,…,9e-16\n2,1.5,3.0,99.8,…,7e-16\n"
    "total,0.0,3.0,152.9,…,9e-16\n"
)
