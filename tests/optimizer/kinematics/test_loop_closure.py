"""All roots of closed loops of arms with parallel, meeting or skew axes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.isolated import distinct
from joulepath.optimizer.kinematics.newton import solved
from joulepath.optimizer.kinematics.six.loop_closure import LoopClosure
from joulepath.optimizer.kinematics.six.multi_start import MULTI_START
from tests.models.own_arm.arms import robot
from tests.models.own_arm.palletiser import description
from tests.optimizer.chains import serial_chain
from tests.optimizer.kinematics.axis_patterns import (
    RELATIONS,
    is_degenerate,
    random_axes,
    redrawn,
    robot_of,
)

# rad and m: pose error of a configuration, and difference of a configuration found again
EXACT = 1e-9
FOUND = 1e-6


def reached(closure: LoopClosure, T: Array) -> Array | None:
    """Distinct configurations (n, 6) of a pose, as many as there are real roots; None if no cut has
    as many.
    """
    for roots in closure.roots(T):
        q, residual = solved(closure.chain, roots.q, T)
        exact = residual < EXACT
        q, residual = wrapped(q[exact]), residual[exact]
        found = q[distinct(q, residual)]
        if len(found) == roots.certain:
            return found
    return None


def test_every_pattern_of_axes_has_its_configurations_among_the_roots() -> None:
    """The given configuration is among the roots, and except at rare poses all roots are exact."""
    rng, patterns = np.random.default_rng(12), list(product(RELATIONS, repeat=5))
    unreached, count = 0, 60
    for _ in range(count):
        axes = random_axes(patterns[rng.integers(len(patterns))], rng)
        if is_degenerate(axes, rng):
            continue
        chain = Chain.of(robot_of(redrawn(axes, rng)[0]).model)
        closure = LoopClosure.of(chain)
        assert closure is not None
        q = rng.uniform(-np.pi, np.pi, 6)
        found = reached(closure, chain.flange(q[None])[0])
        if found is None:
            unreached += 1
            continue
        assert len(found) % 2 == 0 and len(found) <= MULTI_START.most_branches
        assert np.abs(wrapped(found - q)).max(axis=1).min() < FOUND
    assert unreached <= 0.05 * count


def test_a_pose_that_no_configuration_reaches_has_no_real_root() -> None:
    chain = Chain.of(serial_chain(6).model)
    closure = LoopClosure.of(chain)
    assert closure is not None
    T = chain.flange(np.linspace(0.3, 0.9, 6)[None])[0]
    T[:3, 3] *= 1.5 * chain.length / np.linalg.norm(T[:3, 3])
    found = reached(closure, T)
    assert found is not None and not len(found)


@pytest.mark.parametrize("nq", [5, 7])
def test_other_numbers_of_joints_and_followers_have_no_such_loop(nq: int) -> None:
    assert LoopClosure.of(Chain.of(serial_chain(nq).model)) is None
    palletiser = robot(description())
    assert LoopClosure.of(Chain.of(palletiser.model, palletiser.coupling)) is None
