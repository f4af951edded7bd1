"""Solutions of inverse kinematics: configurations of a pose with their branch and singularity.

The distance from a singularity is computed on first use, for all branches of a pose at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.problem.branches import BranchLabel


@dataclass(frozen=True, eq=False)
class Singularities:
    """Singularity measures of configurations q (n, nq) [rad] of one pose.

    `parts` returns the singular parts of the label of a configuration.
    """

    chain: Chain
    q: Array
    parts: Callable[[Array], tuple[str, ...]]

    @cached_property
    def smallest_values(self) -> list[float]:
        """Smallest singular value of the flange's geometric Jacobian at each configuration, with
        metres and radians mixed.
        """
        jacobian = self.chain.flange_and_jacobian(self.q)[1]
        values: list[float] = np.linalg.svd(jacobian, compute_uv=False)[:, -1].tolist()
        return values


@dataclass(frozen=True, eq=False, init=False)
class PrincipalSolution:
    """One branch of a pose: q (nq,) in [-pi, pi], without regard to limits.

    `self_motion` is the curve of solutions through q, or None for an isolated solution; `row` is
    the index of q in `singularities`.
    """

    q: Array
    label: BranchLabel
    self_motion: SelfMotion | None
    singularities: Singularities
    row: int

    def __init__(
        self,
        q: Array,
        label: BranchLabel,
        self_motion: SelfMotion | None,
        singularities: Singularities,
        row: int,
    ) -> None:
        # One dictionary update: for some forty solutions of a pose, frozen fields set one by one
        # took as long as the forward kinematics that confirms the solutions.
        self.__dict__.update(
            q=q, label=label, self_motion=self_motion, singularities=singularities, row=row
        )

    @cached_property
    def singular(self) -> tuple[str, ...]:
        """Singular parts of the label: the configuration belongs to both branches of such a
        part.
        """
        return self.singularities.parts(self.q)

    @property
    def smallest_singular_value(self) -> float:
        """Smallest singular value of the flange's geometric Jacobian."""
        return self.singularities.smallest_values[self.row]


@dataclass(frozen=True, eq=False, init=False)
class LimitedSolution:
    """Configuration q (nq,) [rad] within limits that reaches a pose, and its branch.

    `limit_distance` [rad] is the smallest distance of a joint from its limits.
    """

    q: Array
    branch: PrincipalSolution
    limit_distance: float

    def __init__(self, q: Array, branch: PrincipalSolution, limit_distance: float) -> None:
        self.__dict__.update(q=q, branch=branch, limit_distance=limit_distance)

    @property
    def label(self) -> BranchLabel:
        """Name or number of the branch."""
        return self.branch.label

    @property
    def singular(self) -> tuple[str, ...]:
        """Singular parts of the label."""
        return self.branch.singular

    @property
    def self_motion(self) -> SelfMotion | None:
        """Curve of solutions through q, or None for an isolated solution."""
        return self.branch.self_motion

    @property
    def smallest_singular_value(self) -> float:
        """Smallest singular value of the flange's geometric Jacobian; full turns do not
        change it.
        """
        return self.branch.smallest_singular_value
