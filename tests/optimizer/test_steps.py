"""Progress of a computation without a search: its steps, up to the last."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import joulepath
from joulepath.optimizer.identify.logs.log import Log
from tests.identification_logs import csv_of, recorded, truth_of
from tests.selection import long_but

HOME = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
ROUNDING = 1e-9
"""Relative error of a sum of the lengths of pieces."""


@pytest.fixture(scope="module")
def arm() -> joulepath.Arm:
    return joulepath.Arm(robot=joulepath.load_robot("ur5e"))


@pytest.fixture(scope="module")
def problem(arm: joulepath.Arm) -> joulepath.Problem:
    return joulepath.Problem(arm=arm, start=HOME, goal=HOME + 0.3, deadline=100.0)


@pytest.fixture(scope="module")
def solution(problem: joulepath.Problem) -> joulepath.Solution:
    return joulepath.optimize(problem)


def told(compute: Callable[[Any], object]) -> list[joulepath.StepsDone]:
    """Reported progress of a computation: it begins at zero and never decreases."""
    events = list[joulepath.StepsDone]()
    compute(events.append)
    assert events[0].done == 0 and len({(each.total, each.name) for each in events}) == 1
    assert all(before.done < after.done for before, after in pairwise(events))
    return events


def motions(count: int) -> dict[str, tuple[Any, float]]:
    """Motions with their durations."""
    times = np.arange(count) * 0.05
    q = HOME + 0.2 * np.sin(times)[:, None]
    kinds: tuple[Any, ...] = ("linear", "trapezoid", "quintic", "spline")
    by_kind = {kind: (joulepath.Waypoints(q, 0.05, kind), times[-1]) for kind in kinds}
    return by_kind | {"recording": (joulepath.Recording.of(times + 7.0, q), times[-1])}


@pytest.mark.parametrize(
    "kind",
    long_but(["trapezoid", "recording"], ["linear", "trapezoid", "quintic", "spline", "recording"]),
)
def test_an_evaluation_tells_the_time_that_it_has_reached(arm: joulepath.Arm, kind: str) -> None:
    """A motion of more than one block, and a smooth motion of one block."""
    motion, duration = motions(2500)[kind]
    events = told(lambda tell: joulepath.evaluate(arm, motion, tell=tell))
    assert len(events) == 2 if kind == "spline" else len(events) > 2
    assert events[-1].done == pytest.approx(duration, rel=ROUNDING)
    assert events[-1].total == pytest.approx(duration, rel=ROUNDING)


def test_the_length_of_a_stream_is_unknown(arm: joulepath.Arm) -> None:
    motion = motions(3)["recording"][0]
    stream = dataclasses.replace(motion, blocks=iter(motion.blocks))
    events = told(lambda tell: joulepath.evaluate(arm, stream, tell=tell))
    assert {each.total for each in events} == {None}
    assert events[-1].done == pytest.approx(0.1, rel=ROUNDING)
    empty = joulepath.Recording(())
    with pytest.raises(joulepath.InvalidTable, match="two or more rows"):
        joulepath.evaluate(arm, empty, tell=lambda step: None)


def test_a_replay_tells_its_simulations(
    problem: joulepath.Problem, solution: joulepath.Solution
) -> None:
    """Without a payload there is no variant of it: two controllers, two arms, and the baselines on
    three.
    """
    perturb = {"payload": 0.1, "friction": 0.3}

    def replayed(tell: Any) -> object:
        return joulepath.replay(
            solution,
            step=2e-3,
            perturb=perturb,
            problem=problem,
            tell=tell,
        )

    events = told(replayed)
    assert events[0].total == events[-1].done > 2 + 2
    assert (events[-1].done - 4) % 3 == 0
    alone = told(lambda tell: joulepath.replay(solution, ["pd"], 2e-3, problem=problem, tell=tell))
    assert [each.done for each in alone] == [0, 1] and alone[0].total == 1


@pytest.mark.long
def test_an_identification_tells_its_fits() -> None:
    """One fit without each motion, and the last one with all motions; a single fit if nothing is
    held out.
    """
    robot = joulepath.load_robot("ur5e")
    log = read(csv_of(recorded(robot, truth_of(robot), moves=4)), robot)
    options = joulepath.IdentificationOptions(held_out=1.0)
    events = told(lambda tell: joulepath.identify(robot, [log], options, tell=tell))
    # the first two moves of the log are one motion, forth and back
    assert [each.done for each in events] == [0, 1, 2, 3, 4] and events[0].total == 4
    alone = dataclasses.replace(options, held_out=0.0)
    events = told(lambda tell: joulepath.identify(robot, [log], alone, tell=tell))
    assert [each.done for each in events] == [0, 1]


def read(content: bytes, robot: joulepath.Robot) -> Log:
    options = joulepath.LogOptions(payload=joulepath.Payload())
    return joulepath.read_log(content, robot, options).log
