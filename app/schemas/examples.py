"""Requests that show what can be asked; each runs as it is."""

from __future__ import annotations

from fastapi.openapi.models import Example

_HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]


def _at(x: float, y: float, z: float) -> dict[str, list[float]]:
    """A pose that is not turned."""
    return {"position": [x, y, z], "rotvec": [0.0, 0.0, 0.0]}


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
    "any_of": {
        "summary": "To whichever of several targets costs least",
        "description": "Two grasps of one part; the answer says which was taken.",
        "value": {
            "start": {"q": _HOME},
            "goal": {
                "any_of": [
                    {"pose": {"position": [-0.35, 0.4, 0.3], "rpy": [3.1416, 0.0, 0.0]}},
                    {"pose": {"position": [-0.35, 0.4, 0.3], "rpy": [3.1416, 0.0, 1.5708]}},
                ]
            },
        },
    },
    "free_orientation": {
        "summary": "To a position, with the tool nearly upright",
        "description": "The tool's z axis points within 0.2 rad of straight down; the rest is left to the optimiser.",
        "value": {
            "start": {"q": _HOME},
            "goal": {
                "pose": {
                    "position": [-0.35, 0.4, 0.3],
                    "orientation": {
                        "cone": {"axis": [0.0, 0.0, 1.0], "direction": [0.0, 0.0, -1.0], "half_angle": 0.2}
                    },
                }
            },
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
    "store_on_the_bus": {
        "summary": "A capacitor on the bus",
        "description": "Surplus of a heavy payload going down charges it; what is still in it at the end counts.",
        "value": {
            "start": {"q": [0.0, -1.6, 0.3, -1.0, -1.57, 0.0]},
            "goal": {"q": [0.8, -0.5, 0.4, -1.5, -1.57, 0.0]},
            "payload": {"mass": 5.0, "com": [0.0, 0.0, 0.1]},
            "duration": {"max": 1.0},
            "bus": {"mode": "storage", "capacity": 5.0, "power": 200.0, "efficiency": 0.9},
            "drives": {"inverter": {"constant": 1.5, "linear": 0.6, "quadratic": 0.02}},
        },
    },
    "cycle_with_brakes": {
        "summary": "A cycle that ends on the brakes",
        "description": "Moving faster leaves more of the cycle's time for the brakes, which take less than the motors.",
        "value": {
            "start": {"q": _HOME},
            "goal": {"q": [1.2, -0.9, 1.3, -1.9, -1.57, 0.4]},
            "payload": {"mass": 3.0, "com": [0.0, 0.0, 0.06]},
            "cycle": {"time": 4.0, "hold": "brakes", "brake_delay": 0.5, "brake_power": 15.0},
            "link_mass_scale": 0.8,
        },
    },
    "over_a_post": {
        "summary": "A gripper with a part, past a post on a table",
        "description": "Every instant is proven to keep the obstacles' margins: see the certificate's `clearance`.",
        "value": {
            "start": {"q": [-0.77, -1.52, 1.82, -1.87, -1.57, -2.34]},
            "goal": {"q": [0.66, -1.4, 1.2, -1.37, -1.57, -0.91]},
            "tcp": {"position": [0.0, 0.0, 0.12], "quaternion": [0.0, 0.0, 0.0, 1.0]},
            "tool": {"capsules": [{"start": [0.0, 0.0, 0.03], "end": [0.0, 0.0, 0.1], "radius": 0.04}]},
            "payload": {
                "mass": 0.8,
                "com": [0.0, 0.0, 0.13],
                "shape": {
                    "shape": "box",
                    "size": [0.06, 0.06, 0.06],
                    "pose": {"position": [0.0, 0.0, 0.14], "rotvec": [0.0, 0.0, 0.0]},
                },
            },
            "scene": {
                "obstacles": [
                    {"name": "table", "shape": "half_space", "pose": _at(0.0, 0.0, -0.02)},
                    {
                        "name": "post",
                        "shape": "cylinder",
                        "radius": 0.03,
                        "length": 0.4,
                        "margin": 0.01,
                        "pose": _at(-0.52, 0.0, 0.2),
                    },
                ]
            },
        },
    },
    "glass_upright": {
        "summary": "A glass kept upright",
        "description": "The tool's z axis stays within 0.02 rad of straight down, all along.",
        "value": {
            "start": {"q": [-0.77, -1.52, 1.82, -1.87, -1.57, -2.34]},
            "goal": {"q": [0.66, -1.4, 0.75, -0.92, -1.57, -0.91]},
            "tool_cone": {"axis": [0.0, 0.0, 1.0], "direction": [0.0, 0.0, -1.0], "half_angle": 0.02},
        },
    },
    "collaborative_speeds": {
        "summary": "Beside people",
        "description": "Neither the tool nor the elbow moves faster than a collaborative cell allows.",
        "value": {
            "start": {"q": [-0.77, -1.52, 1.82, -1.87, -1.57, -2.34]},
            "goal": {"q": [0.66, -1.4, 1.2, -1.37, -1.57, -0.91]},
            "limits": {"tcp_speed": 0.25, "elbow_speed": 0.2},
        },
    },
}

COMPARE_EXAMPLES: dict[str, Example] = {
    "all_methods": {
        "summary": "Every method on one move",
        "description": "A table of energies, durations and solve times.",
        "value": {"start": {"q": _HOME}, "goal": {"q": [1.2, -1.1, 1.9, -2.2, -1.3, 0.4]}},
    },
    "two_methods_to_a_pose": {
        "summary": "Two methods, to a pose, whole answers",
        "description": "Each row also holds what `POST /optimize` would answer.",
        "value": {
            "start": {"q": _HOME},
            "goal": {"pose": {"position": [-0.35, 0.4, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}},
            "methods": ["bspline", "lagrange"],
            "answers": True,
            "windings": False,
        },
    },
}
