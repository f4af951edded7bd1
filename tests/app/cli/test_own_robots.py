"""`joulepath robots add` and `remove`: requests may name an added robot."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from joulepath.app.schemas.examples.own_arm import URDF
from tests.app.cli.console import Here, run
from tests.app.requests import PATIENT

MOVE = {"robot": "cell_arm", "start": {"q": [0.2, 0.4]}, "goal": {"q": [-0.9, 1.3]}, **PATIENT}


def test_a_robot_is_added_used_and_removed(here: Here, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    file = tmp_path / "cell_arm.yaml"
    file.write_text("urdf: arm.urdf\ntip: tool\nacceleration: 8\npayload: 2\n")
    code, out, err = here.run("robots", "add", str(file))
    first, warning = out.decode().splitlines()
    assert (code, err) == (0, b"")
    assert (
        first.startswith("cell_arm: 2 joints. Energies are based on")
        and "drives.rotor_inertia" in warning
    )
    code, problem = here.problem("robots", "add", str(file))
    assert (code, problem["type"]) == (1, "/problems/robot-exists")
    assert here.run("robots", "add", str(file), "--replace")[0] == 0
    assert b"\ncell_arm " in here.run("robots")[1]
    written = here.run("robots", "mjcf", "cell_arm")[1]
    assert b'<mujoco model="cell_arm">' in written
    assert here.run("robots", "mjcf", str(file))[1] == written
    limits = here.run("robots", "joint-limits", "cell_arm", "--mass", "0.5")[1]
    assert b"up to 0.5 kg" in limits and b"max_acceleration" in limits
    code, problem = here.problem("robots", "joint-limits", "cell_arm", "--mass", "-1")
    assert (code, problem["type"]) == (2, "/problems/invalid-request")
    answer = run("optimize", "-", stdin=json.dumps(MOVE))
    assert answer.returncode == 0, answer.stderr
    assert json.loads(answer.stdout)["robot"] == "cell_arm"
    assert here.run("robots", "remove", "cell_arm")[0] == 0
    removing, writing = ("robots", "remove", "cell_arm"), ("robots", "mjcf", "cell_arm")
    for command in (("optimize", "-"), removing, writing):
        code, problem = here.problem(*command, stdin=json.dumps(MOVE))
        assert (code, problem["type"]) == (2, "/problems/unknown-robot")


def test_what_makes_no_robot(here: Here, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    file = tmp_path / "Arm 1.yaml"
    file.write_text("urdf: arm.urdf\ntip: hand\nacceleration: 8\npayload: 2\n")
    code, _, err = here.run("robots", "add", str(file))
    assert code == 2 and b"small letters" in err
    code, problem = here.problem("robots", "add", str(file), "--name", "arm_1")
    (error,) = problem["errors"]
    assert code == 2 and error["loc"] == ["body", "tip"] and "no link 'hand'" in error["msg"]
    problem = here.problem("robots", "remove", "ur5e")[1]
    assert (
        problem["type"] == "/problems/robot-exists"
        and "neither replaced nor deleted" in problem["detail"]
    )
    # only an added robot can be removed
    problem = here.problem("robots", "remove", "arm_2")[1]
    assert (problem["known"], problem["detail"]) == (
        [],
        "There is no robot of that name: none has been added.",
    )


def test_what_is_wrong_with_the_database_is_told(
    here: Here, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", "mysql://cell:secret@host/name")
    code, _, error = here.run("robots", "remove", "mine")
    assert code == 2 and b"sqlite:////folder/file" in error and b"secret" not in error
    (tmp_path / "joulepath.db").write_bytes(b"something else" * 100)
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", f"sqlite:///{tmp_path}/joulepath.db")
    code, listed, error = here.run("robots")
    assert code == 0 and b"ur5e" in listed
    assert b"not listed" in error and b"damaged" in error
