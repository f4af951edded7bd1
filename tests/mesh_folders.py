"""Folders of the robots' meshes: a package of the test requirements, or a folder named by the user.

The package `airo-models` ships the meshes of UR3e, UR5e and the gripper Robotiq 2F-85. No package
ships the meshes of UR10e and UR16e: their tests run where ROBOT_MESHES names a folder with `ur10e`
and `ur16e`, laid out as in `joulepath.models.meshes`: the maker's files, as OBJ. Parts shared by
UR16e and UR10e are in both. The test of the hulls of other arms and tools runs for every one in
this folder: `panda`, `iiwa14`, `kr10_r1100`, `xarm7`, `gen3`, `franka_hand`, `onrobot_rg2`.
"""

from __future__ import annotations

import os
from pathlib import Path

from joulepath.models.meshes import SHIFTS, installed
from joulepath.models.tool_meshes import installed_tool

# robots and tools with meshes in the package
SHIPPED = ("ur3e", "ur5e")
SHIPPED_TOOLS = ("robotiq_2f_85",)


def meshes(robot: str) -> Path:
    """The folder of a robot's or tool's meshes."""
    if robot not in (*SHIPPED, *SHIPPED_TOOLS):
        return Path(os.environ["ROBOT_MESHES"]) / robot
    folder = installed(robot) or installed_tool(robot)
    assert folder is not None, "a development dependency: `make test` installs it"
    return folder


# robots with meshes on this machine
FOUND = tuple(robot for robot in SHIFTS if robot in SHIPPED or "ROBOT_MESHES" in os.environ)
