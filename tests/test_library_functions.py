"""Each function of the library in one real use, from `import joulepath` alone."""

from __future__ import annotations

import json
import typing
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import joulepath
from tests.identification_logs import csv_of, recorded, truth_of
from tests.optimizer.clocks import CountingClock

START = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
GOAL = np.array([1.0, -1.2, 1.8, -2.0, -1.3, 0.5])


@cache
def problem() -> joulepath.Problem:
    arm = joulepath.Arm(robot=joulepath.load_robot("ur5e"), payload=joulepath.Payload(mass=1.0))
    return joulepath.Problem(arm=arm, start=START, goal=GOAL, deadline=100.0)


@cache
def solution() -> joulepath.Solution:
    return joulepath.optimize(problem())


@cache
def cycle_solution() -> joulepath.CycleSolution:
    stops = [
        joulepath.Stop(name="pick", target=GOAL, dwell=0.2, payload=joulepath.Payload(mass=2.0)),
        joulepath.Stop(name="place", target=START + 0.3, payload=joulepath.Payload()),
    ]
    arm = joulepath.Arm(robot=joulepath.load_robot("ur5e"))
    return joulepath.plan_cycle(
        joulepath.Cycle(arm=arm, start=START, stops=stops, windings=False, deadline=100.0)
    )


def electrical(energy: joulepath.Energy) -> float:
    return energy.electrical.total


def test_optimize_many() -> None:
    """The caller brings the executor; a problem without a solution does not end the others."""
    far = joulepath.Pose.from_rotvec([3.0, 0.0, 0.0], [np.pi, 0.0, 0.0])
    with ThreadPoolExecutor(1) as executor:
        found = {
            each.index: each
            for each in joulepath.optimize_many([problem(), replace(problem(), goal=far)], executor)
        }
    assert electrical(found[0].result().energy) == pytest.approx(
        electrical(solution().energy), rel=1e-4
    )
    with pytest.raises(joulepath.UnreachablePose):
        found[1].result()


def test_evaluate_takes_a_solution() -> None:
    found = joulepath.evaluate(problem().arm, solution(), sample_period=0.01)
    assert electrical(found.total.energy) == pytest.approx(electrical(solution().energy), rel=1e-4)
    assert found.total.duration == pytest.approx(solution().duration)
    assert all(report.held for report in found.limits) and found.speed_jumps == 0
    assert found.samples is not None and found.samples.q[-1] == pytest.approx(GOAL)
    # the spline, its samples as a recording, and the motion of another arm
    sampled = joulepath.Recording.of(
        found.samples.t, found.samples.q, found.samples.v, found.samples.a
    )
    for motion in (solution().trajectory.spline, sampled):
        again = joulepath.evaluate(problem().arm, motion)
        assert electrical(again.total.energy) == pytest.approx(
            electrical(found.total.energy), rel=1e-3
        )
    heavier = replace(problem().arm, payload=joulepath.Payload(mass=3.0))
    assert electrical(joulepath.evaluate(heavier, solution()).total.energy) > electrical(
        found.total.energy
    )


def test_evaluate_refuses_a_solution_of_another_robot() -> None:
    with pytest.raises(joulepath.InvalidProblem, match="7 joint positions"):
        joulepath.evaluate(joulepath.Arm(robot=joulepath.load_robot("iiwa14")), solution())


def test_compare() -> None:
    told = list[object]()
    found = joulepath.compare(problem(), ["uniform_scaling", "bspline"], tell=told.append)
    assert [each.method for each in found.methods] == ["uniform_scaling", "bspline"]
    energies = {method: electrical(each.energy) for method, each in found.solutions.items()}
    assert found.best == min(energies, key=energies.__getitem__)
    assert found.excess(found.best) == 0
    assert found.lower_bound == max(each.lower_bound for each in found.solutions.values())
    assert found.lower_bound <= min(energies.values())
    assert [type(each) for each in told].count(joulepath.CandidateTried) == 2
    improved = [each.energy for each in told if isinstance(each, joulepath.Improved)]
    assert improved[-1] == min(energies.values())


