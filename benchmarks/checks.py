"""Independent checks of the service's answers: certificate, start and goal, limits, energy,
baselines.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin

from benchmarks.motion import SplineMotion, worst_ratios
from benchmarks.tasks import flange
from joulepath.models.robot import Array, Limits, Robot
from joulepath.optimizer.problem.arm import LIMIT_NAMES, Arm, Payload
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.robots import load_robot

# the documentation of `POST /optimize` promises the first three constants
LARGEST_RATIO = 1 + 1e-6
"""Largest ratio of a quantity to its limit [1]."""
LARGEST_END_ERROR = 1e-6
"""Largest error of an end: position [m], orientation and joint positions [rad]."""
LARGEST_BALANCE_ERROR = 1e-3
"""Largest relative error of the energy balance [1]."""
SAME_DURATION = 1e-9
"""Relative difference below which two durations are equal [1]; rounding."""
ENERGY_SLACK = 1e-6
"""Relative difference of energy below which a baseline is no better [1]; quadrature error."""
RUCKIG_SLACK = 2e-5
"""ENERGY_SLACK for the motion of Ruckig [1]: its representation as a spline merges close jumps of
jerk, and is slower by up to this share."""
LIMITS = ("position", "velocity", "acceleration", "jerk", "torque")
PARTS = ("idle", "potential", "kinetic", "friction", "copper", "inverter", "braking", "recovered")


def balance_error(answer: dict[str, Any]) -> float:
    """|sum of the energy's parts - total| / |total|."""
    electrical = answer["energy"]["electrical"]
    return float(
        abs(sum(electrical[part] for part in PARTS) - electrical["total"])
        / abs(electrical["total"])
    )


def objective(answer: dict[str, Any]) -> float:
    """The energy of the objective [J]."""
    return float(answer["energy"][answer["objective"]]["total"])


def errors_found(
    body: dict[str, Any], answer: dict[str, Any], T_start: Array, T_goal: Array
) -> list[str]:
    """A message for every error in an answer; T_start and T_goal (4, 4) are the flange poses of the
    request.
    """
    return [
        *_certificate_errors(answer),
        *_replay_errors(body, answer, T_start, T_goal),
        *_energy_errors(body, answer),
    ]


def refusal_errors(robot: Robot, problem: str, q_start: Array, q_goal: Array) -> list[str]:
    """A message if the service refuses a request between two collision-free configurations (nq,)
    [rad] at which the motors can hold the arm without a payload.

    Pinocchio computes the torques of gravity.
    """
    data = robot.model.createData()
    held = [np.abs(pin.computeGeneralizedGravity(robot.model, data, q)) for q in (q_start, q_goal)]
    worst = float((np.max(held, axis=0) / robot.limits.tau_max).max())
    if problem == "torque-infeasible" and worst > 1:
        return []
    return [
        f"refused as {problem}, but both ends are free, and holding takes {worst:.0%} of the "
        "torque limits"
    ]


def _certificate_errors(answer: dict[str, Any]) -> Iterator[str]:
    certificate = answer["certificate"]
    for name in LIMITS:
        ratio = certificate["worst_ratio"][name]
        # these comparisons are written so that NaN is an error
        if ratio is None or not ratio <= LARGEST_RATIO:
            yield f"certificate: {name} ratio {ratio}"
    for end in ("start_error", "goal_error"):
        for part, error in certificate[end].items():
            if not error <= LARGEST_END_ERROR:
                yield f"certificate: {end} {part} {error}"
    for name in ("energy_error", "balance_error"):
        if not certificate[name] <= LARGEST_BALANCE_ERROR:
            yield f"certificate: {name} {certificate[name]}"


