"""Arms from files: the arm is found in the file, and the outcome is one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.arm_files import base_of, first_motion, tip_of
from joulepath.models.own_arm.urdf_tree import UrdfTree, parsed_urdf
from joulepath.models.uploads.limits import unwatched
from tests.optimizer.few_joints import DESK, urdf_of

FINGER = """<joint name="finger" type="revolute"><parent link="tool0"/><child link="finger"/>
  <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <link name="finger"><inertial><mass value="0.1"/>
  <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link></robot>"""
COLUMN = """<link name="floor"/><joint name="column" type="prismatic"><parent link="floor"/>
  <child link="base"/><axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/>
  </joint></robot>"""
GRIPPING = urdf_of(DESK).replace('"tool"', '"tool0"').replace("</robot>", FINGER)


def tree(urdf: str) -> UrdfTree:
    return UrdfTree.of(parsed_urdf(urdf, unwatched))


def test_the_arm_ends_before_the_fingers_and_begins_above_a_column() -> None:
    lifted = tree(GRIPPING.replace("</robot>", COLUMN))
    assert (tip_of(lifted), base_of(lifted, "tool0")) == ("tool0", "base")
    unusual = tree(urdf_of(DESK).replace('"tool"', '"hand"'))
    assert (tip_of(unusual), base_of(unusual, "hand")) == ("link_4", "base")


def test_the_first_motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    file = tmp_path / "desk.urdf"
    file.write_text(GRIPPING)
    outcome = first_motion(file, [], {}, seed=1)
    assert (outcome.joints, outcome.status) == (5, "feasible")
    assert 0 < outcome.bound <= outcome.energy
    assert str(outcome).startswith("desk.urdf: 5 joints, searched inverse kinematics: feasible")


def test_a_refusal_is_the_message_of_the_file(tmp_path: Path) -> None:
    file = tmp_path / "broken.urdf"
    file.write_text(urdf_of(DESK).replace('upper="2.9"', 'upper="-2.9"', 1))
    assert "'joint_0' cannot move" in str(first_motion(file, [], {}, seed=1))