@pytest.mark.parametrize("methods", [[], ["bspline", "bspline"], ["simplex"]])
def test_compare_refuses_methods_that_are_none(methods: list[typing.Any]) -> None:
    with pytest.raises(joulepath.InvalidProblem, match=r"^methods(\.0)? must") as caught:
        joulepath.compare(problem(), methods)
    assert caught.value.field.startswith("methods")


def test_inverse_kinematics() -> None:
    """The goal of an optimised motion is among the solutions; a scene marks colliding solutions."""
    pose = joulepath.Pose.from_rotvec([0.4, -0.2, 0.3], [np.pi, 0.0, 0.0])
    arm = problem().arm
    found = joulepath.inverse_kinematics(arm, pose)
    goal = joulepath.optimize(replace(problem(), goal=pose, windings=False)).goal
    assert min(float(np.abs(each.q - goal.q).max()) for each in found) < 1e-6
    branches = joulepath.inverse_kinematics(arm.robot, pose, windings=False)
    assert found.complete and branches.complete
    assert len(branches) == len({each.label for each in branches}) == 8 < len(found)
    assert not any(each.free for each in branches)
    T = np.eye(4)
    T[:3, 3] = 0.4, -0.2, 0.3
    ball = joulepath.Obstacle("ball", joulepath.Sphere(0.05), T)
    among = joulepath.inverse_kinematics(
        replace(arm, scene=joulepath.Scene([ball])), pose, windings=False
    )
    assert all(each.collides for each in among)
    assert any(not each.collides for each in branches)
    unchecked = joulepath.inverse_kinematics(replace(arm, collisions=False), pose, windings=False)
    assert all(each.nearest is None and not each.collides for each in unchecked)


def test_what_is_too_late_says_so() -> None:
    """The clock gains a second at every reading, so the deadline passes in every function."""
    late = {"clock": CountingClock()}
    pose = joulepath.Pose.from_rotvec([0.5, 0.1, 0.4], [np.pi, 0.0, 0.0])
    with pytest.raises(joulepath.DeadlineExceeded):
        joulepath.inverse_kinematics(joulepath.load_robot("iiwa14"), pose, deadline=0.5, **late)
    with pytest.raises(joulepath.DeadlineExceeded):
        joulepath.export(solution(), "csv", problem=problem(), deadline=0.5, **late)
    with pytest.raises(joulepath.DeadlineExceeded):
        joulepath.replay(solution(), deadline=0.5, problem=problem(), **late)
    with pytest.raises(joulepath.DeadlineExceeded):
        joulepath.compare(replace(problem(), deadline=0.5), ["uniform_scaling", "bspline"], **late)


def test_replay_of_a_cycle_plays_every_move() -> None:
    found = joulepath.replay(cycle_solution(), ("feed_forward",), 1e-3)
    assert len(found) == len(cycle_solution().moves)
    for replayed, move in zip(found, cycle_solution().moves, strict=True):
        energy = electrical(replayed.under("feed_forward").energy)
        assert energy == pytest.approx(electrical(move.solution.energy), rel=5e-3)


def test_a_solution_needs_its_own_problem() -> None:
    other = replace(problem(), arm=replace(problem().arm, payload=joulepath.Payload(mass=1.5)))
    with pytest.raises(joulepath.NotCertified, match="torques"):
        joulepath.replay(solution(), problem=other)
    with pytest.raises(joulepath.NotCertified, match="torques"):
        joulepath.export(solution(), "csv", problem=other)
    functions: tuple[typing.Any, ...] = (
        joulepath.replay,
        lambda found: joulepath.export(found, "csv"),
    )
    for function in functions:
        with pytest.raises(joulepath.InvalidProblem, match="give the problem") as caught:
            function(solution())
        assert caught.value.field == "problem"


FILES: dict[str, tuple[str, str, typing.Any]] = {
    "urscript": ("script", "servoj", joulepath.UrscriptOptions(rate=125)),
    "ros2": ("json", "send_action_goal", joulepath.Ros2Options(encoding="json")),
    "moveit": ("yaml", "joint_trajectory", None),
    "csv": ("csv", "t,q1,", joulepath.TableOptions(period=0.1)),
    "json": ("json", "control_points", None),
    "npz": ("npz", "PK", None),
    "joint_limits": (
        "yaml",
        "left_elbow_joint:",
        joulepath.LimitsOptions(prefix="left_"),
    ),
    "mcap": ("mcap", "MCAP", joulepath.McapOptions(period=0.1)),
}


