"""Warnings of answers."""

from __future__ import annotations

from joulepath.optimizer.collision.close_pass import CLOSE_PASS
from joulepath.optimizer.collision.stand_ins import StandInSettings
from joulepath.optimizer.evaluate.evaluation import Evaluation
from joulepath.optimizer.problem.arm import PAYLOAD, TOOL
from joulepath.optimizer.replay.outcome import Outcome
from joulepath.optimizer.replay.planned import PlannedMotion
from joulepath.optimizer.replay.replay_result import Replay
from joulepath.optimizer.replay.shapes import unsimulated
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.result.solution import Solution

ADVICE = "Make sure that the arm and its cell are known with this accuracy, or give a margin."


LITTLE_LEFT = 0.9
"""Share of a torque limit above which a motion leaves too little reserve for a controller."""
MISSED = (
    "The inverse kinematics of this arm may have missed arm configurations: the answer is the best "
    "of those found, its status is not `optimal`, and its lower bound covers those that may be "
    "missing."
)
DIVIDED = (
    "{} is where the path is divided, at {:.1%} of its length, because no arm configuration "
    "follows the whole path. `status` and `lower_bound` are for this division."
)
STAND_INS = {
    TOOL: f"a rod of {1e3 * StandInSettings.tool_radius:g} mm radius from the flange to the TCP",
    PAYLOAD: f"a ball of its mass at {StandInSettings.payload_density:g} kg/m³ about its centre of "
    "mass",
}
"""Descriptions of the stand-ins for bodies without a shape."""
SHAPES = {TOOL: "tool.capsules", PAYLOAD: "payload.shape"}
AT_EDGE = "The best place is at an end of the range of {}: a wider region may have a better one."
JOINT_POSITIONS = (
    "These stops are given by joint positions, which stay the same wherever the base is: {}."
)
NO_DEFAULT_MOTION = (
    "No default motion of the robot's controller is known: `controller_default` is left out."
)


def certified_warnings(solution: Solution) -> list[str]:
    """The warnings of a certified motion."""
    found = [] if solution.complete else [MISSED]
    if all(baseline.name != "controller_default" for baseline in solution.baselines):
        found.append(NO_DEFAULT_MOTION)
    close_pass = solution.certificate.close_pass
    if close_pass is not None:
        proven = f"proven: at least {_mm(max(close_pass.min_clearance, 0.0))} mm"
        found.append(_close(close_pass.pair, close_pass.sampled, close_pass.time, f" ({proven})"))
    return found + [_unmodelled(contact) for contact in solution.unmodelled]


def sampled_warnings(result: Evaluation) -> list[str]:
    """The warnings of a motion with sampled distances."""
    close = result.close_pass
    found = [] if close is None else [_close(close.pair, close.distance, close.time, "")]
    return found + [_unmodelled(contact) for contact in result.unmodelled]


def replay_warnings(planned: PlannedMotion, found: Replay) -> list[str]:
    """The warnings of a replayed motion."""
    arm = planned.arm
    said = [
        f"{name} has many parts and is not simulated: contacts with it are not found. The "
        "certificate includes it."
        for name in unsimulated(arm)
    ]
    for run in found.runs:
        said += _of_run(f"Under {run.control}", planned, found, run)
    for change in found.changes:
        said += _of_run(f"With {change.quantity} times {change.factor:.4g}", planned, found, change)
    return said


def _of_run(what: str, planned: PlannedMotion, found: Replay, run: Outcome) -> list[str]:
    said = []
    for joint, time, ratio in zip(
        planned.arm.robot.joint_names, run.saturated, found.planned.limit_ratio, strict=True
    ):
        if time > 0:
            advice = ": plan with a tighter limits.torque." if ratio > LITTLE_LEFT else "."
            said.append(
                f"{what}, {joint} asks for more than its torque limit for {time:.4g} s. It is "
                f"planned at {ratio:.1%} of this limit{advice}"
            )
    if run.collides and run.contact is not None:
        first, second = run.contact.pair
        said.append(
            f"{what}, {first} and {second} touch: {_mm(run.contact.depth)} mm deep at "
            f"{run.contact.time:.3f} s."
        )
    return said


def _close(pair: tuple[str, str], distance: float, time: float, proven: str) -> str:
    first, second = pair
    # the proven distance may be below CLOSE_PASS.distance, and the sampled one a little above it
    how = f"{_mm(distance)} mm apart" if distance > 0 else f"overlapping by {_mm(-distance)} mm"
    return (
        f"Closer than {CLOSE_PASS.distance * 1e3:g} mm: {first} and {second} are {how} "
        f"at {time:.3f} s{proven}. {ADVICE}"
    )


def _unmodelled(contact: Clearance) -> str:
    obstacle, carried = contact.pair
    return (
        f"The {carried} has no shape, so it is not kept away from obstacles: "
        f"{STAND_INS[carried]} would be {-1e3 * contact.sampled:.0f} mm deep in {obstacle} at "
        f"{contact.time:.3f} s. Give its shape in `{SHAPES[carried]}`."
    )


def _mm(distance: float) -> str:
    return f"{distance * 1e3:.2f}"
