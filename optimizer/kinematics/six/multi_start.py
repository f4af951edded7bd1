"""Inverse kinematics of any six-joint arm by Newton's method from many starts: the last resort.

Far from singularities, an arm with three parallel or three meeting axes is solved by EAIK alone
(`simple_arm`). Otherwise, the first starts are the roots of `loop_closure`, which has all
configurations. If Newton's method does not reach as many as are real, or for other numbers of
joints, starts are drawn uniformly over all joint positions, with a fixed seed, in rounds until
several consecutive rounds find nothing new.
A branch may still be missed, so the result is never `complete`. A general arm has at most sixteen
branches (E. J. F. Primrose, "On the input-output equation of the general 7R-mechanism", 1986).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from joulepath.models.robot import Array, Limits, Mask
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import SingularPose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.isolated import ISOLATED, distinct, lies_on_a_curve
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.kinematics.newton import solved
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.kinematics.six.loop_closure import JOINTS, LoopClosure
from joulepath.optimizer.kinematics.six.named_branches import in_order, numbered
from joulepath.optimizer.kinematics.six.simple_arm import SimpleArm
from joulepath.optimizer.problem.branches import BranchLabel, NumberedBranch


@dataclass(frozen=True)
class MultiStartSettings:
    """Settings of the multi-start search."""

    most_branches: int = 16
    """Number of branches at which the search ends (Primrose 1986)."""
    round_size: int = 64
    """Number of uniformly drawn starts per round."""
    rounds: int = 16
    """Largest number of rounds."""
    idle_rounds: int = 3
    """Number of consecutive rounds without a new solution that ends the search."""
    empty_rounds: int = 12
    """The same number as long as there is no solution at all; after three rounds, one pose in 800
    was missed altogether.
    """
    steps: int = 45
    """Newton steps per start."""
    fold_steps: int = 800
    """Newton steps at a fold of high order."""
    hopeless: float = 0.5
    """Pose error above which a start is given up after a third of the steps [m, rad]."""
    solved: float = 1e-11
    """Largest pose error of a solution [m, rad], far below the promised accuracy."""
    strides: tuple[float, ...] = (0.05, 0.3, 1.0, 2.0, 3.0)
    """Steps from a nearly singular solution along its null direction to the branch on the other
    side of the singularity [rad].
    """
    nearly_singular: float = 0.1
    """Smallest singular value below which another branch is probably near."""
    regular: float = 1e-3
    """Smallest singular value of all configurations above which EAIK loses none."""
    near: float = 0.03
    """Error [m, 1] of a row of EAIK in the matrix of the pose, up to which it may stand for lost
    configurations."""
    cached_poses: int = 256
    """Number of poses with cached configurations."""


MULTI_START = MultiStartSettings()


class MultiStart:
    """`PoseSolver` of a six-joint arm without a closed form."""

    complete, confirmed = False, False

    def __init__(self, chain: Chain) -> None:
        self._chain = chain
        self._found = lru_cache(maxsize=MULTI_START.cached_poses)(self._solve)

    @classmethod
    def of(cls, chain: Chain) -> MultiStart | None:
        """Inverse kinematics of a chain; None unless it has six joints."""
        return cls(chain) if chain.nq == JOINTS else None

    def label(self, q: Array) -> BranchLabel:
        """Branch of a configuration (6,) [rad]: the number of the nearest solution, 1 on a
        self-motion.
        """
        try:
            return numbered(q, self.solve(self._chain.flange(q[None])[0])[0])
        except SingularPose:
            return NumberedBranch(1)

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """Always empty: numbered branches have no parts."""
        return ()

    def solve(self, T: Array) -> tuple[Array, list[BranchLabel]]:
        """Configurations (n, 6) [rad] in [-pi, pi] that put the flange at T (4, 4), and their
        labels.

        Raises:
            SingularPose: a solution lies on a self-motion.
        """
        q = self.configurations(T)
        return q, [NumberedBranch(number) for number in range(1, len(q) + 1)]

    def configurations(self, T: Array) -> Array:
        """Configurations (n, 6) [rad] of the flange pose T (4, 4), as returned by `solve`."""
        return self._found(np.ascontiguousarray(T, dtype=float).tobytes())

    def closed_form(self, T: Array) -> Array | None:
        """All configurations (n, 6) [rad] by EAIK; None for an arm of another form, or if any may
        be lost: without a solution, beside a singularity, or near a row that is no solution.
        """
        if self._simple is None:
            return None
        rows = self._simple.rows(T)
        T_reached, jacobian = self._chain.flange_and_jacobian(rows)
        residual = np.abs(T_reached - T).max(axis=(1, 2))
        near = residual < MULTI_START.near
        off = residual[near]
        if not len(off) or off.max() > MULTI_START.solved or np.abs(rows).max() > np.pi:
            return None
        # EAIK has a row far from the pose where a wrist is aligned
        smallest = np.linalg.svd(jacobian, compute_uv=False)[:, -1].min()
        return rows[near] if smallest > MULTI_START.regular else None

    def self_motions(self, T: Array, limits: Limits | None = None) -> list[SelfMotion]:
        """Always empty: no self-motion is known."""
        return []

    def distance_to_reach(self, T: Array) -> None:
        """Always None: the distance is unknown."""
        return

    def _solve(self, matrix: bytes) -> Array:
        T = np.frombuffer(matrix).reshape(4, 4)
        found = self.closed_form(T)
        found = in_order(self._searched(T) if found is None else found)
        found.setflags(write=False)
        return found

    def _searched(self, T: Array) -> Array:
        """Configurations (n, nq) [rad] by eigenvalues, and from many starts."""
        if self._chain.beyond_length(T) > REACH.beyond:
            return np.zeros((0, self._chain.nq))
        shape = (MULTI_START.round_size, self._chain.nq)
        found, is_settled = self._roots(T)
        rng, idle = np.random.default_rng(0), 0
        starts = rng.uniform(-np.pi, np.pi, shape)
        for _ in range(0 if is_settled else MULTI_START.rounds):
            checkpoint()
            fresh = self._joined(found, starts, T)
            idle = idle + 1 if len(fresh) == len(found) else 0
            most_idle = MULTI_START.idle_rounds if len(fresh) else MULTI_START.empty_rounds
            if idle >= most_idle or len(fresh) >= MULTI_START.most_branches:
                found = fresh
                break
            starts = np.vstack(
                [rng.uniform(-np.pi, np.pi, shape), self._beside(fresh[len(found) :])]
            )
            found = fresh
        singular = self._smallest(found)
        if len(found) > MULTI_START.most_branches:
            found = self._at_fold(found, T)
            singular = self._smallest(found)
        for k in np.flatnonzero(singular < ISOLATED.singular_value):
            if lies_on_a_curve(self._chain, found[k], T):
                raise SingularPose("goal", float(singular[k]))
        return found

    @cached_property
    def _closure(self) -> LoopClosure | None:
        return LoopClosure.of(self._chain)

    @cached_property
    def _simple(self) -> SimpleArm | None:
        if self._chain.nq != JOINTS or self._chain.coupling.follows:
            return None
        return SimpleArm.of(JointAxes.of(self._chain).simplified())

    def _roots(self, T: Array) -> tuple[Array, bool]:
        """Configurations (n, 6) [rad] by the eigenvalues of the closed loop, and whether they are
        all that are real.
        """
        found = np.zeros((0, self._chain.nq))
        for roots in () if self._closure is None else self._closure.roots(T):
            found = self._joined(found, roots.q, T)
            if len(found) == roots.certain and (len(found) or not len(roots.q)):
                return found, True
        return found, False

    def _joined(self, found: Array, starts: Array, T: Array) -> Array:
        """The known solutions (n, 6) [rad], and the distinct new ones found from starts (m, 6)."""
        q, residual = solved(self._chain, starts, T, MULTI_START.steps, MULTI_START.hopeless)
        # At a fold of two branches Newton's method is slow.
        slow = np.flatnonzero((residual >= MULTI_START.solved) & (residual < REACH.near))
        if len(slow):
            q[slow], residual[slow] = solved(self._chain, q[slow], T)
        q = np.vstack([found, np.clip(wrapped(q), -np.pi, np.pi)])
        residual, smallest = np.append(np.zeros(len(found)), residual), self._smallest(q)
        done = np.flatnonzero(self._is_reached(residual, smallest))
        return np.asarray(q[done[distinct(q[done], residual[done], smallest[done])]])

    def _is_reached(self, residual: Array, smallest: Array) -> Mask:
        """Which configurations (n,) reach the pose, by their pose errors (n,) [m, rad] and smallest
        singular values (n,); singular ones may be at the edge of the workspace.
        """
        at_edge = (residual < REACH.beyond) & (smallest < REACH.singular)
        return np.asarray((residual < MULTI_START.solved) | at_edge)

    def _at_fold(self, found: Array, T: Array) -> Array:
        """The exact ones of more solutions (n, 6) [rad] than an arm has branches.

        Around a fold of high order, many configurations hold the pose to the tolerance, and
        Newton's method converges slowly.

        Raises:
            SingularPose: none is exact.
        """
        q, residual = solved(self._chain, found, T, MULTI_START.fold_steps)
        best = np.argsort(residual)[: MULTI_START.most_branches]
        exact = best[residual[best] < ISOLATED.probe_tolerance]
        if not len(exact):
            raise SingularPose("goal", float(self._smallest(q).min()))
        q = np.clip(wrapped(q[exact]), -np.pi, np.pi)
        return np.asarray(q[distinct(q, residual[exact], self._smallest(q))])

    def _smallest(self, q: Array) -> Array:
        """Smallest singular values (n,) of the Jacobian at configurations (n, 6) [rad]."""
        return np.asarray(
            np.linalg.svd(self._chain.flange_and_jacobian(q)[1], compute_uv=False)[:, -1]
        )

    def _beside(self, found: Array) -> Array:
        """Starts (n, 6) on both sides of nearly singular solutions (m, 6), along their null
        directions.
        """
        _, s, vt = np.linalg.svd(self._chain.flange_and_jacobian(found)[1])
        weak = s[:, -1] < MULTI_START.nearly_singular
        null = vt[weak, -1]
        return np.vstack(
            [
                found[weak] + side * stride * null
                for stride in MULTI_START.strides
                for side in (1, -1)
            ]
        )
