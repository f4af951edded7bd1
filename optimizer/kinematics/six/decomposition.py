"""Six-joint arms with three parallel axes or three that meet: solved by EAIK, then exactly by
Newton's method.

EAIK (D. Ostermeier, J. Külz, M. Althoff, "Automatic geometric decomposition for analytical inverse
kinematics", 2025) reduces such an arm to subproblems with closed forms. Its arm here is the
simplest one nearby (`joint_axes`): the arm itself, or the one that a calibrated arm deviates from.
What it returns, its least-squares approaches included where they come near the pose, are starts on
the exact arm.

They tell all branches but next to a singularity, where EAIK loses rows and an arm that deviates has
other branches than the simplest one. More starts are tried there. Only of an arm with a spherical
wrist on an ortho-parallel base, whose singularities are treated by formulas, are the solutions
`complete`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import eaik.pybindings.EAIK as eaik
import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.exceptions import SingularPose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain, miss, pose_error
from joulepath.optimizer.kinematics.forward import link_frames
from joulepath.optimizer.kinematics.isolated import SINGULAR_VALUE, distinct, lies_on_a_curve
from joulepath.optimizer.kinematics.jacobians import geometric_jacobian
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.named_branches import NamedBranches, in_order, numbered
from joulepath.optimizer.kinematics.newton import EXACT, solved
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.six.aligned_wrist import AlignedWrist
from joulepath.optimizer.kinematics.six.spherical_wrist import (
    ALIGNED,
    LABELS,
    SphericalWrist,
    branch_numbers,
)
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from joulepath.optimizer.kinematics.six.valley import along_valleys
from joulepath.optimizer.kinematics.six.wrist_angles import WristAngles
from joulepath.optimizer.problem.branches import BranchLabel, NumberedBranch

# greatest difference [m, rad] of an arm from the simplest one nearby by which it counts as this
# one: that of angles written with ten digits
ONE_AND_THE_SAME = 1e-9
# greatest difference [m, rad] from an arm of Universal Robots' form by which the names of its
# branches are those
NEAR_UR = 5e-3
# error [m, rad] of a start beyond which it is none: beside a fold, and on an arm that deviates
NEAR, NEAR_DEVIATING = 1e-5, 0.03
# error [m, rad] of a solution, and that from which on it is improved: both are far below what is
# promised
SOLVED, IMPROVED = 1e-11, 2e-12
# smallest singular value below which more starts are tried: a branch of the simplest arm need not
# be near one there
WEAK = 0.1
# there, the pose is moved by these [m, rad], and solutions along their weakest direction by these
# [rad]
SHIFTS, STRIDES = (1e-6, 1e-3), (1e-5, 1e-3, 0.03, 0.2, 0.7, 1.4, 2.1, 2.8, 3.1)
# smallest singular value below which the curve is followed on which the pose nearly holds
VALLEY = 0.01
# sine of elbow and wrist, and distance [m] from the shoulder's singularity, beyond which a
# spherical wrist is regular
REGULAR = 1e-4
# step [rad] of the elbow beside its singularity, and the sine below which it is taken
BESIDE_FOLD = 4e-6
# sines, and distance [m] from the shoulder's singularity, below which two of them are refused
TWICE_SINGULAR = 5e-6
# sine of the wrist angle below which a spherical wrist's angles are computed here: EAIK takes 1e-6
# for aligned
NEARLY_ALIGNED = 1e-4


@dataclass(frozen=True, eq=False)
class _Found:
    """The configurations (n, 6) [rad] of a pose, their labels, and its self-motions."""

    q: Array
    labels: list[BranchLabel]
    motions: list[AlignedWrist]


class DecomposedArm:
    """`ClosedForm` of an arm that EAIK knows a decomposition of."""

    confirmed = True

    def __init__(
        self, chain: Chain, axes: JointAxes, names: NamedBranches | None, decomposition: eaik.Robot
    ) -> None:
        self._chain, self._names, self._decomposition = chain, names, decomposition
        self._R_zero = axes.T_zero[:3, :3]
        self.complete = isinstance(names, SphericalWrist) and self._deviation() < ONE_AND_THE_SAME
        self._near = NEAR if self.complete else NEAR_DEVIATING
        self._wrist = (
            WristAngles(chain, names)
            if isinstance(names, SphericalWrist) and self.complete
            else None
        )
        # both the isolated configurations and the self-motions of a pose are asked for
        self._found = lru_cache(maxsize=4)(self._solve)

    @classmethod
    def of(cls, model: pin.Model) -> DecomposedArm | None:
        """The form of a Pinocchio model with a frame `flange`; None if it has not six joints or no
        decomposition.
        """
        if model.nq != 6:
            return None
        chain = Chain.of(model)
        axes = JointAxes.of(chain).simplified()
        steps = np.diff(axes.points, axis=0)
        offsets = np.vstack([axes.points[:1], steps, axes.T_zero[:3, 3] - axes.points[-1]])
        decomposition = eaik.Robot(axes.directions.T, offsets.T, np.eye(3), [], True)
        if not decomposition.has_known_decomposition():
            return None
        names = SphericalWrist.of(axes) or URClosedForm.of(model, NEAR_UR)
        return cls(chain, axes, names, decomposition)

    def label(self, q: Array) -> BranchLabel:
        """The branch of a configuration (6,) [rad]; a number is that of the nearest solution, 1 on
        a self-motion.
        """
        if self._names is not None:
            return self._names.label(q)
        try:
            return numbered(q, self.solve(self._chain.flange(q[None])[0])[0])
        except SingularPose:
            return NumberedBranch(1)

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """The parts of the label that are singular at a configuration (6,) [rad]."""
        return () if self._names is None else self._names.singular_parts(q)

    def solve(self, T: Array) -> tuple[Array, list[BranchLabel]]:
        """The isolated configurations (n, 6) [rad] in [-pi, pi] that put the flange at T (4, 4),
        and their labels.

        Where branches meet, they count once. Raises SingularPose if one lies on a self-motion that
        is not known here.
        """
        found = self._found(np.ascontiguousarray(T, dtype=float).tobytes())
        return found.q, found.labels

    def self_motions(self, T: Array, limits: Limits | None = None) -> list[AlignedWrist]:
        """The self-motions that hold the flange at T (4, 4): one for each position of the arm that
        aligns the wrist.
        """
        return self._found(np.ascontiguousarray(T, dtype=float).tobytes()).motions

    def distance_to_reach(self, T: Array) -> float | None:
        """Distance [m] by which T (4, 4) must shift, with its orientation kept, to have a solution;
        None if unknown.
        """
        return None if self._wrist is None else self._wrist.wrist.distance_to_reach(T)

    def _solve(self, matrix: bytes) -> _Found:
        T = np.frombuffer(matrix).reshape(4, 4)
        rows = self._rows(T)
        if (found := self._regular(rows, T)) is not None:
            return found
        if self._wrist is not None and self._wrist.wrist.turns_freely(T):
            raise SingularPose("goal", 0.0)
        motions, q, frames = list[AlignedWrist](), rows, link_frames(self._chain.placements, rows)
        if self._wrist is not None and len(rows):
            sines = self._wrist.sines(frames, T)
            if self._is_twice_singular(rows, sines):
                raise SingularPose("goal", 0.0)
            near = sines < NEARLY_ALIGNED
            if near.any():
                motions, wrists = self._aligned(rows[near], T)
                rows = np.vstack([rows[~near], *wrists])
            q = np.vstack([rows, *self._beside_folds(rows)])
            frames = link_frames(self._chain.placements, q)
        q, smallest = self._exact(q, frames, T)
        # a spherical wrist's curves are known
        for k in np.flatnonzero(smallest < SINGULAR_VALUE) if self._wrist is None else ():
            if lies_on_a_curve(self._chain, q[k], T):
                raise SingularPose("goal", float(smallest[k]))
        if self._names is None:
            q = in_order(q)
            labels: list[BranchLabel] = [numbered(each, q) for each in q]
        else:
            names = [self._names.label(each) for each in q]
            order = sorted(range(len(q)), key=lambda k: (str(names[k]), *q[k].tolist()))
            q, labels = q[order], [names[k] for k in order]
        return _Found(q, labels, motions)

    def _regular(self, rows: Array, T: Array) -> _Found | None:
        """The rows (n, 6), if all are exact, each of a branch of its own, and far from any
        singularity; else None.

        Nearly every pose of an arm with a spherical wrist is so.
        """
        if self._wrist is None or not len(rows) or np.abs(rows).max() > np.pi:
            return None
        measures = self._wrist.wrist.measures(rows)
        if (
            np.abs(measures).min() < REGULAR
            or np.abs(self._chain.flange(rows) - T).max() > IMPROVED / 2
        ):
            return None
        numbers = branch_numbers(measures)
        order = numbers.argsort()
        branches = numbers[order].tolist()
        return (
            _Found(rows[order], [LABELS[k] for k in branches], [])
            if len(set(branches)) == len(branches)
            else None
        )

    def _is_twice_singular(self, rows: Array, sines: Array) -> bool:
        """Whether two singularities meet in one of rows (n, 6), whose wrist angles have the sines
        (n,).

        There the formulas for each alone lose branches.
        """
        assert self._wrist is not None
        arms = np.abs(self._wrist.wrist.measures(rows)[:, :2])
        return bool((np.column_stack([arms, sines]) < TWICE_SINGULAR).sum(axis=1).max() > 1)

    def _rows(self, T: Array) -> Array:
        """Configurations (n, 6) [rad] of the simplest arm, least-squares approaches included; none
        out of reach.
        """
        turned = np.array(T)
        turned[:3, :3] = T[:3, :3] @ self._R_zero.T
        try:
            rows = np.array(self._decomposition.calculate_IK(turned).Q)
        except RuntimeError:
            return np.zeros((0, 6))
        rows = rows.reshape(-1, 6)
        return np.asarray(rows[np.isfinite(rows).all(axis=1)])

    def _aligned(self, rows: Array, T: Array) -> tuple[list[AlignedWrist], list[Array]]:
        """The self-motions and the other configurations of the arms in rows (n, 6), whose wrists
        are nearly aligned.
        """
        assert self._wrist is not None
        motions, wrists = list[AlignedWrist](), list[Array]()
        for k in distinct(rows[:, :3], np.zeros(len(rows))):
            found = self._wrist.near_alignment(rows[k, :3], T)
            if not isinstance(found, AlignedWrist):
                wrists += [np.array(found)]
            elif miss(pose_error(self._chain.flange(found.q[None]), T))[0] < 2 * ALIGNED:
                motions.append(found)
        return motions, wrists

    def _beside_folds(self, rows: Array) -> list[Array]:
        """Starts (n, 6) on both sides of a stretched or folded elbow: next to it EAIK has one row
        for two branches.
        """
        assert self._wrist is not None
        folds = rows[np.abs(self._wrist.wrist.measures(rows)[:, 1]) < BESIDE_FOLD]
        return [each for q in folds for each in self._wrist.beside_fold(q, BESIDE_FOLD)]

    def _exact(self, q: Array, frames: Array, T: Array) -> tuple[Array, Array]:
        """The distinct solutions (n, 6) in [-pi, pi] near starts q (m, 6), and their smallest
        singular values (n,).
        """
        q, missed, smallest = self._improved(q, frames, T)
        near = missed < self._near
        # of an aligned wrist EAIK's rows are far from the pose, but singular
        more = self._more_starts(q, smallest, near, T)
        q, missed, smallest = q[near], missed[near], smallest[near]
        if len(more):
            q_more, missed_more, smallest_more = self._improved(
                more, link_frames(self._chain.placements, more), T
            )
            q, missed = np.vstack([q, q_more]), np.append(missed, missed_more)
            smallest = np.append(smallest, smallest_more)
        # of an arm that deviates, least errors beside a singularity are not at the edge of the
        # reach
        at_edge = (missed < REACH.beyond) & (smallest < REACH.singular) & self.complete
        done = (missed < SOLVED) | at_edge
        q, missed, smallest = np.clip(wrapped(q[done]), -np.pi, np.pi), missed[done], smallest[done]
        chosen = distinct(q, missed, smallest)
        return q[chosen], smallest[chosen]

    def _improved(self, q: Array, frames: Array, T: Array) -> tuple[Array, Array, Array]:
        """Starts q (n, 6), those that come near the pose improved; what they miss (n,), smallest
        singular values (n,), inf where they need not be known."""
        T_reached = frames[:, -1] @ self._chain.T_last_flange
        missed = miss(pose_error(T_reached, T))
        singular = self._may_be_singular(q)
        moved = np.flatnonzero(
            (missed > np.where(singular, EXACT, IMPROVED)) & (missed < self._near)
        )
        if len(moved):
            q = q.copy()
            q[moved], missed[moved] = solved(self._chain, q[moved], T)
            frames = link_frames(self._chain.placements, q)
            T_reached = frames[:, -1] @ self._chain.T_last_flange
        smallest = np.full(len(q), np.inf)
        if singular.any():
            jacobian = geometric_jacobian(frames[singular], T_reached[singular, :3, 3])
            smallest[singular] = np.linalg.svd(jacobian, compute_uv=False)[:, -1]
        return q, missed, smallest

    def _may_be_singular(self, q: Array) -> Mask:
        """False where the parts of a spherical wrist's label say that a row of q (n, 6) is not; the
        singular value tells more."""
        if self._wrist is None:
            return np.ones(len(q), dtype=bool)
        return np.asarray((np.abs(self._wrist.wrist.measures(q)) < REGULAR).any(axis=1))

    def _more_starts(self, q: Array, smallest: Array, near: Mask, T: Array) -> Array:
        """Starts (n, 6) around nearly singular ones of q (m, 6): of poses nearby, and along their
        weakest direction.

        None for a spherical wrist, which needs none.
        """
        weak = q[smallest < WEAK]
        if self._wrist is not None or not len(weak):
            return np.zeros((0, 6))
        starts, floor = [weak], q[near & (smallest < VALLEY)]
        if len(floor):
            starts.append(
                along_valleys(self._chain, floor[distinct(floor, np.zeros(len(floor)))], T)
            )
        for shift in SHIFTS:
            for axis in range(6):
                for side in (shift, -shift):
                    twist = np.zeros(6)
                    twist[axis] = side
                    starts.append(self._rows(T @ pin.exp6(twist).homogeneous))
        null = np.linalg.svd(self._chain.flange_and_jacobian(weak)[1])[2][:, -1]
        starts += [weak + side * stride * null for stride in STRIDES for side in (1, -1)]
        q = np.vstack(starts)
        # those of poses nearby are mostly the same
        return q[np.unique(np.round(q, 4), axis=0, return_index=True)[1]]

    def _deviation(self) -> float:
        """Greatest difference [m, rad] of the arm from the simplest one nearby, at some
        configurations.
        """
        q = np.random.default_rng(0).uniform(-np.pi, np.pi, (32, 6))
        T = self._chain.flange(q)
        worst = 0.0
        for each, T_exact in zip(q, T, strict=True):
            simple = np.array(self._decomposition.fwdkin(each))
            simple[:3, :3] = simple[:3, :3] @ self._R_zero
            worst = max(worst, float(miss(pose_error(simple[None], T_exact))[0]))
        return worst
