"""Examples of POST /optimize."""

from __future__ import annotations

from fastapi.openapi.models import Example

from joulepath.app.schemas.examples.values import HOME, MESH_FILE, OPTIMIZE, at

_DOWN = [0.0, 1.0, 0.0, 0.0]
_TCP = {"position": [0.0, 0.0, 0.12], "quaternion": [0.0, 0.0, 0.0, 1.0]}
_LEFT = [-0.77, -1.52, 1.82, -1.87, -1.57, -2.34]
_RIGHT = [0.66, -1.4, 1.2, -1.37, -1.57, -0.91]

OPTIMIZE_EXAMPLES: dict[str, Example] = {
    "joint_to_pose": {
        "summary": "From joint positions to a pose",
        "description": "The optimiser chooses the duration, and one of all arm configurations that reach the pose.",
        "value": {"robot": "ur5e", **OPTIMIZE},
    },
    "pose_to_pose": {
        "summary": "From pose to pose, with a tool and a payload",
        "description": "The optimiser chooses the arm configurations at both ends. One orientation is a rotation "
        "vector, as on the teach pendant; the other is roll, pitch, yaw.",
        "value": {
            "robot": "ur5e",
            "start": {"pose": {"position": [0.4, 0.25, 0.35], "rotvec": [0.0, 3.14159, 0.0]}},
            "goal": {"pose": {"position": [0.3, -0.4, 0.2], "rpy": [3.14159, 0.2, 1.5708]}},
            "tcp": _TCP,
            "payload": {"mass": 1.2, "com": [0.0, 0.0, 0.06]},
        },
    },
    "any_of": {
        "summary": "To the one of several targets that needs the least energy",
        "description": "Two grasps of one part. `branch.goal.target` in the answer is the index of the chosen one.",
        "value": {
            "start": {"q": HOME},
            "goal": {
                "any_of": [
                    {"pose": {"position": [-0.35, 0.4, 0.3], "rpy": [3.1416, 0.0, 0.0]}},
                    {"pose": {"position": [-0.35, 0.4, 0.3], "rpy": [3.1416, 0.0, 1.5708]}},
                ]
            },
        },
    },
    "orientation_in_a_cone": {
        "summary": "To a position, with the tool within 0.2 rad of straight down",
        "description": "The optimiser chooses the orientation within this cone.",
        "value": {
            "start": {"q": HOME},
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
    "ceiling_mount_payload": {
        "summary": "On the ceiling, with a payload",
        "description": "If the arm hangs upside down, gravity points along +z of its base frame. The limits of this "
        "request are tighter than the robot's.",
        "value": {
            "robot": "ur5e",
            "start": {"q": [0.5, -1.2, 1.4, -1.8, -1.57, 0.0]},
            "goal": {"q": [-0.8, -1.6, 1.0, -1.0, -1.57, 0.6]},
            "gravity": [0.0, 0.0, 9.81],
            "payload": {"mass": 3.0, "com": [0.0, 0.02, 0.06], "inertia": [0.006, 0.0, 0.0, 0.006, 0.0, 0.004]},
            "limits": {"velocity": 2.0, "torque": [120, 120, 120, 22, 22, 22]},
        },
    },
    "time_scaling": {
        "summary": "Straight line in joint space, with a chosen friction model",
        "description": "The path is the straight line between the two joint positions, which is clear. Only its time "
        "scaling is optimised.",
        "value": {
            "robot": "ur5e",
            "start": {"q": HOME},
            "goal": {"q": [1.2, -1.1, 1.9, -2.2, -1.3, 0.4]},
            "method": "time_scaling",
            "friction": "coulomb_viscous",
        },
    },
    "mechanical_fixed_duration": {
        "summary": "Least mechanical work in a fixed duration",
        "description": "The mechanical objective has no best duration: a slower motion needs less work. The request "
        "must therefore limit it.",
        "value": {"robot": "ur5e", **OPTIMIZE, "objective": "mechanical", "duration": 2.0},
    },
    "storage_on_the_bus": {
        "summary": "A capacitor on the power bus",
        "description": "The arm lowers a heavy payload, and the surplus charges the capacitor. The charge that is left "
        "at the end is subtracted from the total.",
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
        "summary": "A cycle in which the brakes hold the arm after the motion",
        "description": "A faster motion leaves more time on the brakes, which need less power than the motors.",
        "value": {
            "start": {"q": HOME},
            "goal": {"q": [1.2, -0.9, 1.3, -1.9, -1.57, 0.4]},
            "payload": {"mass": 3.0, "com": [0.0, 0.0, 0.06]},
            "dwell": {"time": 4.0, "hold": "brakes", "brake_delay": 0.5, "brake_power": 15.0},
            "link_mass_scale": 0.8,
        },
    },
    "past_a_scan": {
        "summary": "Past a post seen by a depth camera, and a part from a mesh file",
        "description": "Every point and every triangle counts. A scan has up to 100,000 points.",
        "value": {
            "start": {"q": _LEFT},
            "goal": {"q": _RIGHT},
            "scene": {
                "obstacles": [
                    {
                        "name": "scan",
                        "shape": "points",
                        "points": [[-0.52, y, z] for z in (0.0, 0.1, 0.2, 0.3, 0.4) for y in (-0.03, 0.03)],
                        "radius": 0.05,
                        "margin": 0.01,
                    },
                    {
                        "name": "shelf",
                        "shape": "voxels",
                        "size": 0.1,
                        "bits": {"dimensions": [4, 2, 2], "data": "DwA="},
                        "pose": at(-0.2, 0.7, 0.1),
                    },
                    {
                        "name": "bracket",
                        "shape": "mesh_file",
                        "format": "stl",
                        "scale": 0.001,
                        "data": MESH_FILE,
                        "pose": at(0.4, 0.4, 0.0),
                    },
                ]
            },
        },
    },
    "over_a_post": {
        "summary": "A gripper with a part, past a post on a table",
        "description": "The clearances are proven for every instant: see `certificate.clearance` in the answer.",
        "value": {
            "start": {"q": _LEFT},
            "goal": {"q": _RIGHT},
            "tcp": _TCP,
            "tool": {"capsules": [{"start": [0.0, 0.0, 0.03], "end": [0.0, 0.0, 0.1], "radius": 0.04}]},
            "payload": {
                "mass": 0.8,
                "com": [0.0, 0.0, 0.13],
                "shape": {"shape": "box", "size": [0.06, 0.06, 0.06], "pose": at(0.0, 0.0, 0.14)},
            },
            "scene": {
                "obstacles": [
                    {"name": "table", "shape": "half_space", "pose": at(0.0, 0.0, -0.02)},
                    {
                        "name": "post",
                        "shape": "cylinder",
                        "radius": 0.03,
                        "length": 0.4,
                        "margin": 0.01,
                        "pose": at(-0.52, 0.0, 0.2),
                    },
                ]
            },
        },
    },
    "glass_upright": {
        "summary": "A glass that stays upright",
        "description": "The z axis of the tool stays within 0.02 rad of straight down during the whole motion.",
        "value": {
            "start": {"pose": {"position": [-0.45, 0.25, 0.25], "quaternion": _DOWN}},
            "goal": {"pose": {"position": [-0.3, -0.4, 0.6], "quaternion": _DOWN}},
            "tcp": _TCP,
            "payload": {
                "mass": 0.4,
                "com": [0.0, 0.0, 0.14],
                "shape": {"shape": "cylinder", "radius": 0.04, "length": 0.12, "pose": at(0.0, 0.0, 0.14)},
            },
            "tool_cone": {"axis": [0.0, 0.0, 1.0], "direction": [0.0, 0.0, -1.0], "half_angle": 0.02},
            "windings": False,
            "branch": {"shoulder": "left", "elbow": "up", "wrist": "no_flip"},
        },
    },
    "collaborative_speeds": {
        "summary": "Limits on the speed of tool and elbow",
        "description": "For a cell with people: the TCP moves at 0.25 m/s at most, the elbow at 0.2 m/s.",
        "value": {
            "start": {"q": _LEFT},
            "goal": {"q": _RIGHT},
            "tcp": _TCP,
            "limits": {"tcp_speed": 0.25, "elbow_speed": 0.2},
            "windings": False,
        },
    },
    "glue_line": {
        "summary": "A straight line of the tool at 0.1 m/s",
        "description": "The nozzle follows a seam of 0.4 m within 0.1 mm and 0.1 degrees. The branch and the timing "
        "are chosen.",
        "value": {
            "start": {"pose": {"position": [0.45, -0.2, 0.1], "quaternion": _DOWN}},
            "goal": {"pose": {"position": [0.45, 0.2, 0.1], "quaternion": _DOWN}},
            "tcp": _TCP,
            "path": {"speed": 0.1},
        },
    },
    "glue_corner": {
        "summary": "Along two edges, with a rounded corner",
        "description": "The tool follows both edges of a plate and rounds the corner between them within 30 mm. The "
        "arm starts where it stands.",
        "value": {
            "start": {"q": HOME},
            "goal": {"pose": {"position": [-0.3, -0.1, 0.3], "quaternion": _DOWN}},
            "path": {
                "via": [{"position": [-0.3, -0.35, 0.3], "quaternion": _DOWN}],
                "blend": 0.03,
                "tolerance": {"position": 0.0005, "rotation": 0.005},
            },
        },
    },
}
