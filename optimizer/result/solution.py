"""The solution of a problem: motion, samples, baselines and limits, in SI units."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from joulepath.models.robot import Limits
from joulepath.optimizer.declared import (
    Count,
    Internal,
    Joules,
    MetresPerSecond,
    NullIfInfinite,
    PerJoint,
    PerSample,
    PerSampleAndJoint,
    Ratio,
    Seconds,
    Unit,
)
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.result.candidates import CandidateReport, UnreachableTarget
from joulepath.optimizer.result.certificate import Certificate, Clearance
from joulepath.optimizer.result.energy import Energy, SavingInterval, Sensitivity

JointTorques = Annotated[PerSampleAndJoint, Unit("N·m")]


@dataclass(frozen=True)
class Samples:
    """Samples of a motion; arrays are [sample][joint]."""

    t: Annotated[PerSample, Unit("s")]
    """Time of each sample, from the start of the motion."""
    q: Annotated[PerSampleAndJoint, Unit("rad")]
    """Joint positions."""
    v: Annotated[PerSampleAndJoint, Unit("rad/s")]
    """Joint velocities."""
    a: Annotated[PerSampleAndJoint, Unit("rad/s²")]
    """Joint accelerations."""
    tau: JointTorques
    """Joint torque of rigid body and rotor, without friction."""
    tau_motor: JointTorques
    """Motor torque at the joint: `tau` and friction."""
    power: Annotated[PerSample, Unit("W")]
    """Power drawn from the supply."""
    charge: Annotated[PerSample, Unit("J")] | None = None
    """Charge of the energy storage on the bus; null without one."""


@dataclass(frozen=True, kw_only=True)
class Trajectory(Samples):
    """The motion: its spline, and samples of it; arrays are [sample][joint]."""

    spline: Spline
    """The motion itself; all samples follow from it."""


@dataclass(frozen=True)
class Configuration:
    """One arm configuration."""

    label: str
    """Branch: shoulder/elbow/wrist. Full turns of a joint do not change it."""
    q: Annotated[PerJoint, Unit("rad")]
    """Joint positions."""
    target: int = 0
    """Index in `any_of` of the reached target, from 0; 0 for a single target."""


@dataclass(frozen=True)
class Standing:
    """Arm at rest at q (nq,) [rad] with motor torques tau (nq,) [N·m] and a total power of `power`
    [W].
    """

    q: Annotated[PerJoint, Unit("rad")]
    tau: Annotated[PerJoint, Unit("N·m")]
    power: float


BaselineName = Literal[
    "trapezoid", "quintic", "ruckig", "ruckig_slowed", "straight", "controller_default"
]


@dataclass(frozen=True, kw_only=True)
class Baseline:
    """The energy of another planner's motion from the same start to the nearest goal
    configuration."""

    name: BaselineName
    """`trapezoid`: trapezoidal velocity, in the duration of the answer. `quintic`: polynomial of
    degree 5, in the duration of the answer. `ruckig`: time-optimal within the velocity,
    acceleration and jerk limits. `ruckig_slowed`: the same motion, uniformly slowed down to the
    duration of the answer. `straight`: the fastest motion within the same limits along the straight
    line in joints, all joints in step, slowed down to the duration of the answer.
    `controller_default`: the robot's own controller with its default speed
    and acceleration."""
    duration: Seconds
    """Duration of this motion."""
    electrical: Joules
    """Electrical energy of this motion, drawn from the supply; with a `dwell`, also of the wait
    after it."""
    mechanical: Joules
    """Mechanical work of this motion."""
    within_limits: bool = field(init=False)
    """Whether this motion is within every limit; collisions are checked at sample points."""
    reason: str | None
    """Limits that this motion breaks, and the two bodies closer than allowed, with the amount. Null
    if it is within every limit.
    """
    saving: Ratio | None
    """1 - energy of the answer / energy of this motion, of the objective, in the same cycle time:
    the shorter motion also waits at its goal, held by the motors, until the longer one ends. Null
    if this motion is not within every limit, since it is then no valid comparison.
    """
    sensitivity: Annotated[Sensitivity, Internal] = field(repr=False)
    """Sensitivity of the electrical energy."""
    at_goal: Annotated[Standing, Internal] = field(repr=False)
    """Arm at rest at the goal of this motion."""
    saving_interval: SavingInterval | None = None
    """Uncertainty of the saving. Null without a saving, and for the objective `mechanical`."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "within_limits", self.reason is None)


