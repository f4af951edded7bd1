"""What `POST /optimize` answers. `joulepath.app.convert` builds answers without these models, for speed; tests check
that both
agree."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from joulepath.app.schemas.common import MotionAnswer, Response, described, part
from joulepath.app.schemas.energy import Joints, MotionEnergy, SavingInterval
from joulepath.app.schemas.examples.values import ANSWER_PATH, HOME, LABEL, STANDING_STILL
from joulepath.app.schemas.limits_in_force import LimitsInForce
from joulepath.optimizer.collision.close_pass import CLOSE
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.solution import Objective

Samples = list[float]
JointSamples = list[Joints]
Label = str

BODIES = "Names of the two bodies: links, `tool`, `payload` or obstacles."
LOWER_BOUND = (
    "Lower bound of the objective: no motion of any shape and any allowed duration between these targets needs less."
)
GAP = "1 - lower_bound / energy of the objective; 0 if this energy is not positive."
WARNINGS = (
    "Remarks on the motion, in words; empty if there are none. If two bodies come closer than "
    f"{CLOSE * 1e3:g} mm, one names them, their distance without margins, and the time. Others say that arm "
    "configurations may have been missed, that a baseline is left out, or what a tool or payload without a shape would "
    "touch."
)
OBJECTIVE = "Energy that was minimised: electrical energy drawn from the supply, or mechanical work."


class Configuration(Response):
    """One arm configuration."""

    label: Label = described("Branch: shoulder/elbow/wrist. Full turns of a joint do not change it.", None, LABEL)
    q: Joints = described("Joint positions.", "rad", HOME)
    target: int = described("Index in `any_of` of the target that it reaches, from 0; 0 for a single target.", None, 0)


class Branches(Response):
    """The chosen pair of arm configurations."""

    start: Configuration = part("At the start.")
    goal: Configuration = part("At the goal.")


class Spline(Response):
    """Clamped B-spline of the joint positions over time."""

    degree: int = described("Degree.", "1", 5)
    knots: list[float] = described("Knots.", "s", [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.9, 1.8, 1.8, 1.8, 1.8, 1.8, 1.8])
    control_points: JointSamples = described("Control points, [point][joint].", "rad", [HOME, HOME])


class SampledMotion(Response):
    """Samples of a motion; arrays are [sample][joint]."""

    t: Samples = described("Time of each sample, from the start of the motion.", "s", [0.0, 0.008, 0.016])
    q: JointSamples = described("Joint positions.", "rad", [HOME])
    v: JointSamples = described("Joint velocities.", "rad/s", [STANDING_STILL])
    a: JointSamples = described("Joint accelerations.", "rad/s²", [STANDING_STILL])
    tau: JointSamples = described(
        "Joint torque of rigid body and rotor, without friction.", "N·m", [[0.0, -38.1, -16.4, -1.2, 0.0, 0.0]]
    )
    tau_motor: JointSamples = described(
        "Motor torque at the joint: `tau` and friction.", "N·m", [[0.0, -38.1, -16.4, -1.2, 0.0, 0.0]]
    )
    power: Samples = described("Power drawn from the supply.", "W", [42.5, 43.1, 45.0])
    charge: Samples | None = described(
        "Charge of the energy storage on the bus; null without one.", "J", [0.0, 2.1, 5.3]
    )


class Trajectory(SampledMotion):
    """The motion: its spline, and samples of it; arrays are [sample][joint]."""

    spline: Spline = part("The motion itself; all samples follow from it.")


class Energy(MotionEnergy):
    """Energy and power of the motion, and what other motions could save."""

    lower_bound: float = described(LOWER_BOUND, "J", 139.9)
    optimality_gap: float = described(GAP, "1", 0.082)


class Baseline(Response):
    """The energy of another planner's motion from the same start to the nearest goal configuration."""

    name: Literal["trapezoid", "quintic", "ruckig", "ruckig_slowed", "controller_default"] = described(
        "`trapezoid`: trapezoidal velocity, in the duration of the answer. `quintic`: polynomial of degree 5, in the "
        "duration of the answer. `ruckig`: time-optimal within the velocity, acceleration and jerk limits. "
        "`ruckig_slowed`: the same motion, uniformly slowed down to the duration of the answer. `controller_default`: "
        "the robot's own controller with its default speed and acceleration.",
        None,
        "controller_default",
    )
    duration: float = described("Duration of this motion.", "s", 2.4)
    electrical: float = described("Electrical energy of this motion, drawn from the supply.", "J", 190.2)
    mechanical: float = described("Mechanical work of this motion.", "J", 70.3)
    within_limits: bool = described(
        "Whether this motion is within every limit; collisions are checked at sample points.", None, True
    )
    reason: str | None = described(
        "What keeps this motion from being within every limit, in words: limits that it breaks, and two bodies that "
        "come closer than allowed, by how much. Null if nothing does.",
        None,
        "bin front and payload are 31 mm closer than allowed",
    )
    saving: float = described("1 - energy of the answer / energy of this motion, of the objective.", "1", 0.199)
    saving_interval: SavingInterval | None = part(
        "How well the saving is known. Null for the objective `mechanical`, and in answers of an earlier version."
    )


