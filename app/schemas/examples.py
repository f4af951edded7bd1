"""Requests that show what can be asked; each runs as it is."""

from __future__ import annotations

from fastapi.openapi.models import Example

_HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]

OPTIMIZE_EXAMPLES: dict[str, Example] = {
    "joint_to_pose": {
        "summary": "From joints to a pose",
        "description": "The optimiser chooses among all arm configurations that reach the pose, and the duration.",
        "value": {
            "robot": "ur5e",
            "start": {"q": _HOME},
            "goal": {"pose": {"position": [-0.35, 0.4, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
        },
    },
    "pose_to_pose": {
        "summary": "From pose to pose, with a gripper",
        "description": "Start configuration and goal configuration are chosen together; `rotvec` as on the teach "
        "pendant.",
        "value": {
            "start": {"pose": {"position": [0.4, 0.2, 0.35], "rotvec": [0.0, 3.1416, 0.0]}},
            "goal": {"pose": {"position": [0.3, -0.4, 0.2], "rpy": [3.1416, 0.2, 1.5708]}},
            "tcp": {"position": [0.0, 0.0, 0.12], "quaternion": [0.0, 0.0, 0.0, 1.0]},
            "windings": False,
        },
    },
    "payload_on_the_ceiling": {
        "summary": "Hanging from the ceiling, with a payload",
        "description": "Gravity points along +z of the base frame of an arm that hangs upside down.",
        "value": {
            "start": {"q": [0.5, -1.2, 1.4, -1.8, -1.57, 0.0]},
            "goal": {"q": [-0.8, -1.6, 1.0, -1.0, -1.57, 0.6]},
            "payload": {"mass": 2.0, "com": [0.0, 0.02, 0.06], "inertia": [0.004, 0.0, 0.0, 0.004, 0.0, 0.003]},
            "gravity": [0.0, 0.0, 9.81],
            "limits": {"velocity": 2.0, "torque": [120.0, 120.0, 120.0, 20.0, 20.0, 20.0]},
        },
    },
    "time_scaling": {
        "summary": "Straight line in joint space",
        "description": "Only the time law along the line is optimised: the path of a point-to-point move, at its best.",
        "value": {
            "start": {"q": _HOME},
            "goal": {"q": [1.2, -1.1, 1.9, -2.2, -1.3, 0.4]},
            "method": "time_scaling",
            "friction": "coulomb_viscous",
        },
    },
    "mechanical_fixed_duration": {
        "summary": "Least mechanical work in a fixed time",
        "description": "The objective of least mechanical work has no best duration of its own: one is given.",
        "value": {
            "start": {"q": _HOME},
            "goal": {"q": [-1.0, -1.2, 1.2, -1.6, -1.57, 0.5]},
            "objective": "mechanical",
            "duration": 2.0,
        },
    },
}
