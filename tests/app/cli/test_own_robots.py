"""`joulepath robots add` and `remove`: what it added, a request may name."""

from __future__ import annotations

import json
from pathlib import Path

from app.schemas.examples.own_arm import URDF
from tests.app.cli.test_cli import run
from tests.app.requests import PATIENT

MOVE = {"robot": "cell_arm", "start": {"q": [0.2, 0.4]}, "goal": {"q": [-0.9, 1.3]}, **PATIENT}


def test_a_robot_is_added_used_and_removed(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    file = tmp_path / "cell_arm.yaml"
    file.write_text("urdf: arm.urdf\ntip: tool\nacceleration: 8\npayload: 2\n")
    added = run("robots", "add", str(file))
    assert (added.returncode, added.stderr) == (0, b"")
    first, warning = added.stdout.decode().splitlines()
    assert first.startswith("cell_arm: 2 joints. Energies rest on") and "drives.rotor_inertia" in warning
    taken = run("robots", "add", str(file))
    assert taken.returncode == 1 and json.loads(taken.stderr)["type"] == "/problems/robot-exists"
    assert run("robots", "add", str(file), "--replace").returncode == 0
    assert "cell_arm " in run("robots").stdout.decode()
    answer = run("optimize", "-", stdin=json.dumps(MOVE))
    assert answer.returncode == 0, answer.stderr
    assert json.loads(answer.stdout)["robot"] == "cell_arm"
    assert run("robots", "remove", "cell_arm").returncode == 0
    gone = run("optimize", "-", stdin=json.dumps(MOVE))
    assert gone.returncode == 2 and json.loads(gone.stderr)["type"] == "/problems/unknown-robot"
    assert json.loads(run("robots", "remove", "cell_arm").stderr)["type"] == "/problems/unknown-robot"


def test_what_makes_no_robot(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    file = tmp_path / "Arm 1.yaml"
    file.write_text("urdf: arm.urdf\ntip: hand\nacceleration: 8\npayload: 2\n")
    assert b"small letters" in run("robots", "add", str(file)).stderr
    wrong = run("robots", "add", str(file), "--name", "arm_1")
    (error,) = json.loads(wrong.stderr)["errors"]
    assert wrong.returncode == 2 and error["loc"] == ["body", "tip"] and "no link 'hand'" in error["msg"]
    assert json.loads(run("robots", "remove", "ur5e").stderr)["type"] == "/problems/robot-exists"
