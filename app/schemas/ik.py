"""What `POST /ik` takes and answers."""

from __future__ import annotations

from joulepath.app.schemas.common import Answer, BasePose, Response, described, part
from joulepath.app.schemas.examples.values import BOX, HOME, LABEL
from joulepath.app.schemas.scene import CarriedBody, CellRequest
from joulepath.app.schemas.wording import BODIES
from joulepath.optimizer.problem.problem import LONGEST_DURATION


class IKRequest(CellRequest):
    """A pose of the TCP."""

    pose: BasePose = described(
        "Pose of the TCP in the robot's base frame, or in its `frame`.",
        None,
        {"position": [0.4, -0.2, 0.3], "quaternion": [0, 1, 0, 0]},
    )
    windings: bool = described(
        "Whether to return all full-turn alternatives q + 2πk within the joint range. If false: one solution per "
        "branch, the one nearest to zero.",
        None,
        True,
        default=True,
    )
    payload: CarriedBody | None = described(
        "Payload at the flange, for collision checking. Null: no payload.",
        None,
        {"shape": BOX},
        default=None,
    )
    deadline: float = described(
        "Wall time from the arrival of the request, including the wait for a worker.",
        "s",
        10.0,
        default=10.0,
        ge=1e-3,
        le=LONGEST_DURATION,
    )


class ClosestPair(Response):
    """Two bodies and the distance between them."""

    pair: list[str] = described(BODIES, None, ["table", "forearm"])
    distance: float = described(
        "Distance between the two bodies minus the obstacle's `margin`; if negative, the two bodies are too close or "
        "overlap.",
        "m",
        0.12,
    )


class IKSolution(Response):
    """One arm configuration that reaches the pose."""

    q: list[float] = described("Joint positions.", "rad", HOME)
    label: str = described(
        "Branch: shoulder/elbow/wrist, or its number for an arm whose branches have no names. Full turns of a joint do "
        "not change it.",
        None,
        LABEL,
    )
    limit_distance: float = described("Smallest distance of a joint from an end of its range.", "rad", 1.57)
    smallest_singular_value: float = described(
        "Smallest singular value of the Jacobian in metres and radians; near zero, the configuration is nearly "
        "singular.",
        "1",
        0.12,
    )
    singular: list[str] = described(
        "Parts of the branch that are singular here: the configuration is on both branches of such a part.",
        None,
        ["wrist"],
    )
    free: list[str] = described(
        "Joints that can move together while the TCP keeps its pose; empty if the configuration is isolated. Then "
        "infinitely many configurations reach the pose, and `solutions` has some of them, evenly spread.",
        None,
        ["shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_3_joint"],
    )
    collides: bool = described("Whether `nearest.distance` is negative.", None, False)
    nearest: ClosestPair | None = part(
        "The two bodies with the smallest clearance. Null if the arm has no shapes to compare."
    )


class IKResponse(Answer):
    """All arm configurations within the joint range that reach the pose."""

    solutions: list[IKSolution] = part("One entry per configuration.")
    complete: bool = described(
        "Whether every branch is among them. False for an arm whose inverse kinematics is not proven to find all: some "
        "may be missing.",
        None,
        True,
    )
