"""Six-joint arms with three parallel or three meeting axes: solved by EAIK, then refined by
Newton's method.

EAIK (D. Ostermeier, J. Külz, M. Althoff, "Automatic geometric decomposition for analytical inverse
kinematics", 2025) reduces such an arm to subproblems with closed forms. It is applied to the
nearest simple arm (`joint_axes`): the arm itself, or the one that a calibrated arm deviates from.
Its solutions, including least-squares approximations near the pose, seed Newton's method on the
exact arm.

The seeds cover all branches except next to a singularity: EAIK loses rows there, and an arm with
deviations has other branches than the simple one. More seeds are tried there, and a search from
many starts (`multi_start`) follows if no seed reaches the pose. The solutions are
`complete` only for an arm with a spherical wrist on an ortho-parallel base, whose singularities are
solved by formulas.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.exceptions import SingularPose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain, pose_error, twist_size
from joulepath.optimizer.kinematics.forward import link_frames
from joulepath.optimizer.kinematics.isolated import ISOLATED, distinct, lies_on_a_curve
from joulepath.optimizer.kinematics.jacobians import geometric_jacobian
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.newton import NEWTON, solved
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.six.aligned_wrist import AlignedWrist
from joulepath.optimizer.kinematics.six.multi_start import MultiStart
from joulepath.optimizer.kinematics.six.named_branches import NamedBranches
from joulepath.optimizer.kinematics.six.nearly_singular_seeds import SEEDS, seeds_around
from joulepath.optimizer.kinematics.six.simple_arm import SimpleArm
from joulepath.optimizer.kinematics.six.spherical_wrist import (
    LABELS,
    SPHERICAL_WRIST,
    SphericalWrist,
    branch_numbers,
)
from joulepath.optimizer.kinematics.six.ur_geometry import URGeometry
from joulepath.optimizer.kinematics.six.wrist_angles import WristAngles
from joulepath.optimizer.problem.branches import BranchLabel


@dataclass(frozen=True)
class DecompositionSettings:
    """Tolerances of the decomposition and seeds near singularities."""

    identical: float = 1e-9
    """Largest difference from the nearest simple arm of an arm identical to it [m, rad]: the error
    of angles written with ten digits.
    """
    ur_deviation: float = 5e-3
    """Largest difference from an arm of Universal Robots' form whose branch names apply [m,
    rad].
    """
    seed_error: float = 1e-5
    """Largest pose error of an accepted seed beside a fold [m, rad]."""
    deviating_seed_error: float = 0.03
    """Largest pose error of an accepted seed for an arm with deviations [m, rad]."""
    solved: float = 1e-11
    """Largest pose error of a solution [m, rad], far below the promised accuracy."""
    refined: float = 2e-12
    """Pose error above which a seed is refined [m, rad]."""
    regular: float = 1e-4
    """Sine of elbow and wrist, and distance from the shoulder's singularity [m], above which a
    spherical wrist is regular.
    """
    fold_step: float = 4e-6
    """Step of the elbow to both sides of its singularity [rad], and the sine below which it is
    taken.
    """
    twice_singular: float = 5e-6
    """Sines, and distance from the shoulder's singularity [m], below which two simultaneous
    singularities are refused.
    """
    nearly_aligned: float = 1e-4
    """Sine of the wrist angle below which the wrist is solved here; EAIK treats 1e-6 as aligned."""


SETTINGS = DecompositionSettings()


@dataclass(frozen=True, eq=False)
class _Found:
    """Configurations (n, 6) [rad] of a pose, their labels, and the self-motions."""

    q: Array
    labels: list[BranchLabel]
    motions: list[AlignedWrist]


class DecomposedArm:
    """`PoseSolver` of an arm with a decomposition known to EAIK."""

    confirmed = True

    def __init__(self, chain: Chain, names: NamedBranches, simple: SimpleArm) -> None:
        self._chain, self._names, self._simple = chain, names, simple
        self._search = MultiStart(chain)
        self.complete = (
            isinstance(names, SphericalWrist) and simple.deviation(chain) < SETTINGS.identical
        )
        self._seed_error = SETTINGS.seed_error if self.complete else SETTINGS.deviating_seed_error
        self._wrist = (
            WristAngles(chain, names)
            if isinstance(names, SphericalWrist) and self.complete
            else None
        )
        # A pose is asked for its isolated configurations and then for its self-motions.
        self._found = lru_cache(maxsize=4)(self._solve)

    @classmethod
    def of(cls, model: pin.Model) -> DecomposedArm | None:
        """Form of a Pinocchio model with a frame `flange`; None unless it has six joints and a
        decomposition.
        """
        if model.nq != 6:
            return None
        chain = Chain.of(model)
        axes = JointAxes.of(chain).simplified()
        simple = SimpleArm.of(axes)
        if simple is None:
            return None
        names = SphericalWrist.of(axes) or URGeometry.of(model, SETTINGS.ur_deviation)
        # `multi_start` finds more configurations near singularities for axes of other forms
        return None if names is None else cls(chain, names, simple)

    def label(self, q: Array) -> BranchLabel:
        """Branch of a configuration (6,) [rad]."""
        return self._names.label(q)

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """Singular parts of the label at a configuration (6,) [rad]."""
        return self._names.singular_parts(q)

    def solve(self, T: Array) -> tuple[Array, list[BranchLabel]]:
        """Isolated configurations (n, 6) [rad] in [-pi, pi] of the flange pose T (4, 4), and their
        labels.

        Meeting branches count once.

        Raises:
            SingularPose: a configuration lies on a self-motion of unknown form.
        """
        found = self._found(np.ascontiguousarray(T, dtype=float).tobytes())
        return found.q, found.labels

    def self_motions(self, T: Array, limits: Limits | None = None) -> list[AlignedWrist]:
        """Self-motions of the flange pose T (4, 4): one for each position of the arm with an
        aligned wrist.
        """
        return self._found(np.ascontiguousarray(T, dtype=float).tobytes()).motions

    def distance_to_reach(self, T: Array) -> float | None:
        """Shortest shift [m] of T (4, 4), at constant orientation, to a reachable pose; None if
        unknown.
        """
        return None if self._wrist is None else self._wrist.wrist.distance_to_reach(T)

    def _solve(self, matrix: bytes) -> _Found:
        T = np.frombuffer(matrix).reshape(4, 4)
        rows = self._simple.rows(T)
        if (found := self._regular(rows, T)) is not None:
            return found
        if self._wrist is not None and self._wrist.wrist.turns_freely(T):
            raise SingularPose("goal", 0.0)
        motions, q, frames = list[AlignedWrist](), rows, link_frames(self._chain.placements, rows)
        if self._wrist is not None and len(rows):
            sines = self._wrist.sines(frames, T)
            if self._is_twice_singular(rows, sines):
                raise SingularPose("goal", 0.0)
            near = sines < SETTINGS.nearly_aligned
            if near.any():
                motions, wrists = self._aligned(rows[near], T)
                rows = np.vstack([rows[~near], *wrists])
            q = np.vstack([rows, *self._beside_folds(rows)])
            frames = link_frames(self._chain.placements, q)
        q, smallest = self._exact(q, frames, T)
        if not len(q) and not motions and self.distance_to_reach(T) is None:
            q, smallest = self._search.configurations(T), np.zeros(0)
        # The self-motions of a spherical wrist are known.
        for k in np.flatnonzero(smallest < ISOLATED.singular_value) if self._wrist is None else ():
            if lies_on_a_curve(self._chain, q[k], T):
                raise SingularPose("goal", float(smallest[k]))
        names = [self._names.label(each) for each in q]
        order = sorted(range(len(q)), key=lambda k: (str(names[k]), *q[k].tolist()))
        return _Found(q[order], [names[k] for k in order], motions)

    def _regular(self, rows: Array, T: Array) -> _Found | None:
        """The rows (n, 6) if all are exact, of distinct branches and far from any singularity;
        otherwise None.

        Nearly every pose of an arm with a spherical wrist is regular.
        """
        if self._wrist is None or not len(rows) or np.abs(rows).max() > np.pi:
            return None
        measures = self._wrist.wrist.measures(rows)
        if (
            np.abs(measures).min() < SETTINGS.regular
            or np.abs(self._chain.flange(rows) - T).max() > SETTINGS.refined / 2
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
        """Whether two singularities coincide in one of the rows (n, 6), given the sines (n,) of
        their wrist angles.

        The formulas for a single singularity lose branches there.
        """
        assert self._wrist is not None
        arms = np.abs(self._wrist.wrist.measures(rows)[:, :2])
        return bool(
            (np.column_stack([arms, sines]) < SETTINGS.twice_singular).sum(axis=1).max() > 1
        )

    def _aligned(self, rows: Array, T: Array) -> tuple[list[AlignedWrist], list[Array]]:
        """Self-motions and other configurations of rows (n, 6) with nearly aligned wrists."""
        assert self._wrist is not None
        motions, wrists = list[AlignedWrist](), list[Array]()
        for k in distinct(rows[:, :3], np.zeros(len(rows))):
            found = self._wrist.near_alignment(rows[k, :3], T)
            if not isinstance(found, AlignedWrist):
                wrists += [np.array(found)]
            elif (
                twist_size(pose_error(self._chain.flange(found.q[None]), T))[0]
                < 2 * SPHERICAL_WRIST.aligned
            ):
                motions.append(found)
        return motions, wrists

    def _beside_folds(self, rows: Array) -> list[Array]:
        """Seeds (n, 6) on both sides of a stretched or folded elbow, where EAIK has one row for two
        branches.
        """
        assert self._wrist is not None
        folds = rows[np.abs(self._wrist.wrist.measures(rows)[:, 1]) < SETTINGS.fold_step]
        return [each for q in folds for each in self._wrist.beside_fold(q, SETTINGS.fold_step)]

    def _exact(self, q: Array, frames: Array, T: Array) -> tuple[Array, Array]:
        """Distinct solutions (n, 6) in [-pi, pi] from seeds q (m, 6), and their smallest singular
        values (n,).
        """
        q, residual, smallest = self._refined(q, frames, T)
        near = residual < self._seed_error
        # EAIK's rows of an aligned wrist are singular, but far from the pose.
        more = self._more_seeds(q, smallest, near, T)
        q, residual, smallest = q[near], residual[near], smallest[near]
        if len(more):
            q_more, residual_more, smallest_more = self._refined(
                more, link_frames(self._chain.placements, more), T
            )
            q, residual = np.vstack([q, q_more]), np.append(residual, residual_more)
            smallest = np.append(smallest, smallest_more)
        # For an arm with deviations, a least pose error beside a singularity is not at the edge of
        # the workspace.
        at_edge = (residual < REACH.beyond) & (smallest < REACH.singular) & self.complete
        done = (residual < SETTINGS.solved) | at_edge
        q, residual, smallest = q[done], residual[done], smallest[done]
        q = np.clip(wrapped(q), -np.pi, np.pi)
        chosen = distinct(q, residual, smallest)
        return q[chosen], smallest[chosen]

    def _refined(self, q: Array, frames: Array, T: Array) -> tuple[Array, Array, Array]:
        """Refines the seeds q (n, 6) near the pose.

        Returns:
            The configurations (n, 6) [rad], their pose errors (n,), and their smallest singular
            values (n,), infinite for rows that cannot be singular.
        """
        T_reached = frames[:, -1] @ self._chain.T_last_flange
        residual = twist_size(pose_error(T_reached, T))
        singular = self._may_be_singular(q)
        moved = np.flatnonzero(
            (residual > np.where(singular, NEWTON.exact, SETTINGS.refined))
            & (residual < self._seed_error)
        )
        if len(moved):
            q = q.copy()
            q[moved], residual[moved] = solved(self._chain, q[moved], T)
            frames = link_frames(self._chain.placements, q)
            T_reached = frames[:, -1] @ self._chain.T_last_flange
        smallest = np.full(len(q), np.inf)
        if singular.any():
            jacobian = geometric_jacobian(frames[singular], T_reached[singular, :3, 3])
            smallest[singular] = np.linalg.svd(jacobian, compute_uv=False)[:, -1]
        return q, residual, smallest

    def _may_be_singular(self, q: Array) -> Mask:
        """Mask of the rows of q (n, 6) that the measures of a spherical wrist do not prove
        regular.
        """
        if self._wrist is None:
            return np.ones(len(q), dtype=bool)
        return np.asarray((np.abs(self._wrist.wrist.measures(q)) < SETTINGS.regular).any(axis=1))

    def _more_seeds(self, q: Array, smallest: Array, near: Mask, T: Array) -> Array:
        """More seeds (n, 6) around nearly singular seeds; none for a spherical wrist."""
        weak = q[smallest < SEEDS.nearly_singular]
        if self._wrist is not None or not len(weak):
            return np.zeros((0, 6))
        on_curve = q[near & (smallest < SEEDS.curve_singular_value)]
        return seeds_around(self._chain, self._simple.rows, weak, on_curve, T)