def _replay_errors(
    body: dict[str, Any], answer: dict[str, Any], T_start: Array, T_goal: Array
) -> Iterator[str]:
    """Checks the returned spline against the request, without the certificate."""
    robot = load_robot(answer["robot"])
    spline = answer["trajectory"]["spline"]
    points = np.array(spline["control_points"])
    motion = SplineMotion(np.array(spline["knots"]), points, spline["degree"])
    if abs(motion.duration - answer["duration"]) > SAME_DURATION * motion.duration:
        yield f"duration {answer['duration']} s, but the spline has {motion.duration} s"
    for name, q, T, asked in (
        ("start", points[0], T_start, body["start"]),
        ("goal", points[-1], T_goal, body["goal"]),
    ):
        reached = flange(robot, q)
        error = float(np.linalg.norm(reached[:3, 3] - T[:3, 3]))
        rotation = float(
            np.linalg.norm(pin.log3(np.ascontiguousarray(T[:3, :3].T @ reached[:3, :3])))
        )
        joints = float(np.abs(q - asked["q"]).max()) if "q" in asked else 0.0
        if not max(error, rotation, joints) <= LARGEST_END_ERROR:
            yield (
                f"replay: {name} is off by {error:.2g} m, {rotation:.2g} rad, joints by "
                f"{joints:.2g} rad"
            )
    for name, ratio in worst_ratios(problem_of(body), motion).items():
        if not ratio <= LARGEST_RATIO:
            yield f"replay: {name} ratio {ratio}"


def gap_of(gap: float | None) -> float:
    """An optimality gap; infinite without a positive lower bound."""
    return math.inf if gap is None else gap


def _energy_errors(body: dict[str, Any], answer: dict[str, Any]) -> Iterator[str]:
    error, energy = balance_error(answer), answer["energy"]
    if not error <= LARGEST_BALANCE_ERROR:
        yield f"energy balance is off by {error:.2g} of the total"
    total, bound, gap = objective(answer), energy["lower_bound"], energy["optimality_gap"]
    if not bound <= total * (1 + ENERGY_SLACK):
        yield f"lower bound {bound} above the energy {total}"
    expected = total / bound - 1 if bound > 0 else None
    if gap != expected and not abs(gap_of(gap) - gap_of(expected)) <= 1e-6:
        yield f"optimality gap {gap} is not {total} / {bound} - 1"
    for baseline in answer["baselines"]:
        if beats(body, answer, baseline):
            less = 1 - baseline[answer["objective"]] / total
            yield f"{baseline['name']} is within limits and needs {less:.3%} less energy"


def beats(body: dict[str, Any], answer: dict[str, Any], baseline: dict[str, Any]) -> bool:
    """Whether a baseline is within limits, has an allowed duration, and needs less energy than the
    answer."""
    if not baseline["within_limits"]:
        return False
    least, most = allowed(body.get("duration"))
    ours, theirs = answer["duration"], baseline["duration"]
    same = abs(theirs - ours) <= SAME_DURATION * ours
    if not same and not least * (1 - SAME_DURATION) <= theirs <= most * (1 + SAME_DURATION):
        return False
    total = objective(answer)
    slack = RUCKIG_SLACK if baseline["name"] == "ruckig" else ENERGY_SLACK
    return bool(baseline[answer["objective"]] < total - slack * abs(total))


def allowed(duration: Any) -> tuple[float, float]:
    """Shortest and longest duration that a request allows [s]."""
    if duration is None:
        return 0.0, np.inf
    if isinstance(duration, dict):
        return duration.get("min") or 0.0, duration.get("max") or np.inf
    return duration, duration


def problem_of(body: dict[str, Any]) -> Problem:
    """The problem of a request of `benchmarks.tasks`, with a rest position as start and goal."""
    robot = load_robot(body["robot"])
    given = body.get("limits", {})
    limits: Limits = robot.limits.tightened(
        **{name: np.array(given[public]) for public, name in LIMIT_NAMES.items() if public in given}
    )
    load = body.get("payload")
    rest = np.clip(np.zeros(robot.nq), limits.q_min, limits.q_max)
    return Problem(
        arm=Arm(
            robot=robot,
            payload=Payload(load["mass"], np.array(load["com"])) if load else Payload(),
            gravity=np.array(body.get("gravity", [0.0, 0.0, -9.81])),
            limits=limits,
        ),
        start=rest,
        goal=rest,
    )
