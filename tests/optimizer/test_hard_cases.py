"""Requests that once failed, named by their difficulty."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Payload, Pose, Problem, optimize
from tests.by_pinocchio import flange
from tests.optimizer.moves import ROBOT, problem_with
from tests.selection import long_but

# of the energy of a baseline equal to the answer: both are quadratures, and the spline in place of
# the motion is slower by this share if switches of two joints fall within microseconds
HAIR = 3e-4


def pose(q: np.ndarray) -> Pose:
    return Pose(flange(ROBOT, q))


def varied(seed: int, index: int) -> Problem:
    """A random request with random options: payload, mount, limits, duration, method, friction law,
    windings.
    """
    rng = np.random.default_rng([seed, index])
    limits = ROBOT.limits
    q_start, q_goal = (
        rng.uniform(limits.q_min, limits.q_max),
        rng.uniform(limits.q_min, limits.q_max),
    )
    options: dict[str, object] = {}
    if rng.random() < 0.4:
        mass = rng.uniform(0, 5)
        rng.uniform(size=3)
        options["payload"] = Payload(mass, rng.uniform(-0.1, 0.1, 3), np.eye(3) * 0.01)
    if rng.random() < 0.3:
        down = rng.normal(size=3)
        options["gravity"] = down / np.linalg.norm(down) * 9.81
    if rng.random() < 0.4:
        k = rng.uniform(0.2, 1, (4, 1))
        options["limits"] = replace(
            limits, v_max=limits.v_max * k[0], a_max=limits.a_max * k[1], j_max=limits.j_max * k[2]
        )
    kind = rng.random()
    if kind < 0.15:
        options["duration_min"] = options["duration_max"] = rng.uniform(0.5, 4)
    elif kind < 0.25:
        options["duration_max"] = rng.uniform(1, 4)
    elif kind < 0.3:
        options["duration_min"] = rng.uniform(1, 6)
    if rng.random() < 0.2:
        options["method"] = "time_scaling"
    if rng.random() < 0.2:
        options["friction"] = "coulomb_viscous"
    if rng.random() < 0.3:
        options["windings"] = False
    start = q_start if rng.random() < 0.6 else pose(q_start)
    goal = pose(q_goal) if rng.random() < 0.8 else q_goal
    # drawn without regard to collisions
    return problem_with(
        start=start,
        goal=goal,
        deadline=60.0,
        collisions=False,
        **options,  # type: ignore[arg-type]
    )


CASES = {
    "accelerations so low that haste saves most": (0, 27),
    "the same with other friction and a longest duration": (0, 74),
    "payload on a tilted mount, low jerk, no spline as fast as ruckig": (1, 83),
    "two joints share the lead, each with switches of its own": (1, 137),
    "jerk peaks between a span's end and the first point looked at": (1, 140),
    "on the line, torque peaks at a jump of jerk": (7, 21),
    "jerk alone shapes the motion, acceleration stays below its limit": (3, 3),
}


@pytest.mark.parametrize(
    ("seed", "index"), long_but(list(CASES.values())[2:], CASES.values()), ids=CASES.keys()
)
def test_requests_that_once_failed(seed: int, index: int) -> None:
    problem = varied(seed, index)
    solution = optimize(problem)
    assert solution.certificate.valid
    energy = solution.energy.electrical.total
    assert solution.lower_bound <= energy
    least, most = problem.duration_min or 0.0, problem.duration_max or np.inf
    for baseline in solution.baselines:
        off_line = problem.method == "time_scaling" and baseline.name.startswith("ruckig")
        if baseline.within_limits and not off_line and least <= baseline.duration <= most:
            assert energy <= baseline.electrical * (1 + HAIR), baseline.name


@pytest.mark.parametrize(
    ("jerk", "duration", "displacement"),
    [(200.0, 100.0, 0.9), pytest.param(0.01, 600.0, 6.0, marks=pytest.mark.long)],
    ids=["a hundred seconds for one radian", "next to no jerk, all of ten minutes"],
)
def test_very_slow_motions(jerk: float, duration: float, displacement: float) -> None:
    limits = replace(ROBOT.limits, j_max=np.full(6, jerk))
    start = np.full(6, -displacement / 2)
    fixed = {
        "duration_min": duration,
        "duration_max": duration,
        "deadline": 60.0,
        "collisions": False,
    }
    goal = start + displacement
    problem = problem_with(start, goal, limits=limits, **fixed)  # type: ignore[arg-type]
    solution = optimize(problem)
    assert solution.certificate.valid
    assert solution.duration == duration
