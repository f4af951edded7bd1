"""Inverse kinematics of any six-joint arm by Newton's method from many starts: the last resort.

Starts are drawn evenly over all joint positions, from a fixed seed. They come in rounds, until
rounds that find nothing new follow each other. A branch with a small basin of attraction may be
missed all the same: nothing here is `complete`. A general arm has at most sixteen branches (E. J.
F. Primrose, "On the input-output equation of the general 7R-mechanism", 1986).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import SingularPose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.isolated import SINGULAR_VALUE, distinct, lies_on_a_curve
from joulepath.optimizer.kinematics.named_branches import in_order, numbered
from joulepath.optimizer.kinematics.newton import solved
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.problem.branches import BranchLabel, NumberedBranch

JOINTS, MOST_BRANCHES = 6, 16
# starts of a round; rounds at most, and rounds without anything new that end the search
ROUND, ROUNDS, IDLE = 64, 16, 3
# steps of a start, and the error [m, rad] at a third of them that says it is going nowhere
STEPS, HOPELESS = 45, 0.5
# error [m, rad] of a solution, far below what is promised
SOLVED = 1e-11
# steps [rad] from a solution along its weakest direction, behind which the branch that meets it
# there lies
STRIDES = (0.05, 0.3, 1.0, 2.0, 3.0)
# smallest singular value below which another branch is likely to be near
WEAK = 0.1
# poses whose configurations are kept
KEPT = 256


class MultiStart:
    """`ClosedForm` of an arm without one."""

    complete, confirmed = False, False

    def __init__(self, chain: Chain) -> None:
        self._chain = chain
        self._found = lru_cache(maxsize=KEPT)(self._solve)

    @classmethod
    def of(cls, model: pin.Model) -> MultiStart | None:
        """The inverse kinematics of a Pinocchio model with a frame `flange`; None if it has not six
        joints.
        """
        return cls(Chain.of(model)) if model.nq == JOINTS else None

    def label(self, q: Array) -> BranchLabel:
        """The branch of a configuration (6,) [rad], by the nearest solution of its pose: the first
        on a self-motion.
        """
        try:
            return numbered(q, self.solve(self._chain.flange(q[None])[0])[0])
        except SingularPose:
            return NumberedBranch(1)

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """None: the branches have no parts."""
        return ()

    def solve(self, T: Array) -> tuple[Array, list[BranchLabel]]:
        """Configurations (n, 6) [rad] in [-pi, pi] that put the flange at T (4, 4), and their
        labels.

        Raises SingularPose if one lies on a self-motion.
        """
        q = self._found(np.ascontiguousarray(T, dtype=float).tobytes())
        return q, [numbered(each, q) for each in q]

    def self_motions(self, T: Array, limits: Limits | None = None) -> list[SelfMotion]:
        """None is known."""
        return []

    def distance_to_reach(self, T: Array) -> None:
        """None: not known."""
        return

    def _solve(self, matrix: bytes) -> Array:
        T = np.frombuffer(matrix).reshape(4, 4)
        rng, found, idle = np.random.default_rng(0), np.zeros((0, JOINTS)), 0
        starts = rng.uniform(-np.pi, np.pi, (ROUND, JOINTS))
        for _ in range(ROUNDS):
            checkpoint()
            fresh = self._joined(found, starts, T)
            idle = idle + 1 if len(fresh) == len(found) else 0
            if idle == IDLE or len(fresh) >= MOST_BRANCHES:
                found = fresh
                break
            starts = np.vstack(
                [rng.uniform(-np.pi, np.pi, (ROUND, JOINTS)), self._beside(fresh[len(found) :])]
            )
            found = fresh
        singular = self._smallest(found)
        for k in np.flatnonzero(singular < SINGULAR_VALUE):
            if lies_on_a_curve(self._chain, found[k], T):
                raise SingularPose("goal", float(singular[k]))
        found = in_order(found)
        found.setflags(write=False)
        return found

    def _joined(self, found: Array, starts: Array, T: Array) -> Array:
        """The solutions found (n, 6) [rad], then those that starts (m, 6) lead to and that are not
        among them.
        """
        q, missed = solved(self._chain, starts, T, STEPS, HOPELESS)
        singular = self._smallest(q) < REACH.singular
        done = (missed < SOLVED) | ((missed < REACH.beyond) & singular)
        q = np.vstack([found, np.clip(wrapped(q[done]), -np.pi, np.pi)])
        smallest = self._smallest(q)
        return np.asarray(q[distinct(q, np.append(np.zeros(len(found)), missed[done]), smallest)])

    def _smallest(self, q: Array) -> Array:
        """The smallest singular values (n,) of the Jacobian at configurations (n, 6) [rad]."""
        return np.asarray(
            np.linalg.svd(self._chain.flange_and_jacobian(q)[1], compute_uv=False)[:, -1]
        )

    def _beside(self, found: Array) -> Array:
        """Starts (n, 6) beside nearly singular solutions (m, 6), on the side where the branch that
        meets them lies.
        """
        _, s, vt = np.linalg.svd(self._chain.flange_and_jacobian(found)[1])
        weak = s[:, -1] < WEAK
        null = vt[weak, -1]
        return np.vstack(
            [found[weak] + side * stride * null for stride in STRIDES for side in (1, -1)]
        )
