"""Suggestions for the next iteration: requests with one difference from an iteration.

This module only makes the requests. The optimiser computes their energies.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import radians
from typing import Any, Literal

import numpy as np

from joulepath.app.convert.arm import inertia_row, to_arm, to_payload
from joulepath.app.schemas.arm import ArmRequest, Payload
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.reach import POSE_FREEDOMS
from joulepath.optimizer.kinematics.tcp import rotated_poses
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.problem import DURATIONS

Step = Literal["method", "branch", "orientation", "duration", "payload"]
Fields = dict[str, Any]

_TOOL_AXIS = [0.0, 0.0, 1.0]
"""Axis of the tool in the TCP frame."""
_TILTS = [sign * radians(10.0) * axis for axis in np.eye(3)[:2] for sign in (1, -1)]
"""Tilts of the tool: rotation vectors [rad]."""


@dataclass(frozen=True)
class SuggestionSettings:
    """Settings of suggestions."""

    longer: float = 1.25
    """Factor of a longer duration."""
    nearer: float = 0.5
    """Factor of the distance between flange and centre of mass."""
    other_branches: int = 2
    """Most suggested branches."""


SUGGESTIONS = SuggestionSettings()


@dataclass(frozen=True)
class Proposal:
    """A suggestion without a computed energy; `request` is a body of `POST /optimize`."""

    step: Step
    summary: str
    request: Fields


@dataclass(frozen=True)
class Base:
    """The iteration behind the suggestions.

    `request` is a body of `POST /optimize`, `q_goal` the goal configuration of its motion [rad],
    `duration` [s] the duration of the motion. `candidates` are the candidates of its answer; empty
    for an evaluated motion.
    """

    request: Fields
    q_goal: list[float]
    duration: float
    optimized: bool
    candidates: list[Fields]


def base_of(kind: str, request: Fields, answer: Fields, objective: str) -> Base | None:
    """The base from the request and the answer of an iteration.

    None if an evaluated motion passes further configurations, or ends at its start.
    """
    if kind == "optimize":
        return Base(
            request, answer["branch"]["goal"]["q"], answer["duration"], True, answer["candidates"]
        )
    given = request.get("trajectory") or {}
    q = given.get("q") or request["configurations"]
    if ("configurations" in request and len(q) > 2) or np.allclose(q[0], q[-1], rtol=0, atol=1e-6):
        return None
    arm = {name: value for name, value in request.items() if name in ArmRequest.model_fields}
    ends: Fields = {"start": {"q": q[0]}, "goal": {"q": q[-1]}, "objective": objective}
    if objective == "mechanical":
        ends["duration"] = answer["duration"]
    return Base(arm | ends, q[-1], answer["duration"], False, [])


def proposals(base: Base) -> list[Proposal]:
    """All suggestions for the base in the order of computation, usually largest savings first."""
    arm = to_arm(OptimizeRequest.model_validate(base.request))
    takes_poses = inverse_kinematics_for(arm.robot) is not None
    here, *tilted = _poses(arm, base.q_goal, [np.zeros(3), *_TILTS])
    pose = [_same_pose(base, here)] if takes_poses and "q" in base.request["goal"] else []
    # with fewer joints, hardly another orientation can be held
    turns = takes_poses and arm.robot.nq >= POSE_FREEDOMS
    turned = _orientation(base, here, tilted) if turns else ()
    return [*_method(base), *_duration(base), *pose, *_branch(base), *turned, *_payload(base)]


def _method(base: Base) -> Iterator[Proposal]:
    if not base.optimized:
        yield Proposal("method", "Optimise between the same joint positions.", base.request)
        yield Proposal(
            "method",
            "Optimise between the same joint positions in the same time.",
            _timed(base, base.duration),
        )
    elif base.request.get("method", "bspline") != "bspline":
        yield Proposal("method", "Optimise a free B-spline.", base.request | {"method": "bspline"})


def _duration(base: Base) -> Iterator[Proposal]:
    if base.request.get("duration") is not None and base.request["objective"] == "electrical":
        yield Proposal("duration", "Let the optimiser choose the duration.", _timed(base, None))
    for factor, word in ((SUGGESTIONS.longer, "longer"), (1 / SUGGESTIONS.longer, "shorter")):
        duration = min(base.duration * factor, DURATIONS.longest)
        yield Proposal(
            "duration", f"Make the motion {abs(factor - 1):.0%} {word}.", _timed(base, duration)
        )


def _same_pose(base: Base, here: Fields) -> Proposal:
    request = _without(base.request, "branch", "windings") | {"goal": here}
    return Proposal(
        "branch", "Reach the same pose in the arm configuration of least energy.", request
    )


def _branch(base: Base) -> Iterator[Proposal]:
    if "q" not in base.request["goal"] and any(
        name in base.request for name in ("branch", "windings")
    ):
        yield Proposal(
            "branch",
            "Allow every arm configuration and all full-turn alternatives.",
            _without(base.request, "branch", "windings"),
        )
    seen = {
        _branch_name(candidate["goal"])
        for candidate in base.candidates
        if candidate["q_goal"] == base.q_goal
    }
    known = [
        candidate
        for candidate in base.candidates
        if candidate["status"] in ("solved", "pruned", "unvisited")
    ]
    known.sort(key=_least_energy)
    for candidate in known:
        name = _branch_name(candidate["goal"])
        if name not in seen and len(seen) <= SUGGESTIONS.other_branches:
            seen.add(name)
            request = _without(base.request, "branch") | {"goal": {"q": candidate["q_goal"]}}
            yield Proposal("branch", f"Reach the goal in the branch {name}.", request)


def _orientation(base: Base, here: Fields, tilted: list[Fields]) -> Iterator[Proposal]:
    """The goal's pose `here` with the tool free to rotate, and the poses `tilted` by `_TILTS`."""
    orientation = {"free_about": _TOOL_AXIS, "quaternion": here["pose"]["quaternion"]}
    yield Proposal(
        "orientation",
        "Let the tool rotate freely about its z axis at the goal.",
        base.request
        | {"goal": {"pose": {"position": here["pose"]["position"], "orientation": orientation}}},
    )
    yield Proposal(
        "orientation",
        "Tilt the tool by 10 degrees at the goal, about its x or y axis, in the direction that "
        "needs the least energy (four directions compared).",
        base.request | {"goal": {"any_of": tilted}},
    )


