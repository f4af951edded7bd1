"""No pose from forward kinematics is refused, whatever the axes and zero positions of the arm."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from joulepath.optimizer.exceptions import NoConfigurationFound, SingularPose
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.inverse import (
    inverse_kinematics_for,
    required_inverse_kinematics,
)
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.six.simple_arm import SimpleArm
from tests.optimizer.kinematics.axis_patterns import (
    RELATIONS,
    Relation,
    is_degenerate,
    random_axes,
    redrawn,
    robot_of,
)
from tests.optimizer.kinematics.six_joints import ACCURACY, FOUND, flange, solved
from tests.selection import long_but

# without the cache, as these arms would displace the arms of other tests
uncached = inverse_kinematics_for.__wrapped__
PATTERNS = list(product(RELATIONS, repeat=5))
# arms with a closed form, due to three parallel or meeting axes
TRIOS: list[tuple[Relation, ...]] = [
    ("square", "opposed", "opposed", "square", "square"),
    ("square meeting", "parallel", "opposed", "square meeting", "square meeting"),
    ("opposed", "square", "parallel", "parallel", "square"),
    ("oblique", "parallel", "opposed", "oblique", "opposed"),
    ("square meeting", "opposed", "square", "square meeting", "same centre"),
]


@pytest.mark.parametrize("count", long_but((40,), (40, 1_000)))
def test_no_pose_of_any_pattern_is_refused(count: int) -> None:
    rng, refused = np.random.default_rng(51), []
    tried = 0
    while tried < count:
        pattern = PATTERNS[rng.integers(len(PATTERNS))]
        axes = redrawn(random_axes(pattern, rng), rng)[0]
        if is_degenerate(axes, rng):
            continue
        tried += 1
        robot = robot_of(axes)
        T = flange(robot, rng.uniform(-np.pi, np.pi, 6))
        try:
            kinematics = uncached(robot)
            assert kinematics is not None
            found = kinematics.solve(T, windings=False)
            errors = [np.abs(flange(robot, each.q) - T).max() for each in found]
            assert min(errors) < ACCURACY
            for each, error in zip(found, errors, strict=True):
                # at meeting branches, a configuration may keep a small error, as documented in
                # `Reach`
                at_edge = each.smallest_singular_value < REACH.singular
                assert error < (REACH.residual if at_edge else ACCURACY)
        except (SingularPose, NoConfigurationFound) as error:
            refused.append((pattern, str(error)))
    assert not refused


@pytest.mark.parametrize("pattern", TRIOS)
def test_a_closed_form_finds_the_configuration_in_any_drawing(
    pattern: tuple[Relation, ...],
) -> None:
    rng = np.random.default_rng(7)
    axes = random_axes(pattern, rng)
    for _ in range(6):
        other = redrawn(axes, rng)[0]
        assert SimpleArm.of(other.simplified()) is not None
        found = solved(robot_of(other), rng.uniform(-np.pi, np.pi, 6))
        assert found.away < FOUND and found.error < ACCURACY


def test_nothing_found_does_not_claim_the_pose_out_of_reach() -> None:
    """An empty result near the full length of the arm is no proof of a pose out of reach."""
    rng = np.random.default_rng(5)
    robot = robot_of(random_axes(("square", "oblique", "square", "oblique", "square"), rng))
    kinematics, chain = required_inverse_kinematics(robot, "goal"), Chain.of(robot.model)
    T = np.eye(4)
    T[:3, 3] = chain.placements[0, :3, 3] + np.array([0.0, 0.0, 0.99 * chain.length])
    with pytest.raises(NoConfigurationFound, match="may still be reachable") as caught:
        kinematics.solve(T, target="start")
    assert caught.value.target == "start" and not caught.value.within_limits
    assert not kinematics.complete
