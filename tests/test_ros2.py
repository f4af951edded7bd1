"""The tests of the ROS 2 node, by the Python of an environment with rclpy."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PYTHON = ROOT / "build" / "ros2" / "bin" / "python"
WITHOUT_ROS = sys.version_info >= (3, 14)
"""rclpy has no wheels for these versions of Python."""


@pytest.mark.skipif(WITHOUT_ROS, reason="rclpy has no wheels for this version of Python")
@pytest.mark.parametrize(
    "only", ["not long", pytest.param("long", marks=pytest.mark.long)], ids=["quick", "long"]
)
def test_the_node_in_an_environment_with_rclpy(only: str) -> None:
    assert PYTHON.is_file(), "`make ready` makes the environment"
    command = [
        str(PYTHON),
        "-m",
        "pytest",
        "tests/ros2",
        "-q",
        "-m",
        only,
        "-p",
        "no:cacheprovider",
    ]
    environment = os.environ | {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "PYTHONPATH": str(ROOT),
    }
    # variables of the surrounding run, which do not hold for this one
    for name in ("ADDOPTS", "FORKS", "SHARED_FOLDER", "XDIST_WORKER", "XDIST_WORKER_COUNT"):
        environment.pop(f"PYTEST_{name}", None)
    done = subprocess.run(
        [*command, "-p", "no:cacheprovider"],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stdout


@pytest.mark.skipif(importlib.util.find_spec("rclpy") is not None, reason="rclpy is installed")
def test_the_command_says_what_to_install() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "joulepath.app.cli", "ros2", "--ros-args", "-p", "robot:=ur5e"],
        cwd=ROOT,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 2 and "joulepath[ros2]" in done.stderr
