"""What `POST /optimize` answers. Answers are built by `app.convert` without passing through these models: the tests
hold the two together."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.schemas.common import Response, described, part
from optimizer.problem.problem import MethodName

Joints = list[float]
Samples = list[float]
JointSamples = list[Joints]
Label = str
_Q = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
_LABEL = "left/up/no_flip"


class Configuration(Response):
    """One arm configuration."""

    label: Label = described("Branch: shoulder/elbow/wrist, and the windings where there are any.", None, _LABEL)
    q: Joints = described("Joint positions.", "rad", _Q)
    target: int = described("Which target of `any_of` it reaches, counted from 0; 0 for a single target.", None, 0)


class Branches(Response):
    """The chosen pair of arm configurations."""

    start: Configuration = part("At the start.")
    goal: Configuration = part("At the goal.")


class Spline(Response):
    """Clamped B-spline of the joint positions over time."""

    degree: int = described("Degree.", "1", 5)
    knots: list[float] = described("Knots.", "s", [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.9, 1.8, 1.8, 1.8, 1.8, 1.8, 1.8])
    control_points: JointSamples = described("Control points, [point][joint].", "rad", [_Q, _Q])


class Trajectory(Response):
    """The motion, sampled; arrays are [sample][joint]."""

    t: Samples = described("Time of each sample.", "s", [0.0, 0.008, 0.016])
    q: JointSamples = described("Joint positions.", "rad", [_Q])
    v: JointSamples = described("Joint velocities.", "rad/s", [[0.0] * 6])
    a: JointSamples = described("Joint accelerations.", "rad/s²", [[0.0] * 6])
    tau: JointSamples = described(
        "Torque of rigid body and rotor, without friction.", "N·m", [[0.0, -38.1, -16.4, -1.2, 0.0, 0.0]]
    )
    tau_motor: JointSamples = described(
        "Motor torque at the joint, friction included.", "N·m", [[0.0, -38.1, -16.4, -1.2, 0.0, 0.0]]
    )
    power: Samples = described("Power drawn from the supply.", "W", [42.5, 43.1, 45.0])
    charge: Samples | None = described("Charge of the bus' store; null without one.", "J", [0.0, 2.1, 5.3])
    spline: Spline = part("The motion itself, from which all the rest follows.")


class ElectricalEnergy(Response):
    """Energy drawn from the supply and its parts, which add up to the total."""

    total: float = described(
        "Energy drawn from the supply, the wait until the cycle's end included, and what the bus' store, if there is "
        "one, lost of its charge (less than nothing where it gained).",
        "J",
        152.4,
    )
    idle: float = described("Electronics: idle and controller power times the duration.", "J", 66.1)
    potential: float = described("Rise in potential energy.", "J", 12.3)
    kinetic: float = described("Rise in kinetic energy: zero between two rests.", "J", 0.0)
    friction: float = described("Lost to friction in the joints.", "J", 48.0)
    copper: float = described("Lost in the motors' windings.", "J", 21.0)
    inverter: float = described("Lost in the inverters.", "J", 0.0)
    braking: float = described("Surplus burnt in the brake resistor.", "J", 5.0)
    recovered: float = described("Surplus given back to the supply, zero or negative.", "J", 0.0)
    storage_loss: float = described("Lost on the way through the bus' store.", "J", 0.0)
    dwell: float = described("Drawn while waiting at the goal until the cycle is over.", "J", 0.0)


class MechanicalEnergy(Response):
    """Absolute mechanical work of the joints, without friction."""

    total: float = described("Sum over the joints of ∫ |tau v| dt.", "J", 61.7)
    per_joint: Joints = described("The same per joint.", "J", [12.0, 31.0, 15.0, 2.5, 0.9, 0.3])


class JointEnergy(Response):
    """Losses and shaft work per joint."""

    friction: Joints = described("Lost to friction.", "J", [20.0, 15.0, 9.0, 2.0, 1.5, 0.5])
    copper: Joints = described("Lost in the windings.", "J", [4.0, 11.0, 5.0, 0.6, 0.3, 0.1])
    inverter: Joints = described("Lost in the inverter.", "J", [0.0] * 6)
    shaft: Joints = described("∫ tau_motor · v dt.", "J", [20.1, 24.0, 13.0, 2.2, 0.8, 0.2])


class Storage(Response):
    """The bus' store over the motion."""

    initial: float = described("Charge at the start.", "J", 0.0)
    final: float = described("Charge at the end.", "J", 1.4)
    charged: float = described("Put in, at the bus.", "J", 22.7)
    discharged: float = described("Taken out, at the bus.", "J", 19.0)


