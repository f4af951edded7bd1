"""Distances along motions from few samples, against the distances of all samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Obstacle, Points, Scene
from joulepath.models.robot import Array
from joulepath.optimizer.collision import clearance_proof
from joulepath.optimizer.collision.clearance_proof import (
    CLEARANCE_PROOF,
    is_proven_clear,
    proven_clearance,
)
from joulepath.optimizer.collision.model import CollisionModel
from tests.optimizer.cells import LOADS, arm_in_cell, cell, positions, wander
from tests.optimizer.moves import ROBOT

ROUNDING = 1e-9  # m
WITHIN = (0.0, 0.03, 0.3)  # m


def samples(kind: str, seed: int, count: int) -> Array:
    """Samples q (count, nq) [rad] of a slow motion, of random leaps, or of a motion at rest."""
    rng = np.random.default_rng(seed)
    if kind == "leaps":
        return rng.uniform(-3, 3, (count, 6))
    if kind == "still":
        return np.repeat(rng.uniform(-3, 3, (1, 6)), count, axis=0)
    return positions(wander(seed), np.linspace(0, wander(seed).duration, count))


STRIDE = 6
"""Default stride of `CollisionModel.distances_along`."""


@pytest.mark.parametrize("kind", ["motion", "leaps", "still"])
@pytest.mark.parametrize(
    "count", [1, 2 * STRIDE, 2 * STRIDE + 1, 3 * STRIDE + 1, 5 * STRIDE - 1, 97]
)
def test_distances_along_a_motion(kind: str, count: int) -> None:
    model = CollisionModel(arm_in_cell(LOADS[1]))
    q = samples(kind, count, count)
    exact = model.signed_distances(q)[0]
    pairs = np.arange(0, len(model.pairs), 3)
    for within in WITHIN:
        found = model.distances_along(q, within)
        assert (found <= exact + ROUNDING).all(), "lower bounds"
        is_near = exact <= within
        assert is_near.any() or within < WITHIN[-1]
        assert found[is_near] == pytest.approx(exact[is_near], abs=ROUNDING)
        assert (found[~is_near] > within).all()
        some = model.distances_along(q, within, pairs)
        assert (some <= exact[:, pairs] + ROUNDING).all() and (
            (some <= within) == is_near[:, pairs]
        ).all()


def test_what_is_proven_clear_is_certified() -> None:
    """The proven clearance of any other motion is below twice the gap of the proof."""
    clear = 0
    for seed in range(20):
        model = CollisionModel(arm_in_cell(LOADS[0], cell(seed)))
        proof, is_clear = (
            proven_clearance(model, wander(seed)),
            is_proven_clear(model, wander(seed)),
        )
        assert proof is not None
        clear += is_clear
        assert (
            proof.min_clearance >= 0 if is_clear else proof.min_clearance < 2 * CLEARANCE_PROOF.gap
        )
    assert 1 < clear < 19


def test_what_is_proven_clear_is_certified_even_if_its_proof_takes_too_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A bound near the least distance needs more checks than the limit; a proof of the margins
    needs fewer.
    """
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (35, 400, 3))[4]
    around = Points(points[np.linalg.norm(points, axis=1) > 0.55], 0.002)
    scene = Scene([Obstacle("cloud", around, np.eye(4), margin=0.0)])
    model, motion = CollisionModel(Arm(robot=ROBOT, scene=scene)), wander(4)
    exhausted = 0
    for most in (800, 1600, 3200, 6400, 12800):
        settings = replace(CLEARANCE_PROOF, max_checks=most)
        monkeypatch.setattr(clearance_proof, "CLEARANCE_PROOF", settings)
        proof = proven_clearance(model, motion)
        assert proof is not None and proof.min_clearance <= proof.sampled
        exhausted += proof.min_clearance < proof.sampled - 2 * CLEARANCE_PROOF.gap
        assert proof.min_clearance >= 0 or not is_proven_clear(model, motion)
    assert exhausted
