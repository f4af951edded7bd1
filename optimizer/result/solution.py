"""The solution of a problem: motion, samples, baselines and limits, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from joulepath.models.robot import Limits
from joulepath.optimizer.declared import (
    Count,
    MetresPerSecond,
    NotEmpty,
    NullIfNotFinite,
    PerJoint,
    PerSample,
    PerSampleAndJoint,
    Seconds,
    Unit,
)
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.presentation.chart import Chart, joint_curves
from joulepath.optimizer.presentation.equality import Comparable
from joulepath.optimizer.presentation.gap import gap_text, optimality_gap
from joulepath.optimizer.presentation.result import Result, Rows, per_joint
from joulepath.optimizer.result.baseline import Baseline
from joulepath.optimizer.result.candidates import (
    CandidateCounts,
    CandidateReport,
    UnreachableTarget,
    count_by_status,
)
from joulepath.optimizer.result.certificate import Certificate, Clearance
from joulepath.optimizer.result.energy import (
    Energy,
    EnergyAndBound,
    Objective,
    Sensitivity,
    energy_rows,
    energy_text,
)

JointTorques = Annotated[PerSampleAndJoint, Unit("N·m")]


@dataclass(frozen=True, eq=False)
class Samples(Comparable):
    """Samples of a motion; arrays are `[sample][joint]`."""

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


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory(Samples):
    """The motion: its spline, and samples of it; arrays are `[sample][joint]`."""

    spline: Spline
    """The motion itself; all samples follow from it."""


@dataclass(frozen=True, eq=False)
class Configuration(Comparable):
    """One arm configuration."""

    label: str
    """Branch: shoulder/elbow/wrist. Full turns of a joint do not change it."""
    q: Annotated[PerJoint, Unit("rad")]
    """Joint positions."""
    target: int = 0
    """Index in `any_of` of the reached target, from 0; 0 for a single target."""


@dataclass(frozen=True, eq=False)
class LimitsInForce(Comparable):
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
    jerk: Annotated[PerJoint, Unit("rad/s³"), NullIfNotFinite]
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
class Branches:
    """The chosen pair of arm configurations."""

    start: Configuration
    """At the start."""
    goal: Configuration
    """At the goal."""


@dataclass(frozen=True, kw_only=True)
class SolvedMotion:
    """The motion of least energy, its energy with all parts, and a certificate."""

    objective: Objective
    """Energy that was minimised: electrical energy drawn from the supply, or mechanical work."""
    duration: Seconds
    """Duration of the motion."""
    status: Literal["optimal", "feasible"]
    """`optimal`: the method converged, and every other candidate was solved, is infeasible, or was
    ruled out by its lower bound or its energy; for mechanical work, `optimality_gap` is at most
    0.01, too. It does not say that no better motion exists: see `optimality_gap`. `feasible`: the
    motion is certified, but the search was not complete, or arm configurations may have been
    missed."""
    branch: Branches
    """Arm configurations of the chosen candidate."""
    trajectory: Trajectory
    """The motion."""
    energy: EnergyAndBound
    """Energy and power of the motion."""
    limits: LimitsInForce
    """The limits that the motion was held to."""
    baselines: Annotated[list[Baseline], NotEmpty]
    """The same task by other planners."""
    candidates: list[CandidateReport]
    """Pairs of a start and a goal configuration, with their results, as `candidates` of the request
    asks."""
    candidate_counts: CandidateCounts
    """Number of all candidates by status."""
    unreachable: list[UnreachableTarget]
    """Targets of an `any_of` without candidates, each with the cause."""
    certificate: Certificate
    """Independent check of the motion."""
    solver: SolverReport
    """Effort of the computation."""


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Result):
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
        objective: the energy that was minimised.
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
    objective: Objective = "electrical"

    @property
    def duration(self) -> float:
        """Duration of the motion [s]."""
        return self.trajectory.spline.duration

    def solved_motion(self) -> SolvedMotion:
        """The fields of an answer of the service, with all candidates."""
        return SolvedMotion(
            objective=self.objective,
            duration=self.duration,
            status=self.status,
            branch=Branches(self.start, self.goal),
            trajectory=self.trajectory,
            energy=EnergyAndBound.bounded(self.energy, self.lower_bound, self.objective),
            limits=self.limits,
            baselines=self.baselines,
            candidates=self.candidates,
            candidate_counts=count_by_status(self.candidates),
            unreachable=self.unreachable,
            certificate=self.certificate,
            solver=self.solver,
        )

    def _headline(self) -> str:
        gap = optimality_gap(self.lower_bound, self.energy.of(self.objective))
        return (
            f"{energy_text(self.energy, self.objective)}, {self.duration:.4g} s, {self.status}, "
            f"{gap_text(gap)}"
        )

    def _rows(self) -> Rows:
        return energy_rows(self.energy)

    def _shown(self) -> Any:
        return self.solved_motion()

    def _columns(self) -> dict[str, Any]:
        return sample_columns(self.trajectory)

    def _charts(self) -> Sequence[Chart]:
        return sample_charts(self.trajectory)


def sample_columns(samples: Samples) -> dict[str, Any]:
    """The samples as columns of a table, one row per sample."""
    arrays = {name: getattr(samples, name) for name in ("q", "v", "a", "tau", "tau_motor")}
    columns: dict[str, Any] = {"t": samples.t}
    for name, values in arrays.items():
        columns |= per_joint(name, values)
    charge = {} if samples.charge is None else {"charge": samples.charge}
    return columns | {"power": samples.power} | charge


def sample_charts(samples: Samples) -> list[Chart]:
    """Joint positions and power over time."""
    return [
        Chart(samples.t, "t [s]", "q [rad]", joint_curves(samples.q)),
        Chart(samples.t, "t [s]", "power [W]", {"supply": samples.power}),
    ]
