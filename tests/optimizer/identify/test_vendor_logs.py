"""Logs without header, with names of other makers, in bags of ROS 2, and with nominal clocks."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from joulepath import (
    InvalidProblem,
    InvalidTable,
    LogOptions,
    LogTooLarge,
    Robot,
    load_robot,
    read_log,
)
from joulepath.models.robot import Array
from tests.identification_logs import SILENT, Recording, csv_of, recorded, truth_of

UR = load_robot("ur5e")
PANDA = load_robot("panda")
SIX = {"time": 1, "q": [2, 3, 4, 5, 6, 7], "v": [8, 9, 10, 11, 12, 13]}
# rad; of the digits of a CSV file
WRITTEN = 1e-6


@pytest.fixture(scope="module")
def ur() -> Recording:
    return recorded(UR, truth_of(UR), moves=3)


@pytest.fixture(scope="module")
def panda() -> Recording:
    return recorded(PANDA, truth_of(PANDA), moves=3)


def positions(body: bytes, robot: Robot = UR, **options: object) -> Array:
    log = read_log(body, robot, LogOptions(**options)).log  # type: ignore[arg-type]
    return np.asarray(log.q)


def without_header(recording: Recording) -> bytes:
    return csv_of(recording).split(b"\n", 1)[1]


def test_columns_by_number_of_a_file_without_header(ur: Recording) -> None:
    body = without_header(ur)
    log = read_log(body, UR, LogOptions(columns=SIX | {"current": [*range(20, 26)]})).log
    np.testing.assert_allclose(log.q, ur.q, atol=WRITTEN)
    assert log.effort_meaning == "current"
    named = positions(csv_of(ur), columns={"time": "t", "q": SIX["q"]})
    np.testing.assert_allclose(named, ur.q, atol=WRITTEN)
    with pytest.raises(InvalidTable, match=r"no header.*numbers of the columns"):
        read_log(body, UR)
    for wrong in (0, 99):
        with pytest.raises(InvalidTable, match="numbered from 1"):
            read_log(body, UR, LogOptions(columns=SIX | {"power": wrong}))
    with pytest.raises(InvalidProblem, match="time"):
        read_log(body, UR, LogOptions(columns={"q": SIX["q"]}))
    with pytest.raises(InvalidProblem, match="number 2, more often"):
        read_log(body, UR, LogOptions(columns=SIX | {"q": [2, 2, 4, 5, 6, 7]}))


def test_lines_that_end_with_carriage_returns_alone(ur: Recording) -> None:
    body = csv_of(ur).replace(b"\n", b"\r")
    for content in (body, gzip.compress(body)):
        np.testing.assert_allclose(positions(content), ur.q, atol=WRITTEN)


@pytest.mark.parametrize("name", ["fer_joint{}", "panda_joint{}", "joint_a{}", "lbr_A{}"])
def test_rows_of_joint_states_with_names_of_other_makers(panda: Recording, name: str) -> None:
    """In the format of `ros2 topic echo --csv`, with the joints in another order."""
    order = [2, 0, 1, 3, 6, 5, 4]
    names = ",".join(name.format(k + 1) for k in order)
    lines = [
        f"{1_700_000_000 + int(t)},{round(t % 1 * 1e9)},base,{names},"
        + ",".join(f"{value:.12g}" for value in [*q[order], *v[order]])
        for t, q, v in zip(panda.time.tolist(), panda.q, panda.v, strict=True)
    ]
    found = positions("\n".join(lines).encode(), PANDA)
    np.testing.assert_allclose(found, panda.q, atol=1e-4)


@pytest.mark.parametrize("prefix", ["", "left_", "cell/ur5e::"])
def test_a_table_of_positions_under_the_names_of_the_joints(ur: Recording, prefix: str) -> None:
    order = np.argsort(UR.joint_names)
    header = ["t", *(prefix + UR.joint_names[k] for k in order)]
    rows = np.column_stack([ur.time, ur.q[:, order]]).tolist()
    text = "\n".join([",".join(header), *(",".join(f"{x:.12g}" for x in row) for row in rows)])
    np.testing.assert_allclose(positions(text.encode()), ur.q, atol=WRITTEN)


def test_a_nominal_clock_is_named_and_right_speeds_are_kept(ur: Recording) -> None:
    exact = recorded(UR, truth_of(UR), moves=3, noise=SILENT)
    slow = csv_of(exact, time=exact.time * 0.62, without="aiP")
    with pytest.raises(InvalidTable, match=r"clock t is nominal.*divide the times by 0\.62"):
        read_log(slow, UR)
    near = read_log(csv_of(exact, time=exact.time * 0.75, without="aiP"), UR)
    assert any("clock t is nominal" in text for text in near.report.warnings)
    np.testing.assert_allclose(near.log.v, exact.v, atol=1e-6)
    # of a single joint it may be its sensor
    v = exact.v.copy()
    v[:, 1] *= 0.62
    one = read_log(csv_of(replace(exact, v=v), without="aiP"), UR)
    assert any("speeds of joint 2 do not fit" in text for text in one.report.warnings)
    with pytest.raises(InvalidTable, match="one unit"):
        read_log(csv_of(replace(exact, v=np.rad2deg(exact.v)), without="aiP"), UR)


def bag_of(recording: Recording, folder: Path, kind: str, prefix: str = "") -> Path:
    """A bag with states of an arm and states of a gripper on the same topic."""
    types = get_typestore(Stores.ROS2_HUMBLE)
    state, stamp, head = (
        types.types[name]
        for name in (
            "sensor_msgs/msg/JointState",
            "builtin_interfaces/msg/Time",
            "std_msgs/msg/Header",
        )
    )
    plugin = StoragePlugin.MCAP if kind == ".mcap" else StoragePlugin.SQLITE3
    with Writer(folder / "bag", version=9, storage_plugin=plugin) as bag:
        topic = bag.add_connection("/joint_states", state.__msgtype__, typestore=types)
        names = [prefix + name for name in recording.robot.joint_names]
        for t, q, v, i in zip(
            recording.time.tolist(), recording.q, recording.v, recording.current, strict=True
        ):
            ns = 1_700_000_000_000_000_000 + round(t * 1e9)
            header = head(stamp(ns // 10**9, ns % 10**9), "base")
            for message in (
                state(header, names, q, v, i),
                state(header, ["finger"], np.zeros(1), np.zeros(1), np.zeros(1)),
            ):
                bag.write(topic, ns, types.serialize_cdr(message, state.__msgtype__))
    return next((folder / "bag").glob(f"*{kind}"))


@pytest.mark.parametrize("kind", [".db3", ".mcap"])
def test_a_bag_of_ros_2_is_read_like_its_table(ur: Recording, tmp_path: Path, kind: str) -> None:
    file = bag_of(ur, tmp_path, kind, "left_")
    body = file.read_bytes()
    for source in (file, body, gzip.compress(body)):
        log = read_log(source, UR, LogOptions(effort="current")).log
        np.testing.assert_allclose(log.q, ur.q, atol=WRITTEN)
        np.testing.assert_allclose(log.effort, ur.current, atol=1e-5)
    with pytest.raises(LogTooLarge):
        read_log(body, UR, LogOptions(max_bytes=len(body) // 2))
    for broken in (body[: len(body) // 3], body[:200] + bytes(len(body) - 200)):
        with pytest.raises(InvalidTable):
            read_log(broken, UR)
    with pytest.raises(InvalidTable):
        read_log(body, PANDA)
