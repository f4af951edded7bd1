"""Imports of a process before its first use: each of these packages takes 0.1 s or more."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SLOW = {"casadi", "fastapi", "mujoco", "ompl", "pydantic", "scipy", "sqlalchemy", "toppra"}
FIRST_PROBLEM = """
import joulepath
arm = joulepath.Arm(robot=joulepath.load_robot("ur5e"))
goal = joulepath.Pose.from_pendant([400, -200, 300, 2.221, -2.221, 0])
joulepath.Problem(arm=arm, start=[0, -1.57, 1.57, -1.57, -1.57, 0], goal=goal)
"""
HELP = """
from joulepath.app.cli.main import joulepath
joulepath(["--help"], standalone_mode=False)
"""


@pytest.mark.parametrize("code", [FIRST_PROBLEM, HELP], ids=["first_problem", "help"])
def test_nothing_slow_is_imported_before_it_is_needed(code: str) -> None:
    told = subprocess.run(
        [
            sys.executable,
            "-c",
            f"{code}\nimport json, sys\nprint()\nprint(json.dumps([*sys.modules]))",
        ],
        capture_output=True,
        cwd=ROOT,
        check=True,
        text=True,
    )
    imported = set(json.loads(told.stdout.splitlines()[-1]))
    assert imported & SLOW == set()
    if code == HELP:
        assert imported.isdisjoint({"numpy", "pinocchio"})
