"""Types of error about a motion, its targets, its limits or its robot. A docstring is the text of the type's page."""

from __future__ import annotations

from typing import Annotated, Literal

from joulepath.app.answers.declared import Shown
from joulepath.app.schemas.common import Response, described, part
from joulepath.app.schemas.errors.problem_details import ProblemDetails, fixed
from joulepath.app.schemas.examples.values import HOME, LABEL
from joulepath.app.schemas.wording import BODIES
from joulepath.optimizer.result.candidates import CandidateCounts, CandidateReport, UnreachableTarget


class UnknownRobot(ProblemDetails):
    """No robot has this name. Use one of the names in `known`, which `GET /robots` lists too."""

    type: Literal["/problems/unknown-robot"] = fixed("type", "/problems/unknown-robot")
    title: Literal["Unknown robot"] = fixed("title", "Unknown robot")
    status: Literal[404] = fixed("status", 404)
    known: list[str] = described(
        "Names of all robots; where a robot is deleted, of those that were added.", None, ["ur10e", "ur3e", "ur5e"]
    )


class NoMeshes(ProblemDetails):
    """The meshes of this robot are not installed, as `has_meshes` of `GET /robots/{name}` says. Those of ur3e and ur5e
    come with `pip install 'joulepath[meshes]'`. The capsules of `GET /robots/{name}` show every robot."""

    type: Literal["/problems/no-meshes"] = fixed("type", "/problems/no-meshes")
    title: Literal["No meshes"] = fixed("title", "No meshes")
    status: Literal[404] = fixed("status", 404)


class _TargetError(ProblemDetails):
    target: str = described(
        "Target at fault: `start`, `goal` (of `POST /ik`, too), or `stops/` and the name of a stop of `POST /cycle`.",
        None,
        "goal",
    )


class UnreachablePose(_TargetError):
    """No arm configuration within the joint range reaches the pose, or the requested `branch` does not reach it. Check
    that `position` is in metres and in the robot's base frame, and that `tcp` is right. Move the pose closer, or leave
    `branch` out."""

    type: Literal["/problems/unreachable-pose"] = fixed("type", "/problems/unreachable-pose")
    title: Literal["Unreachable pose"] = fixed("title", "Unreachable pose")
    status: Literal[422] = fixed("status", 422)
    distance: float | None = described(
        "Distance from the wrist centre of the pose to the nearest position that it can reach. Null if a joint range "
        "or `branch` is the cause.",
        "m",
        0.12,
    )


class SingularPose(_TargetError):
    """The arm reaches the pose only where it can turn about an axis of its own while the TCP stays, in a way that its
    inverse kinematics does not cover. Move the pose by a few millimetres, or give joint positions. Poses with a
    stretched elbow or wrist are answered."""

    type: Literal["/problems/singular-pose"] = fixed("type", "/problems/singular-pose")
    title: Literal["Singular pose"] = fixed("title", "Singular pose")
    status: Literal[422] = fixed("status", 422)
    smallest_singular_value: float = described(
        "Smallest singular value of the Jacobian in metres and radians, of the configuration that is least singular.",
        "1",
        1e-9,
    )


class UnreachableTargets(_TargetError):
    """The arm can reach no target of an `any_of`. For each target, `unreachable` gives the cause: the pose is out of
    reach or singular, or joint positions are outside their range. Correct at least one target."""

    type: Literal["/problems/unreachable-targets"] = fixed("type", "/problems/unreachable-targets")
    title: Literal["No reachable target"] = fixed("title", "No reachable target")
    status: Literal[422] = fixed("status", 422)
    unreachable: list[Annotated[UnreachableTarget, Shown]] = part("All targets of the `any_of`, each with the cause.")


class OutsideLimits(ProblemDetails):
    """A joint position at the start or the goal is outside the joint range: that of the robot, or the narrower one of
    `limits.position`. Give a value between `lower` and `upper`."""

    type: Literal["/problems/outside-limits"] = fixed("type", "/problems/outside-limits")
    title: Literal["Joint position outside its limits"] = fixed("title", "Joint position outside its limits")
    status: Literal[422] = fixed("status", 422)
    joint: str = described("Name of the joint.", None, "elbow_joint")
    value: float = described("Joint position in the request.", "rad", 3.5)
    lower: float = described("Smallest allowed joint position.", "rad", -3.1416)
    upper: float = described("Largest allowed joint position.", "rad", 3.1416)


