"""The tight bound through `optimize`: greater than the plain one, never above an energy, in time,
or the plain one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import Bus, Dwell, Problem, Solution, optimize
from tests.optimizer.moves import (
    PAYLOAD,
    ROBOT,
    START,
    fixed,
    limits,
    problem,
)
from tests.selection import long_but

CASES: dict[str, dict[str, Any]] = {
    "as it comes": {},
    "loaded": {"payload": PAYLOAD},
    "duration near the shortest": fixed(0.75),
    "isolated bus": {"bus": Bus("isolated")},
    "recuperating bus": {"bus": Bus("recuperating", efficiency=0.8)},
    "wait with motors": {"dwell": Dwell(4.0)},
    "wait with brakes": {"dwell": Dwell(4.0, "brakes", 0.5, 20.0)},
    "plain friction": {"friction": "coulomb_viscous"},
}


def both(asked: Problem) -> tuple[Solution, Solution]:
    """Plain and tight, with time enough on any machine."""
    asked = replace(asked, deadline=600.0)
    return optimize(asked), optimize(replace(asked, bound="tight"))


QUICK = {"as it comes", "duration near the shortest"}


@pytest.mark.parametrize("name", long_but(QUICK, CASES))
def test_it_is_between_the_plain_bound_and_the_energy(name: str) -> None:
    plain, tight = both(problem(**CASES[name]))
    assert np.array_equal(
        plain.trajectory.spline.control_points, tight.trajectory.spline.control_points
    )
    energy = tight.energy.electrical.total
    assert plain.lower_bound <= tight.lower_bound <= energy
    if name == "as it comes":
        assert energy - tight.lower_bound < 0.9 * (energy - plain.lower_bound)


def test_motions_of_other_durations_spend_no_less() -> None:
    """The least energy at fixed durations from the best one on is not below the tight bound for all
    of them.
    """
    free = optimize(problem(bound="tight"))
    for factor in (1.0, 1.1, 1.3, 1.7):
        found = optimize(problem(**fixed(factor * free.duration)))
        assert free.lower_bound <= found.energy.electrical.total


ODD = replace(
    ROBOT, friction_laws={"odd": replace(ROBOT.friction, curved=-0.1 * ROBOT.friction.curved)}
)
DRY = replace(ROBOT.friction, curved=0 * ROBOT.friction.curved, viscous=0 * ROBOT.friction.viscous)
PLAIN: dict[str, dict[str, Any]] = {
    "friction of one torque": {"robot": replace(ROBOT, friction_laws={"dry": DRY})},
    "mechanical": {"objective": "mechanical", "duration_max": 3.0},
    "friction that is not concave": {"robot": ODD},
    "no displacement": {"goal": START, "duration_min": 1.0},
    "slow": {"limits": limits(v_max=0.05)},
}


@pytest.mark.parametrize(
    "name", long_but([name for name in PLAIN if name != "mechanical"][:1], PLAIN)
)
def test_the_plain_bound_stays_where_the_dual_one_does_not_help(name: str) -> None:
    asked = problem(**PLAIN[name])
    plain, tight = both(asked)
    assert plain.lower_bound <= tight.lower_bound <= tight.energy.of(asked.objective)
    if name.startswith(("mechanical", "friction")):
        assert tight.lower_bound == plain.lower_bound
