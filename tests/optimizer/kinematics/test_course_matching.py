"""Matches between a motion and a course: found all at once, they equal those found one by one."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.tool_path import course_matching
from joulepath.optimizer.kinematics.tool_path.course_matching import MatchingSettings, matched


def _courses(rng: np.random.Generator) -> list[Array]:
    """Points (m, d) of a line, there and back, a knot that crosses itself, and a random walk."""
    t = np.linspace(0.0, 1.0, 200)
    line = np.stack([0.4 * t, 0 * t, 0 * t], axis=1)
    knot = 0.2 * np.stack([np.sin(4 * np.pi * t), np.sin(6 * np.pi * t), 0 * t], axis=1)
    return [
        line,
        np.concatenate([line, line[::-1] + 1e-5]),
        knot,
        np.cumsum(rng.normal(0.0, 1e-3, (200, 6)), axis=0),
    ]


@pytest.mark.parametrize("seed", range(4))
def test_all_at_once_are_those_one_by_one(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also for motions that stop early, turn back, or are far off the course."""
    rng = np.random.default_rng(seed)
    for known in _courses(rng):
        at, share = np.linspace(0.0, 1.0, len(known)), np.sort(rng.random(80))
        for shares in (
            share,
            np.concatenate([share[:40], share[40::-1]]),
            np.clip(share, 0.3, 0.6),
        ):
            asked = np.stack([np.interp(shares, at, each) for each in known.T], axis=1)
            asked += rng.normal(0.0, rng.choice([0.0, 1e-5, 1e-2]), asked.shape)
            at_once = matched(at, known, asked, 5e-4)
            monkeypatch.setattr(course_matching, "SETTINGS", MatchingSettings(rounds=0))
            for found, wanted in zip(at_once, matched(at, known, asked, 5e-4), strict=True):
                np.testing.assert_array_equal(found, wanted)
            monkeypatch.undo()