class ContradictoryOrder(ProblemDetails):
    """No order of the stops meets `before` and `together`. Leave out a pair of `before`, or a list of `together`, that
    has the stops `names`."""

    type: Literal["/problems/contradictory-order"] = fixed("type", "/problems/contradictory-order")
    title: Literal["Contradictory order"] = fixed("title", "Contradictory order")
    status: Literal[422] = fixed("status", 422)
    names: list[str] = described(
        "Stops that contradict each other: each would have to come before the next one, and the last before the first.",
        None,
        ["pick", "place"],
    )


class InvalidTable(ProblemDetails):
    """The samples of a given motion or of a log cannot be read. Possible causes: a value is no finite number, or looks
    like degrees; the times do not increase; a line has too few or too many columns; the header is missing or unknown;
    the file is no CSV. Correct the place that `row` and `column` name."""

    type: Literal["/problems/invalid-table"] = fixed("type", "/problems/invalid-table")
    title: Literal["Invalid table"] = fixed("title", "Invalid table")
    status: Literal[422] = fixed("status", 422)
    row: int | None = described(
        "CSV: number of the line; the header is line 1. JSON: index into the list, from 0. Null if no single row is at "
        "fault.",
        "1",
        17,
    )
    column: str | None = described(
        "Name of the column, as in the header of a CSV file. Null if no single column is at fault.", None, "q3"
    )


_DEPTH = "Missing clearance: if the two bodies were this much farther apart, the pair would be allowed."


class CollidingBranch(Response):
    """An arm configuration that collides."""

    label: str = described("Branch: shoulder/elbow/wrist.", None, LABEL)
    target: int = described("Index in `any_of` of the target that it reaches, from 0; 0 for a single target.", None, 0)
    q: list[float] = described("Joint positions.", "rad", HOME)
    pair: list[str] = described(BODIES, None, ["table", "forearm"])
    depth: float = described(_DEPTH, "m", 0.031)


class _InCollision(ProblemDetails):
    pair: list[str] = described(
        f"{BODIES} They belong to the configuration with the smallest `depth`.", None, ["table", "forearm"]
    )
    depth: float = described(f"{_DEPTH} The smallest of all configurations.", "m", 0.031)
    branches: list[CollidingBranch] = part("Arm configurations that collide, smallest `depth` first; at most 64.")


class StartInCollision(_InCollision):
    """Every arm configuration at the start is invalid, at least one because it collides: the arm, its tool or its
    payload touches a link or an obstacle, or is closer to an obstacle than its `margin`. Move the start or the
    obstacle. If the shapes are too coarse, set `collisions` to false."""

    type: Literal["/problems/start-in-collision"] = fixed("type", "/problems/start-in-collision")
    title: Literal["Start in collision"] = fixed("title", "Start in collision")
    status: Literal[422] = fixed("status", 422)


class GoalInCollision(_InCollision):
    """Every arm configuration at the goal is invalid, at least one because it collides: the arm, its tool or its
    payload touches a link or an obstacle, or is closer to an obstacle than its `margin`. Move the goal or the obstacle.
    If the shapes are too coarse, set `collisions` to false."""

    type: Literal["/problems/goal-in-collision"] = fixed("type", "/problems/goal-in-collision")
    title: Literal["Goal in collision"] = fixed("title", "Goal in collision")
    status: Literal[422] = fixed("status", 422)


class StopInCollision(_InCollision):
    """Every arm configuration at a stop of a cycle is invalid, at least one because it collides: the arm, its tool or
    its payload touches a link or an obstacle, or is closer to an obstacle than its `margin`. The arm must be able to
    come with what it carries to the stop, and to leave with what it carries from there. Move the stop or the obstacle.
    If the shapes are too coarse, set `collisions` to false."""

    type: Literal["/problems/stop-in-collision"] = fixed("type", "/problems/stop-in-collision")
    title: Literal["Stop in collision"] = fixed("title", "Stop in collision")
    status: Literal[422] = fixed("status", 422)
    target: str = described("`stops/` and the name of the stop.", None, "stops/pick")


