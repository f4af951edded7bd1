"""Tables of benchmarks, their requirements, and the references of the robots' figures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.energies import RELATIVE, differences
from benchmarks.reference import fingerprint, load
from benchmarks.requirements import Requirement
from joulepath.optimizer.problem.robots import load_robot

ROW = {
    "index": 3,
    "kind": "payload",
    "task": [0.1, 0.2],
    "outcome": "optimal",
    "energy": 50.0,
    "duration": 1.0,
}


@pytest.mark.parametrize(
    ("measured", "at_least", "satisfied"),
    [
        (1.0, False, True),
        (1.0, True, True),
        (1.1, False, False),
        (0.9, True, False),
        (math.nan, False, False),
    ],
)
def test_a_requirement_is_satisfied_up_to_its_bound(
    measured: float, at_least: bool, satisfied: bool
) -> None:
    assert (
        Requirement("task", "quantity [1]", "maximum", measured, 1.0, at_least).satisfied
        is satisfied
    )


@pytest.mark.parametrize(
    "change",
    [
        {"energy": 50.0 * (1 + 2 * RELATIVE)},
        {"energy": 50.0 * (1 - 2 * RELATIVE)},
        {"energy": math.nan},
        {"energy": None, "outcome": "NoTrajectory"},
        {"outcome": "feasible"},
        {"task": [0.1, 0.3]},
        {"task": [0.1]},
        {"kind": "cell"},
        {"index": 4},
    ],
)
def test_a_different_energy_outcome_or_task_is_named(change: dict[str, object]) -> None:
    assert differences([ROW], [ROW]) == []
    (message,) = differences([ROW | change], [ROW])
    assert message.startswith(f"index {(ROW | change)['index']} ")


def test_rounding_is_no_difference() -> None:
    assert (
        differences(
            [ROW | {"energy": 50.0 * (1 + 0.5 * RELATIVE), "task": [0.1 + 1e-12, 0.2]}], [ROW]
        )
        == []
    )
    refused = ROW | {"energy": None, "outcome": "NoTrajectory"}
    assert differences([refused], [refused]) == []


def test_references_are_of_the_robots_figures() -> None:
    robot = load_robot("ur5e")
    # values computed from figures, and cached with them, are not part of the fingerprint
    assert robot.limits.rates.shape == (3, 6)
    assert load()["fingerprint"] == fingerprint(robot)


def test_a_friction_that_grows_with_the_load_has_other_references() -> None:
    robot = load_robot("ur5e")
    laws = {name: replace(law, load=np.full(6, 0.1)) for name, law in robot.friction_laws.items()}
    assert fingerprint(replace(robot, friction_laws=laws)) != fingerprint(robot)
