"""Inverse kinematics: every branch of a pose, labelled, with every full turn that the joint ranges
allow.

A configuration is singular where two branches meet (shoulder or elbow) or where the arm can move
while the pose is held (wrist). The first are solutions like any other. The second are members of a
self-motion, a curve of solutions.

`InverseKinematics` is the interface; `inverse_kinematics_for` chooses its implementation for a
robot. For six joints they are the closed form of Universal Robots' arms in `ur_closed_form`, then
that of `decomposition` for arms with three axes that are parallel or meet, then Newton's method
from many starts (`multi_start`), which may miss branches. For seven joints, which hold every pose
on self-motions, it is that of arms with a spherical shoulder in `redundant_arm`, then self-motions
that are followed point by point (`traced_arm`), of which some may be missed. For any other arm it
returns None: such an arm takes joint positions as targets, not poses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import compress, groupby, product, repeat
from typing import Any, Protocol

import numpy as np

from joulepath.models.robot import MOST_ROBOTS, Array, Limits, Robot
from joulepath.optimizer.exceptions import InvalidProblem, SingularPose, UnreachablePose
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.ik_solutions import (
    LimitedSolution,
    PrincipalSolution,
    Singularities,
)
from joulepath.optimizer.kinematics.isolated import distinct
from joulepath.optimizer.kinematics.multi_start import MultiStart
from joulepath.optimizer.kinematics.reach import REACH, at_the_edge, out_of_reach
from joulepath.optimizer.kinematics.self_motion import SelfMotion, is_point, spread, without_gaps
from joulepath.optimizer.kinematics.seven import redundant_curve, traced_curve
from joulepath.optimizer.kinematics.seven.redundant_arm import RedundantArm
from joulepath.optimizer.kinematics.seven.redundant_curve import RedundantCurve
from joulepath.optimizer.kinematics.seven.traced_arm import TracedArm
from joulepath.optimizer.kinematics.seven.traced_curve import TracedCurve
from joulepath.optimizer.kinematics.six.decomposition import DecomposedArm
from joulepath.optimizer.kinematics.six.full_turns import full_turn_alternatives, nearest_turns
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.problem.branches import BranchLabel

# greatest error [m, rad] of the forward kinematics of a solution against the pose
ACCURACY = 1e-9
# members of a self-motion that stand for it; of many self-motions, so many times those of one in
# all, and of each at least so many
MEMBERS, MOST_IN_ALL, LEAST_OF_EACH = 8, 4, 2
# where so many members are asked for, they stand for the whole curve: none is far from the next
WHOLE = 16
# members among which one within the limits is sought, if no other is
MANY = 128


class InverseKinematics(Protocol):
    """Inverse kinematics of one robot."""

    @property
    def complete(self) -> bool:
        """Whether every branch is found. If not, some may be missed: nothing may be claimed of all
        of them.
        """
        ...

    def label(self, q: Array) -> BranchLabel:
        """The branch of a configuration q (nq,) [rad]. A full turn of a joint does not change
        it."""
        ...

    def branches(self, T_base_flange: Array, members: int = MEMBERS) -> list[PrincipalSolution]:
        """Every branch that reaches the flange pose (4, 4), and `members` of every self-motion or a
        few more.

        Of more than four self-motions, as a redundant arm has them, `members` times four in all. An
        empty list if the pose is out of reach. Raises SingularPose if it is reached on a
        self-motion that this inverse kinematics does not know.
        """
        ...

    def solve(
        self,
        T_base_tcp: Array,
        T_flange_tcp: Array | None = None,
        limits: Limits | None = None,
        windings: bool = True,
        target: str = "goal",
        members: int = MEMBERS,
    ) -> list[LimitedSolution]:
        """Every configuration inside the limits (default: the robot's) that puts the TCP at
        T_base_tcp (4, 4).

        `T_flange_tcp` (4, 4) is the pose of the TCP in the flange frame, by default the identity.
        With `windings` there is one solution for each combination of full turns that the position
        limits allow. Without, there is one per branch, the one whose joints are nearest to zero.
        The solutions of a branch are together, nearest to zero first. Of a self-motion there are
        `members` solutions or a few more, evenly spread, without full turns; of more than four
        self-motions, `members` times four in all. The self-motions of a redundant arm are cut to
        the limits.

        Raises UnreachablePose, which names `target`, if there is no solution; SingularPose if the
        pose is only reached on a self-motion that this inverse kinematics does not know.
        """
        ...


@lru_cache(MOST_ROBOTS)
def inverse_kinematics_for(robot: Robot) -> InverseKinematics | None:
    """The robot's inverse kinematics, built once; None for an arm that has none here."""
    model = robot.model
    exact = URClosedForm.of(model) or DecomposedArm.of(model) or RedundantArm.of(model)
    form = exact or MultiStart.of(model) or TracedArm.of(model)
    return None if form is None else ClosedFormInverseKinematics(robot, form)


def required_inverse_kinematics(robot: Robot, field: str) -> InverseKinematics:
    """The robot's inverse kinematics, for the pose in `field` of a request.

    Raises InvalidProblem, with this field named, for an arm that has none here.
    """
    kinematics = inverse_kinematics_for(robot)
    if kinematics is None:
        raise InvalidProblem(
            field,
            f"There is no inverse kinematics for {robot.name}: give joint positions (`q`) instead "
            "of a pose.",
        )
    return kinematics


class ClosedForm(Protocol):
    """The branches of a flange pose, for one family of arms."""

    @property
    def complete(self) -> bool:
        """Whether every branch is found."""
        ...

    @property
    def confirmed(self) -> bool:
        """Whether what `solve` returns has been confirmed by forward kinematics."""
        ...

    def label(self, q: Array) -> BranchLabel:
        """The branch of a configuration q (nq,) [rad]."""
        ...

    def solve(self, T: Array) -> tuple[Array, Sequence[BranchLabel]]:
        """Isolated configurations (n, nq) [rad] in [-pi, pi] that put the flange at T (4, 4), and
        their n labels.

        Raises SingularPose if T is reached on a self-motion that is not known.
        """
        ...

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """The parts of the label that are singular at q (nq,) [rad]."""
        ...

    def self_motions(self, T: Array, limits: Limits | None = None) -> Sequence[SelfMotion]:
        """The self-motions that hold the flange at T (4, 4); arcs that are outside the limits may
        be left out.
        """
        ...

    def distance_to_reach(self, T: Array) -> float | None:
        """Distance [m] by which T (4, 4) must shift, with its orientation kept, to have a solution;
        None if unknown.
        """
        ...


@dataclass(frozen=True, eq=False)
class _Reached:
    """Configurations q (n, nq) [rad] of one pose that forward kinematics confirms, and the curve of
    each, if any.
    """

    q: Array
    labels: list[BranchLabel]
    curves: list[SelfMotion | None]

    def principal(self, form: ClosedForm, chain: Chain) -> list[PrincipalSolution]:
        """All of them; nobody may write to q from here on."""
        self.q.setflags(write=False)
        singularities = Singularities(chain, self.q, form.singular_parts)
        return list(
            map(
                PrincipalSolution,
                self.q,
                self.labels,
                self.curves,
                repeat(singularities),
                range(len(self.q)),
            )
        )


class ClosedFormInverseKinematics:
    """`InverseKinematics` by a closed form, each solution confirmed by forward kinematics."""

    def __init__(self, robot: Robot, form: ClosedForm) -> None:
        self._limits = robot.limits
        self._form = form
        self._chain = Chain.of(robot.model)

    @property
    def complete(self) -> bool:
        """Whether every branch is found: `InverseKinematics`."""
        return self._form.complete

    def label(self, q: Array) -> BranchLabel:
        """The branch of a configuration q (nq,) [rad]. A full turn of a joint does not change
        it."""
        return self._form.label(q)

    def branches(self, T_base_flange: Array, members: int = MEMBERS) -> list[PrincipalSolution]:
        """Every branch that reaches the flange pose (4, 4), and members of every self-motion:
        `InverseKinematics`.
        """
        return self._reached(T_base_flange, members, None).principal(self._form, self._chain)

    def _reached(self, T_base_flange: Array, members: int, limits: Limits | None) -> _Reached:
        """What `branches` returns, less the arcs of self-motions that are outside the limits."""
        T = _orthonormal(T_base_flange)
        q, known = self._form.solve(T)
        labels = list(known)
        curves: list[SelfMotion | None] = [None] * len(labels)
        motions = self._form.self_motions(T, limits)
        if motions:
            each = max(LEAST_OF_EACH, min(members, MOST_IN_ALL * members // len(motions)))
            parameters = [spread(motion, each) for motion in motions]
            configurations = _members(motions, parameters)
            if members >= WHOLE:
                found = zip(motions, parameters, configurations, strict=True)
                configurations = [without_gaps(motion, u, q) for motion, u, q in found]
            for motion, of_motion in zip(motions, configurations, strict=True):
                labels += [motion.label] * len(of_motion)
                curves += [None if is_point(motion) else motion] * len(of_motion)
            q = np.vstack([q, *configurations])
        elif self._form.confirmed:
            return _Reached(q, labels, curves)
        reached = self._confirmed(_Reached(q, labels, curves), T, len(motions) > 1)
        others = _unseen(motions, reached, limits) if motions and limits is not None else []
        if not others:
            return reached
        more = _Reached(
            np.vstack([q for _, q in others]),
            [each.label for each, _ in others],
            [each for each, _ in others],
        )
        more = self._confirmed(more, T, False)
        return _Reached(
            np.vstack([reached.q, more.q]),
            reached.labels + more.labels,
            reached.curves + more.curves,
        )

    def _confirmed(self, found: _Reached, T: Array, several: bool) -> _Reached:
        """What is found less what does not reach T (4, 4), so that no answer is wrong; and if there
        are several curves, less one of two that are the same: two of a redundant arm's curves meet
        at an end that both have."""
        off = self._chain.flange(found.q) - T
        if not several and np.abs(off).max(initial=0.0) < ACCURACY / 4:
            return found
        # the sum of the squares of a rotation's error is twice that of its angle
        all_, place = (
            np.einsum("ijk,ijk->i", off, off),
            np.einsum("ij,ij->i", off[:, :3, 3], off[:, :3, 3]),
        )
        q, missed = found.q, np.sqrt(np.maximum(place, (all_ - place) / 2))
        isolated = np.array([curve is None for curve in found.curves], dtype=bool)
        q, missed = at_the_edge(self._chain, q, missed, isolated & (missed >= ACCURACY), T)
        chosen = np.flatnonzero(missed < np.where(isolated, REACH.missed, ACCURACY))
        if several:
            chosen = chosen[distinct(q[chosen], missed[chosen])]
        kept = chosen.tolist()
        return _Reached(q[chosen], [found.labels[k] for k in kept], [found.curves[k] for k in kept])

    def solve(
        self,
        T_base_tcp: Array,
        T_flange_tcp: Array | None = None,
        limits: Limits | None = None,
        windings: bool = True,
        target: str = "goal",
        members: int = MEMBERS,
    ) -> list[LimitedSolution]:
        """Every configuration inside the limits that puts the TCP at T_base_tcp (4, 4): see
        `InverseKinematics`.
        """
        T = T_base_tcp if T_flange_tcp is None else flange_pose(T_base_tcp, T_flange_tcp)
        limits = self._limits if limits is None else limits
        try:
            reached = self._reached(T, members, limits)
            reachable = len(reached.q) > 0 or bool(self.branches(T, members))
        except SingularPose as error:
            raise SingularPose(target, error.smallest_singular_value) from None
        if not reachable:
            distance = self._form.distance_to_reach(_orthonormal(T))
            reached = self._reached_beside(T, members, limits, distance)
            if not len(reached.q):
                raise out_of_reach(distance, target)
        nearest, held = nearest_turns(reached.q, limits)
        principal = reached.principal(self._form, self._chain)
        owners = list(compress(principal, held))
        q = nearest if len(owners) == len(nearest) else nearest[np.flatnonzero(held)]
        if windings:
            q, owners = _wound(q, owners, limits)
        if not owners:
            raise UnreachablePose(
                target,
                None,
                f"The {target} pose is within reach, but every arm configuration for it violates a "
                "position limit: "
                "widen limits.position or move the pose.",
            )
        q.setflags(write=False)
        distances = np.minimum(q - limits.q_min, limits.q_max - q).min(axis=1).tolist()
        return list(map(LimitedSolution, q, owners, distances))

    def _reached_beside(
        self, T: Array, members: int, limits: Limits, distance: float | None
    ) -> _Reached:
        """What is reached beside a flange pose T (4, 4) that is out of reach by a `distance` [m]
        within `Reach`.
        """
        nothing = _Reached(np.zeros((0, self._chain.nq)), [], [])
        # a redundant arm knows all of its self-motions; another one may be on one that it does not
        # know
        least = 0.0 if self._chain.nq > 6 else REACH.rounding
        if distance is None or not least <= distance <= REACH.beyond:
            return nothing
        for direction in product((-1.0, 0.0, 1.0), repeat=3):
            if any(direction):
                beside = T.copy()
                beside[:3, 3] += REACH.beyond * np.array(direction) / np.linalg.norm(direction)
                with suppress(SingularPose):
                    reached = self._reached(beside, members, limits)
                    if len(reached.q):
                        return reached
        return nothing


def _wound(
    q: Array, owners: Sequence[PrincipalSolution], limits: Limits
) -> tuple[Array, list[PrincipalSolution]]:
    """Configurations q (n, nq) [rad] and the branch of each, with every full turn within limits of
    those that are on no curve."""
    wound, found = [np.zeros((0, q.shape[1]))], list[PrincipalSolution]()
    for branch, near in zip(owners, q, strict=True):
        if branch.self_motion is None:
            wound.append(
                np.array(
                    list(product(*full_turn_alternatives(branch.q, limits.q_min, limits.q_max)))
                )
            )
        else:
            wound.append(near[None])
        found += [branch] * len(wound[-1])
    return np.concatenate(wound), found


def _members(motions: Sequence[SelfMotion], parameters: Sequence[Array]) -> list[Array]:
    """Configurations (n, nq) [rad] of each of the self-motions of one pose at its parameters
    (n,)."""
    found = list[Array]()
    for kind, group in groupby(
        zip(motions, parameters, strict=True), key=lambda each: type(each[0])
    ):
        alike, at = zip(*group, strict=True)
        together = _TOGETHER.get(kind)
        found += (
            together(alike, at)
            if together
            else [motion.at(u) for motion, u in zip(alike, at, strict=True)]
        )
    return found


def _unseen(
    motions: Sequence[SelfMotion], reached: _Reached, limits: Limits
) -> list[tuple[SelfMotion, Array]]:
    """The self-motions that no configuration within the limits stands for, though they have some,
    and of each the middle one (1, nq) of many that are. Its members may be outside, and an end that
    is not may count as another's."""
    inside = nearest_turns(reached.q, limits)[1]
    held = {id(curve) for curve, each in zip(reached.curves, inside, strict=True) if each}
    found = list[tuple[SelfMotion, Array]]()
    for motion in motions:
        if id(motion) not in held and not is_point(motion):
            # without its ends: they are there as another's, if they are inside
            many = motion.at(spread(motion, MANY)[1:-1])
            within = np.flatnonzero(nearest_turns(many, limits)[1])
            if len(within):
                found.append((motion, many[within[[len(within) // 2]]]))
    return found


# kinds of self-motions whose members are computed together, of all that hold one pose
_TOGETHER: dict[type, Callable[[Any, Sequence[Array]], list[Array]]] = {
    RedundantCurve: redundant_curve.members,
    TracedCurve: traced_curve.members,
}


def _orthonormal(T: Array) -> Array:
    """T with its rotation nearer to orthonormal: one Newton step of the polar decomposition squares
    the error.
    """
    polished = np.array(T, dtype=float)
    R = polished[:3, :3]
    polished[:3, :3] = 1.5 * R - 0.5 * R @ R.T @ R
    return polished
