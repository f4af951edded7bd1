"""Inverse kinematics of a pose solver, with every solution confirmed by forward kinematics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import compress, groupby, product, repeat
from typing import Any, Protocol

import numpy as np

from joulepath.models.robot import Array, Limits, Robot
from joulepath.optimizer.exceptions import NoConfigurationFound, SingularPose, UnreachablePose
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.full_turns import full_turn_alternatives, nearest_turns
from joulepath.optimizer.kinematics.ik_solutions import (
    LimitedSolution,
    PrincipalSolution,
    Singularities,
)
from joulepath.optimizer.kinematics.isolated import distinct
from joulepath.optimizer.kinematics.reach import REACH, at_the_edge, out_of_reach
from joulepath.optimizer.kinematics.self_motion import SelfMotion, is_point, spread
from joulepath.optimizer.kinematics.self_motion_members import (
    one_in_each_part,
    up_to_limits,
    without_gaps,
)
from joulepath.optimizer.kinematics.seven import redundant_curve, traced_curve
from joulepath.optimizer.kinematics.seven.redundant_curve import RedundantCurve
from joulepath.optimizer.kinematics.seven.traced_curve import TracedCurve
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.problem.branches import BranchLabel


@dataclass(frozen=True)
class InverseSettings:
    """Accuracy of solutions, and the numbers of members that represent self-motions."""

    accuracy: float = 1e-9
    """Largest pose error of a solution within reach, by forward kinematics [m, rad]."""
    members: int = 8
    """Default number of members of a self-motion."""
    most_members: int = 4
    """Largest number of members of all self-motions of a pose, relative to the number of one."""
    least_members: int = 2
    """Smallest number of members of each of many self-motions."""
    gapless_members: int = 16
    """Number of members from which on gaps between members are filled, too: the members then
    represent the whole curve.
    """


INVERSE = InverseSettings()


class PoseSolver(Protocol):
    """Solver of the branches of a flange pose, for one family of arms: a closed form, or a
    search.
    """

    @property
    def complete(self) -> bool:
        """Whether every branch is guaranteed to be found."""
        ...

    @property
    def confirmed(self) -> bool:
        """Whether the result of `solve` is already confirmed by forward kinematics."""
        ...

    def label(self, q: Array) -> BranchLabel:
        """Branch of a configuration q (nq,) [rad]."""
        ...

    def solve(self, T: Array) -> tuple[Array, Sequence[BranchLabel]]:
        """Isolated configurations (n, nq) [rad] in [-pi, pi] of the flange pose T (4, 4), and their
        labels.

        Raises:
            SingularPose: the pose is reached on a self-motion of unknown form.
        """
        ...

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """Singular parts of the label at q (nq,) [rad]."""
        ...

    def self_motions(self, T: Array, limits: Limits | None = None) -> Sequence[SelfMotion]:
        """Self-motions of the flange pose T (4, 4); arcs outside the limits may be left out."""
        ...

    def distance_to_reach(self, T: Array) -> float | None:
        """Shortest shift [m] of T (4, 4), at constant orientation, to a reachable pose; None if
        unknown.
        """
        ...


@dataclass(frozen=True, eq=False)
class _Reached:
    """Configurations q (n, nq) [rad] of one pose, with the label and any self-motion of each."""

    q: Array
    labels: list[BranchLabel]
    curves: list[SelfMotion | None]

    def principal(self, solver: PoseSolver, chain: Chain) -> list[PrincipalSolution]:
        """All configurations as solutions; q becomes read-only."""
        self.q.setflags(write=False)
        singularities = Singularities(chain, self.q, solver.singular_parts)
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


class ConfirmedInverseKinematics:
    """`InverseKinematics` by a pose solver, with every solution confirmed by forward kinematics."""

    def __init__(self, robot: Robot, solver: PoseSolver) -> None:
        self._limits = robot.limits
        self._solver = solver
        self._chain = Chain.of(robot.model, robot.coupling)

    @property
    def complete(self) -> bool:
        """Whether every branch is guaranteed to be found."""
        return self._solver.complete

    def label(self, q: Array) -> BranchLabel:
        """Branch of a configuration q (nq,) [rad]; full turns of a joint do not change it."""
        return self._solver.label(q)

    def branches(
        self, T_base_flange: Array, members: int = INVERSE.members
    ) -> list[PrincipalSolution]:
        """Every branch of the flange pose (4, 4), see `InverseKinematics.branches`."""
        return self._reached(T_base_flange, members, None).principal(self._solver, self._chain)

    def solve(
        self,
        T_base_tcp: Array,
        T_flange_tcp: Array | None = None,
        limits: Limits | None = None,
        windings: bool = True,
        target: str = "goal",
        members: int = INVERSE.members,
    ) -> list[LimitedSolution]:
        """Every configuration within the limits of the TCP pose, see `InverseKinematics.solve`."""
        T = T_base_tcp if T_flange_tcp is None else flange_pose(T_base_tcp, T_flange_tcp)
        limits = self._limits if limits is None else limits
        try:
            reached = self._reached(T, members, limits)
            reachable = len(reached.q) > 0 or bool(self.branches(T, members))
        except SingularPose as error:
            raise SingularPose(target, error.smallest_singular_value) from None
        if not reachable:
            distance = self._solver.distance_to_reach(_orthonormal(T))
            reached = self._reached_at_edge(T, members, limits, distance)
            if not len(reached.q):
                raise out_of_reach(self._chain, T, distance, target, self.complete)
        nearest, inside = nearest_turns(reached.q, limits)
        principal = reached.principal(self._solver, self._chain)
        owners = list(compress(principal, inside))
        q = nearest if len(owners) == len(nearest) else nearest[np.flatnonzero(inside)]
        if windings:
            q, owners = _with_full_turns(q, owners, limits)
        if not owners and not self.complete:
            raise NoConfigurationFound(target, within_limits=True)
        if not owners:
            raise UnreachablePose(
                target,
                None,
                f"The {target} pose is within reach, but every arm configuration for it violates a "
                "position limit: widen limits.position or move the pose.",
            )
        q.setflags(write=False)
        distances = np.minimum(q - limits.q_min, limits.q_max - q).min(axis=1).tolist()
        return list(map(LimitedSolution, q, owners, distances))

    def _reached(self, T_base_flange: Array, members: int, limits: Limits | None) -> _Reached:
        """Confirmed configurations of a flange pose, without self-motions outside the limits."""
        T = _orthonormal(T_base_flange)
        q, known = self._solver.solve(T)
        labels = list(known)
        curves: list[SelfMotion | None] = [None] * len(labels)
        motions = self._solver.self_motions(T, limits)
        if motions:
            share = INVERSE.most_members * members // len(motions)
            count = max(INVERSE.least_members, min(members, share))
            parameters = [spread(motion, count) for motion in motions]
            configurations = _members(motions, parameters)
            if members >= INVERSE.gapless_members:
                found = zip(motions, parameters, configurations, strict=True)
                configurations = [_represented(*each, limits) for each in found]
            for motion, of_motion in zip(motions, configurations, strict=True):
                labels += [motion.label] * len(of_motion)
                curves += [None if is_point(motion) else motion] * len(of_motion)
            q = np.vstack([q, *configurations])
        elif self._solver.confirmed:
            return _Reached(q, labels, curves)
        reached = self._confirmed(_Reached(q, labels, curves), T, len(motions) > 1)
        missing = _unrepresented(motions, reached, limits) if motions and limits is not None else []
        if not missing:
            return reached
        more = _Reached(
            np.vstack([q for _, q in missing]),
            [motion.label for motion, _ in missing],
            [motion for motion, _ in missing],
        )
        more = self._confirmed(more, T, False)
        return _Reached(
            np.vstack([reached.q, more.q]),
            reached.labels + more.labels,
            reached.curves + more.curves,
        )

    def _confirmed(self, found: _Reached, T: Array, several: bool) -> _Reached:
        """The configurations that reach T (4, 4) by forward kinematics.

        If there are `several` self-motions, duplicates are dropped: two self-motions of a redundant
        arm may share an end.
        """
        off = self._chain.flange(found.q) - T
        if not several and np.abs(off).max(initial=0.0) < INVERSE.accuracy / 4:
            return found
        # The squared Frobenius norm of a rotation's error is twice the squared angle.
        total = np.einsum("ijk,ijk->i", off, off)
        place = np.einsum("ij,ij->i", off[:, :3, 3], off[:, :3, 3])
        q, residual = found.q, np.sqrt(np.maximum(place, (total - place) / 2))
        isolated = np.array([curve is None for curve in found.curves], dtype=bool)
        q, residual = at_the_edge(
            self._chain, q, residual, isolated & (residual >= INVERSE.accuracy), T
        )
        chosen = np.flatnonzero(residual < np.where(isolated, REACH.residual, INVERSE.accuracy))
        if several:
            chosen = chosen[distinct(q[chosen], residual[chosen])]
        kept = chosen.tolist()
        return _Reached(q[chosen], [found.labels[k] for k in kept], [found.curves[k] for k in kept])

    def _reached_at_edge(
        self, T: Array, members: int, limits: Limits, distance: float | None
    ) -> _Reached:
        """Configurations of a reachable pose next to the flange pose T (4, 4), which is out of
        reach by `distance` [m]; empty beyond the tolerance of `Reach`.
        """
        nothing = _Reached(np.zeros((0, self._chain.nq)), [], [])
        # A redundant arm knows all of its self-motions; another arm may hold the pose on an unknown
        # self-motion if the distance is zero.
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


def _with_full_turns(
    q: Array, owners: Sequence[PrincipalSolution], limits: Limits
) -> tuple[Array, list[PrincipalSolution]]:
    """Configurations q (n, nq) [rad] and the branch of each, where isolated solutions are repeated
    for every combination of full turns within the limits.
    """
    rows, found = [np.zeros((0, q.shape[1]))], list[PrincipalSolution]()
    for branch, near in zip(owners, q, strict=True):
        if branch.self_motion is None:
            turns = full_turn_alternatives(branch.q, limits.q_min, limits.q_max)
            rows.append(np.array(list(product(*turns))))
        else:
            rows.append(near[None])
        found += [branch] * len(rows[-1])
    return np.concatenate(rows), found


# Functions that compute the members of all self-motions of one kind and pose together.
_BATCHED_MEMBERS: dict[type, Callable[[Any, Sequence[Array]], list[Array]]] = {
    RedundantCurve: redundant_curve.members,
    TracedCurve: traced_curve.members,
}


def _members(motions: Sequence[SelfMotion], parameters: Sequence[Array]) -> list[Array]:
    """Configurations (n, nq) [rad] of each self-motion of one pose at its parameters (n,)."""
    found = list[Array]()
    pairs = zip(motions, parameters, strict=True)
    for kind, group in groupby(pairs, key=lambda pair: type(pair[0])):
        of_kind, at = zip(*group, strict=True)
        batched = _BATCHED_MEMBERS.get(kind)
        found += (
            batched(of_kind, at)
            if batched
            else [motion.at(u) for motion, u in zip(of_kind, at, strict=True)]
        )
    return found


def _represented(motion: SelfMotion, u: Array, q: Array, limits: Limits | None) -> Array:
    """Members (m, nq) [rad] that represent a self-motion within the limits, from members q (n, nq)
    at parameters u (n,).
    """
    if limits is not None:
        u, q = up_to_limits(motion, u, q, limits)
    return without_gaps(motion, u, q)


def _unrepresented(
    motions: Sequence[SelfMotion], reached: _Reached, limits: Limits
) -> list[tuple[SelfMotion, Array]]:
    """Self-motions without a reached configuration within the limits, each with a member (1, nq)
    [rad] of every part inside.

    The regular members of a self-motion may all be outside, and a shared end may be kept as a
    member of the other self-motion. Self-motions wholly outside are left out.
    """
    inside = nearest_turns(reached.q, limits)[1]
    represented = set(compress(reached.curves, inside))
    return [
        (motion, q[None])
        for motion in motions
        if motion not in represented and not is_point(motion)
        for q in one_in_each_part(motion, limits)
    ]


def _orthonormal(T: Array) -> Array:
    """T with a rotation closer to orthonormal.

    One Newton step of the polar decomposition squares the error.
    """
    polished = np.array(T, dtype=float)
    R = polished[:3, :3]
    polished[:3, :3] = 1.5 * R - 0.5 * R @ R.T @ R
    return polished