@dataclass(frozen=True)
class LimitsInForce:
    """Limits of the motion: the robot's, or the tighter limits of the request. Lists are per joint,
    from base to flange; null: no limit.
    """

    position_min: Annotated[PerJoint, Unit("rad")]
    """Least joint position."""
    position_max: Annotated[PerJoint, Unit("rad")]
    """Greatest joint position."""
    velocity: Annotated[PerJoint, Unit("rad/s")]
    """Joint velocity."""
    acceleration: Annotated[PerJoint, Unit("rad/s²")]
    """Joint acceleration."""
    jerk: Annotated[PerJoint, Unit("rad/s³"), NullIfInfinite]
    """Joint jerk."""
    torque: Annotated[PerJoint, Unit("N·m")]
    """Torque at the joint, on the side of the robot's `limits.torque_side`."""
    tcp_speed: MetresPerSecond | None
    """Speed of the TCP."""
    elbow_speed: MetresPerSecond | None
    """Speed of the elbow."""

    @classmethod
    def of(
        cls, joints: Limits, tcp_speed: float | None, elbow_speed: float | None
    ) -> LimitsInForce:
        """Limits of the joints and of the speeds of TCP and elbow [m/s]; None is no limit."""
        rates = (joints.v_max, joints.a_max, joints.j_max, joints.tau_max)
        return cls(joints.q_min, joints.q_max, *rates, tcp_speed, elbow_speed)


@dataclass(frozen=True)
class SolverReport:
    """Computing time and number of solver runs."""

    wall_time: Seconds
    """Wall time."""
    iterations: Count
    """Iterations over all candidates: SQP iterations, energy evaluations (`uniform_scaling`) or
    generations (`polynomial_ga`)."""
    nlp_solves: Count
    """Nonlinear programs solved, over all candidates."""
    stationarity: Annotated[float, Unit("1/rad")] | None
    """Largest component of the gradient of the Lagrangian before the last step, relative to the
    cost. Null if the answer is a baseline's motion or the method has none."""


@dataclass(frozen=True)
class Solution:
    """The motion of least energy, with its lower bound and certificate.

    Attributes:
        status: `optimal` if no candidate can need less energy.
        start: configuration at the start.
        goal: configuration at the goal.
        trajectory: the motion and its samples.
        energy: energy of the motion.
        limits: limits of the motion.
        sensitivity: sensitivity of the electrical energy.
        lower_bound: proven lower bound of the objective [J]. If not `complete`, it also covers
            motions between configurations that may be missing.
        baselines: motions of other planners.
        candidates: outcome of every candidate.
        unreachable: targets without candidates.
        certificate: independent check of the motion.
        unmodelled: contacts of bodies that stand in for a tool or payload without a shape; see
            `collision.stand_ins`.
        solver: effort.
        complete: whether all configurations at start and goal were found. If not, `status` is
            `feasible`.
    """

    status: Literal["optimal", "feasible"]
    start: Configuration
    goal: Configuration
    trajectory: Trajectory
    energy: Energy
    limits: LimitsInForce
    sensitivity: Sensitivity = field(repr=False)
    lower_bound: float
    baselines: list[Baseline]
    candidates: list[CandidateReport]
    unreachable: list[UnreachableTarget]
    certificate: Certificate
    unmodelled: list[Clearance]
    solver: SolverReport
    complete: bool

    @property
    def duration(self) -> float:
        """Duration of the motion [s]."""
        return self.trajectory.spline.duration
