"""Limits on speed and acceleration that keep all torque limits in every posture of a set."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import yaml

from joulepath.models.immutable import ReadOnlyArrays
from joulepath.models.robot import Array, Limits, Robot
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.joint_limits.errors import NoJointLimits
from joulepath.optimizer.joint_limits.posture_set import PostureSet
from joulepath.optimizer.joint_limits.posture_terms import PostureTerms
from joulepath.optimizer.joint_limits.torque_cover import TorqueCover
from joulepath.optimizer.joint_limits.torque_load import Rates, TorqueLoad, greatest_torques
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.presentation.equality import same
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.uncoupled import check_uncoupled


@dataclass(frozen=True)
class SearchSettings:
    """Settings of the search for limits."""

    attempts: tuple[tuple[float, int], ...] = (
        (0.1, 250_000),
        (0.35, 150_000),
        (0.65, 600_000),
        (0.85, 600_000),
    )
    """Reserve of torque that a proof has to spare, relative to the torque that gravity and friction
    leave, and the largest number of postures of the proof. With six joints the first attempt is
    mostly enough, with seven often only the third.
    """
    samples: int = 2000
    """Random postures with which the limits are compared before a proof."""
    rounds: int = 100
    """Largest number of proofs, and comparisons, of an attempt that end with a posture."""
    most_joints: int = 7
    """Largest number of joints: boxes of more have too many corners."""
    slowest: float = 0.01
    """Least factor on the speeds; motions that are slower are of no use."""
    decimals: int = 4
    """Decimals to which limits are rounded down."""


SEARCH = SearchSettings()


@dataclass(frozen=True)
class JointLimits(ReadOnlyArrays):
    """Limits of joints within which no torque exceeds its limit.

    Attributes:
        robot: the robot.
        scope: the postures, mounting and payloads for which they hold, a line each.
        v: limits on speeds, shape (nq,) [rad/s].
        a: limits on accelerations, shape (nq,) [rad/s²].
        j: the robot's own limits on jerks, shape (nq,) [rad/s³]; infinite without one.
        spare: torque to spare in the proof, as a share of the torque left by gravity and friction.
    """

    robot: Robot
    scope: tuple[str, ...]
    v: Array
    a: Array
    j: Array
    spare: float

    def to_yaml(self, prefix: str = "") -> str:
        """The limits as a `joint_limits.yaml` for MoveIt and ros2_control.

        Args:
            prefix: prefix of all joint names.

        Returns:
            The text of the file. A comment at its head states the scope of the limits.
        """
        limits = {}
        for k, joint in enumerate(self.robot.joint_names):
            own = limits[prefix + joint] = dict[str, bool | float]()
            for kind, most in (("velocity", self.v), ("acceleration", self.a), ("jerk", self.j)):
                own[f"has_{kind}_limits"] = known = bool(np.isfinite(most[k]))
                if known:
                    own[f"max_{kind}"] = float(most[k])
        head = (
            f"joint_limits.yaml of {self.robot.name}, for MoveIt and ros2_control",
            "No torque exceeds its limit. Proven for all speeds and accelerations within these "
            "limits at once, for",
            *(f"- {line}" for line in self.scope),
            f"The proof has a reserve of {self.spare:.0%} of the torque left by gravity and "
            "friction. Jerks are the robot's own limits.",
        )
        comment = "".join(f"# {line}\n" for line in head)
        return comment + yaml.safe_dump({"joint_limits": limits}, sort_keys=False)


@checked_arguments
def joint_limits(arm: Arm) -> JointLimits:
    """Limits on speed and acceleration that keep the torque limits in every posture of an arm.

    They are proven for all postures within the joint ranges, all speeds and accelerations within
    the limits at once, and all payloads of the arm's centre of mass and radii of gyration up to its
    mass. Speeds share one factor c of the robot's, and accelerations c², as of motions that take
    1 / c times as long, unless a joint's limits can be raised further.

    Args:
        arm: the arm with its payload, mounting, friction and limits.

    Returns:
        The limits, none above that of the arm.

    Raises:
        InvalidProblem: the arm has more than seven joints, or joints that follow others.
        NoJointLimits: gravity leaves too little torque in some posture.
        DeadlinePassed: the watched deadline passed.
    """
    return _limits([(arm, PostureSet.of_ranges(arm))], "all postures within the joint ranges")


def joint_limits_along(moves: Sequence[tuple[Spline, Arm]]) -> JointLimits:
    """Limits on speed and acceleration that keep the torque limits in the postures of motions.

    Args:
        moves: motions of one robot, within the speed limits, each with its arm.

    Returns:
        The limits, as of `joint_limits`, but for the postures of the motions.

    Raises:
        InvalidProblem: the robot has more than seven joints, or joints that follow others.
        NoJointLimits: gravity leaves too little torque in some posture.
        DeadlinePassed: the watched deadline passed.
    """
    sets = [(arm, PostureSet.along(spline, arm)) for spline, arm in moves]
    return _limits(sets, "the postures of the motion alone")


def _payloads(arms: Sequence[Arm]) -> str:
    """The payloads for which the limits of arms hold, in words."""
    first, *others = (arm.payload for arm in arms)
    if any(not same(first, each) for each in others):
        return "payloads of each move up to its own, with the same centre of mass"
    com = ", ".join(f"{x:.4g}" for x in first.com)
    moments = ", ".join(f"{x:.4g}" for x in np.linalg.eigvalsh(first.inertia))
    size = f"principal moments of inertia ({moments}) kg·m² at this mass"
    return (
        f"payloads of up to {first.mass:.4g} kg with the centre of mass ({com}) m in the flange "
        f"frame, {size if first.inertia.any() else 'as points'}"
    )


class _Case:
    """The postures of an arm with one payload."""

    def __init__(self, load: TorqueLoad, chain: ChainDerivatives, postures: PostureSet) -> None:
        self._load, self._chain, self._postures = load, chain, postures
        self._q = postures.draw(SEARCH.samples)
        self._samples = PostureTerms.of(chain, self._q)
        self._binding = np.zeros((0, chain.nq))
        self._bind(np.zeros((0, chain.nq)))
        self.unit = np.ones(chain.nq)

    def measure(self, creeping: Rates) -> tuple[Array, Array]:
        """Greatest torques (nq,) [N·m] of slow motions, and the torques allowed."""
        needed = greatest_torques(self._samples, creeping)
        self._bind(self._q[np.unique(needed.argmax(axis=0))])
        allowed = self._load.allowed(creeping)
        self.unit = allowed - needed.max(axis=0)
        return needed.max(axis=0), allowed

    def spares(self, rates: Rates, spare: float) -> bool:
        """Whether the binding postures have torque to spare, relative to the unit."""
        return bool((self._excess(self._terms, rates) <= -spare).all())

    def is_proven(self, rates: Rates, spare: float, evaluations: int) -> bool | None:
        """Whether all postures hold the limits; None if one has less to spare, which then binds."""
        excess = self._excess(self._samples, rates)
        if excess.max() > -spare:
            self._bind(self._q[np.unique(excess.argmax(axis=0))])
            return None
        allowed = self._load.allowed(rates)
        cover = TorqueCover(
            self._chain, rates, allowed, self.unit, self._postures, -spare, evaluations
        )
        proven = cover.holds()
        self._bind(cover.violations)
        return None if len(cover.violations) else proven

    def _bind(self, q: Array) -> None:
        self._binding = np.concatenate([self._binding, q])
        self._terms = PostureTerms.of(self._chain, self._binding)

    def _excess(self, terms: PostureTerms, rates: Rates) -> Array:
        return (greatest_torques(terms, rates) - self._load.allowed(rates)) / self.unit


@one_thread()
def _limits(sets: Sequence[tuple[Arm, PostureSet]], scope: str) -> JointLimits:
    arms = [arm for arm, _ in sets]
    robot = arms[0].robot
    check_uncoupled(robot, "robot", "Joint limits are not proven")
    if robot.nq > SEARCH.most_joints:
        raise InvalidProblem(
            "robot",
            f"{robot.name} has {robot.nq} joints: joint limits are proven for at most "
            f"{SEARCH.most_joints}.",
        )
    most = _common_limits(arms)
    loads = [(TorqueLoad(arm), postures) for arm, postures in sets]
    cases = [_Case(load, chain, postures) for load, postures in loads for chain in load.chains]
    creeping = Rates(SEARCH.slowest * most.v_max, SEARCH.slowest**2 * most.a_max)
    needs = [case.measure(creeping) for case in cases]
    torque, allowed = max(needs, key=lambda each: (each[0] / each[1]).max())
    joint = int(np.argmax(torque / allowed))
    refusal = NoJointLimits(robot.joint_names[joint], float(torque[joint]), float(allowed[joint]))
    if any((case.unit <= 0).any() for case in cases):
        raise refusal
    for spare, evaluations in SEARCH.attempts:
        rates = _proven(cases, most, spare, evaluations)
        if rates is None:
            continue
        down = 10.0**SEARCH.decimals
        v, a = (np.floor(each * down) / down for each in (rates.v, rates.a))
        if (v >= creeping.v).all() and (a > 0).all() and (rates.a >= creeping.a).all():
            gravity = ", ".join(f"{x:.4g}" for x in arms[0].gravity)
            mounting = f"gravity ({gravity}) m/s² in the base frame"
            return JointLimits(robot, (scope, mounting, _payloads(arms)), v, a, most.j_max, spare)
    raise refusal


def _proven(cases: Sequence[_Case], most: Limits, spare: float, evaluations: int) -> Rates | None:
    """The widest limits with torque to spare at the binding postures, proven for all postures; None
    if no proof was found.
    """
    for _ in range(SEARCH.rounds):
        rates = widest_rates(most, lambda each: all(case.spares(each, spare) for case in cases))
        # postures that bind are found with some tolerance
        found = [case.is_proven(rates, spare / 2, evaluations) for case in cases]
        if all(found):
            return rates
        if False in found:
            return None
    return None


def _common_limits(arms: Sequence[Arm]) -> Limits:
    """The tightest limits on speed, acceleration and jerk of arms."""
    first, *others = (arm.active_limits for arm in arms)
    for each in others:
        first = first.tightened(
            v_max=np.minimum(first.v_max, each.v_max),
            a_max=np.minimum(first.a_max, each.a_max),
            j_max=np.minimum(first.j_max, each.j_max),
        )
    return first


@dataclass(frozen=True)
class WideningSettings:
    """Settings of the widening."""

    bisections: int = 12
    """Bisections of a factor; 1 / 4096 of its range is left."""
    step: float = 1.02
    """Factor on a single limit, to see whether the condition stops it."""


WIDENING = WideningSettings()


def widest_rates(most: Limits, holds: Callable[[Rates], bool]) -> Rates:
    """Limits with the greatest possible least factor, then the greatest second least, and so on.

    At first, one factor c is common to all limits: c times the largest speeds and c² times the
    largest accelerations, like motions slowed down to 1 / c times their duration. Limits without
    effect on the condition are then raised further, again by a common factor, until none is left.

    Args:
        most: the largest limits.
        holds: the condition; if it holds for some limits, it holds for all lower limits.
    """

    def rates(factors: Array) -> Rates:
        return Rates(most.v_max * factors[0], most.a_max * factors[1] ** 2)

    factors = np.zeros((2, len(most.v_max)))
    free, level = np.ones_like(factors, dtype=bool), 0.0
    while free.any():
        if holds(rates(np.where(free, 1.0, factors))):
            return rates(np.where(free, 1.0, factors))
        high = 1.0
        for _ in range(WIDENING.bisections):
            middle = (level + high) / 2
            if holds(rates(np.where(free, middle, factors))):
                level = middle
            else:
                high = middle
        factors[free] = level
        stopped = free.copy()
        for at in np.argwhere(free):
            alone = factors.copy()
            alone[*at] = min(1.0, WIDENING.step * level)
            stopped[*at] = not holds(rates(alone))
        # within the precision of the factor, none may be stopped alone
        free = free & ~stopped if stopped.any() else np.zeros_like(free)
    return rates(factors)
