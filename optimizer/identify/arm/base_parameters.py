"""Base parameters: the minimal set of combinations of standard parameters behind the torques.

Most parameters of a body have no effect on any torque, or only together with others. At random
states, the regressor has as many independent columns as there are base parameters. A QR
decomposition with column pivoting finds these columns, and expresses the dependent columns by the
independent ones (Gautier 1991).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.linalg import qr, solve_triangular

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.dynamics.link_regressor import rigid_regressor

STANDARD_NAMES = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")


@dataclass(frozen=True)
class BaseParameterSettings:
    """Settings of the search for base parameters."""

    rank_tolerance: float = 1e-8
    """Diagonal entry of R over the largest one, up to which a column is dependent [1]; many orders
    of magnitude lie between independent and dependent columns."""
    coefficient_tolerance: float = 1e-6
    """Coefficient of a combination up to which it is a rounding error [1 or SI unit]."""
    states: int = 60
    """Number of random states."""
    max_position: float = float(np.pi)
    """Bound of the random positions [rad]."""
    max_velocity: float = 2.0
    """Bound of the random velocities [rad/s]."""
    max_acceleration: float = 5.0
    """Bound of the random accelerations [rad/s²]."""


BASE_PARAMETERS = BaseParameterSettings()


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Base parameters as linear combinations: base = combination @ standard."""

    names: tuple[str, ...]
    """Names (p,) of the standard parameters: bodies first, then rotors if there are any."""
    independent: tuple[int, ...]
    """Numbers (b,) of the independent standard parameters."""
    combination: Array
    """Coefficients (b, p)."""

    @property
    def count(self) -> int:
        """Number of base parameters."""
        return len(self.independent)

    @property
    def expressions(self) -> tuple[str, ...]:
        """Base parameters as sums of standard parameters, for display."""
        return tuple(
            self._expression(row, main)
            for row, main in zip(self.combination, self.independent, strict=True)
        )

    def single_rotors(self, body_count: int) -> tuple[int, ...]:
        """Indices of the base parameters equal to a single rotor inertia.

        Args:
            body_count: number of standard parameters of bodies.
        """
        single = self._significant(self.combination).sum(axis=1) == 1
        return tuple(
            k for k, main in enumerate(self.independent) if main >= body_count and single[k]
        )

    @staticmethod
    def _significant(coefficients: Array) -> Mask:
        return np.asarray(np.abs(coefficients) > BASE_PARAMETERS.coefficient_tolerance)

    def _expression(self, row: Array, main: int) -> str:
        others = [k for k in np.flatnonzero(self._significant(row)).tolist() if k != main]
        return "".join([self.names[main], *(f" {row[k]:+.6g}·{self.names[k]}" for k in others)])


def base_parameters(model: pin.Model, rotors: bool = True) -> BaseParameters:
    """Find the base parameters of an arm.

    Args:
        model: model of the arm.
        rotors: whether to include the inertias of the rotors.
    """
    generator, settings = np.random.default_rng(0), BASE_PARAMETERS
    nq = model.nq
    q, v, a = (
        generator.uniform(-bound, bound, (settings.states, nq))
        for bound in (settings.max_position, settings.max_velocity, settings.max_acceleration)
    )
    columns = rigid_regressor(model, q, v, a)
    names = [f"{part}{joint}" for joint in range(1, nq + 1) for part in STANDARD_NAMES]
    if rotors:
        columns = np.concatenate([columns, a[:, :, None] * np.eye(nq)], axis=2)
        names += [f"Ia{joint}" for joint in range(1, nq + 1)]
    independent, combination = independent_columns(columns.reshape(settings.states * nq, -1))
    return BaseParameters(tuple(names), independent, combination)


def independent_columns(
    matrix: Array, tolerance: float = BASE_PARAMETERS.rank_tolerance
) -> tuple[tuple[int, ...], Array]:
    """Independent columns of a matrix, by QR decomposition with column pivoting.

    Args:
        matrix: the matrix (n, p).
        tolerance: largest ratio of the diagonal entry of a dependent column in R to the greatest
            diagonal entry [1].

    Returns:
        Indices (b,) of the independent columns, and coefficients (b, p) of all columns as
        combinations of the independent ones.
    """
    _, R, order = qr(matrix, mode="economic", pivoting=True)
    diagonal = np.abs(np.diag(R))
    rank = int((diagonal > tolerance * diagonal[0]).sum()) if diagonal[0] > 0 else 0
    combination = np.zeros((rank, matrix.shape[1]))
    combination[:, order[:rank]] = np.eye(rank)
    combination[:, order[rank:]] = solve_triangular(R[:rank, :rank], R[:rank, rank:])
    ranked = np.argsort(order[:rank])
    return tuple(order[:rank][ranked].tolist()), combination[ranked]
