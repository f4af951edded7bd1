from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import orjson
import pytest

from benchmarks.checks import beats, errors_found, refusal_errors
from benchmarks.motion import SplineMotion, replay
from benchmarks.requests import Outcome, summary
from benchmarks.tasks import RequestTask, request_task
from joulepath import load_robot, optimize
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.convert.arm import arm_fields
from joulepath.app.convert.request import to_problem
from joulepath.app.engine.result import json_document
from joulepath.app.schemas.request import OptimizeRequest

Json = dict[str, Any]
ENERGY_ERROR = 1e-4  # relative, between Simpson's rule on 1 ms and the optimiser's quadrature
ROUNDING = 1e-12  # rad
RATIO_ERROR = 2e-3  # between the certificate's grid and this one


@pytest.fixture(scope="module")
def task() -> RequestTask:
    return request_task(0, 0)


@pytest.fixture(scope="module")
def answered(task: RequestTask) -> Json:
    request = OptimizeRequest.model_validate(task.body)
    content = OptimizeAnswer.of(
        request, "id", optimize(to_problem(request, 10.0)), arm_fields(request)
    )
    return orjson.loads(json_document(content))


def found(task: RequestTask, answer: Json) -> list[str]:
    return errors_found(task.body, answer, task.T_start, task.T_goal)


def test_nothing_is_wrong_with_an_answer(task: RequestTask, answered: Json) -> None:
    assert found(task, answered) == []


def shift_goal(answer: Json) -> None:
    answer["trajectory"]["spline"]["control_points"][-1][0] += 1e-5


def hurry(answer: Json) -> None:
    knots = answer["trajectory"]["spline"]["knots"]
    answer["trajectory"]["spline"]["knots"] = [0.9 * knot for knot in knots]
    answer["duration"] *= 0.9


def lose_energy(answer: Json) -> None:
    answer["energy"]["electrical"]["friction"] *= 0.9


def boast(answer: Json) -> None:
    answer["energy"]["lower_bound"] = 1.1 * answer["energy"]["electrical"]["total"]


def break_a_limit(answer: Json) -> None:
    answer["certificate"]["worst_ratio"]["jerk"] = 1.001


def forget_a_limit(answer: Json) -> None:
    answer["certificate"]["worst_ratio"]["torque"] = None


def miss_the_start(answer: Json) -> None:
    answer["certificate"]["start_error"]["rotation"] = 1e-5


def be_beaten(answer: Json) -> None:
    baseline = answer["baselines"][1]
    baseline |= {
        "within_limits": True,
        "electrical": 0.99 * answer["energy"]["electrical"]["total"],
    }


@pytest.mark.parametrize(
    "spoil",
    [
        shift_goal,
        hurry,
        lose_energy,
        boast,
        break_a_limit,
        forget_a_limit,
        miss_the_start,
        be_beaten,
    ],
)
def test_what_is_wrong_is_found(
    task: RequestTask, answered: Json, spoil: Callable[[Json], None]
) -> None:
    answer = copy.deepcopy(answered)
    spoil(answer)
    assert found(task, answer)


def test_a_baseline_of_a_duration_that_was_not_allowed_does_not_count(answered: Json) -> None:
    answer = copy.deepcopy(answered)
    be_beaten(answer)
    baseline = answer["baselines"][1]
    assert beats({"duration": answer["duration"]}, answer, baseline)
    baseline["duration"] = 2 * answer["duration"]
    assert beats({}, answer, baseline)
    assert not beats({"duration": answer["duration"]}, answer, baseline)
    assert not beats({"duration": {"max": 1.5 * answer["duration"]}}, answer, baseline)


def test_replay_agrees_with_the_certificate(task: RequestTask, answered: Json) -> None:
    spline = answered["trajectory"]["spline"]
    points = np.array(spline["control_points"])
    problem = to_problem(OptimizeRequest.model_validate(task.body), 10.0)
    motion = replay(
        problem,
        SplineMotion(np.array(spline["knots"]), points, spline["degree"]),
        points[0],
        points[-1],
    )
    assert motion.end_error < ROUNDING
    assert motion.energy.electrical.total == pytest.approx(
        answered["energy"]["electrical"]["total"], rel=ENERGY_ERROR
    )
    for name, ratio in answered["certificate"]["worst_ratio"].items():
        assert motion.ratios[name] == pytest.approx(ratio, abs=RATIO_ERROR)


def test_a_refusal_is_right_only_if_the_arm_cannot_be_held(task: RequestTask) -> None:
    robot = load_robot("ur5e")
    ends = task.q_start, task.q_goal
    for problem in ("torque-infeasible", "unreachable-pose", "deadline-exceeded"):
        (message,) = refusal_errors(robot, problem, *ends)
        assert problem in message
    weak = replace(robot, limits=robot.limits.tightened(tau_max=robot.limits.tau_max / 1000))
    assert refusal_errors(weak, "torque-infeasible", *ends) == []
    assert len(refusal_errors(weak, "unreachable-pose", *ends)) == 1


def test_a_summary_has_only_the_kinds_of_tasks_that_were_solved(task: RequestTask) -> None:
    results = summary([Outcome(task, 200, wall=0.1, gap=0.05)])
    assert list(results["gaps"]) == list(results["wall"]) == [task.kind]
