"""Exported programs: steps that fit together, slowed down, certified again."""

from __future__ import annotations

import contextlib
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from joulepath import (
    Cycle,
    InvalidProblem,
    Move,
    NotCertified,
    Payload,
    Program,
    Rest,
    Spline,
    Stop,
    Trajectory,
    UrscriptOptions,
    plan_cycle,
)
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.evaluate.sample_check import check_samples
from joulepath.optimizer.export.certified import certified
from joulepath.optimizer.export.json_document import to_json
from joulepath.optimizer.export.program import program_of_cycle
from joulepath.optimizer.export.quintic_points import quintic_points
from joulepath.optimizer.export.urscript import to_urscript
from joulepath.optimizer.motion.joined import spline_through
from joulepath.optimizer.motion.spline import retimed
from tests.optimizer.export.programs import cycle_with_payload
from tests.optimizer.export.read_back.random_motions import arm_of, one_move, random_spline
from tests.optimizer.export.read_back.urscript_machine import Controller
from tests.optimizer.moves import AMPLE, GOAL, START


def samples_of(move: Move) -> Trajectory:
    return Plant(move.arm).trajectory(move.spline, 0.008)


def test_slowing_scales_the_rates_and_is_certified_again() -> None:
    program = one_move()
    (fast,), (slow,) = certified(program), certified(program.slowed(0.1))
    for power, name in enumerate(("velocity", "acceleration", "jerk"), 1):
        assert slow.worst_ratio[name] == pytest.approx(
            fast.worst_ratio[name] * 0.1**power, rel=1e-3
        )
    assert program.slowed(0.1).duration == pytest.approx(10 * program.duration)
    assert program.slowed(0.5).slowed(0.2).speed_scale == pytest.approx(0.1)


def test_rests_stay_as_long_as_they_are() -> None:
    slow = cycle_with_payload().slowed(0.5)
    assert [step.duration for step in slow.steps if isinstance(step, Rest)] == [0.35]


def test_a_motion_that_is_too_fast_is_not_certified() -> None:
    program = one_move()
    move = replace(program.moves[0], spline=retimed(program.moves[0].spline, 0.7))
    with pytest.raises(NotCertified, match="of the limit") as refusal:
        certified(Program((move,)))
    assert max(refusal.value.worst_ratio.values()) > 1
    certified(Program((move,)).slowed(0.5))


def test_the_load_counts_when_standing_still_is_too_much() -> None:
    program = one_move()
    heavy = replace(program.moves[0].arm, payload=Payload(80.0, np.array([0.5, 0.0, 0.0])))
    with pytest.raises(NotCertified, match="torque"):
        certified(Program((replace(program.moves[0], arm=heavy),)).slowed(0.05))


def test_a_motion_through_the_arm_itself_is_not_certified() -> None:
    arm = replace(arm_of("ur5e"), collisions=True)
    folded = np.array([0.0, -1.57, 3.0, -1.57, -1.57, 0.0])
    q = np.concatenate([[START] * 3, [folded] * 5, [START] * 3])
    spline = Spline(5, np.concatenate([np.zeros(6), [0.2, 0.4, 0.5, 0.6, 0.8], np.ones(6)]) * 30, q)
    with pytest.raises(NotCertified, match="clearance"):
        certified(Program((Move(spline, arm),)))


def test_a_motion_that_does_not_rest_at_its_end_is_not_certified() -> None:
    spline = random_spline(arm_of("ur5e"), 3)
    points = spline.control_points.copy()
    points[-2] += 1e-4
    with pytest.raises(NotCertified, match="at rest"):
        certified(
            Program((Move(replace(spline, control_points=points), arm_of("ur5e")),)).slowed(0.5)
        )


def test_nan_is_not_certified() -> None:
    spline = random_spline(arm_of("ur5e"), 3)
    points = spline.control_points.copy()
    points[4, 2] = np.nan
    with pytest.raises(NotCertified):
        certified(Program((Move(replace(spline, control_points=points), arm_of("ur5e")),)))


