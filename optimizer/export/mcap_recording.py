"""`mcap`: a recording of ROS 2, as if the motion had been run and recorded.

The topics are `/joint_states`, `/joint_trajectory`, `/tf`, `/markers`, `/power` and
`/robot_description`. Foxglove and PlotJuggler open the file, and `ros2 bag play` plays it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import repeat
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.models.urdf import urdf_of
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.export.facts import WrittenFile
from joulepath.optimizer.export.markers import Fields, markers, pose
from joulepath.optimizer.export.option_ranges import OPTION_RANGES
from joulepath.optimizer.export.program import Move, Program
from joulepath.optimizer.export.quintic_points import NANOSECONDS, quintic_points
from joulepath.optimizer.export.ros_messages import joint_trajectory
from joulepath.optimizer.export.rows import check_period, times
from joulepath.optimizer.problem.scalars import check_text

STRING = "std_msgs/msg/String"
FLOAT = "std_msgs/msg/Float64"
JOINT_STATE = "sensor_msgs/msg/JointState"
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
TF = "tf2_msgs/msg/TFMessage"
MARKER_ARRAY = "visualization_msgs/msg/MarkerArray"
DEFAULTS: dict[str, type] = {
    "string": str,
    "bool": bool,
    **dict.fromkeys(("float32", "float64"), float),
    **dict.fromkeys(("int8", "uint8", "int32", "uint32"), int),
}
"""Values of fields that are not given, by their type."""
VERSION: Literal[9] = 9
"""Version of the format of recordings; ROS 2 reads it from Jazzy on."""


@dataclass(frozen=True)
class McapOptions:
    """Options of `mcap`."""

    period: float = 0.008
    """Time between two joint states [s]."""
    prefix: str = ""
    """Prefix of all names of joints and links."""

    def __post_init__(self) -> None:
        check_period(self.period)
        check_text("prefix", self.prefix, OPTION_RANGES.prefix)


def to_mcap(program: Program, options: McapOptions | None = None) -> WrittenFile:
    """Write a program as a recording of ROS 2.

    Args:
        program: the motion.
        options: period and prefix; None for the defaults.

    Raises:
        FormatUnsuitable: the motion is too long.
    """
    options = options or McapOptions()
    # takes as long to import as all other formats together
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_JAZZY)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "recording"
        with Writer(place, version=VERSION, storage_plugin=StoragePlugin.MCAP) as bag:
            topics = dict[str, Any]()
            for t, topic, kind, fields in _messages(program, options):
                if topic not in topics:
                    topics[topic] = bag.add_connection(topic, kind, typestore=types)
                message = types.serialize_cdr(_message(types, kind, fields), kind)
                bag.write(topics[topic], round(t * NANOSECONDS), message)
        (file,) = place.glob("*.mcap")
        content = file.read_bytes()
    notes = ("/power is recorded while the arm moves, not while it rests",)
    return WrittenFile(content, "application/octet-stream", "mcap", notes)


def _messages(program: Program, options: McapOptions) -> Iterator[tuple[float, str, str, Fields]]:
    """Time [s], topic, type and fields of every message, in the order of time."""
    robot, prefix = program.robot, options.prefix
    joints = [prefix + name for name in robot.joint_names]
    frames = [prefix + name for name in robot.link_names]
    model = collision_model(program.moves[0].arm)
    yield 0.0, "/robot_description", STRING, {"data": _description(robot, prefix)}
    shown = [body for body in model.bodies if not body.is_hull]
    yield 0.0, "/markers", MARKER_ARRAY, {"markers": markers(shown, frames)}
    points = quintic_points(program, "mcap")
    yield 0.0, "/joint_trajectory", TRAJECTORY, joint_trajectory(program, points, prefix)
    for t, q, v, tau, power in _rows(program, options.period):
        header = {"stamp": stamp(t)}
        state = {"name": joints, "position": q, "velocity": v, "effort": tau}
        yield t, "/joint_states", JOINT_STATE, {"header": header} | state
        yield t, "/tf", TF, {"transforms": _transforms(model.frames(q[None])[0], frames, t)}
        if power is not None:
            yield t, "/power", FLOAT, {"data": power}


def _description(robot: Robot, prefix: str) -> str:
    """The URDF with a prefix before all names of links and joints."""
    tree = ElementTree.fromstring(urdf_of(robot.name, robot.figures))
    for each in tree.iter():
        for name in ("name", "link"):
            if each is not tree and name in each.attrib:
                each.attrib[name] = prefix + each.attrib[name]
    return ElementTree.tostring(tree, encoding="unicode")


def _rows(
    program: Program, period: float
) -> Iterator[tuple[float, Array, Array, Array, float | None]]:
    """Time [s], q [rad], v [rad/s] and motor torques [N·m], (nq,) each, and the power [W] drawn
    from the supply, which is None at rest.
    """
    t = times(program, period, "mcap")
    for each in program.timed:
        inside = t[(t >= each.t0) & (t < each.t0 + each.step.duration)]
        if each is program.timed[-1]:
            inside = t[t >= each.t0]
        if isinstance(each.step, Move):
            own = np.clip(inside - each.t0, 0.0, each.step.duration)
            at = Plant(each.step.arm).samples(each.step.spline, own)
            yield from zip(
                inside.tolist(), at.q, at.v, at.tau_motor, at.power.tolist(), strict=True
            )
        else:
            q, v, a = program.at(inside)
            arm = replace(program.moves[-1].arm, payload=each.carried)
            tau = Plant(arm).motor_torques(q, v, a)
            yield from zip(inside.tolist(), q, v, tau, repeat(None))


def _transforms(T: Array, frames: list[str], t: float) -> list[Fields]:
    """The transforms of all links from the base, whose poses are T (nq + 1, 4, 4)."""
    found = []
    for name, placed in zip(frames[1:], T[1:], strict=True):
        at = pose(placed)
        found.append(
            {
                "header": {"stamp": stamp(t), "frame_id": frames[0]},
                "child_frame_id": name,
                "transform": {"translation": at["position"], "rotation": at["orientation"]},
            }
        )
    return found


def stamp(t: float) -> Fields:
    """The fields of builtin_interfaces/msg/Time of a time [s]."""
    seconds, rest = divmod(round(t * NANOSECONDS), int(NANOSECONDS))
    return {"sec": seconds, "nanosec": rest}


def _message(types: Any, kind: str, fields: Fields) -> Any:
    """The message of a type with the given fields; the others are zero or empty."""
    _, known = types.fielddefs[kind]
    values = {name: _value(types, node, of, fields.get(name)) for name, (node, of) in known}
    return types.types[kind](**values)


def _value(types: Any, node: Any, of: Any, given: Any) -> Any:
    """The value of a field: of a base type, another message, or a sequence."""
    if node.name == "NAME":
        return _message(types, of, given or {})
    if node.name == "BASE":
        return DEFAULTS[of[0]]() if given is None else given
    (inner, kind), _ = of
    if inner.name == "NAME":
        return [_message(types, kind, each) for each in given or ()]
    if kind[0] == "string":
        return list(given or ())
    return np.array([] if given is None else given, dtype=kind[0])
