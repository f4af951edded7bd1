"""Fit of the friction laws to a friction table: `python -m joulepath.models.fit_friction [robot]`.

Both laws are instances of `joulepath.models.robot.FrictionLaw` with non-negative coefficients,
fitted to relative errors:

- `curved`: least worst error over the table. For a given `speed` this is a linear program in
  coulomb,
  curved and viscous (Boyd and Vandenberghe, Convex Optimization, 6.1.1), so that the fit is a
  one-dimensional search over `speed`.
- `coulomb_viscous`: least squares without `curved`.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog, minimize_scalar, nnls

from joulepath.models.registry import load_figures
from joulepath.models.robot import Array


@dataclass(frozen=True)
class SpeedSearch:
    """Settings of the search over `speed`."""

    least: float = 1e-3
    """Least `speed` [rad/s]; below it, curved · asinh(v / speed) is nearly logarithmic."""
    greatest: float = 1e1
    """Greatest `speed` [rad/s]; above it, the term is nearly linear over the table."""
    points: int = 60
    """Grid points, before a bounded search between two of them."""


SEARCH = SpeedSearch()


def fit_curved(speed: Array, torque: Array, knee: float) -> tuple[float, float, float, float]:
    """Coefficients coulomb, curved, speed, viscous of one joint.

    Args:
        speed: speeds (k,) [rad/s] of the table.
        torque: friction torques (k,) [N·m].
        knee: speed [rad/s] over which Coulomb friction is smoothed.
    """

    def best(log_speed: float) -> tuple[float, Array]:
        bend = np.arcsinh(speed / np.exp(log_speed))
        terms = np.column_stack([speed / np.hypot(speed, knee), bend, speed]) / torque[:, None]
        error = np.ones((speed.size, 1))
        answer = linprog(
            c=[0, 0, 0, 1],
            A_ub=np.block([[terms, -error], [-terms, -error]]),
            b_ub=np.concatenate([np.ones(speed.size), -np.ones(speed.size)]),
            bounds=(0, None),
        )
        assert answer.x is not None, (
            "feasible for any coefficients, as the error is free, and bounded by zero"
        )
        return float(answer.x[3]), np.asarray(answer.x[:3])

    grid = np.linspace(np.log(SEARCH.least), np.log(SEARCH.greatest), SEARCH.points)
    middle = int(np.argmin([best(s)[0] for s in grid]))
    bounds = grid[max(middle - 1, 0)], grid[min(middle + 1, SEARCH.points - 1)]
    found = float(
        minimize_scalar(
            lambda s: best(s)[0], bounds=bounds, method="bounded", options={"xatol": 1e-10}
        ).x
    )
    coulomb, curved, viscous = best(found)[1]
    return float(coulomb), float(curved), float(np.exp(found)), float(viscous)


def fit_coulomb_viscous(
    speed: Array, torque: Array, knee: float
) -> tuple[float, float, float, float]:
    """Coefficients coulomb, curved = 0, speed = 1 (without effect), viscous; see `fit_curved`."""
    terms = np.column_stack([speed / np.hypot(speed, knee), speed]) / torque[:, None]
    (coulomb, viscous), _ = nnls(terms, np.ones(speed.size))
    return float(coulomb), 0.0, 1.0, float(viscous)


FITS = {"curved": fit_curved, "coulomb_viscous": fit_coulomb_viscous}


def fit(robot: str) -> dict[str, dict[str, list[float]]]:
    """Coefficients of every law, per joint, to five significant digits."""
    table = load_figures(robot)["friction_table"]
    speed, torque = np.array(table["speed"]["value"]), np.array(table["torque"]["value"])
    laws = {}
    for name, fit_joint in FITS.items():
        joints = np.array([fit_joint(speed, joint, table["knee"]["value"]) for joint in torque])
        columns = zip(("coulomb", "curved", "speed", "viscous"), joints.T, strict=True)
        laws[name] = {part: [float(f"{x:.5g}") for x in values] for part, values in columns}
    return laws


def main() -> None:
    """Print the coefficients."""
    for name, law in fit(sys.argv[1] if len(sys.argv) > 1 else "ur5e").items():
        print(f"{name}:")
        for part, values in law.items():
            print(f"  {part}: {values}")


if __name__ == "__main__":
    main()