@pytest.mark.parametrize("name", ["q", "v", "a", "tau"])
def test_samples_of_another_motion_are_noticed(name: str) -> None:
    move = one_move().moves[0]
    own = samples_of(move)
    samples = {each: getattr(own, each).copy() for each in ("q", "v", "a", "tau")}
    check_samples(move.arm, move.spline, own.t, list(samples.values()))
    samples[name][7, 2] += 1e-3
    with pytest.raises(NotCertified, match="samples"):
        check_samples(move.arm, move.spline, own.t, list(samples.values()))


def test_another_payload_is_noticed_by_the_torques() -> None:
    move = one_move().moves[0]
    own = samples_of(move)
    loaded = replace(move, arm=replace(move.arm, payload=Payload(0.05)))
    with pytest.raises(NotCertified, match="torques"):
        check_samples(loaded.arm, loaded.spline, own.t, (own.q, own.v, own.a, own.tau))


def test_steps_must_fit_together() -> None:
    move, other = one_move(seed=1).moves[0], one_move(seed=2).moves[0]
    for steps in ((), (Rest(1.0), move), (move, other), (move, one_move("ur10e").moves[0])):
        with pytest.raises(InvalidProblem):
            Program(steps)


def test_a_motion_without_an_end_is_refused_before_it_is_certified() -> None:
    with pytest.raises(InvalidProblem, match="speed_scale"):
        certified(one_move().slowed(1e-4))


def test_samples_joined_by_quintics_are_the_motion() -> None:
    spline = random_spline(arm_of("ur5e"), 8)
    t = np.unique(
        np.concatenate([spline.knots, np.random.default_rng(0).uniform(0, spline.duration, 30)])
    )
    through = spline_through(t, *(spline.curve(t, order) for order in range(3)))
    fine = np.linspace(0, spline.duration, 400)
    for order in range(3):
        assert through.curve(fine, order) == pytest.approx(spline.curve(fine, order), abs=1e-8)


def test_a_cycle_of_the_optimiser_becomes_a_program() -> None:
    arm = arm_of("ur5e")
    stops = [
        Stop(name="pick", target=GOAL, dwell=0.2, payload=Payload(1.0)),
        Stop(name="place", target=START + 0.2, payload=Payload()),
    ]
    found = plan_cycle(Cycle(arm=arm, start=START, stops=stops, deadline=AMPLE))
    program = program_of_cycle(found)
    assert program.duration == pytest.approx(found.duration)
    switched = [each for each in program.timed if each.payload is not None]
    assert [each.grasps for each in switched] == [True, False]
    certified(program)


@pytest.mark.parametrize("dwell", [0.0, 0.3])
def test_what_is_put_down_at_the_end_is_put_down_by_the_program(dwell: float) -> None:
    """The last stop of an open cycle changes the payload, and no move follows."""
    stop = Stop(name="place", target=GOAL, dwell=dwell, payload=Payload())
    carrying = replace(arm_of("ur5e"), payload=Payload(1.0))
    found = plan_cycle(Cycle(arm=carrying, start=START, stops=[stop], closed=False, deadline=AMPLE))
    program = program_of_cycle(found).slowed(0.5)
    move, rest = program.timed
    assert move.payload is None and rest.payload is not None
    assert (rest.payload.mass, rest.grasps, rest.step.duration) == (0.0, False, dwell)
    controller = Controller(START)
    controller.run(to_urscript(program, UrscriptOptions(digital_output=3)).content.decode())
    events = [event[1:] for event in controller.events if event[0] in ("output", "payload")]
    assert events[0][0] == 1.0 and events[-2] == (3, False) and events[-1][0] == 0.0
    assert (np.diff(quintic_points(program, "ros2").nanoseconds) > 0).all()
    (resting,) = {
        state["payload"]["mass"] for state in json.loads(to_json(program).content)["steps"][1:]
    }
    assert resting == 0.0


def test_the_page_shows_what_works() -> None:
    page = (Path(__file__).parents[3] / "docs" / "reference" / "export.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(code, {})
    assert "slowed down to 0.1 of its speed" in printed.getvalue()
