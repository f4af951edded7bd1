"""URScript: run by a small interpreter, the program follows the spline and stops as specified."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline

from joulepath import FormatUnsuitable, Move, Program, UrscriptOptions
from joulepath.models.robot import Array
from joulepath.optimizer.export.urscript import URSCRIPT, to_urscript
from joulepath.optimizer.motion.spline import retimed
from tests.optimizer.export.programs import LOAD, cycle_with_payload
from tests.optimizer.export.read_back.random_motions import arm_of, one_move, random_spline
from tests.optimizer.export.read_back.urscript_machine import Controller, Halt

EVIL = 'pick"\n  set_standard_digital_out(7, True)\r# \u2028 end'


def text_of(program: Program, **options: object) -> str:
    written = to_urscript(program, UrscriptOptions(**options))  # type: ignore[arg-type]
    return written.content.decode()


def run(
    program: Program,
    at: Array | None = None,
    lag: float = 0.0,
    carries: float = 0.0,
    **options: object,
) -> Controller:
    controller = Controller(program.start if at is None else at, lag, carries)
    controller.run(text_of(program, **options))
    return controller


@pytest.mark.parametrize("form", ["polynomials", "points"])
@pytest.mark.parametrize(
    ("robot", "rate", "seed"), [("ur5e", 500, 0), ("ur10e", 500, 1), ("ur3e", 125, 2)]
)
def test_the_set_points_are_the_spline_at_every_period(
    robot: str, rate: int, seed: int, form: str
) -> None:
    program = one_move(robot, seed)
    points = run(program, rate=rate, form=form).set_points
    t, q = points[:, 0] - 0.1, points[:, 1:]  # it sleeps after set_payload
    assert np.allclose(np.diff(t), 1 / rate, rtol=0, atol=1e-12)
    truth = program.moves[0].spline.curve(np.minimum(t, program.duration))
    assert np.abs(q - truth).max() <= URSCRIPT.set_point_error
    assert t[-1] >= program.duration


def test_a_cycle_switches_payload_and_output_where_it_grasps_and_releases() -> None:
    program = cycle_with_payload()
    events = run(program, digital_output=3).events
    told = [event for event in events if event[0] in ("payload", "output", "sleep")]
    none, load = ("payload", 0.0, [0.0] * 3), ("payload", LOAD.mass, LOAD.com.tolist())
    pause = ("sleep", 0.1)
    assert told == [
        none,
        pause,
        ("output", 3, True),
        load,
        pause,
        ("sleep", 0.35),
        ("output", 3, False),
        none,
        pause,
    ]
    served = [event[2] for event in events if event[0] == "servoj"]
    for move in program.moves:
        assert (
            np.abs(np.array(served) - move.spline.control_points[-1]).max(axis=1).min()
            < URSCRIPT.set_point_error
        )


def test_without_an_output_none_is_switched_and_the_file_says_so() -> None:
    file = to_urscript(cycle_with_payload())
    assert b"set_standard_digital_out" not in file.content
    assert any("no output is switched" in note for note in file.notes)


def test_an_arm_elsewhere_is_asked_for_and_moved_slowly() -> None:
    program = one_move()
    events = run(program, at=program.start + 0.5).events
    kinds = [event[0] for event in events]
    assert kinds.index("popup") < kinds.index("movej") < kinds.index("servoj")
    (moved,) = (event for event in events if event[0] == "movej")
    assert moved[1] <= 0.25 and np.allclose(moved[2], program.start)


def test_another_payload_in_force_is_asked_about() -> None:
    assert [event for event in run(one_move()).events if event[0] == "popup"] == []
    events = run(one_move(), carries=1.2).events
    asked = [event for event in events if event[0] == "popup"]
    assert len(asked) == 1 and "0.000 kg" in asked[0][1]
    assert events.index(asked[0]) < [event[0] for event in events].index("payload")


def test_it_stops_when_the_arm_does_not_follow_or_the_payload_is_not_taken() -> None:
    with pytest.raises(Halt, match="does not follow"):
        run(one_move(), lag=2.0)
    with pytest.raises(Halt, match="payload"):
        Controller(one_move().start, payload=1.0, takes_payload=False).run(text_of(one_move()))
    with pytest.raises(Halt, match="did not reach the end"):
        run(one_move(), lag=0.05)


def test_an_arm_that_lags_as_expected_is_not_stopped() -> None:
    run(one_move(), lag=0.0009)


def test_text_of_a_user_cannot_leave_its_comment() -> None:
    text = text_of(cycle_with_payload(label=EVIL))
    plain = text_of(cycle_with_payload(label="x"))
    assert [line for line in text.splitlines() if not line.strip().startswith("#")] == [
        line for line in plain.splitlines() if not line.strip().startswith("#")
    ]
    assert text.isascii()


def test_the_text_has_the_form_that_the_controller_takes_over_a_socket() -> None:
    for form in ("polynomials", "points"):
        first, *inner, last = text_of(
            cycle_with_payload(), form=form, digital_output=0
        ).splitlines()
        assert (first, last) == ("def joulepath():", "end")
        assert all(line.startswith("  ") and line.strip() and line.isascii() for line in inner)


def test_splines_of_other_degrees_are_served_too() -> None:
    arm = arm_of("ur5e")
    spline = random_spline(arm, 5)
    times = np.linspace(0, 1, 12)
    knots = np.concatenate([np.zeros(8), [0.5], np.ones(8)])
    fitted = make_lsq_spline(times, spline.curve(times * spline.duration), knots, k=7)
    program = Program(
        (
            Move(
                replace(spline, degree=7, knots=knots * spline.duration, control_points=fitted.c),
                arm,
            ),
        )
    )
    points = run(program).set_points
    truth = program.moves[0].spline.curve(np.minimum(points[:, 0] - 0.1, program.duration))
    assert np.abs(points[:, 1:] - truth).max() <= URSCRIPT.set_point_error


def test_a_very_short_motion_is_served() -> None:
    program = one_move()
    tiny = replace(
        program.moves[0], spline=retimed(program.moves[0].spline, 1e-4 / program.duration)
    )
    points = run(Program((tiny,)), lookahead_time=0.2).set_points
    assert np.abs(points[-1, 1:] - tiny.spline.control_points[-1]).max() <= URSCRIPT.set_point_error


@pytest.mark.parametrize(("robot", "words"), [("fr3", "7 joints"), ("kr10_r1100", "KUKA")])
def test_other_robots_are_refused_with_formats_that_remain(robot: str, words: str) -> None:
    with pytest.raises(FormatUnsuitable, match=rf"{words}.*use ros2"):
        to_urscript(one_move(robot))


def test_a_long_motion_is_refused_before_it_fills_the_memory() -> None:
    program = one_move().slowed(1e-3)
    with pytest.raises(FormatUnsuitable, match="set points"):
        to_urscript(program, UrscriptOptions(form="points"))
    assert len(to_urscript(program).content) < 10_000


def test_the_title_of_an_own_arm_does_not_decide_its_maker() -> None:
    move = one_move("kr10_r1100").moves[0]
    own = replace(move.arm.robot, title="KUKA with another controller", maker=None)
    assert to_urscript(Program((replace(move, arm=replace(move.arm, robot=own)),))).content