class NoSequence(ProblemDetails):
    """Every stop of the cycle can be reached, but no chain of motions within the limits was found through all of them.
    Move `stop` or the stop before it, relax a limit, leave `branch` out or set `windings` to true."""

    type: Literal["/problems/no-sequence"] = fixed("type", "/problems/no-sequence")
    title: Literal["No sequence of arm configurations"] = fixed("title", "No sequence of arm configurations")
    status: Literal[422] = fixed("status", 422)
    stop: str = described(
        "The first stop to which no motion was found: `start`, or `stops/` and a name.", None, "stops/place"
    )
    reached: list[str] = described("Branches at the stop before it to which motions lead.", None, [LABEL])
    open: list[str] = described("Branches of this stop.", None, [LABEL])


class PathAttempt(Response):
    """How far the path can be followed from one arm configuration."""

    label: str = described("Branch: shoulder/elbow/wrist.", None, LABEL)
    followed: float = described("Share of the path that is followed; of a line, from the stop.", "1", 0.62)
    reason: Literal["unreachable", "singular", "outside_limits", "in_collision", "other_goal", "other_line"] = (
        described(
            "What ends it: the next pose is out of reach; a joint would have to jump, at a singularity; a joint leaves "
            "its range; the arm collides at the end; the path ends at other joint positions than those of `goal`; "
            "another line or the path of the stop cannot be followed.",
            None,
            "outside_limits",
        )
    )


class PathInfeasible(ProblemDetails):
    """From no arm configuration can the tool follow a path, or a line of a stop, to its end. Move it, widen
    `limits.position`, or ask `POST /cycle` to divide it: a stop's `path` with `split`."""

    type: Literal["/problems/path-infeasible"] = fixed("type", "/problems/path-infeasible")
    title: Literal["Path infeasible"] = fixed("title", "Path infeasible")
    status: Literal[422] = fixed("status", 422)
    path: str = described(
        "`path`; or `stops/` and the name of the stop whose path it is, or with its line.", None, "stops/pick/approach"
    )
    length: float = described("Length of the path; a radian of turning counts as a quarter of a metre.", "m", 0.08)
    attempts: list[PathAttempt] = part("Arm configurations at the start, the one that gets farthest first; at most 64.")


class DwellTooShort(ProblemDetails):
    """No cycle was found that is as fast as `time` asks for: the fastest one found takes `shortest`. Allow at least as
    much."""

    type: Literal["/problems/dwell-too-short"] = fixed("type", "/problems/dwell-too-short")
    title: Literal["Cycle too short"] = fixed("title", "Cycle too short")
    status: Literal[422] = fixed("status", 422)
    shortest: float = described("Duration of the fastest cycle found.", "s", 5.55)
    dwells: float = described("Time of it that the arm dwells.", "s", 0.9)


class DurationTooShort(ProblemDetails):
    """No motion within the limits was found for the largest allowed duration: `duration`, its `max`, or the time of the
    `cycle`. Allow at least `shortest`, for which there is a certified motion, or let the optimiser choose the duration.
    """

    type: Literal["/problems/duration-too-short"] = fixed("type", "/problems/duration-too-short")
    title: Literal["Duration too short"] = fixed("title", "Duration too short")
    status: Literal[422] = fixed("status", 422)
    shortest: float | None = described(
        "Duration of the fastest motion found, a certified one. Null if none was found in any duration.", "s", 0.83
    )
    bound: float = described(
        "No motion takes less: the joints need so long within their limits. 0 where this is not known.", "s", 0.8298
    )
    proven: bool = described("Whether no motion is faster than `shortest` by more than 0.1 %.", None, True)
    cut_short: bool = described("The deadline ended the search: a longer one may find a faster motion.", None, False)