class Candidate(Response):
    """One pair of a start and a goal configuration, and the result of the search for it."""

    start: Label = described("Branch at the start.", None, LABEL)
    start_target: int = described("Index in the `any_of` of the start, from 0; 0 for a single target.", None, 0)
    goal: Label = described("Branch at the goal.", None, "left/down/flip")
    goal_target: int = described("Index in the `any_of` of the goal, from 0; 0 for a single target.", None, 0)
    q_start: Joints = described("Joint positions at the start.", "rad", HOME)
    q_goal: Joints = described("Joint positions at the goal.", "rad", HOME)
    status: Literal["solved", "pruned", "infeasible", "failed", "unvisited"] = described(
        "`solved`: a motion was found. `pruned`: ruled out by its lower bound or by its energy. `infeasible`: has no "
        "motion, at least none of this method. `failed`: no motion was found, but one may exist. `unvisited`: not "
        "solved.",
        None,
        "pruned",
    )
    reason: str = described(
        "Reason for the status, in words.", None, "its lower bound is not below the best energy found"
    )
    lower_bound: float | None = described(
        "Lower bound of the objective for this pair of configurations; null if no motion exists or none was computed.",
        "J",
        171.0,
    )
    energy: float | None = described("Energy of the motion found, of the objective; null if not solved.", "J", 180.5)
    duration: float | None = described("Duration of the motion found; null if not solved.", "s", 1.9)
    refined: bool | None = described(
        "Whether the motion was optimised to the end. If not, its energy is that of a first, coarse motion: asked for "
        "alone, this pair may need a few percent less. Null if not solved.",
        None,
        False,
        default=None,
    )


class CandidateCounts(Response):
    """How many candidates have each status; all of them, listed or not."""

    solved: int = described("A motion was found.", "1", 9)
    pruned: int = described("Ruled out by the lower bound or by the energy.", "1", 247)
    infeasible: int = described("No motion exists, at least none of this method.", "1", 0)
    failed: int = described("No motion was found, but one may exist.", "1", 0)
    unvisited: int = described("Not solved.", "1", 0)


class UnreachableTarget(Response):
    """A target of an `any_of` that the arm cannot reach. It has no candidates."""

    end: str = described(
        "What the target belongs to: `start` or `goal`; of `POST /cycle` `start`, or `stops/` and a name.", None, "goal"
    )
    target: int = described("Index in `any_of`, from 0.", None, 2)
    reason: str = described(
        "Why the target cannot be reached, and how to correct it.",
        None,
        "The goal pose is 0.12 m out of reach in this orientation: move the position closer to the robot's workspace, "
        "or change the orientation.",
    )


class WorstRatio(Response):
    """Largest value / limit over all joints and instants: at most 1 + 1e-6. What follows `torque` is there only if the
    request limits it."""

    position: float = described("Joint position: distance from the middle of the range / half of the range.", "1", 0.61)
    velocity: float = described("Joint velocity.", "1", 0.74)
    acceleration: float = described("Joint acceleration.", "1", 1.0)
    jerk: float = described("Joint jerk.", "1", 0.66)
    torque: float = described("Torque at the joint, on the side of the robot's `limits.torque_side`.", "1", 0.55)
    tool_cone: float | None = described(
        "Angle between tool axis and direction / `half_angle` of `tool_cone`.", "1", 0.93, default=None
    )
    tcp_speed: float | None = described("Speed of the TCP.", "1", 1.0, default=None)
    elbow_speed: float | None = described("Speed of the elbow.", "1", 0.71, default=None)
    path_position: float | None = described(
        "Distance of the TCP from the path / `tolerance.position`, between the samples, too.", "1", 0.02, default=None
    )
    path_rotation: float | None = described(
        "Angle of the tool from that of the path / `tolerance.rotation`, between the samples, too.",
        "1",
        0.01,
        default=None,
    )
    path_speed: float | None = described(
        "`speed.min` of the path / least speed of the TCP between the ramps. Of a fixed speed, the largest deviation "
        "from it / 0.1 % of it. Between the samples, too.",
        "1",
        0.98,
        default=None,
    )


