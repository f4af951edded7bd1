"""Inverse kinematics of any seven-joint arm: self-motions traced point by point.

If the closed form of a nearby arm is known (`nearby_arm`), the seeds are points along the curves of
the nearby arm. For other arms, the seeds come from a table of configurations within the joint
ranges (`seed_table`). Newton's method moves the seeds onto curves, and every curve is traced once
around (`curve_tracing`). A curve without a seed is missed, and a curve through a singularity may be
missed. The result is therefore never `complete`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import SingularPose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.newton import solved
from joulepath.optimizer.kinematics.seven.curve_tracing import trace
from joulepath.optimizer.kinematics.seven.nearby_arm import NearbyArm
from joulepath.optimizer.kinematics.seven.seed_table import SeedTable
from joulepath.optimizer.kinematics.seven.traced_curve import TracedCurve
from joulepath.optimizer.kinematics.seven.traced_curve_stack import TracedCurveStack
from joulepath.optimizer.kinematics.seven.traced_limits import cut_to_limits
from joulepath.optimizer.problem.branches import BranchLabel, NumberedBranch


@dataclass(frozen=True)
class TracedArmSettings:
    """Settings of the search for curves."""

    steps: int = 12
    """Newton steps of a seed."""
    solved: float = 1e-9
    """Largest pose error of a seed on a curve [m, rad]."""
    few_seeds: int = 24
    """Number of seeds that get more Newton steps if no seed reaches the pose."""
    most_steps: int = 60
    """Newton steps of the `few_seeds`."""
    nearly_solved: float = 1e-5
    """Largest pose error of a seed as the centre of further, random seeds [m, rad]."""
    nearest: int = 8
    """Largest number of these centres."""
    around: int = 40
    """Number of random seeds around a centre."""
    deviation: float = 0.1
    """Standard deviation of the random seeds from their centre [rad]."""
    edge: float = 1e-6
    """Largest pose error, after many steps, of a pose at the edge of the workspace [m, rad]."""
    singular: float = 1e-4
    """Singular value of the Jacobian at or below which no curve is traced, because the arm can move
    in several directions without moving the flange."""
    cached_poses: int = 32
    """Number of poses with cached curves."""


SETTINGS = TracedArmSettings()


class TracedArm:
    """`PoseSolver` of a seven-joint arm without a closed form.

    All configurations of a pose lie on self-motions.
    """

    complete, confirmed = False, False

    def __init__(self, chain: Chain, seeds: SeedTable, nearby: NearbyArm | None) -> None:
        self._chain, self._seeds, self._nearby = chain, seeds, nearby
        self._found = lru_cache(maxsize=SETTINGS.cached_poses)(self._curves)

    @classmethod
    def of(cls, model: pin.Model) -> TracedArm | None:
        """Inverse kinematics of a Pinocchio model with a frame `flange`; None unless the model has
        seven joints.
        """
        if model.nq != 7:
            return None
        chain = Chain.of(model)
        q_min = model.lowerPositionLimit.copy()
        q_max = model.upperPositionLimit.copy()
        turns = q_max / 2 - q_min / 2 >= np.pi
        seeds = SeedTable(chain, np.where(turns, -np.pi, q_min), np.where(turns, np.pi, q_max))
        return cls(chain, seeds, NearbyArm.of(chain))

    def label(self, q: Array) -> NumberedBranch:
        """Number of the curve nearest to a configuration (7,) [rad].

        The curves are the self-motions of the configuration's flange pose. The number is 1 if no
        curve is found.
        """
        try:
            curves = self.self_motions(self._chain.flange(q[None])[0])
        except SingularPose:
            return NumberedBranch(1)
        for number, each in enumerate(curves, start=1):
            if each.passes(q):
                return NumberedBranch(number)
        away = [
            float(np.abs(wrapped(each.at(np.array([each.parameter(q)]))[0] - q)).max())
            for each in curves
        ]
        return NumberedBranch(int(np.argmin(away)) + 1 if away else 1)

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """Always empty: numbered branches have no parts."""
        return ()

    def solve(self, T: Array) -> tuple[Array, list[BranchLabel]]:
        """Always empty: all configurations are on self-motions."""
        return np.zeros((0, 7)), []

    def self_motions(self, T: Array, limits: Limits | None = None) -> list[TracedCurve]:
        """The curves found for the flange pose T (4, 4), cut to the limits.

        Raises:
            SingularPose: T was reached in singular configurations only, where no curve is traced.
        """
        curves = self._found(np.ascontiguousarray(T, dtype=float).tobytes())
        return curves if limits is None else cut_to_limits(curves, limits.q_min, limits.q_max)

    def distance_to_reach(self, T: Array) -> None:
        """Always None: the distance is unknown."""
        return

    def _with_near(self, q: Array, residual: Array, T: Array) -> tuple[Array, Array]:
        """Adds solutions from random seeds around configurations that nearly reach a pose.

        Next to a singularity, Newton's method converges slowly from most seeds, but not from all.

        Args:
            q: configurations after Newton's method, shape (n, 7) [rad].
            residual: their pose errors, shape (n,) [m, rad].
            T: flange pose, shape (4, 4).

        Returns:
            The given and the additional configurations, and their pose errors.
        """
        near = q[
            np.argsort(np.where(residual < SETTINGS.solved, np.inf, residual))[: SETTINGS.nearest]
        ]
        near = near[
            : int(((residual >= SETTINGS.solved) & (residual < SETTINGS.nearly_solved)).sum())
        ]
        around = near[:, None] + SETTINGS.deviation * np.random.default_rng(0).normal(
            size=(len(near), SETTINGS.around, 7)
        )
        found = solved(self._chain, around.reshape(-1, 7), T, SETTINGS.steps)
        return np.concatenate([q, found[0]]), np.concatenate([residual, found[1]])

    def _curves(self, matrix: bytes) -> list[TracedCurve]:
        T = np.frombuffer(matrix).reshape(4, 4)
        checkpoint()
        paths = trace(self._chain, self._starts(T), T)
        return self._different(TracedCurveStack.of(paths), T) if paths else []

    def _starts(self, T: Array) -> Array:
        """Regular configurations (n, 7) [rad] of the flange pose T (4, 4), one or more per curve.

        The first seeds are configurations of the nearby arm at T. If no seed reaches T, the next
        seeds come from the table, and from the nearby arm at poses beside T.

        Raises:
            SingularPose: T was reached in singular configurations only.
        """
        none, nearby = np.zeros((0, 7)), self._nearby
        seeds = none if nearby is None else nearby.seeds(T)
        q, residual = solved(self._chain, seeds, T, SETTINGS.steps)
        if not (residual < SETTINGS.solved).any():
            beside = none if nearby is None else nearby.beside(T)
            seeds = np.concatenate([self._seeds.starts(T), beside])
            q, residual = solved(self._chain, seeds, T, SETTINGS.steps)
        q, residual = self._with_near(q, residual, T)
        if not (residual < SETTINGS.solved).any():
            q, residual = solved(self._chain, seeds[: SETTINGS.few_seeds], T, SETTINGS.most_steps)
        # A pose error that is small after many steps indicates a singularity.
        is_solved = bool((residual < SETTINGS.solved).any())
        q = q[residual < (SETTINGS.solved if is_solved else SETTINGS.edge)]
        smallest = np.linalg.svd(self._chain.flange_and_jacobian(q)[1], compute_uv=False)[:, -1]
        regular = smallest > SETTINGS.singular
        if len(q) and not regular.any():
            raise SingularPose("goal", float(smallest.min()))
        return q[regular]

    def _different(self, stack: TracedCurveStack, T: Array) -> list[TracedCurve]:
        """Distinct curves of a stack, in the order of their numbers."""
        found = list[TracedCurve]()
        order, beside = stack.order_and_neighbours()
        near = beside.tolist()
        for row in np.argsort(order, kind="stable").tolist():
            # Where a curve bends, one seed may pass another unnoticed.
            if not any(
                near[row][each.row] and each.passes(stack.nodes[stack.first[row]]) for each in found
            ):
                half = float(stack.half[row])
                label = NumberedBranch(len(found) + 1)
                found.append(TracedCurve(self._chain, T, stack, row, label, [(-half, half)]))
        return found