class Energy(Response):
    """Everything about the motion's energy."""

    electrical: ElectricalEnergy = part("Energy drawn from the bus.")
    mechanical: MechanicalEnergy = part("Absolute mechanical work.")
    per_joint: JointEnergy = part("The same, joint by joint.")
    storage: Storage | None = part("The bus' store; null without one.")
    peak_power: float = described("Greatest power drawn from the supply during the motion.", "W", 236.0)
    mean_power: float = described("Mean power drawn from the supply during the motion.", "W", 84.7)
    lower_bound: float = described(
        "Of the objective: no motion of any shape and any allowed duration between these targets needs less.",
        "J",
        139.9,
    )
    optimality_gap: float = described("1 - lower_bound / energy, of the objective.", "1", 0.082)


class Baseline(Response):
    """What another method spends between the same ends."""

    name: Literal["trapezoid", "quintic", "ruckig", "ruckig_slowed", "controller_default"] = described(
        "`trapezoid` and `quintic`: to the nearest goal configuration in our duration; `ruckig`: at its own shortest "
        "time; `ruckig_slowed`: in our duration; `controller_default`: as the robot's controller moves by default.",
        None,
        "controller_default",
    )
    duration: float = described("Its duration.", "s", 2.4)
    electrical: float = described("Energy it draws from the bus.", "J", 190.2)
    mechanical: float = described("Its absolute mechanical work.", "J", 70.3)
    within_limits: bool = described("Whether it keeps every limit.", None, True)
    saving: float = described("1 - ours / theirs, of the objective.", "1", 0.199)


class Candidate(Response):
    """A start and goal pair and what became of it."""

    start: Label = described("Branch at the start.", None, _LABEL)
    start_target: int = described("Target of the start's `any_of`, counted from 0.", None, 0)
    goal: Label = described("Branch at the goal.", None, "left/down/flip")
    goal_target: int = described("Target of the goal's `any_of`, counted from 0.", None, 0)
    q_start: Joints = described("Joint positions at the start.", "rad", _Q)
    q_goal: Joints = described("Joint positions at the goal.", "rad", _Q)
    status: Literal["solved", "pruned", "infeasible", "failed", "unvisited"] = described(
        "What became of it.", None, "pruned"
    )
    reason: str = described("Why, in words.", None, "its bound is above the best energy found")
    lower_bound: float | None = described(
        "Proven bound of the objective; null where no motion exists or none was computed.", "J", 171.0
    )
    energy: float | None = described("Energy found, of the objective; null if not solved.", "J", 180.5)
    duration: float | None = described("Duration found; null if not solved.", "s", 1.9)


class UnreachableTarget(Response):
    """One target of an `any_of` that the arm cannot go to, so that it has no candidates."""

    end: Literal["start", "goal"] = described("Which end of the motion.", None, "goal")
    target: int = described("Its place in `any_of`, counted from 0.", None, 2)
    reason: str = described(
        "Why, and what to do about it.",
        None,
        "The goal pose is 0.12 m out of reach in this orientation: move the position closer to the robot's workspace, "
        "or change the orientation.",
    )


