"""Common data and effort of the dual bounds of all pairs of a problem."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.cruise import copper_loss
from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.grid_cells import Spacing
from joulepath.optimizer.prepared_problem import PreparedProblem

GRID_JOINTS = 2
"""Joints with a grid: those with the greatest copper loss of holding against gravity."""


@dataclass(frozen=True)
class Effort:
    """Effort on the dual bound of a pair."""

    steps: int
    """Number of steps of the path."""
    cell_ratio: float
    """Ratio of the longest to the shortest duration of a cell."""
    cells_per_group: int
    """Number of cells of durations per group; a group has common boxes."""
    spacing: Spacing
    """Spacing of the grid around the path."""
    loaded_joints: tuple[int, ...]
    """Numbers of joints with multipliers among those that carry gravity, tried one by one."""
    weight_rounds: int
    """Number of rounds of the search for weights."""
    time: float
    """Longest time for a group of cells of an arm with six joints on an idle machine [s]."""

    def time_for(self, joints: int) -> float:
        """Least remaining time before the deadline to begin a group of cells [s].

        It grows with joints⁵, the number of bounds on third derivatives of the inertia.
        """
        return self.time * max(joints / 6, 1) ** 5


@dataclass(frozen=True)
class PairBounds:
    """Common data of the dual bounds of all pairs of a problem."""

    prepared: PreparedProblem
    chain: ChainDerivatives
    friction: FrictionConjugate
    loss: Array
    """Copper loss c, shape (nq,) [W/(N·m)²]."""
    stiffness: Array
    """Unit of κ + μ, shape (nq,) [N·m·s/rad]."""

    @classmethod
    def of(cls, prepared: PreparedProblem) -> PairBounds | None:
        """Collect the data.

        The dual bound requires the electrical objective, a concave friction law, and at least two
        independent joints, because bounds on the derivatives of a chain are known for its own
        joints. With a friction torque independent of speed, the friction loss has no convexity for
        the confinement, and the dual bound cannot exceed the plain one.

        Returns:
            The data; None if a requirement is not met.
        """
        arm = prepared.arm
        friction = FrictionConjugate.of(arm.friction_law, arm.active_limits.v_max)
        if (
            prepared.problem.objective != "electrical"
            or friction is None
            or arm.robot.nq < GRID_JOINTS
            or arm.robot.coupling.follows
        ):
            return None
        stiffness = friction.stiffness(arm.friction_law)
        if stiffness.min() <= 0:
            return None
        return cls(prepared, ChainDerivatives.of(arm), friction, copper_loss(arm), stiffness)