class EndError(Response):
    """Deviation of the TCP from its target."""

    position: float = described("Distance.", "m", 2e-12)
    rotation: float = described(
        "Angle to the target orientation, or to the nearest allowed one; includes the deviation of the joints.",
        "rad",
        4e-12,
    )


class Clearance(Response):
    """Smallest distance between two bodies during the motion, minus the obstacle's `margin`."""

    min_clearance: float = described(
        "Proven smallest clearance over the whole motion: no two bodies are ever closer.", "m", 0.0141
    )
    sampled: float = described(
        "Smallest clearance at sample points. The true value is between `min_clearance` and this.", "m", 0.0142
    )
    pair: list[str] = described(BODIES, None, ["table", "tool"])
    time: float = described("Time of this sample, from the start of the motion.", "s", 0.62)
    points: list[list[float]] | None = described(
        "The nearest points of the two bodies at that time, in the base frame, without the margin. Null in answers of "
        "an earlier version.",
        "m",
        [[-0.42, 0.21, 0.0], [-0.42, 0.21, 0.0192]],
    )


class Certificate(Response):
    """Independent check of the motion: Pinocchio replays the spline on a grid of at most 1 ms."""

    worst_ratio: WorstRatio = part("Largest value / limit, for each limit.")
    start_error: EndError = part("Deviation at the start.")
    goal_error: EndError = part("Deviation at the goal.")
    energy_error: float = described(
        "Relative difference of the energy on this grid and the reported energy: the larger one of electrical and "
        "mechanical.",
        "1",
        1e-6,
    )
    balance_error: float = described("Relative difference of the sum of the electrical parts and the total.", "1", 1e-6)
    clearance: Clearance | None = part("Smallest clearance; null if `collisions` is false.")


class Solver(Response):
    """Computing time and number of solver runs."""

    wall_time: float = described("Wall time.", "s", 0.41)
    iterations: int = described(
        "Iterations over all candidates: SQP iterations, energy evaluations (`uniform_scaling`) or generations "
        "(`polynomial_ga`).",
        "1",
        52,
    )
    nlp_solves: int = described("Nonlinear programs solved, over all candidates.", "1", 4)
    stationarity: float | None = described(
        "Largest component of the gradient of the Lagrangian before the last step, relative to the cost. Null if the "
        "answer is a baseline's motion or the method has none.",
        "1/rad",
        2e-4,
    )


class OptimizeResponse(MotionAnswer):
    """The motion of least energy, its energy with all parts, and a certificate."""

    method: MethodName = described("How the motion is parametrised.", None, "bspline")
    objective: Objective = described(OBJECTIVE, None, "electrical")
    duration: float = described("Duration of the motion.", "s", 1.8)
    status: Literal["optimal", "feasible"] = described(
        "`optimal`: the method converged, and every other candidate was solved, is infeasible, or was ruled out by its "
        "lower bound or its energy; for mechanical work, `optimality_gap` is at most 0.01, too. It does not say that "
        "no better motion exists: see `optimality_gap`. `feasible`: the motion is certified, but the search was not "
        "complete, or arm configurations may have been missed.",
        None,
        "optimal",
    )
    branch: Branches = part("Arm configurations of the chosen candidate.")
    trajectory: Trajectory = part("The motion.")
    energy: Energy = part("Energy and power of the motion.")
    limits: LimitsInForce = part("The limits that the motion was held to.")
    baselines: Annotated[list[Baseline], Field(min_length=1)] = part("The same task by other planners.")
    candidates: list[Candidate] = part(
        "Pairs of a start and a goal configuration, with their results, as `candidates` of the request asks."
    )
    candidate_counts: CandidateCounts = part("Number of all candidates by status.")
    unreachable: list[UnreachableTarget] = part("Targets of an `any_of` without candidates, each with the cause.")
    certificate: Certificate = part("Independent check of the motion.")
    warnings: list[str] = described(WARNINGS, None, [])
    solver: Solver = part("Effort of the computation.")
    answer: str | None = described(
        "Path under which this answer is kept: `GET` returns it again. Null if it is not kept: the database cannot be "
        "written, the answer is larger than all that the service may keep, or it is a part of another answer.",
        None,
        ANSWER_PATH,
    )
