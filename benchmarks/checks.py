"""What an answer of the service must hold, looked at from outside: certificate, ends, limits, energy, baselines."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin

from benchmarks.motion import SplineMotion, limit_shares
from benchmarks.tasks import flange
from models.registry import load_robot
from models.robot import Array, Limits
from optimizer.problem.arm import LIMIT_NAMES, Arm, Payload
from optimizer.problem.problem import Problem

# as the contract has them
RATIO, REACH, BALANCE = 1 + 1e-6, 1e-6, 1e-3
# two durations are the same within this share; a baseline is better only beyond what quadrature leaves open
SAME, SLACK = 1e-9, 1e-6
LIMITS = ("position", "velocity", "acceleration", "jerk", "torque")
PARTS = ("idle", "potential", "kinetic", "friction", "copper", "inverter", "braking", "recovered")


def identity_error(answer: dict[str, Any]) -> float:
    """Sum of the energy's parts against its total, relative."""
    electrical = answer["energy"]["electrical"]
    return float(abs(sum(electrical[part] for part in PARTS) - electrical["total"]) / abs(electrical["total"]))


def objective(answer: dict[str, Any]) -> float:
    """The energy that was minimised [J]."""
    return float(answer["energy"][answer["objective"]]["total"])


def faults(body: dict[str, Any], answer: dict[str, Any], T_start: Array, T_goal: Array) -> list[str]:
    """Everything wrong with an answer, in words; T_start, T_goal (4, 4) are the flange poses asked for."""
    return [*_certificate_faults(answer), *_replay_faults(body, answer, T_start, T_goal), *_energy_faults(body, answer)]


def _certificate_faults(answer: dict[str, Any]) -> Iterator[str]:
    certificate = answer["certificate"]
    for name in LIMITS:
        ratio = certificate["worst_ratio"][name]
        # written so that NaN, here and below, is a fault
        if ratio is None or not ratio <= RATIO:
            yield f"certificate: {name} ratio {ratio}"
    for end in ("start_error", "goal_error"):
        for part, error in certificate[end].items():
            if not error <= REACH:
                yield f"certificate: {end} {part} {error}"
    for name in ("energy_error", "balance_error"):
        if not certificate[name] <= BALANCE:
            yield f"certificate: {name} {certificate[name]}"


def _replay_faults(body: dict[str, Any], answer: dict[str, Any], T_start: Array, T_goal: Array) -> Iterator[str]:
    """The returned spline against the request, without a look at the certificate."""
    robot = load_robot(answer["robot"])
    spline = answer["trajectory"]["spline"]
    points = np.array(spline["control_points"])
    motion = SplineMotion(np.array(spline["knots"]), points, spline["degree"])
    if abs(motion.duration - answer["duration"]) > SAME * motion.duration:
        yield f"the spline lasts {motion.duration}, the answer says {answer['duration']}"
    for name, q, T, asked in (
        ("start", points[0], T_start, body["start"]),
        ("goal", points[-1], T_goal, body["goal"]),
    ):
        reached = flange(robot, q)
        error = float(np.linalg.norm(reached[:3, 3] - T[:3, 3]))
        turn = float(np.linalg.norm(pin.log3(np.ascontiguousarray(T[:3, :3].T @ reached[:3, :3]))))
        joints = float(np.abs(q - asked["q"]).max()) if "q" in asked else 0.0
        if not max(error, turn, joints) <= REACH:
            yield f"replay: {name} is {error:.2g} m, {turn:.2g} rad, joints {joints:.2g} rad off"
    for name, share in limit_shares(problem_of(body), motion).items():
        if not share <= RATIO:
            yield f"replay: {name} ratio {share}"


def _energy_faults(body: dict[str, Any], answer: dict[str, Any]) -> Iterator[str]:
    error, energy = identity_error(answer), answer["energy"]
    if not error <= BALANCE:
        yield f"energy identity off by {error:.2g}"
    total, bound, gap = objective(answer), energy["lower_bound"], energy["optimality_gap"]
    if not bound <= total * (1 + SLACK):
        yield f"lower bound {bound} above the energy {total}"
    if not abs(gap - (1 - bound / total)) <= 1e-6:
        yield f"optimality gap {gap} is not 1 - {bound} / {total}"
    for baseline in answer["baselines"]:
        if beats(body, answer, baseline):
            yield f"{baseline['name']} is within limits and spends {-baseline['saving']:.3%} less"


def beats(body: dict[str, Any], answer: dict[str, Any], baseline: dict[str, Any]) -> bool:
    """Whether a baseline is within limits, takes a duration that the request allows, and spends less than ours."""
    if not baseline["within_limits"]:
        return False
    least, most = allowed(body.get("duration"))
    ours, theirs = answer["duration"], baseline["duration"]
    same = abs(theirs - ours) <= SAME * ours
    if not same and not least * (1 - SAME) <= theirs <= most * (1 + SAME):
        return False
    total = objective(answer)
    return bool(baseline[answer["objective"]] < total - SLACK * abs(total))


def allowed(duration: Any) -> tuple[float, float]:
    """Least and most that a request lets a motion take [s]."""
    if duration is None:
        return 0.0, np.inf
    if isinstance(duration, dict):
        return duration.get("min") or 0.0, duration.get("max") or np.inf
    return duration, duration


def problem_of(body: dict[str, Any]) -> Problem:
    """What a request of `benchmarks.tasks` asks, but for its targets."""
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