class WorstRatio(Response):
    """Greatest value / limit over the motion: at most 1 + 1e-6. The last three only where they were asked for."""

    position: float = described("Joint position within its range.", "1", 0.61)
    velocity: float = described("Joint speed.", "1", 0.74)
    acceleration: float = described("Joint acceleration.", "1", 1.0)
    jerk: float = described("Joint jerk.", "1", 0.66)
    torque: float = described("Motor torque.", "1", 0.55)
    tool_cone: float | None = described("Angle of the tool's axis in its cone.", "1", 0.93, default=None)
    tcp_speed: float | None = described("Speed of the TCP.", "1", 1.0, default=None)
    elbow_speed: float | None = described("Speed of the elbow.", "1", 0.71, default=None)


class EndError(Response):
    """Distance of the TCP from where it was asked to be."""

    position: float = described("Distance.", "m", 2e-12)
    rotation: float = described("Angle.", "rad", 4e-12)


class Clearance(Response):
    """How far the arm keeps from itself and from the scene, the obstacles' margins taken off."""

    min_clearance: float = described("No two bodies are ever nearer: proven for every instant.", "m", 0.0141)
    sampled: float = described("Least distance met: the truth lies between the two.", "m", 0.0142)
    pair: list[str] = described("What is nearest there: links, `tool`, `payload`, obstacles.", None, ["table", "tool"])
    time: float = described("When, from the motion's start.", "s", 0.62)


class Certificate(Response):
    """The motion recomputed by Pinocchio on a 1 ms grid, apart from the solver."""

    worst_ratio: WorstRatio = part("Worst value / limit, per limit.")
    start_error: EndError = part("At the start.")
    goal_error: EndError = part("At the goal.")
    energy_error: float = described("Fine quadrature against the reported total, relative.", "1", 1e-6)
    balance_error: float = described("Sum of the parts against the total, relative.", "1", 1e-6)
    clearance: Clearance | None = part("How far the arm keeps from everything; null where `collisions` is false.")


class Solver(Response):
    """What the answer cost to compute."""

    wall_time: float = described("Wall time.", "s", 0.41)
    iterations: int = described(
        "Iterations over all candidates: the solver's steps, the energies evaluated by `uniform_scaling`, or the "
        "generations of `polynomial_ga`.",
        "1",
        52,
    )
    nlp_solves: int = described("Nonlinear programmes solved.", "1", 4)
    stationarity: float | None = described(
        "Largest component of the Lagrangian's gradient at the answer, as a share of the cost. Null where that is "
        "a baseline's motion, or the method has none.",
        "1/rad",
        2e-4,
    )


class OptimizeResponse(Response):
    """The motion of least energy, its energy breakdown, and a certificate that it holds every limit."""

    id: str = described(
        "The request's id, as in the `X-Request-ID` header.", None, "0b0f3b0e-4c4f-4a43-9d6b-1f6f2f1f6a55"
    )
    robot: str = described("Name of the robot.", None, "ur5e")
    method: MethodName = described("How the motion is parametrised.", None, "bspline")
    objective: Literal["electrical", "mechanical"] = described("What was minimised.", None, "electrical")
    duration: float = described("Length of the motion.", "s", 1.8)
    status: Literal["optimal", "feasible"] = described(
        "`optimal`: converged, and every other candidate solved, ruled out by a bound, or dearer even without keeping "
        "clear. `feasible`: verified, but the search was cut short.",
        None,
        "optimal",
    )
    branch: Branches = part("The arm configurations chosen at both ends.")
    trajectory: Trajectory = part("The motion.")
    energy: Energy = part("Its energy.")
    baselines: Annotated[list[Baseline], Field(min_length=1)] = part("What other methods spend between the same ends.")
    candidates: Annotated[list[Candidate], Field(min_length=1)] = part("Every start and goal pair looked at.")
    unreachable: list[UnreachableTarget] = part("Targets of an `any_of` that have no candidates, and why.")
    certificate: Certificate = part("Proof that the motion holds.")
    solver: Solver = part("What it cost to compute.")
