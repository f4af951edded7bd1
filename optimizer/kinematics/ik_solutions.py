"""Solutions of inverse kinematics: configurations that reach a pose, and what is known of them.

How near they are to a singularity is computed when it is first asked for, for all branches of a
pose at once.
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
    """How near configurations q (n, nq) [rad] are to a singularity. `parts` names parts of a label
    that are on one.
    """

    chain: Chain
    q: Array
    parts: Callable[[Array], tuple[str, ...]]

    @cached_property
    def smallest_values(self) -> list[float]:
        """The smallest singular value of the flange's geometric Jacobian (m and rad mixed, as
        usual) at each.
        """
        jacobian = self.chain.flange_and_jacobian(self.q)[1]
        values: list[float] = np.linalg.svd(jacobian, compute_uv=False)[:, -1].tolist()
        return values


@dataclass(frozen=True, eq=False, init=False)
class PrincipalSolution:
    """One branch of a pose: q (nq,) in [-pi, pi], without regard to limits.

    `self_motion` is the curve of solutions that it is a member of, if any. It is row `row` of those
    in `singularities`.
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
        # all at once: of some forty solutions of a pose, one by one took as long as it takes to
        # confirm them
        self.__dict__.update(
            q=q, label=label, self_motion=self_motion, singularities=singularities, row=row
        )

    @cached_property
    def singular(self) -> tuple[str, ...]:
        """The parts of the label that are singular: the configuration is on both branches of such a
        part.
        """
        return self.singularities.parts(self.q)

    @property
    def smallest_singular_value(self) -> float:
        """That of the flange's geometric Jacobian."""
        return self.singularities.smallest_values[self.row]


@dataclass(frozen=True, eq=False, init=False)
class LimitedSolution:
    """One configuration q (nq,) [rad] within limits that reaches a pose, and its branch: see
    `PrincipalSolution`.

    `limit_distance` [rad] is the least distance of any joint to its limits.
    """

    q: Array
    branch: PrincipalSolution
    limit_distance: float

    def __init__(self, q: Array, branch: PrincipalSolution, limit_distance: float) -> None:
        self.__dict__.update(q=q, branch=branch, limit_distance=limit_distance)

    @property
    def label(self) -> BranchLabel:
        """The branch's name or number."""
        return self.branch.label

    @property
    def singular(self) -> tuple[str, ...]:
        """The parts of the label that are singular."""
        return self.branch.singular

    @property
    def self_motion(self) -> SelfMotion | None:
        """The curve of solutions that this is a member of, if any."""
        return self.branch.self_motion

    @property
    def smallest_singular_value(self) -> float:
        """That of the flange's geometric Jacobian, which full turns do not change."""
        return self.branch.smallest_singular_value
