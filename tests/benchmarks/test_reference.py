"""References that were computed once: they hold for the robot's figures of today."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.reference import fingerprint, load
from joulepath.models.registry import load_robot


def test_references_are_of_the_robots_figures() -> None:
    robot = load_robot("ur5e")
    # what is computed from figures, and kept with them, is none
    assert robot.limits.rates.shape == (3, 6)
    assert load()["fingerprint"] == fingerprint(robot)


def test_a_friction_that_grows_with_the_load_has_other_references() -> None:
    robot = load_robot("ur5e")
    laws = {name: replace(law, load=np.full(6, 0.1)) for name, law in robot.friction_laws.items()}
    assert fingerprint(replace(robot, friction_laws=laws)) != fingerprint(robot)
