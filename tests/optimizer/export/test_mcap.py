"""Recordings of ROS 2, read back by a library independent of the writing one."""

from __future__ import annotations

from collections import defaultdict
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from joulepath import McapOptions, Program, export
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.dynamics.plant import Plant
from tests.optimizer.export.programs import cycle_with_payload

# rad, rad/s: messages have 64 bits
EXACT = 1e-12
# s: stamps have whole nanoseconds
STAMP = 1e-9
PERIOD = 0.02


def messages(program: Program, **options: Any) -> dict[str, list[tuple[float, Any]]]:
    """Times [s] and messages by topic."""
    file = export(program, "mcap", McapOptions(**options))
    found = defaultdict(list)
    reader = make_reader(BytesIO(file.content), decoder_factories=[DecoderFactory()])
    for each in reader.iter_decoded_messages():
        found[each.channel.topic].append((each.message.log_time * 1e-9, each.decoded_message))
    return found


@pytest.fixture(scope="module")
def recorded() -> dict[str, list[tuple[float, Any]]]:
    return messages(cycle_with_payload(), period=PERIOD, prefix="left_")


def test_joint_states_are_those_of_the_motion(recorded: Any) -> None:
    program = cycle_with_payload()
    t = np.array([at for at, _ in recorded["/joint_states"]])
    states = [state for _, state in recorded["/joint_states"]]
    assert t[0] == 0 and t[-1] == pytest.approx(program.duration, abs=STAMP)
    assert np.diff(t).min() > 0 and np.diff(t).max() < PERIOD + STAMP
    q, v, _ = program.at(t)
    # at a rounded instant
    assert np.abs(np.array([each.position for each in states]) - q).max() < 10 * STAMP
    assert np.abs(np.array([each.velocity for each in states]) - v).max() < 100 * STAMP
    assert states[0].name == ["left_" + name for name in program.robot.joint_names]


def test_power_and_torques_are_those_of_the_arm_with_its_payload(recorded: Any) -> None:
    program = cycle_with_payload()
    power, states = dict(recorded["/power"]), dict(recorded["/joint_states"])
    for timed in program.timed:
        inside = [
            t for t in states if timed.t0 + STAMP < t < timed.t0 + timed.step.duration - STAMP
        ]
        if timed.step not in program.moves:
            assert not set(inside) & set(power)
            continue
        at = Plant(timed.step.arm).samples(timed.step.spline, np.array(inside) - timed.t0)
        assert np.allclose([power[t].data for t in inside], at.power, rtol=0, atol=1e-4)
        efforts = np.array([states[t].effort for t in inside])
        assert np.allclose(efforts, at.tau_motor, rtol=0, atol=1e-5)


def test_frames_and_shapes_are_those_of_the_arm(recorded: Any) -> None:
    program = cycle_with_payload()
    model = collision_model(program.moves[0].arm)
    for (_, message), (_, state) in zip(recorded["/tf"], recorded["/joint_states"], strict=True):
        placed = model.frames(np.array([state.position]))[0]
        for each, T in zip(message.transforms, placed[1:], strict=True):
            move = each.transform.translation
            assert each.header.frame_id == "left_base"
            assert np.abs([move.x, move.y, move.z] - T[:3, 3]).max() < EXACT
    ((_, array),) = recorded["/markers"]
    frames = {each.header.frame_id for each in array.markers}
    assert frames <= {"left_base", *("left_" + name for name in program.robot.link_names)}
    assert len(array.markers) >= len(model.bodies)
    assert {each.id for each in array.markers} == set(range(len(array.markers)))


def test_the_trajectory_is_that_of_a_controller(recorded: Any) -> None:
    program = cycle_with_payload()
    ((t, trajectory),) = recorded["/joint_trajectory"]
    end = trajectory.points[-1]
    assert t == 0
    assert end.time_from_start.sec + end.time_from_start.nanosec * 1e-9 == pytest.approx(
        program.duration, abs=STAMP
    )
    assert list(end.positions) == pytest.approx(
        program.moves[-1].spline.control_points[-1].tolist(), abs=EXACT
    )
    assert 'link name="left_forearm"' in recorded["/robot_description"][0][1].data


def test_the_same_motion_gives_the_same_file() -> None:
    first, second = (export(cycle_with_payload(), "mcap").content for _ in range(2))
    assert first == second