def _payload(base: Base) -> Iterator[Proposal]:
    payload = base.request.get("payload")
    if not payload or not payload["mass"]:
        return
    body = to_payload(Payload.model_validate(payload))
    if body.com.any():
        nearer = payload | {"com": (SUGGESTIONS.nearer * body.com).tolist()}
        if payload.get("com") is None:  # the inertia of the shape would be lost
            nearer["inertia"] = inertia_row(body)
        yield Proposal(
            "payload",
            "Grip the payload so that its centre of mass is at half its current distance from "
            "the flange.",
            base.request | {"payload": nearer},
        )


def _timed(base: Base, duration: float | None) -> Fields:
    return _without(base.request, "duration") | ({} if duration is None else {"duration": duration})


def _without(request: Fields, *names: str) -> Fields:
    return {name: value for name, value in request.items() if name not in names}


def _poses(arm: Arm, q: list[float], rotvecs: list[Array]) -> list[Fields]:
    poses = rotated_poses(arm, np.array(q), rotvecs)
    return [
        {"pose": {"position": at.tolist(), "quaternion": quaternion.tolist()}}
        for at, quaternion in poses
    ]


def _branch_name(label: str) -> str:
    """shoulder/elbow/wrist, without the full turns."""
    return "/".join(label.split("/")[:3])


def _least_energy(candidate: Fields) -> float:
    known = [candidate[name] for name in ("energy", "lower_bound") if candidate[name] is not None]
    return float(known[0]) if known else float("inf")
