"""The answer: trajectory, energy, candidates, baselines, certificate. SI units; arrays are [sample][joint]."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Literal, NamedTuple

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.trajectories.limit_ratios import RATIO_TOLERANCE
from joulepath.optimizer.trajectories.spline import Spline

# what is minimised: energy drawn from the supply, or mechanical work
Objective = Literal["electrical", "mechanical"]


@dataclass(frozen=True)
class Trajectory:
    """Samples of a motion: t (k,), q, v, a, tau, tau_motor (k, nq), power (k,) drawn from the supply [W].

    `tau` is rigid body and rotor; `tau_motor` adds friction. `charge` (k,) [J] is that of the energy storage,
    None without one.
    """

    t: Array
    q: Array
    v: Array
    a: Array
    tau: Array
    tau_motor: Array
    power: Array
    spline: Spline
    charge: Array | None = None


@dataclass(frozen=True)
class Sensitivity:
    """Dependence of an electrical energy on the arm's figures: its `gradient` (p,) in the order of
    `models.uncertainty.parameters`, and the excess of the mean over their errors above the energy [J]."""

    gradient: Array
    shift: float

    def __add__(self, other: Sensitivity) -> Sensitivity:
        return Sensitivity(self.gradient + other.gradient, self.shift + other.shift)


@dataclass(frozen=True)
class EnergyInterval:
    """P5 and P95 of an energy and its standard deviation `sd` [J], from the errors that the arm's figures may have.

    `shares` [1] of the variance add up to 1, by source: a figure to measure, `session` or `move`.
    """

    p5: float
    p95: float
    sd: float
    shares: dict[str, float]


@dataclass(frozen=True)
class SavingInterval:
    """P5, P95 and standard deviation `sd` [1] of a saving of electrical energy."""

    p5: float
    p95: float
    sd: float


@dataclass(frozen=True)
class ElectricalEnergy:
    """Energy drawn from the supply plus the decrease of the energy storage's charge [J], and the parts of this total.

    `recovered` is negative; `storage_loss` is lost in the storage, `dwell` drawn while the arm waits after its motion.
    `interval` is that of the total, None for a part of a motion.
    """

    total: float
    idle: float
    potential: float
    kinetic: float
    friction: float
    copper: float
    inverter: float
    braking: float
    recovered: float
    storage_loss: float = 0.0
    dwell: float = 0.0
    interval: EnergyInterval | None = None

    @property
    def parts_sum(self) -> float:
        """Sum of the parts [J]: equal to `total` up to quadrature."""
        return (
            self.idle + self.potential + self.kinetic + self.friction
            + self.copper + self.inverter + self.braking + self.recovered + self.storage_loss + self.dwell
        )  # fmt: skip


@dataclass(frozen=True)
class MechanicalEnergy:
    """∫ Σ_j |tau_j v_j| dt [J], tau without friction, and its share per joint (nq,)."""

    total: float
    per_joint: Array


@dataclass(frozen=True)
class JointEnergy:
    """Per joint (nq,) [J]: losses, and `shaft` = ∫ tau_motor · v dt."""

    friction: Array
    copper: Array
    inverter: Array
    shaft: Array


@dataclass(frozen=True)
class StorageUse:
    """Energy storage over a motion [J]: charge at both ends, and energy charged and discharged, at the bus."""

    initial: float
    final: float
    charged: float
    discharged: float


@dataclass(frozen=True)
class Energy:
    """Everything about a motion's energy [J, W]; peak and mean power are of the motion itself, drawn from the supply.

    `storage` is None on a bus without energy storage.
    """

    electrical: ElectricalEnergy
    mechanical: MechanicalEnergy
    per_joint: JointEnergy
    peak_power: float
    mean_power: float
    storage: StorageUse | None = None

    def of(self, objective: Objective) -> float:
        """The part of the energy that an objective minimises [J]."""
        return self.electrical.total if objective == "electrical" else self.mechanical.total

    def with_dwell(self, dwell: float) -> Energy:
        """The same with energy [J] drawn while the arm waits afterwards."""
        electrical = self.electrical
        return replace(self, electrical=replace(electrical, total=electrical.total + dwell, dwell=dwell))


@dataclass(frozen=True)
class Branch:
    """One arm configuration: its label, e.g. `left/up/no_flip`, and joints (nq,) [rad].

    `target` is the index of the target that it reaches among several, 0 where only one was given.
    """

    label: str
    q: Array
    target: int = 0


@dataclass(frozen=True)
class UnreachableTarget:
    """One of several targets of the `end` (start or goal), by index, that has no candidates, and the reason."""

    end: str
    target: int
    reason: str


class CandidateStatus(StrEnum):
    """Outcome of a candidate."""

    SOLVED = "solved"
    PRUNED = "pruned"
    INFEASIBLE = "infeasible"
    FAILED = "failed"
    UNVISITED = "unvisited"


class CandidateReport(NamedTuple):
    """A start and goal pair: its status and reason, its proven bound and the energy found [J], of the objective.

    `start_target` and `goal_target` are indices as in `Branch.target`. `tried`: a motion was computed, found or not.
    `refined`: its energy is not that of a first, coarse motion; None if it has none.
    An answer has thousands of them: a frozen dataclass takes four times as long to make.
    """

    start: str
    goal: str
    q_start: Array
    q_goal: Array
    status: CandidateStatus
    reason: str
    lower_bound: float
    energy: float | None = None
    duration: float | None = None
    start_target: int = 0
    goal_target: int = 0
    tried: bool = False
    refined: bool | None = None


BaselineName = Literal["trapezoid", "quintic", "ruckig", "ruckig_slowed", "controller_default"]


@dataclass(frozen=True)
class Baseline:
    """Energy [J] of another method's motion between the same ends; `saving` = 1 - ours / theirs, of the objective.

    `reason` says which limits it breaks, and what collides; None if it is within all.
    `sensitivity` is that of the electrical energy. Mechanical work has no `saving_interval`.
    """

    name: BaselineName
    duration: float
    electrical: float
    mechanical: float
    saving: float
    reason: str | None
    sensitivity: Sensitivity = field(repr=False)
    saving_interval: SavingInterval | None = None

    @property
    def within_limits(self) -> bool:
        """Whether this motion is within every limit; collisions are checked at sample points."""
        return self.reason is None


@dataclass(frozen=True)
class LimitsInForce:
    """The limits that an answer was held to: those of the joints; speeds [m/s] of TCP and elbow, None without limit."""

    joints: Limits
    tcp_speed: float | None
    elbow_speed: float | None


@dataclass(frozen=True)
class Clearance:
    """Clearance of a motion [m], with the margins subtracted; negative if bodies overlap.

    `min_clearance` is proven for every instant. `sampled` is the least distance at sample points, of `pair` at `time`
    [s]. The true least distance lies between the two. `points` [m] are the nearest points of the two bodies, in the
    base frame, on their surfaces without margins; None where nobody asks for them.
    """

    min_clearance: float
    sampled: float
    pair: tuple[str, str]
    time: float
    points: tuple[list[float], list[float]] | None = None

    @property
    def message(self) -> str:
        """The two bodies and the missing clearance [m]."""
        first, second = self.pair
        return f"{first} and {second}: clearance {max(-self.sampled, 0.0):.4f} m too small"


@dataclass(frozen=True)
class Certificate:
    """The answer recomputed by Pinocchio on a 1 ms grid, apart from the solver.

    `worst_ratio` maps position, velocity, acceleration, jerk, torque, and of tool_cone, tcp_speed, elbow_speed,
    path_position, path_rotation and path_speed those that are limited, to the worst value / limit. `clearance` is
    proven over continuous time, None if no bodies are compared; `close_pass` is the least distance without margins,
    None unless it may be below 2 mm. `start_error` and `goal_error` are (position [m], rotation [rad]) of the TCP
    against the pose asked for (or the forward kinematics of the joints asked for). `rest_error` is the worst
    |v| / v_max and |a| / a_max at the two ends. `pass_error` is the largest deviation [rad] of a joint from the joint
    positions that the motion passes through, 0 if there are none. `energy_error` is |fine quadrature - reported| /
    reported, `balance_error` |sum of parts - total| / total.
    """

    worst_ratio: dict[str, float]
    start_error: tuple[float, float]
    goal_error: tuple[float, float]
    rest_error: float
    pass_error: float
    energy_error: float
    balance_error: float
    clearance: Clearance | None
    close_pass: Clearance | None

    POSITION_TOLERANCE = 1e-6
    # rounding of control points (1e-16 rad) over the square of the shortest knot span
    REST_TOLERANCE = 1e-7
    ENERGY_TOLERANCE = 1e-3

    @property
    def valid(self) -> bool:
        """Whether the motion is within every limit, at rest at its ends, on its passes, and of the reported energy.

        NaN is invalid.
        """
        return (
            all(ratio <= 1 + RATIO_TOLERANCE for ratio in self.worst_ratio.values())
            and all(error <= self.POSITION_TOLERANCE for error in self.start_error + self.goal_error)
            and self.rest_error <= self.REST_TOLERANCE
            and self.pass_error <= self.POSITION_TOLERANCE
            and self.energy_error <= self.ENERGY_TOLERANCE
            and self.balance_error <= self.ENERGY_TOLERANCE
            and (self.clearance is None or self.clearance.min_clearance >= 0)
        )


@dataclass(frozen=True)
class SolverReport:
    """Effort: wall time [s], iterations and nonlinear programs solved over all candidates; and the largest component
    of the Lagrangian's gradient, relative to the cost, per rad (None for the motion of a baseline).
    """

    wall_time: float
    iterations: int
    nlp_solves: int
    stationarity: float | None


@dataclass(frozen=True)
class Solution:
    """The motion of least energy, with its lower bound and certificate.

    Not `complete`: the inverse kinematics of the arm may have missed configurations at the start or goal. Then `status`
    is `feasible`, and the lower bound covers the motions between those that may be missing.
    `sensitivity` is that of the electrical energy. `unmodelled` are contacts of bodies that stand in for a tool or a
    payload without a shape, see `collision.stand_ins`.
    """

    status: Literal["optimal", "feasible"]
    start: Branch
    goal: Branch
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
        """Length of the motion [s]."""
        return self.trajectory.spline.duration