@pytest.mark.parametrize("format", FILES)
def test_export(format: typing.Any) -> None:
    extension, content, options = FILES[format]
    file = joulepath.export(solution(), format, options, problem=problem())
    assert file.name == f"joulepath-ur5e.{extension}" and content in file.content.decode(
        errors="replace"
    )
    assert file.worst_ratio == pytest.approx(
        max(solution().certificate.worst_ratio.values()), rel=1e-6
    )
    assert "Not tested on hardware" in file.notes[-1]


@pytest.mark.parametrize(("format", "robot"), [("franka", "fr3"), ("krl", "kr10_r1100")])
def test_export_for_the_controller_of_one_maker(format: typing.Any, robot: str) -> None:
    arm = joulepath.Arm(robot=joulepath.load_robot(robot), collisions=False)
    middle = (arm.active_limits.q_min + arm.active_limits.q_max) / 2
    task = joulepath.Problem(arm=arm, start=middle, goal=middle + 0.2, deadline=100.0)
    found = joulepath.optimize(task)
    assert joulepath.export(found, format, problem=task).content
    with pytest.raises(joulepath.FormatUnsuitable):
        joulepath.export(found, "urscript", problem=task)


def test_export_of_a_cycle_slowed_down_and_a_program() -> None:
    file = joulepath.export(cycle_solution(), "json", speed_scale=0.5)
    content = json.loads(file.content)
    assert file.speed_scale == content["speed_scale"] == 0.5 and "speed-0.5" in file.name
    moving = sum(move.solution.duration for move in cycle_solution().moves)
    assert content["duration"] == pytest.approx(2 * moving + 0.2)
    program = joulepath.Program(
        (joulepath.Move(solution().trajectory.spline, problem().arm), joulepath.Rest(1.0))
    )
    content = json.loads(joulepath.export(program, "json").content)
    assert [step["kind"] for step in content["steps"]] == ["move", "rest"]


def test_export_refuses_what_does_not_fit() -> None:
    given = {"problem": problem()}
    with pytest.raises(joulepath.InvalidProblem, match="takes UrscriptOptions"):
        joulepath.export(solution(), "urscript", joulepath.TableOptions(), **given)
    with pytest.raises(joulepath.InvalidProblem, match="has no options"):
        joulepath.export(solution(), "json", joulepath.TableOptions(), **given)
    with pytest.raises(joulepath.InvalidProblem, match="format must be one of"):
        joulepath.export(solution(), "gcode", **given)  # type: ignore[arg-type]
    for scale in (0.0, -1.0, 1.5, float("nan")):
        with pytest.raises(joulepath.InvalidProblem, match="speed_scale"):
            joulepath.export(solution(), "csv", speed_scale=scale, **given)


def test_a_log_is_read_evaluated_and_identified(tmp_path: Path) -> None:
    robot = joulepath.load_robot("ur10e")
    truth = truth_of(robot)
    path = tmp_path / "monday.csv"
    path.write_bytes(csv_of(recorded(robot, truth, moves=8)))
    reading = joulepath.read_log(
        path, robot, joulepath.LogOptions(payload=joulepath.Payload(), name="monday")
    )
    log = reading.log
    assert log.effort_meaning == "current" and reading.report.rows == len(log.time)
    found = joulepath.identify(robot, [log], joulepath.IdentificationOptions(held_out=0.0))
    viscous = {each.joint: each for each in found.parameters if each.figure == "viscous"}
    for joint, parameter in viscous.items():
        assert joint is not None
        assert abs(parameter.value - truth.viscous[joint]) <= 5 * parameter.sd
    # an arm with these figures predicts the energy of the log's motion better
    own = joulepath.load_robot("ur10e", figures=found.document("2026-01-31"))
    measured = float(np.trapezoid(log.power, log.time))
    before, after = (
        electrical(joulepath.evaluate(joulepath.Arm(robot=each), log.recording()).total.energy)
        for each in (robot, own)
    )
    assert abs(after - measured) < abs(before - measured)