class TorqueInfeasible(ProblemDetails):
    """A joint cannot hold the load at standstill, in any arm configuration at the start or at the goal that is
    otherwise valid. The torque during the motion is not part of this check. Reduce the payload, move its centre of mass
    closer to the flange, or widen `limits.torque` if the request sets it."""

    type: Literal["/problems/torque-infeasible"] = fixed("type", "/problems/torque-infeasible")
    title: Literal["Not enough torque"] = fixed("title", "Not enough torque")
    status: Literal[422] = fixed("status", 422)
    joint: str = described("Name of the joint.", None, "shoulder_lift_joint")
    needed: float = described(
        "Absolute torque that holds the load, in the configuration with the smallest ratio to `available`.",
        "N·m",
        171.0,
    )
    available: float = described("Torque limit of the joint.", "N·m", 150.0)


class _SearchError(ProblemDetails):
    candidates: list[Annotated[CandidateReport, Shown]] = part(
        "Candidates with their status and their reason: those that failed first, at most 64."
    )
    candidate_counts: Annotated[CandidateCounts, Shown] = part("Number of all candidates by status.")


class NoTrajectory(_SearchError):
    """No candidate has a motion within the limits; the `reason` of each candidate gives the cause. Widen a limit, allow
    a longer duration, or leave `branch` out."""

    type: Literal["/problems/no-trajectory"] = fixed("type", "/problems/no-trajectory")
    title: Literal["No trajectory found"] = fixed("title", "No trajectory found")
    status: Literal[422] = fixed("status", 422)


class NoCollisionFreeTrajectory(_SearchError):
    """No collision-free motion was found, from several initial guesses. This does not prove that none exists. `pair`
    names the two bodies that collide: move the obstacle among them, move the start or the goal, leave `branch` out, or
    split the motion in two."""

    type: Literal["/problems/no-collision-free-trajectory"] = fixed("type", "/problems/no-collision-free-trajectory")
    title: Literal["No collision-free trajectory found"] = fixed("title", "No collision-free trajectory found")
    status: Literal[422] = fixed("status", 422)
    pair: list[str] = described(
        f"{BODIES} They belong to the attempt with the smallest `depth`.", None, ["table", "forearm"]
    )
    depth: float = described(_DEPTH, "m", 0.031)
    time: float = described("Time of the collision, from the start of this attempt.", "s", 0.62)
    start: str = described("Branch at the start of this attempt.", None, LABEL)
    goal: str = described("Branch at the goal of this attempt.", None, LABEL)
    cut_short: bool = described(
        "Whether the deadline ended the search for a collision-free path. If so, allow a longer deadline.", None, False
    )


class DeadlineExceeded(_SearchError):
    """The deadline passed before any motion was certified. The wait for a free worker counts. Allow a longer
    `deadline`, or try again when the service is less busy."""

    type: Literal["/problems/deadline-exceeded"] = fixed("type", "/problems/deadline-exceeded")
    title: Literal["Deadline exceeded"] = fixed("title", "Deadline exceeded")
    status: Literal[504] = fixed("status", 504)


class NotCertified(ProblemDetails):
    """The motion of an answer that is to be exported failed its certificate, which is computed again: it exceeds a
    limit of the arm, touches something, does not stand still at its ends, or its samples are not those of its spline
    on this arm. Export the answer as the service gave it, with the arm that it was computed for. If the robot's figures
    have changed since, optimise again. A motion that `POST /evaluate` finds beyond a limit cannot be exported."""

    type: Literal["/problems/not-certified"] = fixed("type", "/problems/not-certified")
    title: Literal["Motion not certified"] = fixed("title", "Motion not certified")
    status: Literal[422] = fixed("status", 422)
    move: int = described("Index of the move, from 0; 0 for an answer that is one move.", None, 0)
    worst_ratio: dict[str, float] = described(
        "Largest value / limit, for each limit where it is finite; empty if the certificate was not reached.",
        "1",
        {"velocity": 1.31},
    )


class FormatUnsuitable(ProblemDetails):
    """The motion cannot be written in this format: the robot has another number of joints or another maker's
    controller, or the file would be too large. `detail` says which formats or options remain."""

    type: Literal["/problems/format-unsuitable"] = fixed("type", "/problems/format-unsuitable")
    title: Literal["Format unsuitable"] = fixed("title", "Format unsuitable")
    status: Literal[422] = fixed("status", 422)
    format: str = described("The format.", None, "urscript")
