"""Examples of POST /cycle."""

from __future__ import annotations

from typing import Any

from fastapi.openapi.models import Example

from joulepath.app.schemas.examples.values import HOME, at

PART = {"mass": 2.0, "com": [0.0, 0.0, 0.1]}
"""A part in the gripper."""


def _down(x: float, y: float, z: float) -> dict[str, Any]:
    """A pose with the tool down at a position [m]."""
    return {"pose": {"position": [x, y, z], "quaternion": [0.0, 1.0, 0.0, 0.0]}}


CYCLE_EXAMPLES: dict[str, Example] = {
    "pick_and_place": {
        "summary": "Three parts from a belt into a box",
        "description": "Six stops between a table, a post and a wall of the box. The arm carries 2 kg on every other "
        "move; its configurations at all stops are chosen together.",
        "value": {
            "start": {"q": HOME},
            "stops": [
                {"name": "pick 1", "target": _down(0.45, -0.25, 0.15), "dwell": 0.3, "payload": PART},
                {"name": "place 1", "target": _down(0.1, 0.5, 0.25), "dwell": 0.3, "payload": None},
                {"name": "pick 2", "target": _down(0.45, -0.15, 0.15), "dwell": 0.3, "payload": PART},
                {"name": "place 2", "target": _down(-0.05, 0.5, 0.25), "dwell": 0.3, "payload": None},
                {"name": "pick 3", "target": _down(0.45, -0.05, 0.15), "dwell": 0.3, "payload": PART},
                {"name": "place 3", "target": _down(-0.2, 0.5, 0.25), "dwell": 0.3, "payload": None},
            ],
            "scene": {
                "obstacles": [
                    {"name": "table", "shape": "box", "size": [1.6, 1.6, 0.1], "pose": at(0.0, 0.0, -0.1)},
                    {"name": "post", "shape": "cylinder", "radius": 0.04, "length": 0.5, "pose": at(0.45, 0.3, 0.2)},
                    {"name": "box wall", "shape": "box", "size": [0.6, 0.02, 0.12], "pose": at(-0.05, 0.36, 0.01)},
                ]
            },
        },
    },
    "press_tending": {
        "summary": "Tending a press in a given time, with brakes during the work",
        "description": "The arm brings a blank, waits on its brakes while the press works, and takes the part away in "
        "15 s. This time is shared among the moves, and what is left is waited out where that costs least.",
        "value": {
            "start": {"q": HOME},
            "stops": [
                {"name": "blanks", "target": _down(0.4, -0.35, 0.1), "dwell": 0.2, "payload": PART},
                {"name": "press", "target": _down(0.55, 0.1, 0.2), "dwell": 0.2, "payload": None},
                {"name": "aside", "target": {"q": [-0.6, -1.4, 1.6, -1.8, -1.57, 0.0]}, "dwell": 4.0},
                {"name": "take", "target": _down(0.55, 0.1, 0.2), "dwell": 0.2, "payload": PART},
                {"name": "finished", "target": _down(0.1, 0.5, 0.15), "dwell": 0.2, "payload": None},
            ],
            "time": 15.0,
            "hold": {"hold": "brakes", "brake_delay": 0.5, "brake_power": 12.0},
        },
    },
    "past_a_scanner": {
        "summary": "Past a scanner without a rest, and over a wall",
        "description": "The arm takes up a part, moves it past a scanner and puts it down; on its way back it passes "
        "over a rinsing bowl. It does not rest there: each way from rest to rest is one motion.",
        "value": {
            "start": {"q": HOME},
            "stops": [
                {"name": "pick", "target": _down(0.45, -0.3, 0.15), "dwell": 0.3, "payload": PART},
                {"name": "scanner", "target": _down(0.45, 0.05, 0.35), "via": True},
                {"name": "place", "target": _down(0.1, 0.5, 0.2), "dwell": 0.3, "payload": None},
                {"name": "bowl", "target": _down(0.4, 0.25, 0.3), "via": True},
            ],
            "windings": False,
            "scene": {
                "obstacles": [
                    {"name": "table", "shape": "box", "size": [1.6, 1.6, 0.1], "pose": at(0.0, 0.0, -0.1)},
                    {"name": "wall", "shape": "box", "size": [0.3, 0.03, 0.2], "pose": at(0.5, -0.12, 0.05)},
                ]
            },
        },
    },
    "out_of_a_tray": {
        "summary": "Out of a tray, with lines into and out of the stops",
        "description": "The gripper goes straight down to the part and lifts it straight up; the part itself is no "
        "obstacle there. It is put down on a shelf the same way.",
        "value": {
            "start": {"q": HOME},
            "stops": [
                {
                    "name": "pick",
                    "target": _down(0.45, -0.25, 0.12),
                    "dwell": 0.3,
                    "payload": PART,
                    "approach": {"direction": [0.0, 0.0, 1.0], "distance": 0.12},
                    "retreat": {"direction": [0.0, 0.0, 1.0], "frame": "base", "distance": 0.12, "speed": 0.5},
                    "obstacles_ignored": ["part"],
                },
                {
                    "name": "place",
                    "target": _down(0.1, 0.5, 0.25),
                    "dwell": 0.3,
                    "payload": None,
                    "approach": {"direction": [0.0, 0.0, 1.0], "distance": 0.08},
                    "retreat": {"direction": [0.0, 0.0, -1.0], "distance": 0.08},
                },
            ],
            "windings": False,
            "scene": {
                "obstacles": [
                    {"name": "table", "shape": "box", "size": [1.6, 1.6, 0.1], "pose": at(0.0, 0.0, -0.1)},
                    {"name": "part", "shape": "box", "size": [0.06, 0.06, 0.1], "pose": at(0.45, -0.25, 0.06)},
                ]
            },
        },
    },
    "glue_path": {
        "summary": "A bead of glue on a part",
        "description": "The nozzle comes down to the part, follows its edge at no more than 0.15 m/s, and lifts. Then "
        "it is cleaned. The branch that follows the whole path is chosen together with all others.",
        "value": {
            "start": {"q": HOME},
            "tcp": {"position": [0.0, 0.0, 0.12], "quaternion": [0.0, 0.0, 0.0, 1.0]},
            "stops": [
                {
                    "name": "glue",
                    "path": {
                        "points": [
                            {"position": [0.5, -0.15, 0.112], "quaternion": [0.0, 1.0, 0.0, 0.0]},
                            {"position": [0.5, 0.15, 0.112], "quaternion": [0.0, 1.0, 0.0, 0.0]},
                            {"position": [0.35, 0.15, 0.112], "quaternion": [0.0, 1.0, 0.0, 0.0]},
                        ],
                        "blend": 0.03,
                        "tolerance": {"position": 2e-4},
                        "speed": 0.15,
                    },
                    "approach": {"direction": [0.0, 0.0, 1.0], "distance": 0.06},
                    "retreat": {"direction": [0.0, 0.0, -1.0], "distance": 0.06},
                    "obstacles_ignored": ["part"],
                },
                {"name": "clean", "target": _down(0.1, 0.5, 0.2), "dwell": 0.5},
            ],
            "windings": False,
            "scene": {
                "obstacles": [
                    {"name": "table", "shape": "box", "size": [1.6, 1.6, 0.1], "pose": at(0.0, 0.0, -0.1)},
                    {"name": "part", "shape": "box", "size": [0.24, 0.4, 0.1], "pose": at(0.42, 0.0, 0.05)},
                ]
            },
        },
    },
}
