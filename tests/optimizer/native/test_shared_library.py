"""The library that all arms share: who makes it, what serves without it, and the frames that it computes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from joulepath.models.registry import load_robot, robot_names
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames, link_frames_by_numpy
from joulepath.optimizer.native.shared_library import library_path

FRAMES = 1e-14  # m and cosines; both round, and numpy's sine differs in the last digit

# a motion among obstacles, by its energy
MOTION = """
import logging; logging.basicConfig()
from tests.optimizer.moves import GOAL, START
from joulepath import Arm, Problem, load_robot, optimize
from joulepath.optimizer.problem.scene import Obstacle, Scene, Sphere
from joulepath.optimizer.native.shared_library import shared_library
from tests.optimizer.cells import at
scene = Scene([Obstacle("ball", Sphere(0.1), at([0.3, -0.5, 0.4]))])
arm = Arm(robot=load_robot("ur5e"), scene=scene)
answer = optimize(Problem(arm=arm, start=START, goal=GOAL, deadline=100))
print(shared_library() is not None, answer.certificate.valid, answer.energy.electrical.total)
"""


def run(script: str = MOTION, **environment: str) -> tuple[list[str], str]:
    """What a script prints in a process of its own, as words; and its log."""
    found = subprocess.run(
        [sys.executable, "-c", script], env=os.environ | environment, capture_output=True, text=True, timeout=300
    )
    assert found.returncode == 0, found.stderr
    return found.stdout.split(), found.stderr


def test_the_answer_is_the_same_without_it(tmp_path: Path) -> None:
    """Without a compiler, without a word; where the compiler fails, with one."""
    compiled, _ = run()
    assert compiled[:2] == ["True", "True"]
    empty = {"JOULEPATH_CACHE_DIR": str(tmp_path)}
    for name, log in (("no-such-compiler", ""), ("false", "numpy serves: the C compiler failed")):
        by_numpy, said = run(**empty, CC=name, PATH="/nowhere" if not log else os.environ["PATH"])
        assert by_numpy[:2] == ["False", "True"]
        assert float(by_numpy[2]) == pytest.approx(float(compiled[2]), rel=1e-6)
        assert log in said


def test_nobody_waits_for_a_compiler_that_hangs(tmp_path: Path) -> None:
    """It is started once for each library, numpy and the virtual machine serve, and the answers are the same."""
    compiler, calls = tmp_path / "compiler", tmp_path / "calls"
    compiler.write_text(f"#!/bin/sh\necho $$ >> {calls}\nexec sleep 1000\n", encoding="utf-8")
    compiler.chmod(0o755)
    script = (
        f"{MOTION}answer = optimize(Problem(arm=arm, start=START, goal=GOAL, deadline=100))\nprint(shared_library())"
    )
    compiled, _ = run()
    hung, said = run(script, CC=str(compiler), JOULEPATH_CACHE_DIR=str(tmp_path / "cache"))
    assert (hung[0], hung[1], hung[3], said) == ("False", "True", "None", "")
    assert float(hung[2]) == pytest.approx(float(compiled[2]), rel=1e-6)
    # that of all arms, and that of this one
    assert len(calls.read_text().split()) == 2


def test_it_is_made_once_and_made_anew_when_damaged(tmp_path: Path) -> None:
    environment = os.environ | {"JOULEPATH_CACHE_DIR": str(tmp_path)}
    script = "from joulepath.optimizer.native.shared_library import shared_library; print(shared_library(60))"

    def load() -> float:
        found = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
        assert found.stdout.startswith("<CDLL"), found.stderr
        (library,) = tmp_path.glob("*.so")
        assert library.name == library_path().name
        return library.stat().st_ino

    first = load()
    assert load() == first
    library = tmp_path / library_path().name
    library.write_bytes(library.read_bytes()[:1000])
    assert load() != first


@pytest.mark.parametrize("name", robot_names())
def test_frames_are_those_of_numpy(name: str) -> None:
    """Also of no configuration, of some joints alone, and of arrays whose numbers do not lie one after the other."""
    robot = load_robot(name)
    placements = joint_placements(robot.model)
    q = np.random.default_rng(4).uniform(-7, 7, (robot.nq, 200)).T
    assert not q.flags.c_contiguous
    for given, of in ((q, placements), (q[:0], placements), (q[:, :3], placements[:3]), (q[::7], placements)):
        expected = link_frames_by_numpy(of, given)
        np.testing.assert_allclose(link_frames(of, given), expected, rtol=0, atol=FRAMES)
