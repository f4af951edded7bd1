"""Base parameters: the least set of combinations on which the torques depend (Gautier 1991, by QR
with pivoting).

Most of the parameters of a body have no effect on any torque, or only together with others. At
random states the regressor has as many independent columns as there are base parameters; the QR
decomposition with column pivoting finds them, and how the other columns are combined from them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.linalg import qr, solve_triangular

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.link_regressor import rigid_regressor

# of the largest diagonal entry of R; between independent and dependent columns lie many orders of
# magnitude
TOLERANCE = 1e-8
# coefficients of an expression below it are rounding
LEAST_COEFFICIENT = 1e-6
STATES = 60
NAMES = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """`independent` (b,) numbers of the columns that are kept; `combination` (b, p): base =
    combination @ standard.

    `names` (p,) are those of the standard parameters, of bodies and, if asked for, of rotors behind
    them.
    """

    names: tuple[str, ...]
    independent: tuple[int, ...]
    combination: Array

    @property
    def count(self) -> int:
        """Number of base parameters."""
        return len(self.independent)

    @property
    def expressions(self) -> tuple[str, ...]:
        """Each base parameter as a sum of standard parameters."""
        return tuple(
            self._expression(row, main)
            for row, main in zip(self.combination, self.independent, strict=True)
        )

    def lone(self, bodies: int) -> tuple[int, ...]:
        """Numbers of the base parameters that are a single rotor's, behind so many parameters of
        bodies."""
        single = (np.abs(self.combination) > LEAST_COEFFICIENT).sum(axis=1) == 1
        return tuple(k for k, main in enumerate(self.independent) if main >= bodies and single[k])

    def _expression(self, row: Array, main: int) -> str:
        others = [k for k in np.flatnonzero(np.abs(row) > LEAST_COEFFICIENT).tolist() if k != main]
        return "".join([self.names[main], *(f" {row[k]:+.6g}·{self.names[k]}" for k in others)])


def base_parameters(model: pin.Model, rotors: bool = True) -> BaseParameters:
    """The base parameters of an arm, with those of its rotors or without."""
    generator = np.random.default_rng(0)
    nq = model.nq
    q, v, a = (generator.uniform(-reach, reach, (STATES, nq)) for reach in (np.pi, 2.0, 5.0))
    columns = rigid_regressor(model, q, v, a)
    names = [f"{part}{joint}" for joint in range(1, nq + 1) for part in NAMES]
    if rotors:
        columns = np.concatenate([columns, a[:, :, None] * np.eye(nq)], axis=2)
        names += [f"Ia{joint}" for joint in range(1, nq + 1)]
    independent, combination = independent_columns(columns.reshape(STATES * nq, -1))
    return BaseParameters(tuple(names), independent, combination)


def independent_columns(
    matrix: Array, tolerance: float = TOLERANCE
) -> tuple[tuple[int, ...], Array]:
    """Numbers (b,) of independent columns of a matrix (n, p), and the combination (b, p) of all
    columns from them.
    """
    _, R, order = qr(matrix, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(R))
    rank = int((diagonal > tolerance * diagonal[0]).sum()) if diagonal[0] > 0 else 0
    combination = np.zeros((rank, matrix.shape[1]))
    combination[:, order[:rank]] = np.eye(rank)
    combination[:, order[rank:]] = solve_triangular(R[:rank, :rank], R[:rank, rank:])
    ranked = np.argsort(order[:rank])
    return tuple(order[:rank][ranked].tolist()), combination[ranked]
