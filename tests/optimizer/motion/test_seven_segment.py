"""The seven-segment profile against Ruckig's single-joint motions and against its own jerk,
integrated.
"""

from __future__ import annotations

import numpy as np
import pytest
import ruckig

from joulepath.models.robot import Array
from joulepath.optimizer.motion.seven_segment import shortest_duration, switches
from tests.optimizer.moves import limits

CASES = 1000
RUCKIG = 1e-9  # relative; Ruckig finds its phases as roots of polynomials in double precision
EXACT = 1e-12  # relative; closed forms in double precision
ROUNDED = 1e-8  # absolute; switches are rounded to 1e-9 of the duration


def ruckig_profile(d: float, v: float, a: float, j: float) -> tuple[float, Array]:
    """Duration [s] of one joint's fastest rest-to-rest motion, and the lengths (7,) of its
    phases."""
    given = ruckig.InputParameter(1)
    given.current_position, given.target_position = [0.0], [d]
    given.max_velocity, given.max_acceleration, given.max_jerk = [v], [a], [j]
    found = ruckig.Trajectory(1)
    result = ruckig.Ruckig(1).calculate(given, found)
    assert result in (ruckig.Result.Working, ruckig.Result.Finished)
    return found.duration, np.array(found.profiles[0][0].t)


def one_joint(d: float) -> Array:
    return np.array([0.0, 0.0, d, 0.0, 0.0, 0.0])


def random_case(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Travel from a hair to a full turn, limits over two decades: every shape of profile comes
    up."""
    d = 10 ** rng.uniform(-4, 0.8) * rng.choice([-1, 1])
    return d, 10 ** rng.uniform(-1, 0.5), 10 ** rng.uniform(-0.5, 1), 10 ** rng.uniform(0, 2.3)


def shape(phases: Array) -> tuple[bool, bool]:
    """Whether a profile holds its greatest acceleration, and whether it cruises."""
    return bool(phases[1] > 1e-9), bool(phases[3] > 1e-9)


def test_durations_are_ruckigs() -> None:
    rng = np.random.default_rng(1)
    shapes = set()
    for _ in range(CASES):
        d, v, a, j = random_case(rng)
        duration, phases = ruckig_profile(abs(d), v, a, j)
        shapes.add(shape(phases))
        assert shortest_duration(one_joint(d), limits(v_max=v, a_max=a, j_max=j)) == pytest.approx(
            duration, rel=RUCKIG
        )
    assert shapes == {(True, True), (True, False), (False, True), (False, False)}


def test_the_arm_takes_as_long_as_its_slowest_joint() -> None:
    """Over many travels at once: as long as the longest of six profiles, for rows and for blocks of
    rows.
    """
    rng = np.random.default_rng(2)
    own = limits(
        v_max=rng.uniform(0.5, 3, 6), a_max=rng.uniform(1, 10, 6), j_max=rng.uniform(10, 200, 6)
    )
    displacement = rng.normal(size=(4, 5, 6)) * 10 ** rng.uniform(-3, 0.5, (4, 5, 6))
    found = shortest_duration(displacement, own)
    assert found.shape == (4, 5)
    for index in np.ndindex(4, 5):
        rates = zip(np.abs(displacement[index]), own.v_max, own.a_max, own.j_max, strict=True)
        assert found[index] == pytest.approx(
            max(ruckig_profile(*each)[0] for each in rates), rel=RUCKIG
        )
        assert found[index] == pytest.approx(
            float(shortest_duration(displacement[index], own)), rel=EXACT
        )


def test_switches_are_ruckigs_at_the_shortest_duration() -> None:
    """Switches of the leading joint at its acceleration limit; none otherwise."""
    rng = np.random.default_rng(4)
    seen = 0
    for _ in range(200):
        d, v, a, j = random_case(rng)
        duration, phases = ruckig_profile(abs(d), v, a, j)
        found = switches(one_joint(d), duration, limits(v_max=v, a_max=a, j_max=j))
        if not shape(phases)[0]:
            assert len(found) <= 6
            continue
        expected = np.unique(np.round(np.cumsum(phases)[:-1] / duration, 9))
        keep = np.append(True, np.diff(expected) > ROUNDED)
        distance = np.abs(found[:, None] - expected[keep][None]).min(axis=1)
        assert (
            len(found) > 0 and distance.max() < 1e-4
        )  # at a cruise of no length, a square root of rounding
        seen += 1
    assert seen > 50


# signs of the jerk between switches: with and without a time of greatest acceleration
PATTERNS = {6: [1, 0, -1, 0, -1, 0, 1], 4: [1, -1, 0, -1, 1]}


@pytest.mark.parametrize("stretch", [1.0001, 1.05, 1.5, 4.0])
def test_switches_make_a_motion_of_the_travel(stretch: float) -> None:
    """±jerk switched there and integrated thrice: at rest at both ends, at its acceleration limit,
    all of the way.
    """
    rng = np.random.default_rng(5)
    seen = 0
    for _ in range(200):
        d, v, a, j = random_case(rng)
        own = limits(v_max=v, a_max=a, j_max=j)
        duration = stretch * float(shortest_duration(one_joint(d), own))
        at = switches(one_joint(d), duration, own) * duration
        whole = len(at) == 6 or (len(at) == 4 and at[1] == pytest.approx(2 * at[0]))
        if not whole:  # switches came so close that they count as one
            continue
        q = v_now = a_now = 0.0
        peak = 0.0
        steps = np.diff(np.concatenate([[0.0], at, [duration]]))
        for jerk, h in zip(j * np.array(PATTERNS[len(at)]), steps, strict=True):
            q, v_now, a_now = (
                q + v_now * h + a_now * h**2 / 2 + jerk * h**3 / 6,
                v_now + a_now * h + jerk * h**2 / 2,
                a_now + jerk * h,
            )
            peak = max(peak, abs(a_now))
        slack = 1e-7  # switches rounded to 1e-9 of the duration, integrated three times
        assert q == pytest.approx(abs(d), rel=slack, abs=slack * j * duration**3)
        assert abs(v_now) < slack * j * duration**2 and abs(a_now) < slack * j * duration
        if len(at) == 6:
            assert peak == pytest.approx(a, abs=slack * j * duration)
        seen += 1
    assert seen > 20


def test_the_joint_that_needs_longest_leads() -> None:
    """The switches belong to the slowest joint, although another joint travels further: limits
    differ.
    """
    own = limits(v_max=[3, 3, 3, 3, 3, 0.8])
    displacement = np.array([2.0, 0.1, 0.2, -0.3, 0.0, -1.5])
    duration = 1.1 * float(shortest_duration(displacement, own))
    alone = np.where(np.arange(6) == 5, displacement, 0.0)
    assert switches(displacement, duration, own) == pytest.approx(switches(alone, duration, own))
    assert len(switches(alone, duration, own)) == 6


def test_jerk_alone_shapes_motions_that_stay_below_the_acceleration_limit() -> None:
    own = limits()
    short = one_joint(1e-3)  # below 2 a³ / j² = 5 cm: half of the way up, half of the way down
    at = switches(short, float(shortest_duration(short, own)), own)
    assert at == pytest.approx([0.25, 0.5, 0.75], abs=1e-6)
    at = switches(
        one_joint(1.0), 4.0, own
    )  # at leisure: a short ramp at either end of a long cruise
    assert len(at) == 4 and at[1] < 0.02 and at[2] > 0.98
    assert len(switches(np.zeros(6), 1.0, own)) == 0
